//! The coefficients of a model as the synthesis asks for them: computed from the weights, a block of sixteen at a time, and not kept.

use super::local::{LaneWeights, Locals, gather};
use crate::generator::{Block, LANES, Weights};
use crate::wavelet::step::Rows;

/// A run of coefficients of one model at one set of weights.
pub(crate) struct Source<'s, L> {
    pub(crate) locals: L,
    pub(crate) weights: Weights<'s>,
    /// Coefficients that have weights; the others stand at their mean, in the block of the last of these as a sum, in which -0 becomes 0.
    pub(crate) weighted: usize,
    pub(crate) identity: &'s mut [LaneWeights],
    pub(crate) pose: &'s mut [LaneWeights],
    /// The last block: one row begins where the one before has stopped.
    pub(crate) last: Option<(usize, Block)>,
    /// The run that was asked for, x, y, z.
    pub(crate) rows: [&'s mut [f32]; 3],
}

impl<L: Locals> Source<'_, L> {
    #[inline(always)]
    fn block(&mut self, block: usize) -> Option<&Block> {
        if self.last.as_ref().is_none_or(|(last, _)| *last != block) {
            let first = block * LANES;
            let value = if first < self.weighted {
                gather(self.weights.identity, self.locals.identity_dim(), first, self.identity);
                gather(self.weights.pose, self.locals.pose_dim(), first, self.pose);
                self.locals.block(block, self.identity, self.pose)?
            } else {
                self.locals.mean(block)?
            };
            self.last = Some((block, value));
        }
        self.last.as_ref().map(|(_, value)| value)
    }
}

impl<L: Locals> Rows<3, f32> for Source<'_, L> {
    /// One copy of the local models in a program.
    #[inline(never)]
    fn row(&mut self, from: usize, len: usize) -> Option<[&[f32]; 3]> {
        let mut done = 0;
        while done < len {
            let (block, lane) = ((from + done) / LANES, (from + done) % LANES);
            let count = (LANES - lane).min(len - done);
            let axes = self.block(block)?.axes;
            for (row, axis) in self.rows.iter_mut().zip(&axes) {
                let to = row.get_mut(done..)?.get_mut(..count)?;
                for (to, from) in to.iter_mut().zip(axis.get(lane..)?) {
                    *to = *from;
                }
            }
            done += count;
        }
        let [x, y, z] = &self.rows;
        Some([x.get(..len)?, y.get(..len)?, z.get(..len)?])
    }
}
