//! Tests of the skinned generator, of the linear one, and of all storages.

use std::vec::Vec;

use proptest::prelude::*;

use crate::Error;
use crate::format::{ElementType, Mode, Model};
use crate::generator::linear::Linear;
use crate::generator::skinned::{Blend, Skinned};
use crate::generator::{Block, Generator, NUMBERS, Weights};
use crate::quantise::{F16, F32, I8, Storage};
use crate::skeleton::JointMode;
use crate::testing::{Body, Stream, bilinear_file, header, linear_file};

fn evaluated(generator: &impl Generator, identity: &[f32], pose: &[f32]) -> Vec<f32> {
    let n = generator.vertex_count();
    let mut state = vec![f32::NAN; generator.state_req(false).numbers()];
    let mut out = vec![f32::NAN; 3 * n];
    let at = generator.begin(Weights { identity, pose }, false, &mut state).unwrap();
    generator.evaluate_at(at, 0..n, &mut out).unwrap();
    out
}

/// Values and columns of every block, and of every vertex: the same bits.
fn linearised(generator: &impl Generator, identity: &[f32], pose: &[f32]) -> (Vec<f32>, Vec<Vec<f32>>) {
    let (n, dim) = (generator.vertex_count(), generator.dim());
    let mut state = vec![f32::NAN; generator.state_req(true).numbers()];
    let at = generator.begin(Weights { identity, pose }, true, &mut state).unwrap();
    let (mut values, mut columns) = (Vec::new(), vec![Vec::new(); dim]);
    let mut jacobian = vec![[f32::NAN; NUMBERS]; dim];
    let mut one = vec![[f32::NAN; 3]; dim];
    for vertex in 0..n {
        let (block, lane) = (vertex / 16, vertex % 16);
        let whole = generator.linearised_block_unchecked(at, block, &mut jacobian).unwrap();
        let value = generator.linearised_vertex_unchecked(at, vertex, &mut one).unwrap();
        assert_eq!(value, whole.lane(lane));
        assert_eq!(generator.vertex_unchecked(at, vertex).unwrap(), value);
        assert_eq!(generator.block_unchecked(at, block).unwrap(), whole);
        values.extend(value);
        for (column, (numbers, one)) in columns.iter_mut().zip(jacobian.iter().zip(&one)) {
            assert_eq!(Block::load(numbers).lane(lane), *one);
            column.extend(one);
        }
    }
    (values, columns)
}

fn weights(seed: u32, identity: usize, pose: usize, angle: f32) -> (Vec<f32>, Vec<f32>) {
    let mut stream = Stream::new(seed);
    (stream.take(identity), stream.take(pose).iter().map(|value| angle * value).collect())
}

/// Central differences of one weight, millimetres per weight.
fn difference(generator: &impl Generator, identity: &[f32], pose: &[f32], k: usize, step: f32) -> Vec<f32> {
    let moved = |step: f32| {
        let (mut identity, mut pose) = (identity.to_vec(), pose.to_vec());
        if k < identity.len() {
            identity[k] += step
        } else {
            pose[k - identity.len()] += step
        }
        evaluated(generator, &identity, &pose)
    };
    let (above, below) = (moved(step), moved(-step));
    above.iter().zip(below).map(|(above, below)| (above - below) / (2.0 * step)).collect()
}

fn body<'a>(file: &'a [u8]) -> Skinned<'a, Linear<'a, F32<'a>>> {
    Model::open(file).unwrap().skinned().unwrap()
}

#[test]
fn a_pose_of_zero_yields_the_rest_shape() {
    for dual in [false, true] {
        let mut spec = Body::new(37, 3);
        (spec.dual, spec.corrections) = (dual, true);
        let file = spec.file(5);
        let body = body(&file);
        let identity = [0.5, -1.0, 2.0];
        let posed = evaluated(&body, &identity, &vec![0.0; body.pose_dim()]);
        let rest = evaluated(body.rest(), &identity, &[]);
        for (posed, rest) in posed.iter().zip(&rest) {
            assert!((posed - rest).abs() < 2e-4, "{posed} {rest}");
        }
    }
}

#[test]
fn a_turned_root_turns_everything_about_itself() {
    for dual in [false, true] {
        let mut spec = Body::new(20, 2);
        spec.dual = dual;
        let file = spec.file(7);
        let body = body(&file);
        let mut pose = vec![0.0; body.pose_dim()];
        pose[1] = core::f32::consts::FRAC_PI_2;
        let still = evaluated(&body, &[0.0; 2], &[0.0; 9]);
        let turned = evaluated(&body, &[0.0; 2], &pose);
        let [cx, _, cz] = body.skeleton().joint(0).unwrap().position;
        for (still, turned) in still.chunks_exact(3).zip(turned.chunks_exact(3)) {
            let expected = [cx + (still[2] - cz), still[1], cz - (still[0] - cx)];
            for (found, expected) in turned.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-3, "{found} {expected}");
            }
        }
    }
}

#[test]
fn joints_follow_the_identity_or_stay() {
    let file = Body::new(20, 2).file(3);
    let body = body(&file);
    let (identity, pose) = (vec![2.0, -1.0], vec![0.3; 9]);
    let place = |body: &Skinned<'_, _>, identity: &[f32], joint| {
        let mut state = vec![0.0; Generator::state_req(body, false).numbers()];
        let at = body.begin(Weights { identity, pose: &[0.0; 9] }, false, &mut state).unwrap();
        body.joint_position(at, joint).unwrap()
    };
    let mean = body.skeleton().joint(3).unwrap().position;
    let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3);
    assert!(near(place(&body, &[0.0; 2], 3), mean));
    assert!(!near(place(&body, &identity, 3), mean));
    let still = body.with_joints(JointMode::Mean);
    assert!(near(place(&still, &identity, 3), mean));
    assert_ne!(evaluated(&body, &identity, &pose), evaluated(&still, &identity, &pose));
}

/// With joints of the mean the body is linear in the identity: the value at a sum is that of the parts (eq. 8.2).
#[test]
fn joints_of_the_mean_make_it_bilinear() {
    let file = Body::new(33, 2).file(3);
    let body = body(&file).with_joints(JointMode::Mean);
    let pose = weights(4, 0, 9, 0.8).1;
    let [o, a, b, ab] =
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|identity| evaluated(&body, &identity, &pose));
    for k in 0..o.len() {
        assert!((a[k] + b[k] - o[k] - ab[k]).abs() < 2e-3);
    }
}

#[test]
fn a_batch_has_the_bits_of_single_bodies() {
    let file = Body::new(37, 2).file(3);
    let body = body(&file);
    let all: Vec<_> = (1..4).map(|seed| weights(seed, 2, 9, 1.0)).collect();
    let mut states = vec![vec![0.0; Generator::state_req(&body, false).numbers()]; 3];
    let ats: Vec<_> = all
        .iter()
        .zip(&mut states)
        .map(|((identity, pose), state)| body.begin(Weights { identity, pose }, false, state).unwrap())
        .collect();
    let mut out = vec![f32::NAN; 3 * 3 * 25];
    body.evaluate_batch_at(&ats, 5..30, &mut out).unwrap();
    for ((identity, pose), found) in all.iter().zip(out.chunks(75)) {
        assert_eq!(found, &evaluated(&body, identity, pose)[15..90]);
    }
    assert_eq!(
        body.evaluate_batch_at(&ats, 0..37, &mut out),
        Err(Error::DimensionMismatch { expected: 333, found: 225 })
    );
    body.evaluate_batch_at(&[], 0..37, &mut []).unwrap();
}

#[test]
fn refusals() {
    let file = Body::new(20, 2).file(3);
    let body = body(&file);
    let weights = Weights { identity: &[0.0; 2], pose: &[0.0; 9] };
    let needed = Generator::state_req(&body, false).numbers() as u32;
    let mut out = [7.0; 60];
    assert_eq!(body.evaluate(weights, 0..20, &mut out), Err(Error::WorkspaceTooSmall { needed, given: 0 }));
    let mut state = vec![0.0; 4096];
    let at = body.begin(weights, false, &mut state).unwrap();
    let (mut values, mut jacobian) = (vec![0.0; 96], vec![0.0; 96 * 11]);
    let result = body.linearise_at(at, 0..2, &mut values, &mut jacobian);
    assert!(matches!(result, Err(Error::WorkspaceTooSmall { .. })), "{result:?}");
    assert!(out.iter().all(|&value| value == 7.0));
    let model = Model::open(&file).unwrap();
    assert_eq!(model.bilinear().unwrap_err(), Error::WrongKind { expected: 1, found: 3 });
    assert_eq!(model.skinned::<I8<'_>>().unwrap_err(), Error::WrongKind { expected: 5, found: 3 });
}

/// Found by the fuzz target `c_calls`: a pose that is refused had set zeros in the workspace before.
#[test]
fn refused_forms_leave_the_workspace_alone() {
    let file = Body::new(20, 2).file(3);
    let body = body(&file);
    let mut memory = vec![7.0; body.with_pose_req(&(0..2)).numbers()];
    let mut pose = [0.0; 9];
    assert!(body.with_pose(&pose[1..], 0..2, &mut memory).is_err());
    pose[4] = f32::NAN;
    assert_eq!(body.with_pose(&pose, 0..2, &mut memory).unwrap_err(), Error::NotFinite { index: 6 });
    assert!(memory.iter().all(|&value| value == 7.0));
    let mut memory = vec![7.0; body.with_identity_req(&(0..2)).numbers()];
    assert_eq!(
        body.with_identity(&[0.0, f32::INFINITY], 0..2, &mut memory).unwrap_err(),
        Error::NotFinite { index: 1 }
    );
    assert!(memory.iter().all(|&value| value == 7.0));
}

#[test]
fn every_forged_byte_of_a_body_is_refused_or_harmless() {
    let mut spec = Body::new(18, 1);
    (spec.corrections, spec.element) = (true, ElementType::I8);
    let file = spec.file(3);
    let mut opened = 0;
    for at in 0..file.len() {
        for flip in [0xff, 0x01] {
            let forged = crate::format::forged(&file, |file| file[at] ^= flip);
            let Ok(model) = Model::open(&forged) else { continue };
            let Ok(body) = model.skinned::<I8<'_>>() else { continue };
            for blend in [Blend::Linear, Blend::DualQuaternion] {
                let body = body.with_blend(blend);
                let shape = evaluated(&body, &vec![0.5; Generator::identity_dim(&body)], &vec![0.5; body.pose_dim()]);
                assert!(shape.iter().all(|value| value.is_finite()), "{at} {flip}");
            }
            opened += 1;
        }
    }
    assert!(opened > 500, "{opened}");
}

fn check_storage<'a, S: Storage<'a>>(file: &'a [u8], seed: u32) -> Result<(), TestCaseError> {
    let linear: Linear<'a, S> = Model::open(file).unwrap().linear().unwrap();
    let identity = Stream::new(seed).take(linear.dim());
    let (values, columns) = linearised(&linear, &identity, &[]);
    prop_assert_eq!(&values, &evaluated(&linear, &identity, &[]));
    for (k, column) in columns.iter().enumerate() {
        for (found, expected) in column.iter().zip(difference(&linear, &identity, &[], k, 1.0)) {
            prop_assert!((found - expected).abs() < 2e-4, "{} {}", found, expected);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::testing::cases().min(8000)))]

    #[test]
    fn derivatives_match_central_differences(seed in 1u32..100000, corrections: bool, dual: bool, angle in 0.1f32..2.0) {
        let mut spec = Body::new(21, 2);
        (spec.corrections, spec.dual) = (corrections, dual);
        let file = spec.file(seed);
        let body = body(&file);
        // Dual quaternions turn the shorter way, so a vertex jumps where two of its bones are half a turn apart; nine angles of 0.3 are
        // less than that in all.
        let (identity, pose) = weights(seed + 1, 2, 9, if dual { 0.15 * angle } else { angle });
        let (values, columns) = linearised(&body, &identity, &pose);
        prop_assert_eq!(&values, &evaluated(&body, &identity, &pose));
        for (k, column) in columns.iter().enumerate() {
            // Positions of 1000 mm have 6e-5 mm of rounding; the second step halves a truncation of about 0.1.
            let step = if k < 2 { 0.5 } else { 2e-2 };
            let (wide, narrow) = (difference(&body, &identity, &pose, k, step), difference(&body, &identity, &pose, k, step / 2.0));
            for ((found, wide), narrow) in column.iter().zip(wide).zip(narrow) {
                let expected = (4.0 * narrow - wide) / 3.0;
                prop_assert!((found - expected).abs() < 0.06, "{k}: {found} {expected}");
            }
        }
    }

    #[test]
    fn prepared_bodies_agree_with_the_whole(seed in 1u32..100000, corrections: bool, dual: bool, from in 0usize..2) {
        let mut spec = Body::new(37, 2);
        (spec.corrections, spec.dual) = (corrections, dual);
        let file = spec.file(seed);
        let body = body(&file);
        let (identity, pose) = weights(seed + 1, 2, 9, 1.0);
        let whole = evaluated(&body, &identity, &pose);
        let (_, columns) = linearised(&body, &identity, &pose);
        let blocks = from..3;
        let mut memory = vec![f32::NAN; body.with_identity_req(&blocks).numbers()];
        let fixed = body.with_identity(&identity, blocks.clone(), &mut memory).unwrap();
        let (posed, slopes) = linearised(&fixed, &[], &pose);
        let expected = &whole[48 * from..];
        prop_assert_eq!(posed.len(), expected.len());
        for (found, expected) in posed.iter().zip(expected) {
            prop_assert!((found - expected).abs() < 1e-3 && (corrections || found == expected));
        }
        for (slope, column) in slopes.iter().zip(&columns[2..]) {
            for (found, expected) in slope.iter().zip(&column[48 * from..]) {
                prop_assert!((found - expected).abs() < 1e-2);
            }
        }
        let mut memory = vec![f32::NAN; body.with_pose_req(&blocks).numbers()];
        let fixed = body.with_pose(&pose, blocks.clone(), &mut memory).unwrap();
        prop_assert_eq!(fixed.free(), Mode::Identity);
        for (found, expected) in evaluated(&fixed, &identity, &[]).iter().zip(expected) {
            prop_assert!((found - expected).abs() < 2e-3, "{found} {expected}");
        }
    }

    #[test]
    fn linear_models_agree_in_every_storage(seed in 1u32..100000, n in 1u32..40, dim in 1u32..5) {
        check_storage::<F32<'_>>(&linear_file(n, dim, ElementType::F32, seed), seed)?;
        check_storage::<F16<'_>>(&linear_file(n, dim, ElementType::F16, seed), seed)?;
        check_storage::<I8<'_>>(&linear_file(n, dim, ElementType::I8, seed), seed)?;
    }

    /// A quantised coefficient is off by half a step at most: 20 mm / 255 / 2 of the 20 mm that the terms span, 2^-8 for the half precision numbers
    /// from 8 to 16.
    #[test]
    fn quantised_models_are_near_the_original(seed in 1u32..100000, linear: bool) {
        let header = header(35, 3, 2, linear);
        let plain = bilinear_file(&header, ElementType::F32, seed);
        let (identity, pose) = weights(seed + 1, 3, 2, 1.0);
        let expected = evaluated(&Model::open(&plain).unwrap().bilinear().unwrap(), &identity, &pose);
        let sum: f32 = identity.iter().map(|x| x.abs()).sum::<f32>() * (1.0 + pose.iter().map(|y| y.abs()).sum::<f32>())
            + pose.iter().map(|y| y.abs()).sum::<f32>();
        for (element, step) in [(ElementType::F16, 0.00391), (ElementType::I8, 0.0396)] {
            let file = bilinear_file(&header, element, seed);
            let model = Model::open(&file).unwrap();
            let (found, columns) = match element {
                ElementType::F16 => linearised(&model.bilinear_in::<F16<'_>>().unwrap(), &identity, &pose),
                _ => linearised(&model.bilinear_in::<I8<'_>>().unwrap(), &identity, &pose),
            };
            prop_assert_eq!(columns.len(), 5);
            for (found, expected) in found.iter().zip(&expected) {
                prop_assert!((found - expected).abs() <= step * sum + 1e-3, "{found} {expected} {element:?}");
            }
        }
    }
}
