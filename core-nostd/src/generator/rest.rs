//! What a skinned body is posed from: a linear rest shape over a model file, or one whose identity is fixed, in the caller's memory.

use super::lanes::{Axes, Lanes};
use super::linear::Linear;
use super::{Block, Generator, NUMBERS};
use crate::quantise::{Storage, Terms};

/// A rest shape `v(z) = mean + A z + C f`.
pub trait Rest: Copy + core::fmt::Debug + sealed::Kernels {
    /// Number of vertices.
    fn vertex_count(&self) -> usize;
    /// Number of identity weights; 0 when the identity is fixed.
    fn identity_dim(&self) -> usize;
    /// Number of corrections f.
    fn corrections(&self) -> usize;
}

pub(crate) mod sealed {
    use super::{Axes, Lanes};

    /// The kernels of a rest shape.
    pub trait Kernels {
        /// The shape of a block.
        fn shape<const N: usize, L: Lanes<N>>(
            &self,
            lanes: L,
            block: usize,
            weights: &[f32],
            corrections: &[f32],
        ) -> Option<Axes<N>>;

        /// The components `a_l` of a block, one after the other.
        fn components<const N: usize, L: Lanes<N>>(&self, lanes: L, block: usize, visit: impl FnMut(usize, Axes<N>));

        /// The derivatives of a block's corrections: `visit` gets, for each group of as many corrections as a slope has entries and each of the slopes
        /// `slopes(group)`, the sum of the terms times the slope, in order.
        fn correct<const N: usize, const G: usize, L: Lanes<N>>(
            &self,
            lanes: L,
            block: usize,
            groups: impl Iterator<Item = core::ops::Range<usize>>,
            slopes: &[[f32; G]],
            visit: impl FnMut(usize, Axes<N>),
        );
    }
}

impl<'a, S: Storage<'a>> Rest for Linear<'a, S> {
    fn vertex_count(&self) -> usize {
        Generator::vertex_count(self)
    }

    fn identity_dim(&self) -> usize {
        Generator::identity_dim(self)
    }

    fn corrections(&self) -> usize {
        self.n_corrections()
    }
}

impl<'a, S: Storage<'a>> sealed::Kernels for Linear<'a, S> {
    #[inline(always)]
    fn shape<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        block: usize,
        weights: &[f32],
        corrections: &[f32],
    ) -> Option<Axes<N>> {
        self.summed(lanes, block, weights, corrections)
    }

    #[inline(always)]
    fn components<const N: usize, L: Lanes<N>>(&self, lanes: L, block: usize, mut visit: impl FnMut(usize, Axes<N>)) {
        let Some((_, components, _)) = self.parts(lanes, block) else { return };
        for (column, term) in components.iter().enumerate() {
            visit(column, lanes.term(term));
        }
    }

    #[inline(always)]
    fn correct<const N: usize, const G: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        block: usize,
        groups: impl Iterator<Item = core::ops::Range<usize>>,
        slopes: &[[f32; G]],
        mut visit: impl FnMut(usize, Axes<N>),
    ) {
        if self.n_corrections() == 0 {
            return;
        }
        let Some((_, _, corrections)) = self.parts(lanes, block) else { return };
        for (terms, group) in corrections.groups(G).zip(groups) {
            for index in group {
                let Some(slopes) = slopes.get(index) else { continue };
                let mut change = [[0.0; N]; 3];
                for (term, slope) in terms.iter().zip(slopes) {
                    for (change, term) in change.iter_mut().zip(lanes.term(term)) {
                        for (change, term) in change.iter_mut().zip(term) {
                            *change += slope * term;
                        }
                    }
                }
                visit(index, change);
            }
        }
    }
}

/// The rest shape of one identity for some blocks, in the caller's memory; the corrections are still the file's.
#[derive(Debug, Clone, Copy)]
pub struct StoredRest<'w, S> {
    pub(crate) blocks: &'w [[f32; NUMBERS]],
    pub(crate) first_block: usize,
    pub(crate) n_vertices: usize,
    pub(crate) source: S,
}

impl<'a, S: Storage<'a>> Rest for StoredRest<'_, Linear<'a, S>> {
    fn vertex_count(&self) -> usize {
        self.n_vertices
    }

    fn identity_dim(&self) -> usize {
        0
    }

    fn corrections(&self) -> usize {
        self.source.n_corrections()
    }
}

impl<'a, S: Storage<'a>> sealed::Kernels for StoredRest<'_, Linear<'a, S>> {
    /// The stored shape plus the sum of the corrections, which begins at zero.
    #[inline(always)]
    fn shape<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        block: usize,
        _: &[f32],
        corrections: &[f32],
    ) -> Option<Axes<N>> {
        let mut shape = lanes.block(&Block::load(self.blocks.get(block)?));
        if self.source.n_corrections() != 0 {
            let sum = self.source.corrected(lanes, block + self.first_block, corrections)?;
            for (axis, sum) in shape.iter_mut().zip(sum) {
                for (value, sum) in axis.iter_mut().zip(sum) {
                    *value += sum;
                }
            }
        }
        Some(shape)
    }

    #[inline(always)]
    fn components<const N: usize, L: Lanes<N>>(&self, _: L, _: usize, _: impl FnMut(usize, Axes<N>)) {}

    #[inline(always)]
    fn correct<const N: usize, const G: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        block: usize,
        groups: impl Iterator<Item = core::ops::Range<usize>>,
        slopes: &[[f32; G]],
        visit: impl FnMut(usize, Axes<N>),
    ) {
        sealed::Kernels::correct(&self.source, lanes, block + self.first_block, groups, slopes, visit);
    }
}
