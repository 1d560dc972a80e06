//! A generator with its identity or its pose fixed, where it is linear in the rest: tracking fixes the identity once, then pays only for the pose.

use core::ops::Range;

use super::bilinear::Bilinear;
use super::block::lane_of_numbers;
use super::{At, Block, Generator, LANES, NUMBERS, Weights};
use crate::Error;
use crate::format::Mode;
use crate::quantise::Storage;
use crate::workspace::{Requirement, saturated};

/// What remains of a generator that is linear in the free weights when the others are fixed: an offset and one column per remaining weight, in the
/// caller's memory.
///
/// It is a generator of its own, over the vertices that were prepared; the fixed group has no weights any more. Fixing the pose gives the same
/// bits as the whole model. Fixing the identity sums over the identity first, so the last bits may differ from the whole model's; they are
/// the same on every target.
#[derive(Debug, Clone, Copy)]
pub struct Prepared<'w> {
    free: Mode,
    dim: usize,
    n_vertices: usize,
    /// For each block: the offset, then one column per free weight.
    columns: &'w [[f32; NUMBERS]],
}

/// Memory that a prepared form of the vertices of `blocks` (in blocks of [`LANES`] vertices) takes.
pub fn prepared_req<'a, S: Storage<'a>>(
    generator: &Bilinear<'a, S>,
    fixed: Mode,
    blocks: &Range<usize>,
) -> Requirement {
    let dim = match fixed {
        Mode::Identity => generator.pose_dim(),
        Mode::Pose => generator.identity_dim(),
    };
    let count = blocks.end.saturating_sub(blocks.start);
    Requirement::of(count.saturating_mul(dim.saturating_add(1)).saturating_mul(NUMBERS))
}

impl<'w> Prepared<'w> {
    /// Fixes one group of weights for the vertices of `blocks`: vertex `v` of the result is vertex `LANES * blocks.start + v` of the model.
    ///
    /// | argument | shape | note |
    /// |---|---|---|
    /// | `fixed` | | which group `weights` are |
    /// | `weights` | `identity_dim` or `pose_dim` | checked as in [`Weights::check`] |
    /// | `workspace` | [`prepared_req`] | borrowed as long as the result lives |
    ///
    /// Cost: one pass over the coefficients of the range.
    /// Errors: `DimensionMismatch`, `NotFinite`, `IndexOutOfRange`, `WorkspaceTooSmall`. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub fn new<'a, S: Storage<'a>>(
        generator: &Bilinear<'a, S>,
        fixed: Mode,
        weights: &[f32],
        blocks: Range<usize>,
        workspace: &'w mut [f32],
    ) -> Result<Self, Error> {
        let fixed_dim = match fixed {
            Mode::Identity => generator.identity_dim(),
            Mode::Pose => generator.pose_dim(),
        };
        check_blocks(generator, &blocks)?;
        Weights { identity: weights, pose: &[] }.check(fixed_dim, 0)?;
        let requirement = prepared_req(generator, fixed, &blocks);
        requirement.check(workspace.len())?;
        let (numbers, _) = workspace.split_at_mut_checked(requirement.numbers()).unwrap_or_default();
        let dim = generator.dim() - fixed_dim;
        for (block, out) in
            blocks.clone().zip(numbers.chunks_exact_mut(dim.saturating_add(1).saturating_mul(NUMBERS).max(1)))
        {
            let Some((offset_out, columns)) = out.as_chunks_mut().0.split_first_mut() else { break };
            let offset = match fixed {
                Mode::Identity => generator.with_identity(weights, block, columns),
                Mode::Pose => generator.with_pose(weights, block, columns),
            };
            offset.unwrap_or(Block::ZERO).store(offset_out);
        }
        Prepared::of_numbers(generator, fixed, blocks, numbers)
    }

    /// The form whose memory [`Prepared::new`] has filled before, for the same blocks at once or for consecutive ranges of them.
    ///
    /// Errors: `IndexOutOfRange`, `WorkspaceTooSmall`. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub fn of_numbers<'a, S: Storage<'a>>(
        generator: &Bilinear<'a, S>,
        fixed: Mode,
        blocks: Range<usize>,
        numbers: &'w [f32],
    ) -> Result<Self, Error> {
        check_blocks(generator, &blocks)?;
        prepared_req(generator, fixed, &blocks).check(numbers.len())?;
        let (free, dim) = match fixed {
            Mode::Identity => (Mode::Pose, generator.pose_dim()),
            Mode::Pose => (Mode::Identity, generator.identity_dim()),
        };
        let n_vertices = generator.vertex_count().min(blocks.end * LANES).saturating_sub(blocks.start * LANES);
        Ok(Prepared { free, dim, n_vertices, columns: numbers.as_chunks().0 })
    }

    /// A form whose columns were written by its maker.
    pub(crate) fn of_columns(free: Mode, dim: usize, n_vertices: usize, columns: &'w [[f32; NUMBERS]]) -> Self {
        Prepared { free, dim, n_vertices, columns }
    }

    /// The group of weights that is still free.
    pub fn free(&self) -> Mode {
        self.free
    }

    /// The offset of a block and its columns.
    #[inline(always)]
    fn parts(&self, block: usize) -> Option<(&'w [f32; NUMBERS], &'w [[f32; NUMBERS]])> {
        let stride = self.dim + 1;
        let from = block.checked_mul(stride)?;
        self.columns.get(from..from.checked_add(stride)?)?.split_first()
    }

    #[inline(always)]
    fn free_weights<'a>(&self, weights: Weights<'a>) -> &'a [f32] {
        match self.free {
            Mode::Identity => weights.identity,
            Mode::Pose => weights.pose,
        }
    }
}

/// Refuses blocks that the generator does not have.
pub(crate) fn check_blocks(generator: &impl Generator, blocks: &Range<usize>) -> Result<(), Error> {
    let limit = generator.block_count();
    if blocks.start > blocks.end || blocks.end > limit {
        return Err(Error::IndexOutOfRange { index: saturated(blocks.end.max(blocks.start)), limit: saturated(limit) });
    }
    Ok(())
}

impl Generator for Prepared<'_> {
    fn vertex_count(&self) -> usize {
        self.n_vertices
    }

    fn identity_dim(&self) -> usize {
        if self.free == Mode::Identity { self.dim } else { 0 }
    }

    fn pose_dim(&self) -> usize {
        if self.free == Mode::Pose { self.dim } else { 0 }
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block> {
        let (offset, columns) = self.parts(block)?;
        let mut value = Block::load(offset);
        for (column, &weight) in columns.iter().zip(self.free_weights(at.weights)) {
            value = value.plus_scaled(weight, &Block::load(column));
        }
        Some(value)
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block> {
        let (_, columns) = self.parts(block)?;
        for (to, column) in jacobian.get_mut(..self.dim)?.iter_mut().zip(columns) {
            *to = *column;
        }
        self.block_unchecked(at, block)
    }

    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]> {
        let (offset, columns) = self.parts(vertex / LANES)?;
        let lane = vertex % LANES;
        let mut value = lane_of_numbers(offset, lane);
        for (column, &weight) in columns.iter().zip(self.free_weights(at.weights)) {
            let [x, y, z] = lane_of_numbers(column, lane);
            value = [value[0] + weight * x, value[1] + weight * y, value[2] + weight * z];
        }
        Some(value)
    }

    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        let (_, columns) = self.parts(vertex / LANES)?;
        for (to, column) in jacobian.get_mut(..self.dim)?.iter_mut().zip(columns) {
            *to = lane_of_numbers(column, vertex % LANES);
        }
        self.vertex_unchecked(at, vertex)
    }
}
