//! Skinning: the vertices of a rest shape follow the joints (Wuhrer, eq. 9.2), by blending matrices or dual quaternions.
//!
//! Weights lie as a block of sixteen vertices needs them: the joints that hold any of its vertices, each with sixteen weights. A body's blocks are
//! held by a few joints each, so a kernel loads a joint's motion once for sixteen vertices and gathers nothing.

pub(crate) mod dual_quaternion;
pub(crate) mod linear_blend;

use crate::format::Indices;
use crate::generator::lanes::RawWeights;

/// How the motions of joints are blended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blend {
    /// Matrices, eq. 9.2: linear in the rest shape and in the matrices; loses volume at strong bends and twists.
    Linear,
    /// Dual quaternions (Kavan et al. 2008): rigid motions stay rigid.
    DualQuaternion,
}

/// Which joints hold which vertices, over the sections of a model file; copying it copies views.
#[derive(Debug, Clone, Copy)]
pub struct Influences<'a> {
    starts: Indices<'a>,
    joints: Indices<'a>,
    weights: &'a [RawWeights],
}

impl<'a> Influences<'a> {
    pub(crate) fn new(starts: Indices<'a>, joints: Indices<'a>, weights: &'a [u8]) -> Self {
        Influences { starts, joints, weights: weights.as_chunks().0 }
    }

    /// The joints that hold a block's vertices, in ascending order, each with the weights of its sixteen vertices; `None` beyond the last block.
    #[inline(always)]
    pub(crate) fn block(&self, block: usize) -> Option<Holds<'a>> {
        let (from, to) = (self.starts.get(block)? as usize, self.starts.get(block.checked_add(1)?)? as usize);
        let joints = self.joints.part(from, to.checked_sub(from)?)?;
        Some(Holds { joints, weights: self.weights.get(from..to)? })
    }

    /// Pairs of a block and a joint that holds it: what the time of skinning is in proportion to.
    pub fn len(&self) -> usize {
        self.weights.len()
    }

    /// No pairs.
    pub fn is_empty(&self) -> bool {
        self.weights.is_empty()
    }
}

/// The joints of one block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Holds<'a> {
    joints: Indices<'a>,
    weights: &'a [RawWeights],
}

impl<'a> Holds<'a> {
    /// Joint and weights, in ascending order of the joints.
    #[inline(always)]
    pub(crate) fn iter(self) -> impl Iterator<Item = (usize, &'a RawWeights)> {
        self.joints.iter().map(|joint| joint as usize).zip(self.weights)
    }
}
