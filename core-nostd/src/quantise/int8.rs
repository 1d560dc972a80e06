//! Coefficients as bytes, `value = offset + scale * q`, with a scale and an offset for each block of sixteen vertices, axis and component.

use super::{Storage, Term, Terms, ahead, plus_scaled};
use crate::format::ElementType;
use crate::generator::block::RawBlock;
use crate::generator::{Block, LANES, NUMBERS};

/// Coefficients as `i8`, 72 bytes a term with its ranges; the offsets of the model are `f32` and lie apart.
#[derive(Debug, Clone, Copy)]
pub struct I8<'a> {
    offsets: &'a [RawBlock],
    terms: ByteTerms<'a>,
}

/// The bytes of consecutive terms and their ranges: scale and offset for x, then y, then z.
#[derive(Debug, Clone, Copy)]
pub struct ByteTerms<'a> {
    values: &'a [[u8; NUMBERS]],
    ranges: &'a [[u8; 24]],
}

/// One of them.
#[derive(Debug, Clone, Copy)]
pub struct ByteTerm<'a> {
    values: &'a [u8; NUMBERS],
    range: &'a [u8; 24],
}

/// One term, quantised: bytes, and scale and offset for each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantised {
    /// Codes -128 to 127, x of the sixteen vertices, then y, then z.
    pub codes: [i8; NUMBERS],
    /// Scale and offset of x, of y, of z.
    pub ranges: [[f32; 2]; 3],
}

/// Quantises the used lanes of a term, one axis at a time: the codes -128 and 127 stand for its least and its largest value.
///
/// `scale = (largest - least) / 255`, `offset = least + 128 * scale`; each code is the nearest, halves away from zero. The others, `used..16`, get the
/// code nearest to zero.
pub fn quantised(term: &Block, used: usize) -> Quantised {
    let mut result = Quantised { codes: [0; NUMBERS], ranges: [[0.0; 2]; 3] };
    let axes = term.axes.iter().zip(result.codes.as_chunks_mut::<LANES>().0).zip(&mut result.ranges);
    for ((values, codes), range) in axes {
        let mut least = f32::INFINITY;
        let mut largest = f32::NEG_INFINITY;
        for &value in values.iter().take(used) {
            least = if value < least { value } else { least };
            largest = if value > largest { value } else { largest };
        }
        if !(least <= largest) {
            continue;
        }
        let scale = (largest - least) / 255.0;
        let offset = least + 128.0 * scale;
        *range = [scale, offset];
        for (lane, (code, &value)) in codes.iter_mut().zip(values).enumerate() {
            let value = if lane < used { value } else { 0.0 };
            let steps = if scale > 0.0 { (value - offset) / scale } else { 0.0 };
            // A cast saturates.
            *code = libm::roundf(steps) as i8;
        }
    }
    result
}

impl<'a> Storage<'a> for I8<'a> {
    const ELEMENT: ElementType = ElementType::I8;
    type Terms = ByteTerms<'a>;

    fn new(coefficients: &'a [u8], offsets: &'a [u8], ranges: &'a [u8]) -> Self {
        let terms = ByteTerms { values: coefficients.as_chunks().0, ranges: ranges.as_chunks().0 };
        I8 { offsets: offsets.as_chunks().0, terms }
    }

    #[inline(always)]
    fn block(&self, block: usize, n_terms: usize) -> Option<(&'a RawBlock, Self::Terms)> {
        let count = n_terms.checked_sub(1)?;
        let from = block.checked_mul(count)?;
        let to = from.checked_add(count)?;
        let terms = ByteTerms { values: self.terms.values.get(from..to)?, ranges: self.terms.ranges.get(from..to)? };
        Some((self.offsets.get(block)?, terms))
    }
}

impl<'a> Terms for ByteTerms<'a> {
    type Term = ByteTerm<'a>;

    #[inline(always)]
    fn split_at(self, count: usize) -> Option<(Self, Self)> {
        let (values, values_behind) = self.values.split_at_checked(count)?;
        let (ranges, ranges_behind) = self.ranges.split_at_checked(count)?;
        Some((ByteTerms { values, ranges }, ByteTerms { values: values_behind, ranges: ranges_behind }))
    }

    #[inline(always)]
    fn iter(self) -> impl Iterator<Item = Self::Term> {
        self.values.iter().zip(self.ranges).map(|(values, range)| ByteTerm { values, range })
    }

    #[inline(always)]
    fn groups(self, count: usize) -> impl Iterator<Item = Self> {
        // Not `chunks_exact` zipped: a `zip` that is not inlined divides by the sizes, which may be zero as far as it knows.
        let mut rest = self;
        core::iter::from_fn(move || {
            let (group, behind) = rest.split_at(count.max(1))?;
            rest = behind;
            Some(group)
        })
    }
}

impl ByteTerm<'_> {
    /// Scales and offsets of the axes.
    #[inline(always)]
    fn range(self) -> [[f32; 2]; 3] {
        let mut range = [[0.0; 2]; 3];
        for (axis, bytes) in range.iter_mut().zip(self.range.as_chunks::<8>().0) {
            for (value, raw) in axis.iter_mut().zip(bytes.as_chunks::<4>().0) {
                *value = f32::from_le_bytes(*raw);
            }
        }
        range
    }

    #[inline(always)]
    fn codes(self, lane: usize) -> [f32; 3] {
        [0, LANES, 2 * LANES].map(|axis| self.values.get(axis + lane).map_or(0.0, |&code| f32::from(code as i8)))
    }
}

/// A weighted sum of codes, and what their offsets add to all vertices of the block.
#[derive(Debug, Clone, Copy)]
pub struct CodeSum {
    codes: Block,
    offsets: [f32; 3],
}

/// A term with weight `w` adds `(w * scale) * q` to a sum and `w * offset` to another, every product rounded; in the end the second is added to the first.
/// So a coefficient costs one conversion, one product and one sum, as an `f32` does.
impl Term for ByteTerm<'_> {
    type Sum = CodeSum;
    type LaneSum = ([f32; 3], [f32; 3]);

    /// `offset + scale * q`: the sum that begins at zero, with a weight of 1.
    #[inline(always)]
    fn block(self) -> Block {
        Self::total(self.start())
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> [f32; 3] {
        Self::lane_total(self.lane_start(lane))
    }

    #[inline(always)]
    fn zero() -> CodeSum {
        CodeSum { codes: Block::ZERO, offsets: [0.0; 3] }
    }

    #[inline(always)]
    fn start(self) -> CodeSum {
        self.add_to(Self::zero(), 1.0)
    }

    #[inline(always)]
    fn add_to(self, mut sum: CodeSum, weight: f32) -> CodeSum {
        ahead(self.values);
        ahead(self.range);
        let axes = sum.codes.axes.iter_mut().zip(self.values.as_chunks::<LANES>().0).zip(&mut sum.offsets);
        for (((axis, codes), constant), [scale, offset]) in axes.zip(self.range()) {
            let factor = weight * scale;
            *constant += weight * offset;
            for (value, &code) in axis.iter_mut().zip(codes) {
                *value += factor * f32::from(code as i8);
            }
        }
        sum
    }

    #[inline(always)]
    fn total(sum: CodeSum) -> Block {
        let mut block = sum.codes;
        for (axis, constant) in block.axes.iter_mut().zip(sum.offsets) {
            for value in axis {
                *value += constant;
            }
        }
        block
    }

    #[inline(always)]
    fn lane_zero() -> ([f32; 3], [f32; 3]) {
        ([0.0; 3], [0.0; 3])
    }

    #[inline(always)]
    fn lane_start(self, lane: usize) -> ([f32; 3], [f32; 3]) {
        self.lane_add_to(lane, Self::lane_zero(), 1.0)
    }

    #[inline(always)]
    fn lane_add_to(self, lane: usize, (codes, offsets): Self::LaneSum, weight: f32) -> Self::LaneSum {
        let [x, y, z] = self.range();
        let [p, q, r] = self.codes(lane);
        let sum = [codes[0] + (weight * x[0]) * p, codes[1] + (weight * y[0]) * q, codes[2] + (weight * z[0]) * r];
        (sum, plus_scaled(offsets, weight, [x[1], y[1], z[1]]))
    }

    #[inline(always)]
    fn lane_total(([a, b, c], [x, y, z]): Self::LaneSum) -> [f32; 3] {
        [a + x, b + y, c + z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Stream;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn bytes(term: &Quantised) -> ([u8; NUMBERS], [u8; 24]) {
        let ranges: Vec<u8> = term.ranges.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        (term.codes.map(|code| code as u8), ranges.try_into().unwrap())
    }

    proptest! {
        /// The error of a coefficient is at most half a step, but for rounding, and the lanes have the bits of the block.
        #[test]
        fn codes_are_the_nearest(seed in 1u32..10000, used in 1usize..17, size in 1e-6f32..1e6) {
            let mut stream = Stream::new(seed);
            let mut block = Block::ZERO;
            for axis in &mut block.axes { for value in axis.iter_mut().take(used) { *value = size * stream.next(); } }
            let term = quantised(&block, used);
            let (values, range) = bytes(&term);
            let raw = ByteTerm { values: &values, range: &range };
            let decoded = raw.block();
            for (axis, [scale, _]) in term.ranges.iter().enumerate() {
                for lane in 0..used {
                    let error = (decoded.axes[axis][lane] - block.axes[axis][lane]).abs();
                    prop_assert!(error <= 0.5 * scale + 2e-6 * size, "{error} {scale}");
                    prop_assert_eq!(raw.lane(lane)[axis].to_bits(), decoded.axes[axis][lane].to_bits());
                }
            }
        }
    }

    #[test]
    fn a_constant_axis_is_exact() {
        let mut block = Block::ZERO;
        block.axes[1] = [3.25; LANES];
        let (values, range) = bytes(&quantised(&block, LANES));
        assert_eq!(ByteTerm { values: &values, range: &range }.block(), block);
    }
}
