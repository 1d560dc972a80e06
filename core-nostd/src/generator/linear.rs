//! The linear generator, eq. 9.1: a mean shape and principal components, `v = mean + sum_l w_l a_l`.

use core::marker::PhantomData;

use super::lanes::{Axes, Columns, Lanes, One, Whole};
use super::{At, Block, Generator, LANES, NUMBERS};
use crate::quantise::{Storage, Terms};

/// A linear generator over the coefficients of a model file; copying it copies views.
///
/// Order of summation, per lane: the components from zero, `w_l a_l` for l ascending as the storage sums ([`crate::quantise::Term`]); then `mean + sum`. Derivatives are
/// the decoded components.
#[derive(Debug, Clone, Copy)]
pub struct Linear<'a, S: Storage<'a>> {
    n_vertices: u32,
    dim: u32,
    /// Terms behind the components, which a skinned model corrects its rest shape with.
    corrections: u32,
    storage: S,
    bytes: PhantomData<&'a [u8]>,
}

type TermOf<'a, S> = <<S as Storage<'a>>::Terms as Terms>::Term;

impl<'a, S: Storage<'a>> Linear<'a, S> {
    /// A generator over coefficients whose number was checked.
    pub(crate) fn new(n_vertices: u32, dim: u32, corrections: u32, storage: S) -> Self {
        Linear { n_vertices, dim, corrections, storage, bytes: PhantomData }
    }

    /// Terms behind the components.
    #[inline(always)]
    pub(crate) fn n_corrections(&self) -> usize {
        self.corrections as usize
    }

    /// The mean, the components, the corrections of a block.
    #[inline(always)]
    pub(crate) fn parts<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        block: usize,
    ) -> Option<(Axes<N>, S::Terms, S::Terms)> {
        let dim = self.dim as usize;
        let (mean, terms) = self.storage.block(block, dim + self.n_corrections() + 1)?;
        let (components, corrections) = terms.split_at(dim)?;
        Some((lanes.raw(mean), components, corrections))
    }

    /// The shape: `mean + sum`, the sum over the components, then over the corrections.
    #[inline(always)]
    pub(crate) fn summed<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        block: usize,
        weights: &[f32],
        corrections: &[f32],
    ) -> Option<Axes<N>> {
        let (mut shape, components, corrective) = self.parts(lanes, block)?;
        let mut sum = L::zero::<TermOf<'a, S>>();
        for (term, &weight) in components.iter().zip(weights) {
            sum = lanes.add_to(term, sum, weight);
        }
        if self.corrections != 0 {
            for (term, &weight) in corrective.iter().zip(corrections) {
                sum = lanes.add_to(term, sum, weight);
            }
        }
        for (axis, sum) in shape.iter_mut().zip(L::total::<TermOf<'a, S>>(sum)) {
            for (value, sum) in axis.iter_mut().zip(sum) {
                *value += sum;
            }
        }
        Some(shape)
    }

    /// The sum of the corrections alone, from zero.
    #[inline(always)]
    pub(crate) fn corrected<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        block: usize,
        corrections: &[f32],
    ) -> Option<Axes<N>> {
        let (_, _, corrective) = self.parts(lanes, block)?;
        let mut sum = L::zero::<TermOf<'a, S>>();
        for (term, &weight) in corrective.iter().zip(corrections) {
            sum = lanes.add_to(term, sum, weight);
        }
        Some(L::total::<TermOf<'a, S>>(sum))
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearised<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        block: usize,
        weights: &[f32],
        columns: &mut (impl Columns<N> + ?Sized),
    ) -> Option<Axes<N>> {
        let (_, components, _) = self.parts(lanes, block)?;
        for (column, term) in components.iter().enumerate() {
            columns.set(column, lanes.term(term));
        }
        self.summed(lanes, block, weights, &[])
    }
}

impl<'a, S: Storage<'a>> Generator for Linear<'a, S> {
    fn vertex_count(&self) -> usize {
        self.n_vertices as usize
    }

    fn identity_dim(&self) -> usize {
        self.dim as usize
    }

    fn pose_dim(&self) -> usize {
        0
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block> {
        Some(Block { axes: self.summed(Whole, block, at.weights.identity, &[])? })
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block> {
        Some(Block { axes: self.linearised(Whole, block, at.weights.identity, jacobian)? })
    }

    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]> {
        let shape = self.summed(One(vertex % LANES), vertex / LANES, at.weights.identity, &[])?;
        Some(shape.map(|[value]| value))
    }

    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        let shape = self.linearised(One(vertex % LANES), vertex / LANES, at.weights.identity, jacobian)?;
        Some(shape.map(|[value]| value))
    }
}
