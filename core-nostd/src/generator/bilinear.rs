//! The bilinear generator, eq. 8.2: `c = o + sum_j y_j b_j + sum_i x_i (a_i + sum_j y_j m_ij)`; without linear terms it is the
//! multilinear model of eq. 12.1, with `o` the mean and `m` the core tensor.

use super::block::{Term, lane_of_term};
use super::{Block, Generator, LANES, NUMBERS, Weights};
use crate::Error;
use crate::format::Header;
use crate::workspace::check_len;

/// A bilinear generator over the coefficients of a model file; copying it copies views.
///
/// Order of summation, per lane: `t_i = a_i`, then `t_i += y_j m_ij` for j ascending; `value = o`, then `value += y_j b_j` for j ascending,
/// then `value += x_i t_i` for i ascending. Every product is rounded before it is added; no fused operations.
#[derive(Debug, Clone, Copy)]
pub struct Bilinear<'a> {
    header: Header,
    terms: &'a [Term],
}

/// The terms of one block, told apart.
struct Parts<'a> {
    offset: &'a Term,
    pose_linear: &'a [Term],
    /// For each identity weight: its linear term (if any), then its bilinear terms.
    identity: &'a [Term],
}

impl<'a> Bilinear<'a> {
    /// A generator over the bytes of the coefficients' section.
    pub(crate) fn new(header: Header, bytes: &'a [u8]) -> Result<Self, Error> {
        let (terms, _) = bytes.as_chunks();
        check_len(header.n_blocks().saturating_mul(header.n_terms()), terms.len())?;
        Ok(Bilinear { header, terms })
    }

    /// Counts.
    pub fn header(&self) -> &Header {
        &self.header
    }

    #[inline(always)]
    fn parts(&self, block: usize) -> Option<Parts<'a>> {
        let count = self.header.n_terms();
        let from = block.checked_mul(count)?;
        let terms = self.terms.get(from..from.checked_add(count)?)?;
        let (offset, terms) = terms.split_first()?;
        let pose_terms = if self.header.pose_linear { self.header.pose_dim as usize } else { 0 };
        let (pose_linear, identity) = terms.split_at_checked(pose_terms)?;
        Some(Parts { offset, pose_linear, identity })
    }

    /// Terms of one identity weight.
    #[inline(always)]
    fn stride(&self) -> usize {
        self.header.pose_dim as usize + usize::from(self.header.identity_linear)
    }

    /// The linear term of an identity weight and its bilinear terms.
    #[inline(always)]
    fn identity_terms(&self, terms: &'a [Term]) -> (Option<&'a Term>, &'a [Term]) {
        if self.header.identity_linear {
            terms.split_first().map_or((None, terms), |(first, rest)| (Some(first), rest))
        } else {
            (None, terms)
        }
    }

    /// What is left of a block when the pose is fixed: the offset, and one column per identity weight in `columns`.
    #[inline(always)]
    pub(crate) fn with_pose(&self, pose: &[f32], block: usize, columns: &mut [[f32; NUMBERS]]) -> Option<Block> {
        let parts = self.parts(block)?;
        for (terms, column) in parts.identity.chunks_exact(self.stride().max(1)).zip(columns) {
            self.identity_column(terms, pose).store(column);
        }
        Some(parts.pose_offset(pose))
    }

    /// What is left of a block when the identity is fixed: the offset, and one column per pose weight in `columns`.
    ///
    /// Order of summation: offset `o + x_i a_i`, columns `b_j + x_i m_ij`, i ascending.
    #[inline(always)]
    pub(crate) fn with_identity(
        &self,
        identity: &[f32],
        block: usize,
        columns: &mut [[f32; NUMBERS]],
    ) -> Option<Block> {
        let parts = self.parts(block)?;
        let mut offset = Block::of_term(parts.offset);
        parts.start_columns(columns);
        for (terms, &x) in parts.identity.chunks_exact(self.stride().max(1)).zip(identity) {
            let (linear, bilinear) = self.identity_terms(terms);
            if let Some(linear) = linear {
                offset = offset.plus_scaled(x, &Block::of_term(linear));
            }
            for (column, term) in columns.iter_mut().zip(bilinear) {
                Block::load(column).plus_scaled(x, &Block::of_term(term)).store(column);
            }
        }
        Some(offset)
    }

    /// `a_i + sum_j y_j m_ij`.
    #[inline(always)]
    fn identity_column(&self, terms: &'a [Term], pose: &[f32]) -> Block {
        let (linear, bilinear) = self.identity_terms(terms);
        let mut sum = linear.map_or(Block::ZERO, Block::of_term);
        for (term, &y) in bilinear.iter().zip(pose) {
            sum = sum.plus_scaled(y, &Block::of_term(term));
        }
        sum
    }
}

impl Parts<'_> {
    /// `o + sum_j y_j b_j`.
    #[inline(always)]
    fn pose_offset(&self, pose: &[f32]) -> Block {
        let mut sum = Block::of_term(self.offset);
        for (term, &y) in self.pose_linear.iter().zip(pose) {
            sum = sum.plus_scaled(y, &Block::of_term(term));
        }
        sum
    }

    /// Sets the columns to `b_j`, or zero.
    #[inline(always)]
    fn start_columns(&self, columns: &mut [[f32; NUMBERS]]) {
        columns.fill([0.0; NUMBERS]);
        for (column, term) in columns.iter_mut().zip(self.pose_linear) {
            Block::of_term(term).store(column);
        }
    }
}

impl Generator for Bilinear<'_> {
    fn vertex_count(&self) -> usize {
        self.header.n_vertices as usize
    }

    fn identity_dim(&self) -> usize {
        self.header.identity_dim as usize
    }

    fn pose_dim(&self) -> usize {
        self.header.pose_dim as usize
    }

    #[inline(always)]
    fn block_unchecked(&self, weights: Weights<'_>, block: usize) -> Option<Block> {
        let parts = self.parts(block)?;
        let mut value = parts.pose_offset(weights.pose);
        for (terms, &x) in parts.identity.chunks_exact(self.stride().max(1)).zip(weights.identity) {
            value = value.plus_scaled(x, &self.identity_column(terms, weights.pose));
        }
        Some(value)
    }

    /// One pass over the coefficients: the derivative by `x_i` is `t_i`, the one by `y_j` is `b_j + sum_i x_i m_ij`, i ascending.
    #[inline(always)]
    fn linearised_block_unchecked(
        &self,
        weights: Weights<'_>,
        block: usize,
        jacobian: &mut [[f32; NUMBERS]],
    ) -> Option<Block> {
        let parts = self.parts(block)?;
        let (by_identity, by_pose) = jacobian.split_at_mut_checked(self.identity_dim())?;
        let by_pose = by_pose.get_mut(..self.pose_dim())?;
        let mut value = parts.pose_offset(weights.pose);
        parts.start_columns(by_pose);
        let identity = parts.identity.chunks_exact(self.stride().max(1)).zip(weights.identity);
        for ((terms, &x), column) in identity.zip(by_identity) {
            let (linear, bilinear) = self.identity_terms(terms);
            let mut sum = linear.map_or(Block::ZERO, Block::of_term);
            for ((term, &y), by_pose) in bilinear.iter().zip(weights.pose).zip(by_pose.iter_mut()) {
                let term = Block::of_term(term);
                sum = sum.plus_scaled(y, &term);
                Block::load(by_pose).plus_scaled(x, &term).store(by_pose);
            }
            value = value.plus_scaled(x, &sum);
            sum.store(column);
        }
        Some(value)
    }

    fn vertex_unchecked(&self, weights: Weights<'_>, vertex: usize) -> Option<[f32; 3]> {
        let parts = self.parts(vertex / LANES)?;
        let lane = vertex % LANES;
        let mut value = lane_of_term(parts.offset, lane);
        for (term, &y) in parts.pose_linear.iter().zip(weights.pose) {
            value = plus_scaled(value, y, lane_of_term(term, lane));
        }
        for (terms, &x) in parts.identity.chunks_exact(self.stride().max(1)).zip(weights.identity) {
            let (linear, bilinear) = self.identity_terms(terms);
            let mut sum = linear.map_or([0.0; 3], |term| lane_of_term(term, lane));
            for (term, &y) in bilinear.iter().zip(weights.pose) {
                sum = plus_scaled(sum, y, lane_of_term(term, lane));
            }
            value = plus_scaled(value, x, sum);
        }
        Some(value)
    }

    fn linearised_vertex_unchecked(
        &self,
        weights: Weights<'_>,
        vertex: usize,
        jacobian: &mut [[f32; 3]],
    ) -> Option<[f32; 3]> {
        let parts = self.parts(vertex / LANES)?;
        let lane = vertex % LANES;
        let (by_identity, by_pose) = jacobian.split_at_mut_checked(self.identity_dim())?;
        let by_pose = by_pose.get_mut(..self.pose_dim())?;
        let mut value = lane_of_term(parts.offset, lane);
        by_pose.fill([0.0; 3]);
        for ((term, &y), column) in parts.pose_linear.iter().zip(weights.pose).zip(by_pose.iter_mut()) {
            *column = lane_of_term(term, lane);
            value = plus_scaled(value, y, *column);
        }
        let identity = parts.identity.chunks_exact(self.stride().max(1)).zip(weights.identity);
        for ((terms, &x), column) in identity.zip(by_identity) {
            let (linear, bilinear) = self.identity_terms(terms);
            let mut sum = linear.map_or([0.0; 3], |term| lane_of_term(term, lane));
            for ((term, &y), by_pose) in bilinear.iter().zip(weights.pose).zip(by_pose.iter_mut()) {
                let term = lane_of_term(term, lane);
                sum = plus_scaled(sum, y, term);
                *by_pose = plus_scaled(*by_pose, x, term);
            }
            value = plus_scaled(value, x, sum);
            *column = sum;
        }
        Some(value)
    }
}

#[inline(always)]
fn plus_scaled([a, b, c]: [f32; 3], weight: f32, [x, y, z]: [f32; 3]) -> [f32; 3] {
    [a + weight * x, b + weight * y, c + weight * z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::{Mode, Model};
    use crate::generator::prepared::{Prepared, prepared_req};
    use crate::testing::{Stream, header, model_file};
    use proptest::prelude::*;
    use std::vec::Vec;

    fn random_weights(header: &Header, seed: u32) -> (Vec<f32>, Vec<f32>) {
        let mut stream = Stream::new(seed);
        (stream.take(header.identity_dim as usize), stream.take(header.pose_dim as usize))
    }

    fn evaluated(generator: &impl Generator, identity: &[f32], pose: &[f32]) -> Vec<f32> {
        let n = generator.vertex_count();
        let mut out = vec![f32::NAN; 3 * n];
        generator.evaluate(Weights { identity, pose }, 0..n, &mut out).unwrap();
        out
    }

    #[test]
    fn zero_weights_yield_the_offset() {
        let file = model_file(&header(37, 3, 2, true), 1);
        let generator = Model::open(&file).unwrap().bilinear().unwrap();
        let shape = evaluated(&generator, &[0.0; 3], &[0.0; 2]);
        for vertex in 0..37 {
            let term = generator.terms[vertex / 16 * generator.header.n_terms()];
            assert_eq!(shape[3 * vertex..3 * vertex + 3], lane_of_term(&term, vertex % 16));
        }
    }

    #[test]
    fn refusals_leave_the_output_alone() {
        let file = model_file(&header(20, 2, 2, false), 1);
        let generator = Model::open(&file).unwrap().bilinear().unwrap();
        let mut out = [7.0; 60];
        let mut run = |identity: &[f32], pose: &[f32], range, len: usize| {
            generator.evaluate(Weights { identity, pose }, range, &mut out[..len])
        };
        assert_eq!(run(&[0.0], &[0.0; 2], 0..20, 60), Err(Error::DimensionMismatch { expected: 2, found: 1 }));
        assert_eq!(run(&[0.0; 2], &[0.0, f32::NAN], 0..20, 60), Err(Error::NotFinite { index: 3 }));
        assert_eq!(run(&[0.0, 1e10], &[0.0; 2], 0..20, 60), Err(Error::NotFinite { index: 1 }));
        assert_eq!(run(&[0.0; 2], &[0.0; 2], 0..21, 60), Err(Error::IndexOutOfRange { index: 21, limit: 20 }));
        #[allow(clippy::reversed_empty_ranges)]
        let reversed = run(&[0.0; 2], &[0.0; 2], 5..4, 0);
        assert_eq!(reversed, Err(Error::IndexOutOfRange { index: 5, limit: 20 }));
        assert_eq!(run(&[0.0; 2], &[0.0; 2], 0..20, 59), Err(Error::DimensionMismatch { expected: 60, found: 59 }));
        assert!(out.iter().all(|&value| value == 7.0));
    }

    #[test]
    fn largest_weights_stay_finite() {
        let file = model_file(&header(16, 2, 2, true), 1);
        let generator = Model::open(&file).unwrap().bilinear().unwrap();
        assert!(evaluated(&generator, &[1e9; 2], &[-1e9; 2]).iter().all(|value| value.is_finite()));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::cases()))]

        #[test]
        fn any_split_into_ranges_gives_the_same_bits(n in 1u32..70, cut in 0.0f64..1.0, seed in 1u32..1000, linear: bool) {
            let header = header(n.max(3), 3, 4, linear);
            let n = header.n_vertices as usize;
            let file = model_file(&header, seed);
            let generator = Model::open(&file).unwrap().bilinear().unwrap();
            let (identity, pose) = random_weights(&header, seed);
            let whole = evaluated(&generator, &identity, &pose);
            let cut = (cut * n as f64) as usize;
            let weights = Weights { identity: &identity, pose: &pose };
            let mut out = vec![0.0; 3 * n];
            let (first, second) = out.split_at_mut(3 * cut);
            generator.evaluate(weights, 0..cut, first).unwrap();
            generator.evaluate(weights, cut..n, second).unwrap();
            prop_assert_eq!(&out, &whole);
            for vertex in 0..n {
                prop_assert_eq!(&generator.vertex_unchecked(weights, vertex).unwrap()[..], &whole[3 * vertex..3 * vertex + 3]);
            }
        }

        #[test]
        fn derivatives_match_central_differences(seed in 1u32..1000, linear: bool) {
            let header = header(19, 3, 2, linear);
            let file = model_file(&header, seed);
            let generator = Model::open(&file).unwrap().bilinear().unwrap();
            let (identity, pose) = random_weights(&header, seed + 1);
            let mut jacobian = vec![[0.0; NUMBERS]; 5];
            let weights = Weights { identity: &identity, pose: &pose };
            let value = generator.linearised_block_unchecked(weights, 1, &mut jacobian).unwrap();
            prop_assert_eq!(value, generator.block_unchecked(weights, 1).unwrap());
            for k in 0..5 {
                // The model is linear in each weight: a wide step has no error but rounding.
                let moved = |step: f32| {
                    let (mut identity, mut pose) = (identity.clone(), pose.clone());
                    if k < 3 { identity[k] += step } else { pose[k - 3] += step }
                    generator.block_unchecked(Weights { identity: &identity, pose: &pose }, 1).unwrap()
                };
                let (above, below) = (moved(1.0), moved(-1.0));
                let column = Block::load(&jacobian[k]);
                for axis in 0..3 { for lane in 0..16 {
                    let difference = (above.axes[axis][lane] - below.axes[axis][lane]) / 2.0;
                    prop_assert!((difference - column.axes[axis][lane]).abs() < 2e-4);
                } }
                for lane in 0..3 {
                    let mut one = vec![[0.0; 3]; 5];
                    let position = generator.linearised_vertex_unchecked(weights, 16 + lane, &mut one).unwrap();
                    prop_assert_eq!(position, value.lane(lane));
                    prop_assert_eq!(one[k], column.lane(lane));
                }
            }
        }

        #[test]
        fn prepared_forms_agree_with_the_whole(seed in 1u32..1000, linear: bool, from in 0usize..3, count in 0usize..3) {
            let header = header(50, 4, 3, linear);
            let file = model_file(&header, seed);
            let generator = Model::open(&file).unwrap().bilinear().unwrap();
            let (identity, pose) = random_weights(&header, seed + 2);
            let whole = evaluated(&generator, &identity, &pose);
            let blocks = from..(from + count).min(4);
            for (fixed, fixed_weights) in [(Mode::Identity, &identity), (Mode::Pose, &pose)] {
                let mut memory = vec![0.0; prepared_req(&generator, fixed, &blocks).numbers()];
                let prepared = Prepared::new(&generator, fixed, fixed_weights, blocks.clone(), &mut memory).unwrap();
                let out = match fixed {
                    Mode::Identity => evaluated(&prepared, &[], &pose),
                    Mode::Pose => evaluated(&prepared, &identity, &[]),
                };
                let expected = &whole[3 * 16 * blocks.start.min(3)..][..out.len()];
                for (a, b) in out.iter().zip(expected) {
                    prop_assert!((a - b).abs() < 1e-4);
                    prop_assert!(fixed == Mode::Identity || a == b);
                }
            }
        }
    }
}
