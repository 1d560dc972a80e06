//! Tests of the fits: derivatives, recovery of the truth, priors, refusals.

use std::vec::Vec;

use super::*;
use crate::Error;
use crate::format::{Mode, Model};
use crate::generator::{Generator, Weights};
use crate::prior::Prior;
use crate::rotation::axis_angle::rotation_matrix;
use crate::rotation::similarity::Similarity;
use crate::solve::levenberg_marquardt::{Limits, Status};
use crate::testing::{Stream, header, model_file};
use proptest::prelude::*;

fn placed(scale: f32) -> Similarity<f32> {
    Similarity { scale, rotation: rotation_matrix([0.4, -0.3, 0.2]), translation: [30.0, -20.0, 500.0] }
}

/// Samples of every vertex of the model, placed, with distances of `noise` mm.
fn samples_of(generator: &impl Generator, weights: Weights<'_>, place: &Similarity<f32>, noise: f32) -> Vec<Sample> {
    let mut stream = Stream::new(77);
    (0..generator.vertex_count())
        .map(|vertex| {
            let point = generator.vertex_unchecked(generator.begin(weights, false, &mut []).unwrap(), vertex).unwrap();
            let target = place.applied(point).map(|value| value + noise * stream.next());
            Sample { point: SurfacePoint::vertex(vertex as u32), target, normal: None, weight: 1.0 }
        })
        .collect()
}

fn options<'a>(frame: Frame) -> FitOptions<'a> {
    FitOptions {
        frame,
        place: true,
        identity_prior: Prior::None,
        pose_prior: Prior::None,
        noise: 1.0,
        limits: Limits::default(),
    }
}

/// Energy of the samples in f64, from the definition.
fn energy(
    generator: &impl Generator,
    identity: &[f32],
    pose: &[f32],
    samples: &[Sample],
    place: &Similarity<f32>,
) -> f64 {
    let weights = Weights { identity, pose };
    let square = |sample: &Sample| {
        let mut point = [0.0f32; 3];
        for (&vertex, &part) in sample.point.vertices.iter().zip(&sample.point.barycentric) {
            let corner =
                generator.vertex_unchecked(generator.begin(weights, false, &mut []).unwrap(), vertex as usize).unwrap();
            (0..3).for_each(|k| point[k] += part * corner[k]);
        }
        let found = place.applied(point);
        let r: Vec<f64> = (0..3).map(|k| f64::from(found[k]) - f64::from(sample.target[k])).collect();
        let squared = match sample.normal {
            Some(n) => (0..3).map(|k| r[k] * f64::from(n[k])).sum::<f64>().powi(2),
            None => r.iter().map(|r| r * r).sum(),
        };
        f64::from(sample.weight) * squared
    };
    samples.iter().map(square).sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::testing::cases()))]

    /// Energy and gradient against the definition, for all frames, barycentric points, normals and weights.
    #[test]
    fn normal_equations_match_the_definition(seed in 1u32..10_000, linear: bool, kind in 0u8..3, scale in 0.5f32..2.0) {
        let header = header(40, 3, 2, linear);
        let file = model_file(&header, seed);
        let generator = Model::open(&file).unwrap().bilinear().unwrap();
        let mut stream = Stream::new(seed);
        let (identity, pose) = (stream.take(3), stream.take(2));
        let place = placed(scale);
        let mut samples = samples_of(&generator, Weights { identity: &identity, pose: &pose }, &place, 5.0);
        for (k, sample) in samples.iter_mut().enumerate() {
            if k % 3 == 1 {
                sample.point.vertices = [k as u32, (k as u32 * 7) % 40, (k as u32 * 11) % 40];
                sample.point.barycentric = [0.5, 0.3, 0.2];
            }
            if k % 4 == 2 {
                sample.normal = Some([0.6, 0.0, 0.8]);
            }
            sample.weight = 0.5 + (k % 5) as f32 * 0.25;
        }
        let frame = [Frame::Fixed, Frame::Rigid, Frame::Similarity][kind as usize];
        let all = 5 + frame.dim();
        let (mut jtj, mut jtr) = (vec![0.0; all * all], vec![0.0; all]);
        let mut memory = vec![0.0; normal_equations_req(5, frame).numbers()];
        let weights = Weights { identity: &identity, pose: &pose };
        let found =
            normal_equations(&generator, weights, &samples[..], &place, frame, &mut jtj, &mut jtr, &mut memory).unwrap();
        let expected = energy(&generator, &identity, &pose, &samples, &place);
        prop_assert!((f64::from(found) - expected).abs() <= 1e-3 * expected);
        // The energy is E(x) = E + 2 g.d + ...: central differences of every variable.
        for k in 0..all {
            let step = if k < 5 { 1e-2f32 } else if k < 8 { 1e-3 } else if k < 11 { 0.1 } else { 1e-3 };
            let at = |sign: f32| {
                let (mut identity, mut pose, mut motion) = (identity.clone(), pose.clone(), [0.0f32; 7]);
                match k {
                    0..3 => identity[k] += sign * step,
                    3..5 => pose[k - 3] += sign * step,
                    _ => motion[k - 5] = sign * step,
                }
                let [a, b, c, d, e, f, g] = motion;
                energy(&generator, &identity, &pose, &samples, &place.moved([a, b, c], [d, e, f], g))
            };
            let difference = (at(1.0) - at(-1.0)) / (4.0 * f64::from(step));
            // Curvature bounds what a step of that size can hide; the rest is rounding of positions of some 500 mm.
            let bound = 2e-2 * f64::from(jtj[k * all + k]).sqrt() * expected.sqrt() + 1.0;
            prop_assert!((difference - f64::from(jtr[k])).abs() <= bound, "{} {} {} {}", k, difference, jtr[k], bound);
        }
        for p in 0..all { for q in 0..all { prop_assert_eq!(jtj[p * all + q], jtj[q * all + p]); } }
    }

    /// Noise-free points of a placed model give weights and placement back.
    #[test]
    fn the_truth_is_recovered(seed in 1u32..10_000, linear: bool) {
        let header = header(60, 3, 2, linear);
        let file = model_file(&header, seed);
        let generator = Model::open(&file).unwrap().bilinear().unwrap();
        let mut stream = Stream::new(seed);
        let truth = (stream.take(3), stream.take(2).iter().map(|y| 1.0 + 0.5 * y).collect::<Vec<f32>>());
        let weights = Weights { identity: &truth.0, pose: &truth.1 };
        let samples = samples_of(&generator, weights, &placed(1.25), 0.0);
        let (mut identity, mut pose, mut place) = (vec![0.0; 3], vec![1.0; 2], Similarity::IDENTITY);
        let mut memory = vec![0.0; fit_points_req(3, 2, Frame::Similarity).numbers()];
        let options = options(Frame::Similarity);
        let report =
            fit_points(&generator, &samples[..], &options, &mut identity, &mut pose, &mut place, &mut memory).unwrap();
        prop_assert!(report.rms < 2e-3, "{:?}", report);
        prop_assert!((place.scale - 1.25).abs() < 1e-4);
    }

    /// Never panics, never leaves the box, never ends above the start; untouched on error.
    #[test]
    fn any_landmarks_are_survived(targets in proptest::collection::vec(proptest::option::of(proptest::array::uniform3(any::<f32>())), 8), kappa in 0.1f32..3.0) {
        let file = model_file(&header(30, 3, 2, false), 4);
        let model = Model::open(&file).unwrap();
        let generator = model.bilinear().unwrap();
        let (identity_prior, pose_prior) = (model.gaussian(Mode::Identity).unwrap(), model.gaussian(Mode::Pose).unwrap());
        let mut options = options(Frame::Rigid);
        options.identity_prior = Prior::Box(identity_prior.spread(), kappa);
        options.pose_prior = Prior::Gaussian(pose_prior, 1.0);
        let (mut identity, mut pose, mut place) = (vec![0.05; 3], vec![0.1; 2], Similarity::IDENTITY);
        let mut memory = vec![0.0; fit_landmarks_req(3, 2, Frame::Rigid).numbers()];
        match fit_landmarks(&model, &generator, &targets, &options, &mut identity, &mut pose, &mut place, &mut memory) {
            Ok(report) => {
                prop_assert!(report.energy <= report.start_energy);
                for (k, value) in identity.iter().enumerate() {
                    let (mean, width) = (identity_prior.mean.get(k).unwrap(), kappa * identity_prior.scale.get(k).unwrap());
                    prop_assert!(*value >= mean - width && *value <= mean + width);
                }
            }
            Err(_) => {
                prop_assert_eq!(identity, vec![0.05; 3]);
                prop_assert_eq!(pose, vec![0.1; 2]);
                prop_assert_eq!(place, Similarity::IDENTITY);
            }
        }
    }
}

#[test]
fn a_strong_prior_keeps_the_mean_and_a_weak_one_follows_the_data() {
    let file = model_file(&header(60, 3, 2, true), 8);
    let model = Model::open(&file).unwrap();
    let generator = model.bilinear().unwrap();
    let weights = Weights { identity: &[0.9, -0.5, 0.4], pose: &[0.3, 0.8] };
    let samples = samples_of(&generator, weights, &Similarity::IDENTITY, 0.0);
    let priors = (model.gaussian(Mode::Identity).unwrap(), model.gaussian(Mode::Pose).unwrap());
    let mut memory = vec![0.0; fit_points_req(3, 2, Frame::Fixed).numbers()];
    let mut fitted = |factor: f32| {
        let mut options = options(Frame::Fixed);
        options.place = false;
        options.identity_prior = Prior::Gaussian(priors.0, factor);
        options.pose_prior = Prior::Gaussian(priors.1, factor);
        let (mut identity, mut pose, mut place) = (vec![0.0; 3], vec![0.1; 2], Similarity::IDENTITY);
        let report = fit_points(&generator, &samples[..], &options, &mut identity, &mut pose, &mut place, &mut memory);
        assert_eq!(report.unwrap().status, Status::Converged);
        identity
    };
    for (found, truth) in fitted(1e-6).iter().zip(weights.identity) {
        assert!((found - truth).abs() < 1e-3);
    }
    for (found, mean) in fitted(1e12).iter().zip(priors.0.mean.iter()) {
        assert!((found - mean).abs() < 1e-3);
    }
}

#[test]
fn refusals() {
    let file = model_file(&header(20, 2, 2, false), 1);
    let model = Model::open(&file).unwrap();
    let generator = model.bilinear().unwrap();
    let good = samples_of(&generator, Weights { identity: &[0.1; 2], pose: &[0.1; 2] }, &Similarity::IDENTITY, 0.0);
    let mut memory = vec![0.0; fit_points_req(2, 2, Frame::Rigid).numbers()];
    let needed = memory.len();
    let mut run = |samples: &[Sample], options: &FitOptions<'_>, identity: &mut [f32], room: usize| {
        let mut place = Similarity::IDENTITY;
        let room = room.min(memory.len());
        fit_points(&generator, samples, options, identity, &mut [0.1; 2], &mut place, &mut memory[..room]).unwrap_err()
    };
    let rigid = options(Frame::Rigid);
    assert_eq!(run(&[], &rigid, &mut [0.0; 2], needed), Error::Empty);
    let weightless: Vec<Sample> = good.iter().map(|sample| Sample { weight: 0.0, ..*sample }).collect();
    assert_eq!(run(&weightless, &rigid, &mut [0.0; 2], needed), Error::Empty);
    assert_eq!(run(&good[..2], &rigid, &mut [0.0; 2], needed), Error::Degenerate);
    let mut bad = good.clone();
    bad[3].target[1] = f32::NAN;
    assert_eq!(run(&bad, &rigid, &mut [0.0; 2], needed), Error::NotFinite { index: 3 });
    bad[3] = Sample { weight: -1.0, ..good[3] };
    assert_eq!(run(&bad, &rigid, &mut [0.0; 2], needed), Error::NotFinite { index: 3 });
    bad[3] = Sample { normal: Some([0.0; 3]), ..good[3] };
    assert_eq!(run(&bad, &rigid, &mut [0.0; 2], needed), Error::BadSample { index: 3 });
    bad[3] = Sample { point: SurfacePoint::vertex(20), ..good[3] };
    assert_eq!(run(&bad, &rigid, &mut [0.0; 2], needed), Error::IndexOutOfRange { index: 20, limit: 20 });
    assert_eq!(run(&good, &rigid, &mut [0.0; 3], needed), Error::DimensionMismatch { expected: 2, found: 3 });
    assert!(matches!(run(&good, &rigid, &mut [0.0; 2], needed - 1), Error::WorkspaceTooSmall { .. }));
    let silent = FitOptions { noise: 0.0, ..rigid };
    assert_eq!(run(&good, &silent, &mut [0.0; 2], needed), Error::BadOption { option: 2 });
    let gaussian = model.gaussian(Mode::Identity).unwrap();
    let wrong = FitOptions { identity_prior: Prior::Box(gaussian.spread(), -1.0), ..rigid };
    assert_eq!(run(&good, &wrong, &mut [0.0; 2], needed), Error::BadOption { option: 1 });
}

/// Sums beyond `f32` and placements that are none are errors, and leave the output alone.
#[test]
fn normal_equations_refuse_what_is_not_finite() {
    let file = model_file(&header(20, 2, 2, false), 1);
    let generator = Model::open(&file).unwrap().bilinear().unwrap();
    let weights = Weights { identity: &[0.1; 2], pose: &[0.1; 2] };
    let mut samples = samples_of(&generator, weights, &Similarity::IDENTITY, 0.0);
    let (mut jtj, mut jtr) = ([7.0; 16], [7.0; 4]);
    let mut memory = vec![0.0; normal_equations_req(4, Frame::Fixed).numbers()];
    let mut run = |samples: &[Sample], place: &Similarity<f32>| {
        normal_equations(&generator, weights, samples, place, Frame::Fixed, &mut jtj, &mut jtr, &mut memory)
            .unwrap_err()
    };
    for scale in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let place = Similarity { scale, ..Similarity::IDENTITY };
        assert_eq!(run(&samples, &place), Error::NotFinite { index: 0 });
    }
    samples[5].target[0] = 3e38;
    assert!(matches!(run(&samples, &Similarity::IDENTITY), Error::NotFinite { .. }));
    assert_eq!((jtj, jtr), ([7.0; 16], [7.0; 4]));
}
