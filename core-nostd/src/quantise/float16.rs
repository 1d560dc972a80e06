//! Coefficients as IEEE 754 half precision: half the bytes, 11 bits of precision, decoded exactly.

use super::{Storage, Term, Terms, ahead, plus_scaled};
use crate::format::ElementType;
use crate::generator::block::RawBlock;
use crate::generator::{Block, LANES, NUMBERS};

/// Coefficients as `f16`, 96 bytes a term; the offsets are `f32` and lie apart.
#[derive(Debug, Clone, Copy)]
pub struct F16<'a> {
    offsets: &'a [RawBlock],
    terms: &'a [HalfBlock],
}

/// One term as it lies in the file.
pub type HalfBlock = [u8; 2 * NUMBERS];

/// The `f32` that a half-precision number stands for, exactly, for any finite one.
#[inline(always)]
pub const fn f32_of(half: u16) -> f32 {
    // The exponent of a half is 112 less than that of the float with the same bits, which also holds for numbers below the normal ones.
    const SHIFT: f32 = f32::from_bits((127 + 112) << 23);
    let magnitude = f32::from_bits(((half & 0x7fff) as u32) << 13) * SHIFT;
    f32::from_bits(magnitude.to_bits() | ((half & 0x8000) as u32) << 16)
}

/// The half-precision number nearest to `value`, ties to even; the largest finite one beyond the range, zero for NaN.
pub const fn f16_of(value: f32) -> u16 {
    let sign = ((value.to_bits() >> 16) & 0x8000) as u16;
    let magnitude = f32::from_bits(value.to_bits() & 0x7fff_ffff);
    if value.is_nan() {
        return 0;
    }
    if magnitude >= 65520.0 {
        return sign | 0x7bff;
    }
    let bits = magnitude.to_bits();
    // Spacing of halves: 2^-24 below 2^-14, else 2^(exponent - 10).
    if magnitude < 6.103_515_6e-5 {
        // Adding 0.5 * 2^23 * 2^-24 leaves the rounded multiple of 2^-24 in the mantissa.
        return sign | ((magnitude + 0.5).to_bits() - 0.5f32.to_bits()) as u16;
    }
    let rounded = bits + 0xfff + ((bits >> 13) & 1);
    sign | ((rounded >> 13) - (112 << 10)) as u16
}

impl<'a> Storage<'a> for F16<'a> {
    const ELEMENT: ElementType = ElementType::F16;
    type Terms = &'a [HalfBlock];

    fn new(coefficients: &'a [u8], offsets: &'a [u8], _: &'a [u8]) -> Self {
        F16 { offsets: offsets.as_chunks().0, terms: coefficients.as_chunks().0 }
    }

    #[inline(always)]
    fn block(&self, block: usize, n_terms: usize) -> Option<(&'a RawBlock, Self::Terms)> {
        let count = n_terms.checked_sub(1)?;
        let from = block.checked_mul(count)?;
        Some((self.offsets.get(block)?, self.terms.get(from..from.checked_add(count)?)?))
    }
}

impl<'a> Terms for &'a [HalfBlock] {
    type Term = &'a HalfBlock;

    #[inline(always)]
    fn split_at(self, count: usize) -> Option<(Self, Self)> {
        self.split_at_checked(count)
    }

    #[inline(always)]
    fn iter(self) -> impl Iterator<Item = Self::Term> {
        <[HalfBlock]>::iter(self)
    }

    #[inline(always)]
    fn groups(self, count: usize) -> impl Iterator<Item = Self> {
        self.chunks_exact(count.max(1))
    }
}

/// Sums add `weight * decoded term`, the product rounded, in the order of the terms.
impl Term for &HalfBlock {
    type Sum = Block;
    type LaneSum = [f32; 3];

    #[inline(always)]
    fn block(self) -> Block {
        ahead(self);
        let mut block = Block::ZERO;
        for (axis, bytes) in block.axes.iter_mut().zip(self.as_chunks::<{ 2 * LANES }>().0) {
            for (value, raw) in axis.iter_mut().zip(bytes.as_chunks::<2>().0) {
                *value = f32_of(u16::from_le_bytes(*raw));
            }
        }
        block
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> [f32; 3] {
        let (numbers, _) = self.as_chunks::<2>();
        [0, LANES, 2 * LANES].map(|axis| numbers.get(axis + lane).map_or(0.0, |raw| f32_of(u16::from_le_bytes(*raw))))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Value of a half by its definition.
    fn by_definition(half: u16) -> f64 {
        let (sign, exponent, fraction) = (half >> 15, (half >> 10) & 31, f64::from(half & 1023));
        let magnitude = if exponent == 0 {
            fraction * 2f64.powi(-24)
        } else {
            (1024.0 + fraction) * 2f64.powi(i32::from(exponent) - 25)
        };
        if sign == 1 { -magnitude } else { magnitude }
    }

    #[test]
    fn every_half_is_decoded_exactly_and_comes_back() {
        for half in 0..=u16::MAX {
            if half & 0x7c00 == 0x7c00 {
                continue;
            }
            let value = f32_of(half);
            assert_eq!(f64::from(value), by_definition(half), "{half:#x}");
            assert_eq!(f16_of(value), half, "{half:#x}");
        }
    }

    #[test]
    fn rounding_is_to_the_nearest_and_to_even() {
        for half in 0..0x7bffu16 {
            let (low, high) = (f32_of(half), f32_of(half + 1));
            let middle = (low + high) / 2.0;
            let even = if half & 1 == 0 { half } else { half + 1 };
            assert_eq!(f16_of(middle), even, "{half:#x}");
            assert_eq!(f16_of(f32::from_bits(middle.to_bits() + 1)), half + 1);
            assert_eq!(f16_of(-f32::from_bits(middle.to_bits() - 1)), half | 0x8000);
        }
        assert_eq!(f16_of(f32::INFINITY), 0x7bff);
        assert_eq!(f16_of(-1e9), 0xfbff);
        assert_eq!(f16_of(65519.9), 0x7bff);
        assert_eq!(f16_of(f32::NAN), 0);
    }
}
