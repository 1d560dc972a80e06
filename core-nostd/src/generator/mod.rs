//! Generators `F(w): R^d -> R^3n` (Wuhrer, eq. 8.1): everything that consumes a model is written against [`Generator`].
//!
//! Vertices come in blocks of [`LANES`]: vertex `v` is lane `v % LANES` of block `v / LANES`, and a block holds x of its vertices, then y,
//! then z. That is how coefficients are stored, and why kernels vectorise over vertices on every target: each lane sums its terms in
//! the same order whatever the vector width, so all targets give the same bits.
//!
//! [`linear`] is eq. 9.1, [`bilinear`] eq. 8.2 and 12.1, [`skinned`] eq. 9.1 to 9.3, [`wavelet`] ch. 15; [`prepared`] are forms with one of the two groups of weights fixed.

pub mod any;
pub mod any_prepared;
pub mod bilinear;
pub mod block;
pub(crate) mod gradient;
pub(crate) mod lanes;
pub mod linear;
pub mod prepared;
pub mod rest;
pub mod skinned;
mod skinned_gradient;
mod skinned_prepared;
#[cfg(test)]
mod skinned_tests;
pub mod wavelet;

use core::hint::black_box;
use core::ops::Range;

use crate::Error;
use crate::format::limits::MAX_WEIGHT;
use crate::workspace::{Requirement, check_len, saturated};
pub use block::{Block, LANES, NUMBERS};
pub use skinned_prepared::FixedIdentity;

/// The weights `w = (w_id, w_pose)` of a generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights<'a> {
    /// Identity weights, `identity_dim`.
    pub identity: &'a [f32],
    /// Pose weights (expression or posture), `pose_dim`.
    pub pose: &'a [f32],
}

impl Weights<'_> {
    /// `Ok` when the lengths are right and every weight is a number of magnitude at most 1e9.
    ///
    /// Errors: `DimensionMismatch`, `NotFinite` (index counted over identity, then pose).
    pub fn check(&self, identity_dim: usize, pose_dim: usize) -> Result<(), Error> {
        check_len(identity_dim, self.identity.len())?;
        check_len(pose_dim, self.pose.len())?;
        let fine = |weight: &f32| weight.abs() <= MAX_WEIGHT;
        // Whole rows without a way out of the middle: the weights of a wavelet model are hundreds of thousands.
        let all_fine = |weights: &[f32]| {
            let mut rows = weights.chunks(4 * LANES);
            rows.all(|row| row.iter().fold(true, |so_far, weight| so_far & fine(weight)))
        };
        if all_fine(self.identity) && all_fine(self.pose) {
            return Ok(());
        }
        let index = self.identity.iter().chain(self.pose).position(|weight| !fine(weight));
        Err(Error::NotFinite { index: saturated(index.unwrap_or(0)) })
    }
}

/// Weights that were checked, with what a generator keeps for them: made by [`Generator::begin`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct At<'a> {
    pub(crate) weights: Weights<'a>,
    /// A skeleton's joints in the pose, the positions of a wavelet's grid; empty for sums of terms.
    pub(crate) state: &'a [f32],
    /// The state holds what derivatives need.
    pub(crate) derivatives: bool,
}

impl<'a> At<'a> {
    /// The weights.
    pub fn weights(&self) -> Weights<'a> {
        self.weights
    }
}

/// A deformation model: vertex positions and their derivatives as a function of weights.
///
/// An evaluation has two steps. [`Generator::begin`] checks the weights and writes what all vertices share into the caller's memory; the others give
/// vertices from that, in ranges or one by one, in any order. Models that are sums of terms share nothing: for them [`Generator::evaluate`] and
/// [`Generator::linearise`] do both steps in one call.
///
/// The methods ending in `_unchecked` trust that `at` is this generator's; with another's they give numbers without meaning, but neither panic nor leave
/// the model.
pub trait Generator {
    /// Number of vertices n.
    fn vertex_count(&self) -> usize;
    /// Number of identity weights; 0 in a form whose identity is fixed.
    fn identity_dim(&self) -> usize;
    /// Number of pose weights; 0 in a form whose pose is fixed.
    fn pose_dim(&self) -> usize;

    /// Memory that [`Generator::begin`] fills; nothing for sums of terms.
    fn state_req(&self, derivatives: bool) -> Requirement {
        let _ = derivatives;
        Requirement::NONE
    }

    /// Writes the state of weights that were checked into memory of the right length.
    fn write_state(&self, weights: Weights<'_>, derivatives: bool, state: &mut [f32]) {
        let _ = (weights, derivatives, state);
    }

    /// Positions of the vertices of one block, millimetres; `None` beyond the last block.
    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block>;

    /// As [`Generator::block_unchecked`], with the derivatives by each weight (identity first) in `jacobian`, which holds at least
    /// `identity_dim + pose_dim` blocks as [`Block::store`] lays them. The positions have the same bits. `at` was begun with derivatives.
    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block>;

    /// One vertex of [`Generator::block_unchecked`], same bits.
    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]>;

    /// One vertex of [`Generator::linearised_block_unchecked`], same bits; `jacobian` holds at least `identity_dim + pose_dim` entries.
    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]>;

    /// Checks the weights and writes what all vertices share.
    ///
    /// `state` holds at least [`Generator::state_req`] numbers; with `derivatives` what the derivatives need too.
    /// Errors: `DimensionMismatch`, `NotFinite` (weights), `WorkspaceTooSmall`; `state` is untouched then. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn begin<'a>(&self, weights: Weights<'a>, derivatives: bool, state: &'a mut [f32]) -> Result<At<'a>, Error> {
        weights.check(self.identity_dim(), self.pose_dim())?;
        let requirement = self.state_req(derivatives);
        requirement.check(state.len())?;
        let (state, _) = state.split_at_mut_checked(requirement.numbers()).unwrap_or_default();
        self.write_state(weights, derivatives, state);
        Ok(At { weights, state, derivatives })
    }

    /// Number of weights.
    fn dim(&self) -> usize {
        self.identity_dim() + self.pose_dim()
    }

    /// Number of blocks of vertices.
    fn block_count(&self) -> usize {
        self.vertex_count().div_ceil(LANES)
    }

    /// Writes the positions of a range of vertices (eq. 8.1).
    ///
    /// | argument | shape | unit |
    /// |---|---|---|
    /// | `weights` | `identity_dim`, `pose_dim` | the model's (see `Gaussian` for standard deviations) |
    /// | `vertices` | within `0..n` | |
    /// | `out` | `3 * vertices.len()`, xyz interleaved | millimetres; wholly overwritten, untouched on error |
    ///
    /// Cost: time and memory traffic in proportion to the range. Any split into ranges gives the same bits; multiples of [`LANES`] avoid double
    /// work.
    /// Errors: `DimensionMismatch`, `NotFinite`, `IndexOutOfRange`; `WorkspaceTooSmall` for models with a state, which want [`Generator::begin`]
    /// and [`Generator::evaluate_at`]. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn evaluate(&self, weights: Weights<'_>, vertices: Range<usize>, out: &mut [f32]) -> Result<(), Error> {
        let at = self.begin(weights, false, &mut [])?;
        self.evaluate_at(at, vertices, out)
    }

    /// [`Generator::evaluate`] behind [`Generator::begin`].
    ///
    /// Errors: `DimensionMismatch`, `IndexOutOfRange`. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn evaluate_at(&self, at: At<'_>, vertices: Range<usize>, out: &mut [f32]) -> Result<(), Error> {
        self.evaluate_batch_at(&[at], vertices, out)
    }

    /// [`Generator::evaluate_at`] for several sets of weights at once, so that the model's coefficients are read once for all of them.
    ///
    /// `out` holds the positions of the first, then of the second, ..: `ats.len() * 3 * vertices.len()` numbers. The bits are those of single evaluations.
    /// Errors: as [`Generator::evaluate_at`]. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn evaluate_batch_at(&self, ats: &[At<'_>], vertices: Range<usize>, out: &mut [f32]) -> Result<(), Error> {
        for at in ats {
            self.state_req(at.derivatives).check(at.state.len())?;
        }
        let n = self.vertex_count();
        if vertices.start > vertices.end || vertices.end > n {
            return Err(Error::IndexOutOfRange {
                index: saturated(vertices.end.max(vertices.start)),
                limit: saturated(n),
            });
        }
        let each = (vertices.end - vertices.start).saturating_mul(3);
        check_len(each.saturating_mul(ats.len()), out.len())?;
        let mut vertex = vertices.start;
        while vertex < vertices.end {
            let block = vertex / LANES;
            let lane = vertex % LANES;
            let count = (LANES - lane).min(vertices.end - vertex);
            let from = 3 * (vertex - vertices.start);
            for (at, out) in ats.iter().zip(out.chunks_exact_mut(each.max(1))) {
                if let (Some(piece), Some(values)) =
                    (out.get_mut(from..from + 3 * count), self.block_unchecked(*at, block))
                {
                    // Through memory: otherwise LLVM keeps the sums in the interleaved order and shuffles every coefficient instead.
                    black_box(&values).write_interleaved(lane, piece);
                }
            }
            vertex += count;
        }
        Ok(())
    }

    /// Writes the positions of a range of blocks and their derivatives by every weight, in one pass over the model.
    ///
    /// | argument | shape | unit |
    /// |---|---|---|
    /// | `weights` | `identity_dim`, `pose_dim` | the model's |
    /// | `blocks` | within `0..block_count` | |
    /// | `values` | `blocks.len()`, 3, [`LANES`] | millimetres; x of a block's vertices, then y, then z |
    /// | `jacobian` | `blocks.len()`, `dim`, 3, [`LANES`] | millimetres per weight: identity weights first |
    ///
    /// Both outputs are wholly overwritten, untouched on error. The positions have the bits of [`Generator::evaluate`]; lanes behind the last
    /// vertex hold what the file's padding gives, zero in a file of ours.
    /// Cost: one pass over the coefficients of the range. Any split into ranges gives the same bits.
    /// Errors: as [`Generator::evaluate`]. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearise(
        &self,
        weights: Weights<'_>,
        blocks: Range<usize>,
        values: &mut [f32],
        jacobian: &mut [f32],
    ) -> Result<(), Error> {
        let at = self.begin(weights, true, &mut [])?;
        self.linearise_at(at, blocks, values, jacobian)
    }

    /// [`Generator::linearise`] behind [`Generator::begin`] with derivatives.
    ///
    /// Errors: `DimensionMismatch`, `IndexOutOfRange`, `WorkspaceTooSmall` when `at` was begun without derivatives. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearise_at(
        &self,
        at: At<'_>,
        blocks: Range<usize>,
        values: &mut [f32],
        jacobian: &mut [f32],
    ) -> Result<(), Error> {
        self.state_req(true).check(at.state.len())?;
        let limit = self.block_count();
        if blocks.start > blocks.end || blocks.end > limit {
            let index = saturated(blocks.end.max(blocks.start));
            return Err(Error::IndexOutOfRange { index, limit: saturated(limit) });
        }
        let numbers = (blocks.end - blocks.start).saturating_mul(NUMBERS);
        check_len(numbers, values.len())?;
        check_len(numbers.saturating_mul(self.dim()), jacobian.len())?;
        let mut rest = jacobian.as_chunks_mut().0;
        for (block, value) in blocks.zip(values.as_chunks_mut().0) {
            let Some((columns, behind)) = rest.split_at_mut_checked(self.dim()) else { break };
            if let Some(block) = self.linearised_block_unchecked(at, block, columns) {
                block.store(value);
            }
            rest = behind;
        }
        Ok(())
    }

    /// Scratch of [`Generator::gradient_at`].
    fn gradient_req(&self) -> Requirement {
        gradient::by_jacobian_req(self.dim())
    }

    /// Writes the derivative of an energy by every weight from its derivatives by the vertices: `J^T g` (reverse mode), for solvers that work with gradients.
    ///
    /// | argument | shape | note |
    /// |---|---|---|
    /// | `at` | | begun with derivatives |
    /// | `vertex_gradients` | `3 n`, xyz interleaved | energy per millimetre |
    /// | `gradient` | `dim` | energy per weight, identity first; wholly overwritten, untouched on error |
    /// | `workspace` | [`Generator::gradient_req`] | |
    ///
    /// Order of summation: for each weight sixteen sums, one for each lane, over the blocks in order, each adding `(x g_x + y g_y) + z g_z`; then the lanes from zero.
    /// A body blended as matrices without corrections sums forces and torques of the joints likewise and carries them to the root.
    /// Cost: one linearisation; for such a body less than two evaluations.
    /// Errors: `DimensionMismatch`, `WorkspaceTooSmall`. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn gradient_at(
        &self,
        at: At<'_>,
        vertex_gradients: &[f32],
        gradient: &mut [f32],
        workspace: &mut [f32],
    ) -> Result<(), Error> {
        gradient::by_jacobian(self, at, vertex_gradients, gradient, workspace)
    }
}
