//! A body with its identity fixed (tracking: only joints and skinning are left), or with its pose fixed (identity from many frames: linear).

use core::ops::Range;

use super::linear::Linear;
use super::prepared::{Prepared, check_blocks};
use super::rest::{StoredRest, sealed::Kernels};
use super::skinned::Skinned;
use super::{Block, Generator, LANES, NUMBERS, Weights, lanes};
use crate::Error;
use crate::format::Mode;
use crate::quantise::Storage;
use crate::workspace::{Requirement, Workspace, saturated};

/// A body whose identity is fixed for some of its blocks: a generator with the pose weights alone.
pub type FixedIdentity<'w, 'a, S> = Skinned<'w, StoredRest<'w, Linear<'a, S>>>;

impl<'a, S: Storage<'a>> Skinned<'a, Linear<'a, S>> {
    /// Memory of [`Skinned::with_identity`].
    pub fn with_identity_req(&self, blocks: &Range<usize>) -> Requirement {
        let count = blocks.end.saturating_sub(blocks.start);
        Requirement::of(count.saturating_mul(NUMBERS)).and(Requirement::of(3 * self.skeleton().n_joints()))
    }

    /// Fixes the identity for the vertices of `blocks`: vertex `v` of the result is vertex `LANES * blocks.start + v` of the model.
    ///
    /// | argument | shape | note |
    /// |---|---|---|
    /// | `identity` | `identity_dim` | |
    /// | `workspace` | [`Skinned::with_identity_req`] | borrowed as long as the result lives |
    ///
    /// The bits are those of the whole model, but for corrective terms, which are summed apart from the components.
    /// Cost: one pass over the components of the range.
    /// Errors: `DimensionMismatch`, `NotFinite`, `IndexOutOfRange`, `WorkspaceTooSmall`. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub fn with_identity<'w>(
        &self,
        identity: &[f32],
        blocks: Range<usize>,
        workspace: &'w mut [f32],
    ) -> Result<FixedIdentity<'w, 'a, S>, Error>
    where
        'a: 'w,
    {
        check_blocks(self, &blocks)?;
        Weights { identity, pose: &[] }.check(self.identity_dim(), 0)?;
        self.with_identity_req(&blocks).check(workspace.len())?;
        let mut pieces = Workspace::new(workspace);
        let numbers = pieces.take((blocks.end - blocks.start).saturating_mul(NUMBERS))?;
        let positions = pieces.take(3 * self.skeleton().n_joints())?.as_chunks_mut().0;
        for (block, out) in blocks.clone().zip(numbers.as_chunks_mut().0) {
            if let Some(axes) = Kernels::shape(self.rest(), lanes::Whole, block, identity, &[]) {
                Block { axes }.store(out);
            }
        }
        for (joint, position) in positions.iter_mut().enumerate() {
            *position = self.skeleton().placed(joint, identity, self.joints()).unwrap_or_default();
        }
        let n_vertices = self.vertex_count().min(blocks.end * LANES).saturating_sub(blocks.start * LANES);
        let rest =
            StoredRest { blocks: numbers.as_chunks().0, first_block: blocks.start, n_vertices, source: *self.rest() };
        Ok(Skinned {
            rest,
            skeleton: self.skeleton().with_positions(positions),
            influences: self.influences,
            first_block: blocks.start,
            blend: self.blend,
            joints: self.joints,
        })
    }

    /// Memory of [`Skinned::with_pose`]: what stays borrowed, and scratch.
    pub fn with_pose_req(&self, blocks: &Range<usize>) -> Requirement {
        let count = blocks.end.saturating_sub(blocks.start);
        let columns = count.saturating_mul(self.identity_dim().saturating_add(1)).saturating_mul(NUMBERS);
        Requirement::of(columns)
            .and(self.state_req(true))
            .and(Requirement::of(self.dim().saturating_mul(NUMBERS)))
            .and(Requirement::of(self.identity_dim()))
    }

    /// Fixes the pose for the vertices of `blocks`; what is left is linear in the identity (eq. 9.1 to 9.3 with a fixed posture).
    ///
    /// The offset is the body of identity zero in the pose, the columns are its derivatives by the identity weights there, which for a fixed pose are
    /// the same everywhere. The last bits may differ from the whole model's.
    ///
    /// | argument | shape | note |
    /// |---|---|---|
    /// | `pose` | `pose_dim` | |
    /// | `workspace` | [`Skinned::with_pose_req`] | borrowed as long as the result lives |
    ///
    /// Cost: one linearisation of the range.
    /// Errors: `DimensionMismatch`, `NotFinite`, `IndexOutOfRange`, `WorkspaceTooSmall`. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub fn with_pose<'w>(
        &self,
        pose: &[f32],
        blocks: Range<usize>,
        workspace: &'w mut [f32],
    ) -> Result<Prepared<'w>, Error> {
        check_blocks(self, &blocks)?;
        Weights { identity: &[], pose }.check(0, self.pose_dim()).map_err(|error| match error {
            // Counted over identity, then pose, as everywhere.
            Error::NotFinite { index } => {
                Error::NotFinite { index: saturated(self.identity_dim()).saturating_add(index) }
            }
            other => other,
        })?;
        self.with_pose_req(&blocks).check(workspace.len())?;
        let dim = self.identity_dim();
        let mut pieces = Workspace::new(workspace);
        let numbers = pieces.take((blocks.end - blocks.start).saturating_mul((dim + 1).saturating_mul(NUMBERS)))?;
        let zeros = pieces.take(dim)?;
        zeros.fill(0.0);
        let columns = pieces.take(self.dim().saturating_mul(NUMBERS))?.as_chunks_mut().0;
        let at = self.begin(Weights { identity: zeros, pose }, true, pieces.rest())?;
        for (block, out) in blocks.clone().zip(numbers.chunks_exact_mut((dim + 1).saturating_mul(NUMBERS).max(1))) {
            let Some((offset, out)) = out.as_chunks_mut().0.split_first_mut() else { break };
            self.linearised_block_unchecked(at, block, columns).unwrap_or(Block::ZERO).store(offset);
            for (out, column) in out.iter_mut().zip(columns.iter()) {
                *out = *column;
            }
        }
        let n_vertices = Generator::vertex_count(self).min(blocks.end * LANES).saturating_sub(blocks.start * LANES);
        Ok(Prepared::of_columns(Mode::Identity, dim, n_vertices, numbers.as_chunks().0))
    }
}
