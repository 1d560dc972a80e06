//! The local models of a wavelet generator: sixteen coefficients side by side, each with weights of its own.

use core::marker::PhantomData;

use crate::format::Mode;
use crate::generator::block::{lane_of_numbers, lane_of_raw};
use crate::generator::{Block, LANES, NUMBERS};
use crate::quantise::{Storage, Term, Terms, plus_scaled};

/// One weight of sixteen coefficients.
pub(crate) type LaneWeights = [f32; LANES];

/// Models `s_q` of the coefficients, bilinear in the weights of each.
pub trait Locals: Copy + core::fmt::Debug + sealed::Kernels {
    /// Identity weights of a coefficient; 0 when the identity is fixed.
    fn identity_dim(&self) -> usize;
    /// Pose weights of a coefficient; 0 when the pose is fixed.
    fn pose_dim(&self) -> usize;
}

pub(crate) mod sealed {
    use super::{Block, LaneWeights};

    /// The kernels of local models.
    pub trait Kernels {
        /// The means of a block of coefficients.
        fn mean(&self, block: usize) -> Option<Block>;
        /// A block of coefficients at weights of their own: `identity_dim` and `pose_dim` rows.
        fn block(&self, block: usize, identity: &[LaneWeights], pose: &[LaneWeights]) -> Option<Block>;
        /// Derivative of one coefficient by one of its weights, identity first.
        fn slope(&self, coefficient: usize, identity: &[f32], pose: &[f32], weight: usize) -> Option<[f32; 3]>;
    }
}

/// Local models over the coefficients of a model file; copying it copies views.
///
/// `s = mean + sum_i x_i sum_j y_j m_ij`. Order of summation: `t_i` from zero, `t_i += y_j m_ij` for j ascending; `s = mean`, then `s += x_i t_i` for i
/// ascending: the order of [`Bilinear`](crate::generator::bilinear::Bilinear) over decoded terms, every product rounded before it is added. The derivative
/// by `x_i` is `t_i`, that by `y_j` is `x_i m_ij` summed from zero for i ascending.
#[derive(Debug, Clone, Copy)]
pub struct Stored<'a, S: Storage<'a>> {
    identity_dim: u32,
    pose_dim: u32,
    storage: S,
    bytes: PhantomData<&'a [u8]>,
}

impl<'a, S: Storage<'a>> Stored<'a, S> {
    pub(crate) fn new(identity_dim: u32, pose_dim: u32, storage: S) -> Self {
        Stored { identity_dim, pose_dim, storage, bytes: PhantomData }
    }

    #[inline(always)]
    fn parts(&self, block: usize) -> Option<(Block, S::Terms)> {
        let (identity, pose) = (self.identity_dim as usize, self.pose_dim as usize);
        let (mean, terms) = self.storage.block(block, identity.saturating_mul(pose).saturating_add(1))?;
        Some((Block::of_raw(mean), terms))
    }

    /// The mean of one coefficient; its terms `m_ij`, j fastest, go to `core`, as many as it holds.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(crate) fn one(&self, coefficient: usize, core: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        let (block, lane) = (coefficient / LANES, coefficient % LANES);
        let (identity, pose) = (self.identity_dim as usize, self.pose_dim as usize);
        let (mean, terms) = self.storage.block(block, identity.saturating_mul(pose).saturating_add(1))?;
        for (to, term) in core.iter_mut().zip(terms.iter()) {
            *to = term.lane(lane);
        }
        Some(lane_of_raw(mean, lane))
    }

    /// What is left of a block when one mode is fixed: the mean, and one column per free weight. `weight(k)` are the weights `k` of the fixed mode.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(crate) fn with_fixed(
        &self,
        fixed: Mode,
        block: usize,
        weight: impl Fn(usize) -> LaneWeights,
        columns: &mut [[f32; NUMBERS]],
    ) -> Option<Block> {
        let (mean, terms) = self.parts(block)?;
        let groups = terms.groups(self.pose_dim as usize);
        match fixed {
            Mode::Identity => {
                columns.fill([0.0; NUMBERS]);
                for (i, terms) in groups.enumerate() {
                    let x = weight(i);
                    for (column, term) in columns.iter_mut().zip(terms.iter()) {
                        Block::load(column).plus_weighted(&x, &term.block()).store(column);
                    }
                }
            }
            Mode::Pose => {
                for (column, terms) in columns.iter_mut().zip(groups) {
                    let mut sum = Block::ZERO;
                    for (j, term) in terms.iter().enumerate() {
                        sum = sum.plus_weighted(&weight(j), &term.block());
                    }
                    sum.store(column);
                }
            }
        }
        Some(mean)
    }
}

impl<'a, S: Storage<'a>> Locals for Stored<'a, S> {
    fn identity_dim(&self) -> usize {
        self.identity_dim as usize
    }

    fn pose_dim(&self) -> usize {
        self.pose_dim as usize
    }
}

impl<'a, S: Storage<'a>> sealed::Kernels for Stored<'a, S> {
    #[inline(always)]
    fn mean(&self, block: usize) -> Option<Block> {
        Some(self.parts(block)?.0)
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn block(&self, block: usize, identity: &[LaneWeights], pose: &[LaneWeights]) -> Option<Block> {
        let (mut value, terms) = self.parts(block)?;
        for (terms, x) in terms.groups(self.pose_dim as usize).zip(identity) {
            let mut sum = Block::ZERO;
            for (term, y) in terms.iter().zip(pose) {
                sum = sum.plus_weighted(y, &term.block());
            }
            value = value.plus_weighted(x, &sum);
        }
        Some(value)
    }

    fn slope(&self, coefficient: usize, identity: &[f32], pose: &[f32], weight: usize) -> Option<[f32; 3]> {
        let (block, lane) = (coefficient / LANES, coefficient % LANES);
        let (_, terms) = self.parts(block)?;
        let mut groups = terms.groups(self.pose_dim as usize);
        let mut sum = [0.0; 3];
        match weight.checked_sub(self.identity_dim as usize) {
            None => {
                for (term, &y) in groups.nth(weight)?.iter().zip(pose) {
                    sum = plus_scaled(sum, y, term.lane(lane));
                }
            }
            Some(j) => {
                for (terms, &x) in groups.zip(identity) {
                    sum = plus_scaled(sum, x, terms.iter().nth(j)?.lane(lane));
                }
            }
        }
        Some(sum)
    }
}

/// Local models with one mode fixed, linear in the other: a mean and columns in the caller's memory for the first blocks, the means of the file
/// for the rest.
///
/// `s = mean + sum_k w_k c_k`, k ascending. With the pose fixed the bits are those of the whole model; with the identity fixed the sums over the identity
/// come first, and the last bits may differ.
#[derive(Debug, Clone, Copy)]
pub struct Fixed<'w, L> {
    pub(crate) free: Mode,
    pub(crate) dim: usize,
    /// For each block: the mean, then one column per free weight.
    pub(crate) columns: &'w [[f32; NUMBERS]],
    pub(crate) source: L,
}

impl<L> Fixed<'_, L> {
    /// The mode whose weights are still free.
    pub const fn free(&self) -> Mode {
        self.free
    }

    #[inline(always)]
    fn parts(&self, block: usize) -> Option<(&[f32; NUMBERS], &[[f32; NUMBERS]])> {
        let stride = self.dim + 1;
        let from = block.checked_mul(stride)?;
        self.columns.get(from..from.checked_add(stride)?)?.split_first()
    }
}

impl<L: Locals> Locals for Fixed<'_, L> {
    fn identity_dim(&self) -> usize {
        if self.free == Mode::Identity { self.dim } else { 0 }
    }

    fn pose_dim(&self) -> usize {
        if self.free == Mode::Pose { self.dim } else { 0 }
    }
}

impl<L: Locals> sealed::Kernels for Fixed<'_, L> {
    #[inline(always)]
    fn mean(&self, block: usize) -> Option<Block> {
        // A level of detail of a prepared form keeps its columns; the means are in the file as well.
        self.source.mean(block)
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn block(&self, block: usize, identity: &[LaneWeights], pose: &[LaneWeights]) -> Option<Block> {
        let Some((mean, columns)) = self.parts(block) else { return self.source.mean(block) };
        let mut value = Block::load(mean);
        let weights = if self.free == Mode::Identity { identity } else { pose };
        for (column, weight) in columns.iter().zip(weights) {
            value = value.plus_weighted(weight, &Block::load(column));
        }
        Some(value)
    }

    fn slope(&self, coefficient: usize, _: &[f32], _: &[f32], weight: usize) -> Option<[f32; 3]> {
        let (_, columns) = self.parts(coefficient / LANES)?;
        Some(lane_of_numbers(columns.get(weight)?, coefficient % LANES))
    }
}

/// The weights `index` of the coefficients of a block, from coefficient `first` on; zero behind the last.
#[inline(always)]
pub(crate) fn gathered(weights: &[f32], dim: usize, first: usize, index: usize) -> LaneWeights {
    let mut lanes = [0.0; LANES];
    let own = weights.get(first.saturating_mul(dim)..).unwrap_or_default();
    for (lane, weights) in lanes.iter_mut().zip(own.chunks_exact(dim.max(1))) {
        *lane = weights.get(index).copied().unwrap_or(0.0);
    }
    lanes
}

/// All weights of the coefficients of a block: row `k` of `lanes` gets weight `k` of each.
#[inline(always)]
pub(crate) fn gather(weights: &[f32], dim: usize, first: usize, lanes: &mut [LaneWeights]) {
    let own = weights.get(first.saturating_mul(dim)..).unwrap_or_default();
    if own.len() < LANES.saturating_mul(dim) {
        lanes.fill([0.0; LANES]);
    }
    for (lane, weights) in own.chunks_exact(dim.max(1)).take(LANES).enumerate() {
        for (row, weight) in lanes.iter_mut().zip(weights) {
            row[lane & (LANES - 1)] = *weight;
        }
    }
}

/// `mean + sum_i x_i sum_j y_j m_ij` of one coefficient, in the order of [`Stored`].
#[inline(always)]
pub(crate) fn bilinear(mean: [f32; 3], core: &[[f32; 3]], identity: &[f32], pose: &[f32]) -> [f32; 3] {
    let mut value = mean;
    for (terms, &x) in core.chunks_exact(pose.len().max(1)).zip(identity) {
        let mut sum = [0.0; 3];
        for (term, &y) in terms.iter().zip(pose) {
            sum = plus_scaled(sum, y, *term);
        }
        value = plus_scaled(value, x, sum);
    }
    value
}
