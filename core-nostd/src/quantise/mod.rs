//! Storage of coefficients: `f32`, `f16`, or `i8` with a scale and an offset per block, axis and component, decoded inside the kernels.
//!
//! A kernel is written once against [`Storage`]: it asks for the terms of a block of sixteen vertices and sums them with weights. The first term of
//! a block, the offset (the mean shape), is `f32` in every storage, because it is metres long where the others are millimetres. How a storage
//! sums is part of its definition, and the same for a whole block as for one vertex of it, so that both have the same bits on every target.

mod float16;
mod float32;
mod int8;

pub use float16::{F16, f16_of, f32_of};
pub use float32::F32;
pub use int8::{I8, Quantised, quantised};

use crate::format::ElementType;
use crate::generator::Block;
use crate::generator::block::RawBlock;

/// Coefficients of a model in one of the storages; copying it copies views.
pub trait Storage<'a>: Copy + core::fmt::Debug {
    /// Element type of the coefficients' section.
    const ELEMENT: ElementType;
    /// Terms of a block behind its offset.
    type Terms: Terms;

    /// Over the bytes of the sections coefficients, offsets and ranges; those that the storage has not are empty.
    fn new(coefficients: &'a [u8], offsets: &'a [u8], ranges: &'a [u8]) -> Self;

    /// The offset of a block and its other terms, `n_terms` with the offset; `None` beyond the last block.
    fn block(&self, block: usize, n_terms: usize) -> Option<(&'a RawBlock, Self::Terms)>;
}

/// Consecutive terms of one block.
pub trait Terms: Copy {
    /// One of them.
    type Term: Term;

    /// The first `count` and the rest.
    fn split_at(self, count: usize) -> Option<(Self, Self)>;
    /// The terms in order.
    fn iter(self) -> impl Iterator<Item = Self::Term>;
    /// Groups of `count` terms in order.
    fn groups(self, count: usize) -> impl Iterator<Item = Self>;

    /// The first and the rest.
    #[inline(always)]
    fn split_first(self) -> Option<(Self::Term, Self)> {
        let (first, rest) = self.split_at(1)?;
        Some((first.iter().next()?, rest))
    }
}

/// One term: a displacement of sixteen vertices by a weight of one.
pub trait Term: Copy {
    /// A weighted sum of terms of a block.
    type Sum: Copy;
    /// The same for one vertex.
    type LaneSum: Copy;

    /// The term, decoded.
    fn block(self) -> Block;
    /// The term of one vertex, decoded: the bits of [`Term::block`].
    fn lane(self, lane: usize) -> [f32; 3];

    /// The empty sum.
    fn zero() -> Self::Sum;
    /// The sum that begins with this term, unweighted.
    fn start(self) -> Self::Sum;
    /// Adds the term times a weight.
    fn add_to(self, sum: Self::Sum, weight: f32) -> Self::Sum;
    /// What a sum has come to.
    fn total(sum: Self::Sum) -> Block;

    /// As [`Term::zero`], for one vertex.
    fn lane_zero() -> Self::LaneSum;
    /// As [`Term::start`].
    fn lane_start(self, lane: usize) -> Self::LaneSum;
    /// As [`Term::add_to`].
    fn lane_add_to(self, lane: usize, sum: Self::LaneSum, weight: f32) -> Self::LaneSum;
    /// As [`Term::total`].
    fn lane_total(sum: Self::LaneSum) -> [f32; 3];
}

/// `a + weight * b`, every product rounded before it is added.
#[inline(always)]
pub(crate) fn plus_scaled([a, b, c]: [f32; 3], weight: f32, [x, y, z]: [f32; 3]) -> [f32; 3] {
    [a + weight * x, b + weight * y, c + weight * z]
}

/// Asks the processor for the coefficients some way behind these, which lie one after the other: what decodes many numbers a byte of memory
/// does not look far enough ahead by itself, and waits at every line of the cache.
#[inline(always)]
pub(crate) fn ahead(bytes: &[u8]) {
    #[cfg(all(feature = "inline-kernels", not(debug_assertions)))]
    for line in (0..bytes.len()).step_by(64) {
        prefetch_index::prefetch_index(bytes, BYTES_AHEAD + line);
    }
    #[cfg(not(all(feature = "inline-kernels", not(debug_assertions))))]
    let _ = bytes;
}

/// In a loop over bytes in C++, 1 KB and 4 KB are as fast; of numbers in 32 bits, four times as much is slower than none.
#[cfg(all(feature = "inline-kernels", not(debug_assertions)))]
const BYTES_AHEAD: usize = 1536;
