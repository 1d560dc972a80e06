//! The linear and the skinned kernel against the slow reference, in every storage: evaluation, derivatives and prepared forms give the
//! same bits; what is refused is refused for the reason that is documented, and leaves outputs and state alone.

use std::ops::Range;

use habitus_core::Error;
use habitus_core::format::Model;
use habitus_core::generator::linear::Linear;
use habitus_core::generator::skinned::{Blend, Skinned};
use habitus_core::generator::{Generator, LANES, NUMBERS, Weights};
use habitus_core::quantise::{F16, F32, I8, Storage};
use habitus_core::skeleton::JointMode;
use habitus_reference::bilinear::{Linearised, value_of_prepared};
use habitus_reference::skinned::FixedIdentity;
use habitus_reference::storage::Term;

use crate::bits::assert_same;
use crate::body_case::{Case, Choice, file_refused};

/// Value of outputs that must stay untouched.
pub(crate) const UNTOUCHED: f32 = -77.25;

/// How far a case comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reached {
    /// The model file is refused.
    File,
    /// The weights are refused.
    Weights,
    /// All is compared.
    End,
}

/// Compares the linear kernel with the reference on the case that the bytes make.
pub fn check_linear(bytes: &[u8]) {
    if let Some(choice) = Choice::of(bytes) {
        check_case(&choice.case(), true);
    }
}

/// The same for bodies.
pub fn check_skinned(bytes: &[u8]) {
    if let Some(choice) = Choice::of(bytes) {
        check_case(&choice.case(), false);
    }
}

fn check_case(case: &Case, linear: bool) -> Reached {
    let (sections, file) = case.file(linear);
    let model = match (Model::open(&file), file_refused(&sections)) {
        (Ok(model), None) => model,
        (Err(error), Some(expected)) => {
            assert_eq!(error, expected);
            return Reached::File;
        }
        (outcome, expected) => panic!("opened: {:?}, expected: {expected:?}", outcome.err()),
    };
    match case.body.rest.components[0] {
        Term::Floats(_) => check_stored::<F32<'_>>(case, &model, linear),
        Term::Halves(_) => check_stored::<F16<'_>>(case, &model, linear),
        Term::Bytes { .. } => check_stored::<I8<'_>>(case, &model, linear),
    }
}

fn check_stored<'a, S: Storage<'a>>(case: &Case, model: &Model<'a>, linear: bool) -> Reached {
    if linear {
        let generator: Linear<'a, S> = model.linear().expect("a linear model");
        let any = model.generator().expect("an opened model has a generator");
        let expected = |v: usize| case.body.rest.linearised(&case.identity, v);
        let weights = Weights { identity: &case.identity, pose: &[] };
        let refused = case.weights_refused(&[]);
        check_generator(&case.range, &any, weights, refused, case.body.rest.n, expected);
        return check_generator(&case.range, &generator, weights, refused, case.body.rest.n, expected);
    }
    let mut body: Skinned<'a, Linear<'a, S>> = model.skinned().expect("a body");
    let mut reference = case.body.clone();
    if case.other_blend {
        reference.dual = !reference.dual;
        body = body.with_blend(if reference.dual { Blend::DualQuaternion } else { Blend::Linear });
    }
    if case.still {
        reference.skeleton.basis = None;
        body = body.with_joints(JointMode::Mean);
    }
    let weights = Weights { identity: &case.identity, pose: &case.pose };
    let refused = case.weights_refused(&case.pose);
    let expected = |v: usize| reference.linearised(&case.identity, &case.pose, v);
    let reached = check_generator(&case.range, &body, weights, refused, reference.rest.n, expected);
    if refused.is_some() {
        return reached;
    }
    let blocks = case.range.start / LANES..case.range.end.div_ceil(LANES);
    let limit = body.block_count();
    let mut memory = vec![UNTOUCHED; body.with_identity_req(&blocks).numbers()];
    let mut other = vec![UNTOUCHED; body.with_pose_req(&blocks).numbers()];
    let identity_fixed = body.with_identity(&case.identity, blocks.clone(), &mut memory);
    let pose_fixed = body.with_pose(&case.pose, blocks.clone(), &mut other);
    if blocks.start > blocks.end || blocks.end > limit {
        let index = blocks.start.max(blocks.end) as u32;
        let refused = Some(Error::IndexOutOfRange { index, limit: limit as u32 });
        assert_eq!((identity_fixed.err(), pose_fixed.err()), (refused, refused));
        assert!(
            memory.iter().chain(&other).all(|&number| number == UNTOUCHED),
            "the memory of a refused call was touched"
        );
        return reached;
    }
    let first = LANES * blocks.start;
    let n = reference.rest.n.min(LANES * blocks.end).saturating_sub(first);
    let fixed = FixedIdentity::new(&reference, &case.identity);
    let weights = Weights { identity: &[], pose: &case.pose };
    let expected = |v: usize| fixed.linearised(&case.pose, first + v);
    check_generator(&case.range, &identity_fixed.expect("blocks of the body"), weights, None, n, expected);
    let weights = Weights { identity: &case.identity, pose: &[] };
    let expected = |v: usize| {
        let form = reference.with_pose(&case.pose, first + v);
        Linearised { value: value_of_prepared(&form, &case.identity), ..form }
    };
    check_generator(&case.range, &pose_fixed.expect("blocks of the body"), weights, None, n, expected)
}

/// Compares a generator of so many vertices with what is expected of each.
pub(crate) fn check_generator(
    range: &Range<usize>,
    generator: &impl Generator,
    weights: Weights<'_>,
    refused: Option<Error>,
    n: usize,
    expected: impl Fn(usize) -> Linearised,
) -> Reached {
    assert_eq!(generator.vertex_count(), n);
    let dim = generator.dim();
    for derivatives in [false, true] {
        let numbers = generator.state_req(derivatives).numbers();
        let mut state = vec![UNTOUCHED; numbers];
        assert_eq!(generator.begin(weights, derivatives, &mut state).err(), refused);
        if refused.is_some() {
            assert!(state.iter().all(|&number| number == UNTOUCHED), "the state of a refused call was touched");
        } else if numbers > 0 {
            let mut short = vec![UNTOUCHED; numbers - 1];
            let needed = Error::WorkspaceTooSmall { needed: numbers as u32, given: numbers as u32 - 1 };
            assert_eq!(generator.begin(weights, derivatives, &mut short).err(), Some(needed));
            assert!(short.iter().all(|&number| number == UNTOUCHED), "the state of a refused call was touched");
        }
    }
    if refused.is_some() {
        return Reached::Weights;
    }
    let mut memory = vec![UNTOUCHED; generator.state_req(false).numbers()];
    let at = generator.begin(weights, false, &mut memory).expect("weights that were checked");
    let expected: Vec<Linearised> = (0..n).map(expected).collect();
    let range = range.clone();
    let mut out = vec![UNTOUCHED; 3 * range.end.saturating_sub(range.start)];
    let outcome = generator.evaluate_at(at, range.clone(), &mut out);
    if range.start > range.end || range.end > n {
        let index = range.start.max(range.end) as u32;
        assert_eq!(outcome, Err(Error::IndexOutOfRange { index, limit: n as u32 }));
        assert!(out.iter().all(|&number| number == UNTOUCHED), "outputs of a refused call were touched");
    } else {
        let positions: Vec<f32> = expected[range].iter().flat_map(|vertex| vertex.value).collect();
        assert_same("positions", &out, &positions);
    }
    let mut memory = vec![UNTOUCHED; generator.state_req(true).numbers()];
    let at = generator.begin(weights, true, &mut memory).expect("weights that were checked");
    let mut one = vec![[UNTOUCHED; 3]; dim];
    let mut columns = vec![[UNTOUCHED; NUMBERS]; dim];
    for (v, expected) in expected.iter().enumerate() {
        let position = generator.linearised_vertex_unchecked(at, v, &mut one).expect("a vertex");
        assert_same("position of a vertex", &position, &expected.value);
        assert_same("derivatives of a vertex", one.as_flattened(), expected.derivatives.as_flattened());
    }
    for block in 0..generator.block_count() {
        let value = generator.linearised_block_unchecked(at, block, &mut columns).expect("a block");
        for (lane, expected) in expected[LANES * block..].iter().take(LANES).enumerate() {
            assert_same("position in a block", &value.lane(lane), &expected.value);
            let found: Vec<f32> =
                columns.iter().flat_map(|column| [0, 1, 2].map(|axis| column[axis * LANES + lane])).collect();
            assert_same("derivatives in a block", &found, expected.derivatives.as_flattened());
        }
    }
    Reached::End
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The comparison is worth something only if many cases come to its end.
    #[test]
    fn random_bytes_reach_every_end() {
        let mut state = 7u32;
        let mut byte = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        for linear in [true, false] {
            let mut ends = [0; 3];
            for _ in 0..600 {
                let bytes: Vec<u8> = (0..120).map(|_| byte()).collect();
                if let Some(choice) = Choice::of(&bytes) {
                    ends[check_case(&choice.case(), linear) as usize] += 1;
                }
            }
            assert!(ends.iter().all(|&count| count >= 10), "file refused, weights refused, compared: {ends:?}");
        }
    }
}
