//! Which vertices of a block a kernel works on: all sixteen side by side, or one. A kernel that is written once for both gives both the same bits.

use core::hint::black_box;

use super::block::{RawBlock, lane_of_raw};
use super::{Block, LANES, NUMBERS};
use crate::quantise::Term;

/// x, y and z of `N` vertices.
pub type Axes<const N: usize> = [[f32; N]; 3];

/// Skinning weights of sixteen vertices as they lie in the file.
pub type RawWeights = [u8; 4 * LANES];

/// The vertices of a block that are worked on.
pub trait Lanes<const N: usize>: Copy {
    /// A weighted sum of terms.
    type Sum<T: Term>: Copy;

    fn zero<T: Term>() -> Self::Sum<T>;
    fn add_to<T: Term>(self, term: T, sum: Self::Sum<T>, weight: f32) -> Self::Sum<T>;
    fn total<T: Term>(sum: Self::Sum<T>) -> Axes<N>;
    /// The same values, which the compiler knows nothing of.
    fn settled(values: Axes<N>) -> Axes<N>;
    fn term<T: Term>(self, term: T) -> Axes<N>;
    fn raw(self, raw: &RawBlock) -> Axes<N>;
    fn block(self, block: &Block) -> Axes<N>;
    fn weights(self, raw: &RawWeights) -> [f32; N];
}

/// The whole block.
#[derive(Debug, Clone, Copy)]
pub struct Whole;

impl Lanes<LANES> for Whole {
    type Sum<T: Term> = T::Sum;

    #[inline(always)]
    fn zero<T: Term>() -> T::Sum {
        T::zero()
    }

    #[inline(always)]
    fn add_to<T: Term>(self, term: T, sum: T::Sum, weight: f32) -> T::Sum {
        term.add_to(sum, weight)
    }

    #[inline(always)]
    fn total<T: Term>(sum: T::Sum) -> Axes<LANES> {
        Self::settled(T::total(sum).axes)
    }

    /// Through memory: otherwise LLVM keeps the sums in the order in which a later kernel wants the lanes, and shuffles every term into it.
    #[inline(always)]
    fn settled(values: Axes<LANES>) -> Axes<LANES> {
        *black_box(&values)
    }

    #[inline(always)]
    fn term<T: Term>(self, term: T) -> Axes<LANES> {
        term.block().axes
    }

    #[inline(always)]
    fn raw(self, raw: &RawBlock) -> Axes<LANES> {
        Block::of_raw(raw).axes
    }

    #[inline(always)]
    fn block(self, block: &Block) -> Axes<LANES> {
        block.axes
    }

    #[inline(always)]
    fn weights(self, raw: &RawWeights) -> [f32; LANES] {
        let mut weights = [0.0; LANES];
        for (weight, raw) in weights.iter_mut().zip(raw.as_chunks::<4>().0) {
            *weight = f32::from_le_bytes(*raw);
        }
        weights
    }
}

/// One lane.
#[derive(Debug, Clone, Copy)]
pub struct One(pub usize);

impl Lanes<1> for One {
    type Sum<T: Term> = T::LaneSum;

    #[inline(always)]
    fn zero<T: Term>() -> T::LaneSum {
        T::lane_zero()
    }

    #[inline(always)]
    fn add_to<T: Term>(self, term: T, sum: T::LaneSum, weight: f32) -> T::LaneSum {
        term.lane_add_to(self.0, sum, weight)
    }

    #[inline(always)]
    fn total<T: Term>(sum: T::LaneSum) -> Axes<1> {
        T::lane_total(sum).map(|value| [value])
    }

    #[inline(always)]
    fn settled(values: Axes<1>) -> Axes<1> {
        values
    }

    #[inline(always)]
    fn term<T: Term>(self, term: T) -> Axes<1> {
        term.lane(self.0).map(|value| [value])
    }

    #[inline(always)]
    fn raw(self, raw: &RawBlock) -> Axes<1> {
        lane_of_raw(raw, self.0).map(|value| [value])
    }

    #[inline(always)]
    fn block(self, block: &Block) -> Axes<1> {
        block.lane(self.0).map(|value| [value])
    }

    #[inline(always)]
    fn weights(self, raw: &RawWeights) -> [f32; 1] {
        [raw.as_chunks::<4>().0.get(self.0).map_or(0.0, |raw| f32::from_le_bytes(*raw))]
    }
}

/// Where the derivatives of `N` vertices go, a column for each weight.
pub trait Columns<const N: usize> {
    fn set(&mut self, column: usize, value: Axes<N>);
    fn get(&self, column: usize) -> Axes<N>;
}

impl Columns<LANES> for [[f32; NUMBERS]] {
    #[inline(always)]
    fn set(&mut self, column: usize, value: Axes<LANES>) {
        if let Some(to) = self.get_mut(column) {
            Block { axes: value }.store(to);
        }
    }

    #[inline(always)]
    fn get(&self, column: usize) -> Axes<LANES> {
        <[_]>::get(self, column).map_or([[0.0; LANES]; 3], |numbers| Block::load(numbers).axes)
    }
}

impl Columns<1> for [[f32; 3]] {
    #[inline(always)]
    fn set(&mut self, column: usize, value: Axes<1>) {
        if let Some(to) = self.get_mut(column) {
            *to = value.map(|[value]| value);
        }
    }

    #[inline(always)]
    fn get(&self, column: usize) -> Axes<1> {
        <[_]>::get(self, column).map_or([[0.0]; 3], |column| column.map(|value| [value]))
    }
}
