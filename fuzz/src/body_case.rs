//! A small linear model or body with weights, made from the fuzzer's bytes; and what must be refused of it.

use std::ops::Range;

use arbitrary::{Arbitrary, Unstructured};
use habitus_core::Error;
use habitus_core::format::limits::{MAX_COEFFICIENT, MAX_WEIGHT};
use habitus_reference::linear::Linear;
use habitus_reference::model_file::{Extras, Section, file};
use habitus_reference::skeleton::{Joint, Skeleton};
use habitus_reference::skin_file::{linear_head, linear_sections, skinned_head, skinned_sections};
use habitus_reference::skinned::Skinned;
use habitus_reference::storage::{Storage, Term};

use crate::numbers::Number;

/// What the fuzzer chooses.
#[derive(Debug, Default, Arbitrary)]
pub struct Choice {
    pub n: u8,
    pub dim: u8,
    /// Parent and axis (every fourth: none).
    pub joints: [(u8, u8); 4],
    pub n_joints: u8,
    /// Bits: corrective terms, dual quaternions, joints that follow, the blend of the other kind, joints of the mean,
    /// weights within reach, a weight too many.
    pub flags: u8,
    pub storage: u8,
    pub seed: u32,
    pub offset_size: u8,
    pub term_size: u8,
    pub range: [u8; 2],
    pub weights: Vec<Number>,
    pub coefficients: Vec<(u16, Number)>,
}

/// A case for both the kernel and the reference.
pub struct Case {
    pub body: Skinned,
    pub identity: Vec<f32>,
    pub pose: Vec<f32>,
    pub range: Range<usize>,
    /// The kernel is asked for the other blend, and for joints of the mean.
    pub other_blend: bool,
    pub still: bool,
}

/// Sizes of the terms, millimetres: of a body, and at the ends of what can be computed.
pub(crate) const SIZES: [f32; 8] = [300.0, 10.0, 1.0, 0.0, 1e-30, 6e4, 1e9, 1e12];

impl Choice {
    /// The choice of these bytes; `None` when they are too few.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        Choice::arbitrary_take_rest(Unstructured::new(bytes)).ok()
    }

    /// The body and the case around it.
    pub fn case(&self) -> Case {
        let flag = |bit: u8| self.flags >> bit & 1 == 1;
        let body = self.body();
        let (n, di, dp) = (body.rest.n, body.rest.components.len(), body.skeleton.pose_dim());
        let weight = |k: usize| match self.weights.get(k % self.weights.len().max(1)) {
            Some(Number(weight)) if !flag(5) || weight.abs() <= 20.0 => *weight,
            _ => 0.25 * (k as f32 - 3.0),
        };
        let further = flag(6) && self.seed.is_multiple_of(4);
        Case {
            identity: (0..di + usize::from(further)).map(weight).collect(),
            pose: (0..dp).map(|k| weight(di + k)).collect(),
            range: usize::from(self.range[0]) % (n + 3)..usize::from(self.range[1]) % (n + 3),
            other_blend: flag(3),
            still: flag(4),
            body,
        }
    }

    fn body(&self) -> Skinned {
        let flag = |bit: u8| self.flags >> bit & 1 == 1;
        let n = 1 + usize::from(self.n % 36);
        let d = 1 + usize::from(self.dim % 3);
        let storage = Storage::ALL[usize::from(self.storage) % 3];
        let (mut state, mut index) = (self.seed, 0usize);
        let mut number = |size: f32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let set = self.coefficients.iter().find(|(at, _)| usize::from(*at) == index);
            index += 1;
            set.map_or(size * ((state >> 8) as f32 / (1 << 23) as f32 - 1.0), |(_, number)| number.0)
        };
        let mut point = |size: f32| [number(size), number(size), number(size)];
        let size = |choice: u8| SIZES[usize::from(choice) % SIZES.len()];
        let mut mean: Vec<[f32; 3]> = (0..n).map(|_| point(size(self.offset_size))).collect();
        mean.resize(n.next_multiple_of(16), [0.0; 3]);
        let n_joints = 1 + usize::from(self.n_joints % 4);
        let mut term = || -> Term { storage.stored(&(0..n).map(|_| point(size(self.term_size))).collect::<Vec<_>>()) };
        let components = (0..d).map(|_| term()).collect();
        let corrective = (0..if flag(0) { 9 * n_joints } else { 0 }).map(|_| term()).collect();
        let axes = [None, Some([1.0, 0.0, 0.0]), Some([0.0, 0.6, -0.8]), Some([0.0, -1.0, 0.0])];
        let joints: Vec<Joint> = (0..n_joints)
            .map(|j| {
                let (parent, axis) = self.joints[j];
                let parent = usize::from(parent) % (j + 1);
                Joint {
                    parent: (parent < j).then_some(parent),
                    axis: axes[usize::from(axis) % 4],
                    position: point(size(self.offset_size)),
                }
            })
            .collect();
        let basis = flag(2).then(|| (0..n_joints).map(|_| (0..d).map(|_| point(5.0)).collect()).collect());
        let rest = Linear { n, mean, components };
        let weights = weights(self.seed, n, n_joints);
        Skinned { rest, corrective, skeleton: Skeleton { joints, basis }, weights, dual: flag(1) }
    }
}

/// Shares of the joints at each vertex; now and then one joint has all, and some have none in a block.
fn weights(seed: u32, n: usize, joints: usize) -> Vec<Vec<f32>> {
    let mut weights = vec![vec![0.0; n.next_multiple_of(16)]; joints];
    for v in 0..n {
        let chosen = seed.wrapping_mul(v as u32 + 1).wrapping_mul(2_654_435_769) >> 16;
        if chosen.is_multiple_of(5) {
            weights[chosen as usize / 5 % joints][v] = 1.0;
            continue;
        }
        // Shares in sixteenths sum to one without rounding.
        let mut left = 16;
        for (j, weights) in weights.iter_mut().enumerate() {
            let share = if j + 1 == joints { left } else { (chosen >> (3 * j)) % (left + 1) };
            weights[v] = share as f32 / 16.0;
            left -= share;
        }
    }
    weights
}

impl Case {
    /// The sections and the bytes of the body's file, or of its rest shape's.
    pub fn file(&self, linear: bool) -> (Vec<Section>, Vec<u8>) {
        let (head, sections) = match linear {
            true => (linear_head(&self.body.rest), linear_sections(&self.body.rest, &Extras::default())),
            false => (skinned_head(&self.body), skinned_sections(&self.body, &Extras::default())),
        };
        let bytes = file(&head, &sections);
        (sections, bytes)
    }

    /// The error of the weights: a wrong number of them, or one beyond the limit.
    pub fn weights_refused(&self, pose: &[f32]) -> Option<Error> {
        let expected = self.body.rest.components.len();
        if expected != self.identity.len() {
            return Some(Error::DimensionMismatch { expected: expected as u32, found: self.identity.len() as u32 });
        }
        let beyond = self.identity.iter().chain(pose).position(|weight| !(weight.abs() <= MAX_WEIGHT));
        beyond.map(|index| Error::NotFinite { index: index as u32 })
    }
}

/// The error of the first number of the first section that is beyond its limit.
pub fn file_refused(sections: &[Section]) -> Option<Error> {
    sections.iter().find_map(|section| {
        let limit = match (section.id, section.element) {
            (1, 3) | (18 | 23 | 24, _) => MAX_COEFFICIENT,
            (19, _) => MAX_COEFFICIENT / 256.0,
            _ => return None,
        };
        let numbers = section.bytes.as_chunks::<4>().0.iter().map(|raw| f32::from_le_bytes(*raw));
        let index = numbers.into_iter().position(|number| !(number.abs() <= limit))?;
        Some(Error::BadContent { section: section.id, index: index as u32 })
    })
}
