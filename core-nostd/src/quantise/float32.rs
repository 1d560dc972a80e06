//! Coefficients as `f32`: the offset is the first term of its block.

use super::{Storage, Term, Terms, ahead, plus_scaled};
use crate::format::ElementType;
use crate::generator::Block;
use crate::generator::block::{RawBlock, lane_of_raw};

/// Coefficients as `f32`, 192 bytes a term.
#[derive(Debug, Clone, Copy)]
pub struct F32<'a> {
    terms: &'a [RawBlock],
}

impl<'a> Storage<'a> for F32<'a> {
    const ELEMENT: ElementType = ElementType::F32;
    type Terms = &'a [RawBlock];

    fn new(coefficients: &'a [u8], _: &'a [u8], _: &'a [u8]) -> Self {
        F32 { terms: coefficients.as_chunks().0 }
    }

    #[inline(always)]
    fn block(&self, block: usize, n_terms: usize) -> Option<(&'a RawBlock, Self::Terms)> {
        let from = block.checked_mul(n_terms)?;
        self.terms.get(from..from.checked_add(n_terms)?)?.split_first()
    }
}

impl<'a> Terms for &'a [RawBlock] {
    type Term = &'a RawBlock;

    #[inline(always)]
    fn split_at(self, count: usize) -> Option<(Self, Self)> {
        self.split_at_checked(count)
    }

    #[inline(always)]
    fn iter(self) -> impl Iterator<Item = Self::Term> {
        <[RawBlock]>::iter(self)
    }

    #[inline(always)]
    fn groups(self, count: usize) -> impl Iterator<Item = Self> {
        self.chunks_exact(count.max(1))
    }
}

/// Sums add `weight * term`, the product rounded, in the order of the terms.
impl Term for &RawBlock {
    type Sum = Block;
    type LaneSum = [f32; 3];

    #[inline(always)]
    fn block(self) -> Block {
        ahead(self);
        Block::of_raw(self)
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> [f32; 3] {
        lane_of_raw(self, lane)
    }

    #[inline(always)]
    fn zero() -> Block {
        Block::ZERO
    }

    #[inline(always)]
    fn start(self) -> Block {
        self.block()
    }

    #[inline(always)]
    fn add_to(self, sum: Block, weight: f32) -> Block {
        sum.plus_scaled(weight, &self.block())
    }

    #[inline(always)]
    fn total(sum: Block) -> Block {
        sum
    }

    #[inline(always)]
    fn lane_zero() -> [f32; 3] {
        [0.0; 3]
    }

    #[inline(always)]
    fn lane_start(self, lane: usize) -> [f32; 3] {
        self.lane(lane)
    }

    #[inline(always)]
    fn lane_add_to(self, lane: usize, sum: [f32; 3], weight: f32) -> [f32; 3] {
        plus_scaled(sum, weight, self.lane(lane))
    }

    #[inline(always)]
    fn lane_total(sum: [f32; 3]) -> [f32; 3] {
        sum
    }
}
