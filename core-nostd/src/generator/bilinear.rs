//! The bilinear generator, eq. 8.2: `c = o + sum_j y_j b_j + sum_i x_i (a_i + sum_j y_j m_ij)`; without linear terms it is the
//! multilinear model of eq. 12.1, with `o` the mean and `m` the core tensor.

use core::marker::PhantomData;

use super::block::{RawBlock, lane_of_raw};
use super::{At, Block, Generator, LANES, NUMBERS};
use crate::format::Header;
use crate::quantise::{F32, Storage, Term, Terms, plus_scaled};

/// A bilinear generator over the coefficients of a model file; copying it copies views.
///
/// Order of summation, per lane: `t_i = a_i`, then `t_i += y_j m_ij` for j ascending; `value = o`, then `value += y_j b_j` for j ascending,
/// then `value += x_i t_i` for i ascending. Every product is rounded before it is added; no fused operations. The sums over j are those of the
/// storage ([`Term`]); `o` and the sum over i are always `f32`.
#[derive(Debug, Clone, Copy)]
pub struct Bilinear<'a, S: Storage<'a> = F32<'a>> {
    header: Header,
    storage: S,
    bytes: PhantomData<&'a [u8]>,
}

type TermOf<'a, S> = <<S as Storage<'a>>::Terms as Terms>::Term;

/// The terms of one block, told apart.
struct Parts<'a, S: Storage<'a>> {
    offset: &'a RawBlock,
    pose_linear: S::Terms,
    /// For each identity weight: its linear term (if any), then its bilinear terms.
    identity: S::Terms,
}

impl<'a, S: Storage<'a>> Bilinear<'a, S> {
    /// A generator over coefficients whose number was checked.
    pub(crate) fn new(header: Header, storage: S) -> Self {
        Bilinear { header, storage, bytes: PhantomData }
    }

    /// Counts.
    pub fn header(&self) -> &Header {
        &self.header
    }

    #[inline(always)]
    fn parts(&self, block: usize) -> Option<Parts<'a, S>> {
        let (offset, terms) = self.storage.block(block, self.header.n_terms())?;
        let pose_terms = if self.header.pose_linear { self.header.pose_dim as usize } else { 0 };
        let (pose_linear, identity) = terms.split_at(pose_terms)?;
        Some(Parts { offset, pose_linear, identity })
    }

    /// Terms of one identity weight.
    #[inline(always)]
    fn stride(&self) -> usize {
        self.header.pose_dim as usize + usize::from(self.header.identity_linear)
    }

    /// The linear term of an identity weight and its bilinear terms.
    #[inline(always)]
    fn identity_terms(&self, terms: S::Terms) -> (Option<TermOf<'a, S>>, S::Terms) {
        if self.header.identity_linear {
            terms.split_first().map_or((None, terms), |(first, rest)| (Some(first), rest))
        } else {
            (None, terms)
        }
    }

    /// What is left of a block when the pose is fixed: the offset, and one column per identity weight in `columns`.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(crate) fn with_pose(&self, pose: &[f32], block: usize, columns: &mut [[f32; NUMBERS]]) -> Option<Block> {
        let parts = self.parts(block)?;
        for (terms, column) in parts.identity.groups(self.stride()).zip(columns) {
            self.identity_column(terms, pose).store(column);
        }
        Some(parts.pose_offset(pose))
    }

    /// What is left of a block when the identity is fixed: the offset, and one column per pose weight in `columns`.
    ///
    /// Order of summation: offset `o + x_i a_i`, columns `b_j + x_i m_ij`, i ascending, of the decoded terms.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(crate) fn with_identity(
        &self,
        identity: &[f32],
        block: usize,
        columns: &mut [[f32; NUMBERS]],
    ) -> Option<Block> {
        let parts = self.parts(block)?;
        let mut offset = Block::of_raw(parts.offset);
        parts.start_columns(columns);
        for (terms, &x) in parts.identity.groups(self.stride()).zip(identity) {
            let (linear, bilinear) = self.identity_terms(terms);
            if let Some(linear) = linear {
                offset = offset.plus_scaled(x, &linear.block());
            }
            for (column, term) in columns.iter_mut().zip(bilinear.iter()) {
                Block::load(column).plus_scaled(x, &term.block()).store(column);
            }
        }
        Some(offset)
    }

    /// `a_i + sum_j y_j m_ij`.
    #[inline(always)]
    fn identity_column(&self, terms: S::Terms, pose: &[f32]) -> Block {
        let (linear, bilinear) = self.identity_terms(terms);
        let mut sum = started(linear);
        for (term, &y) in bilinear.iter().zip(pose) {
            sum = term.add_to(sum, y);
        }
        TermOf::<'a, S>::total(sum)
    }
}

impl<'a, S: Storage<'a>> Parts<'a, S> {
    /// `o + sum_j y_j b_j`.
    #[inline(always)]
    fn pose_offset(&self, pose: &[f32]) -> Block {
        let mut sum = Block::of_raw(self.offset);
        for (term, &y) in self.pose_linear.iter().zip(pose) {
            sum = sum.plus_scaled(y, &term.block());
        }
        sum
    }

    /// Sets the columns to `b_j`, or zero.
    #[inline(always)]
    fn start_columns(&self, columns: &mut [[f32; NUMBERS]]) {
        columns.fill([0.0; NUMBERS]);
        for (column, term) in columns.iter_mut().zip(self.pose_linear.iter()) {
            term.block().store(column);
        }
    }
}

/// The sum that begins with the linear term, where there is one. Not by `map_or_else`: that is not inlined, and LLVM then sums bytes one by one.
#[inline(always)]
fn started<T: Term>(linear: Option<T>) -> T::Sum {
    match linear {
        Some(term) => term.start(),
        None => T::zero(),
    }
}

impl<'a, S: Storage<'a>> Generator for Bilinear<'a, S> {
    fn vertex_count(&self) -> usize {
        self.header.n_vertices as usize
    }

    fn identity_dim(&self) -> usize {
        self.header.identity_dim as usize
    }

    fn pose_dim(&self) -> usize {
        self.header.pose_dim as usize
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block> {
        let parts = self.parts(block)?;
        let mut value = parts.pose_offset(at.weights.pose);
        for (terms, &x) in parts.identity.groups(self.stride()).zip(at.weights.identity) {
            value = value.plus_scaled(x, &self.identity_column(terms, at.weights.pose));
        }
        Some(value)
    }

    /// One pass over the coefficients: the derivative by `x_i` is `t_i`, the one by `y_j` is `b_j + sum_i x_i m_ij`, i ascending.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block> {
        let parts = self.parts(block)?;
        let (by_identity, by_pose) = jacobian.split_at_mut_checked(self.identity_dim())?;
        let by_pose = by_pose.get_mut(..self.pose_dim())?;
        let mut value = parts.pose_offset(at.weights.pose);
        parts.start_columns(by_pose);
        let identity = parts.identity.groups(self.stride()).zip(at.weights.identity);
        for ((terms, &x), column) in identity.zip(by_identity) {
            let (linear, bilinear) = self.identity_terms(terms);
            let mut sum = started(linear);
            for ((term, &y), by_pose) in bilinear.iter().zip(at.weights.pose).zip(by_pose.iter_mut()) {
                sum = term.add_to(sum, y);
                Block::load(by_pose).plus_scaled(x, &term.block()).store(by_pose);
            }
            let sum = TermOf::<'a, S>::total(sum);
            value = value.plus_scaled(x, &sum);
            sum.store(column);
        }
        Some(value)
    }

    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]> {
        let parts = self.parts(vertex / LANES)?;
        let lane = vertex % LANES;
        let mut value = lane_of_raw(parts.offset, lane);
        for (term, &y) in parts.pose_linear.iter().zip(at.weights.pose) {
            value = plus_scaled(value, y, term.lane(lane));
        }
        for (terms, &x) in parts.identity.groups(self.stride()).zip(at.weights.identity) {
            let (linear, bilinear) = self.identity_terms(terms);
            let mut sum = match linear {
                Some(term) => term.lane_start(lane),
                None => TermOf::<'a, S>::lane_zero(),
            };
            for (term, &y) in bilinear.iter().zip(at.weights.pose) {
                sum = term.lane_add_to(lane, sum, y);
            }
            value = plus_scaled(value, x, TermOf::<'a, S>::lane_total(sum));
        }
        Some(value)
    }

    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        let parts = self.parts(vertex / LANES)?;
        let lane = vertex % LANES;
        let (by_identity, by_pose) = jacobian.split_at_mut_checked(self.identity_dim())?;
        let by_pose = by_pose.get_mut(..self.pose_dim())?;
        let mut value = lane_of_raw(parts.offset, lane);
        by_pose.fill([0.0; 3]);
        for ((term, &y), column) in parts.pose_linear.iter().zip(at.weights.pose).zip(by_pose.iter_mut()) {
            *column = term.lane(lane);
            value = plus_scaled(value, y, *column);
        }
        let identity = parts.identity.groups(self.stride()).zip(at.weights.identity);
        for ((terms, &x), column) in identity.zip(by_identity) {
            let (linear, bilinear) = self.identity_terms(terms);
            let mut sum = match linear {
                Some(term) => term.lane_start(lane),
                None => TermOf::<'a, S>::lane_zero(),
            };
            for ((term, &y), by_pose) in bilinear.iter().zip(at.weights.pose).zip(by_pose.iter_mut()) {
                sum = term.lane_add_to(lane, sum, y);
                *by_pose = plus_scaled(*by_pose, x, term.lane(lane));
            }
            let sum = TermOf::<'a, S>::lane_total(sum);
            value = plus_scaled(value, x, sum);
            *column = sum;
        }
        Some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::format::{Mode, Model};
    use crate::generator::Weights;
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
            let (offset, _) = generator.storage.block(vertex / 16, generator.header.n_terms()).unwrap();
            assert_eq!(shape[3 * vertex..3 * vertex + 3], lane_of_raw(offset, vertex % 16));
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
            let at = generator.begin(weights, false, &mut []).unwrap();
            let mut out = vec![0.0; 3 * n];
            let (first, second) = out.split_at_mut(3 * cut);
            generator.evaluate(weights, 0..cut, first).unwrap();
            generator.evaluate(weights, cut..n, second).unwrap();
            prop_assert_eq!(&out, &whole);
            for vertex in 0..n {
                prop_assert_eq!(&generator.vertex_unchecked(at, vertex).unwrap()[..], &whole[3 * vertex..3 * vertex + 3]);
            }
        }

        #[test]
        fn derivatives_match_central_differences(seed in 1u32..1000, linear: bool) {
            let header = header(19, 3, 2, linear);
            let file = model_file(&header, seed);
            let generator = Model::open(&file).unwrap().bilinear().unwrap();
            let (identity, pose) = random_weights(&header, seed + 1);
            let mut jacobian = vec![[0.0; NUMBERS]; 5];
            let at = generator.begin(Weights { identity: &identity, pose: &pose }, true, &mut []).unwrap();
            let value = generator.linearised_block_unchecked(at, 1, &mut jacobian).unwrap();
            prop_assert_eq!(value, generator.block_unchecked(at, 1).unwrap());
            for k in 0..5 {
                // The model is linear in each weight: a wide step has no error but rounding.
                let moved = |step: f32| {
                    let (mut identity, mut pose) = (identity.clone(), pose.clone());
                    if k < 3 { identity[k] += step } else { pose[k - 3] += step }
                    let weights = Weights { identity: &identity, pose: &pose };
                    generator.block_unchecked(generator.begin(weights, false, &mut []).unwrap(), 1).unwrap()
                };
                let (above, below) = (moved(1.0), moved(-1.0));
                let column = Block::load(&jacobian[k]);
                for axis in 0..3 { for lane in 0..16 {
                    let difference = (above.axes[axis][lane] - below.axes[axis][lane]) / 2.0;
                    prop_assert!((difference - column.axes[axis][lane]).abs() < 2e-4);
                } }
                for lane in 0..3 {
                    let mut one = vec![[0.0; 3]; 5];
                    let position = generator.linearised_vertex_unchecked(at, 16 + lane, &mut one).unwrap();
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
