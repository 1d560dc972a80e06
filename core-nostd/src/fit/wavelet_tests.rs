//! Tests of the fit of wavelet models: planted weights, landmarks on the published grid, memory, refusals.

use std::vec::Vec;

use super::*;
use crate::Error;
use crate::format::{Mode, Model};
use crate::generator::wavelet::local::bilinear;
use crate::generator::wavelet::{Multiscale, Stored};
use crate::generator::{Generator, Weights};
use crate::quantise::F32;
use crate::rotation::axis_angle::rotation_matrix;
use crate::rotation::similarity::Similarity;
use crate::testing::{Stream, Waves};

type Generated<'a> = Multiscale<Stored<'a, F32<'a>>>;

fn positions(generator: &Generated<'_>, identity: &[f32], pose: &[f32]) -> Vec<f32> {
    let mut state = vec![f32::NAN; generator.state_req(false).numbers()];
    let at = generator.begin(Weights { identity, pose }, false, &mut state).unwrap();
    let mut out = vec![0.0; 3 * generator.vertex_count()];
    generator.evaluate_at(at, 0..generator.vertex_count(), &mut out).unwrap();
    out
}

fn samples_of(shape: &[f32], vertices: impl Iterator<Item = usize>, place: &Similarity<f32>) -> Vec<Sample> {
    let target = |vertex: usize| place.applied([shape[3 * vertex], shape[3 * vertex + 1], shape[3 * vertex + 2]]);
    let sample = |vertex| Sample {
        point: SurfacePoint::vertex(vertex as u32),
        target: target(vertex),
        normal: None,
        weight: 1.0,
    };
    vertices.map(sample).collect()
}

/// Means, and weights within half of their scales about them.
fn planted(model: &Model<'_>, generator: &Generated<'_>, seed: u32) -> [[Vec<f32>; 2]; 2] {
    let mut stream = Stream::new(seed);
    let dims = [generator.identity_dim(), generator.pose_dim()];
    let modes = [(Mode::Identity, dims[0]), (Mode::Pose, dims[1])].map(|(mode, dim)| {
        let spread = model.spread(mode).unwrap();
        let means: Vec<f32> = spread.mean.iter().take(dim).collect();
        let moved = means.iter().zip(spread.scale.iter()).map(|(mean, scale)| mean + 0.5 * scale * stream.next());
        [means.clone(), moved.collect()]
    });
    let [[a, b], [c, d]] = modes;
    [[a, c], [b, d]]
}

fn options<'a>(model: &Model<'a>, frame: Frame, passes: u32) -> WaveletOptions<'a> {
    WaveletOptions {
        frame,
        identity: model.spread(Mode::Identity),
        pose: model.spread(Mode::Pose),
        kappa: 1.0,
        omega: 0.0,
        levels: 0..2,
        passes,
    }
}

fn fitted(
    generator: &Generated<'_>,
    samples: &[Sample],
    options: &WaveletOptions<'_>,
    weights: &mut [Vec<f32>; 2],
    place: &mut Similarity<f32>,
) -> Result<WaveletReport, Error> {
    let mut memory = vec![f32::NAN; fit_wavelet_req(generator, samples.len(), &options.levels).numbers()];
    let [identity, pose] = weights;
    fit_wavelet(generator, samples, options, identity, pose, place, &mut memory)
}

fn placed() -> Similarity<f32> {
    Similarity { scale: 1.25, rotation: rotation_matrix([0.3, -0.2, 0.1]), translation: [30.0, -20.0, 500.0] }
}

#[test]
fn planted_weights_come_back() {
    for is_bilinear in [false, true] {
        let file = Waves { dims: [3, 3], bilinear: is_bilinear, ..Waves::new([4, 5], 3) }.file(7);
        let model = Model::open(&file).unwrap();
        let generator = model.wavelet::<F32<'_>>().unwrap().with_levels(1, 3).unwrap();
        let [means, truth] = planted(&model, &generator, 3);
        let shape = positions(&generator, &truth[0], &truth[1]);
        let samples = samples_of(&shape, 0..generator.vertex_count(), &placed());
        // One mode known: the weights of the other are determined.
        for held in [Mode::Identity, Mode::Pose] {
            let mut weights = means.clone();
            let mut options = options(&model, Frame::Fixed, 3);
            match held {
                Mode::Identity => (weights[0], options.identity) = (truth[0].clone(), None),
                Mode::Pose => (weights[1], options.pose) = (truth[1].clone(), None),
            }
            let mut place = placed();
            let first = fitted(&generator, &samples, &options, &mut weights, &mut place).unwrap();
            assert_eq!((first.passes, first.reached), (6, 3 * 63));
            // The levels reach into each other: round after round.
            let mut report = first;
            for _ in 0..100 {
                report = fitted(&generator, &samples, &options, &mut weights, &mut place).unwrap();
            }
            assert!(report.rms < 2e-3 && first.start_rms > 1.0, "{is_bilinear} {held:?} {first:?} {report:?}");
            let errors = weights.iter().zip(&truth).flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()));
            let mut errors: Vec<f32> = errors.collect();
            errors.sort_by(f32::total_cmp);
            let ninth = errors[errors.len() * 9 / 10];
            // Some local models hardly move in one direction; the coefficients are what counts.
            let mut core = [[0.0; 3]; 9];
            let mut largest = 0.0f32;
            for q in 0..63 {
                let mean = generator.locals().one(q, &mut core).unwrap();
                let value = |weights: &[Vec<f32>; 2]| {
                    bilinear(mean, &core, &weights[0][3 * q..3 * q + 3], &weights[1][3 * q..3 * q + 3])
                };
                let (found, expected) = (value(&weights), value(&truth));
                largest = found.iter().zip(expected).fold(largest, |largest, (a, b)| largest.max((a - b).abs()));
            }
            assert!(ninth < 0.05 && largest < 0.1, "{is_bilinear} {held:?} {ninth} {largest}");
        }
        // Both modes, and the placement: the shape.
        let mut weights = means.clone();
        let mut place = Similarity::IDENTITY;
        let options = options(&model, Frame::Similarity, 3);
        let first = fitted(&generator, &samples, &options, &mut weights, &mut place).unwrap();
        let mut report = first;
        for _ in 0..100 {
            report = fitted(&generator, &samples, &options, &mut weights, &mut place).unwrap();
        }
        assert!(report.rms < 0.05 * first.start_rms, "{is_bilinear} {first:?} {report:?}");
    }
}

/// 13 landmarks of the published grid, in 64 KiB with the weights of the fitted levels.
#[test]
fn landmarks_lower_the_error_at_every_pass() {
    let file = Waves { dims: [3, 3], ..Waves::new([5, 7], 5) }.file(7);
    let model = Model::open(&file).unwrap();
    let generator = model.wavelet::<F32<'_>>().unwrap().with_levels(1, 5).unwrap();
    let [means, truth] = planted(&model, &generator, 5);
    let needed = fit_wavelet_req(&generator, 13, &(0..2));
    assert_eq!(needed.numbers(), 4_343);
    assert!(needed.f32_bytes() + 4 * Generator::dim(&generator) < 64 << 10);
    let shape = positions(&generator, &truth[0], &truth[1]);
    let place = placed();
    let mut samples = samples_of(&shape, (0..13).map(|k| 24_896 * (2 * k + 1) / 27), &place);
    let mut stream = Stream::new(8);
    for sample in &mut samples {
        sample.target = sample.target.map(|value| value + 0.5 * stream.next());
    }
    for frame in [Frame::Fixed, Frame::Rigid, Frame::Similarity] {
        for (kappa, omega) in [(1.0, 0.0), (f32::INFINITY, 0.0), (1.0, 0.1)] {
            let mut weights = means.clone();
            let mut place = place;
            let pull = |weights: &[Vec<f32>; 2]| {
                [Mode::Identity, Mode::Pose].iter().zip(weights).fold(0.0, |sum, (mode, weights)| {
                    let spread = model.spread(*mode).unwrap();
                    let all = weights.iter().zip(spread.mean.iter()).zip(spread.scale.iter());
                    sum + all.map(|((w, mean), scale)| ((w - mean) / scale).powi(2)).sum::<f32>()
                })
            };
            let mut last = f32::INFINITY;
            let mut first = None;
            for levels in [0..1, 0..1, 0..1, 0..1, 1..2, 1..2, 1..2, 1..2] {
                let options = WaveletOptions { kappa, omega, levels, passes: 1, ..options(&model, frame, 1) };
                let report = fitted(&generator, &samples, &options, &mut weights, &mut place).unwrap();
                first.get_or_insert(report.start_rms);
                let energy = report.rms * report.rms * 13.0 + omega * pull(&weights);
                assert!(energy <= last * 1.0001 + 1e-3, "{frame:?} {kappa} {omega} {energy} {last}");
                last = energy;
                if kappa < 2.0 {
                    for (mode, weights) in [Mode::Identity, Mode::Pose].iter().zip(&weights) {
                        let spread = model.spread(*mode).unwrap();
                        for ((w, mean), scale) in weights.iter().zip(spread.mean.iter()).zip(spread.scale.iter()) {
                            assert!((w - mean).abs() <= 1.0001 * scale);
                        }
                    }
                }
            }
        }
    }
}

/// Samples at positions that the kernel gives are at rest.
#[test]
fn positions_of_samples_are_those_of_the_surface() {
    let file = Waves::new([3, 4], 3).file(2);
    let model = Model::open(&file).unwrap();
    for (detail, resolution) in [(3, 3), (1, 3), (0, 2)] {
        let whole = model.wavelet::<F32<'_>>().unwrap().with_levels(detail, resolution).unwrap();
        let [width, height] = [whole.grid().width(resolution), whole.grid().height(resolution)];
        for generator in [whole, whole.with_window(2..width - 1, 1..height).unwrap()] {
            let [_, mut truth] = planted(&model, &generator, 3);
            let shape = positions(&generator, &truth[0], &truth[1]);
            let samples = samples_of(&shape, 0..generator.vertex_count(), &Similarity::IDENTITY);
            let options = WaveletOptions { levels: 0..1, ..options(&model, Frame::Fixed, 1) };
            let mut place = Similarity::IDENTITY;
            let report = fitted(&generator, &samples, &options, &mut truth, &mut place).unwrap();
            assert!(report.start_rms < 1e-4, "{report:?}");
        }
    }
}

#[test]
fn refusals_leave_the_outputs_alone() {
    let file = Waves::new([3, 4], 1).file(2);
    let model = Model::open(&file).unwrap();
    let generator = model.wavelet::<F32<'_>>().unwrap();
    let [_, truth] = planted(&model, &generator, 3);
    let shape = positions(&generator, &truth[0], &truth[1]);
    let good = samples_of(&shape, 0..generator.vertex_count(), &placed());
    let needed = fit_wavelet_req(&generator, good.len(), &(0..2)).numbers();
    let plain = options(&model, Frame::Rigid, 1);
    let run = |samples: &[Sample], options: &WaveletOptions<'_>, dims: [usize; 2], start: f32, memory: usize| {
        let (mut identity, mut pose) = (vec![start; dims[0]], vec![start; dims[1]]);
        let mut place = Similarity { scale: if start == 0.25 { f32::NAN } else { 1.0 }, ..Similarity::IDENTITY };
        let mut memory = vec![0.0; memory];
        let error =
            fit_wavelet(&generator, samples, options, &mut identity, &mut pose, &mut place, &mut memory).unwrap_err();
        assert!(identity.iter().chain(&pose).all(|&value| value == start || start.is_nan()));
        error
    };
    let dims = [generator.identity_dim(), generator.pose_dim()];
    let with = |change: &dyn Fn(&mut WaveletOptions<'_>)| {
        let mut options = plain.clone();
        change(&mut options);
        run(&good, &options, dims, 0.5, needed)
    };
    let one = |change: &dyn Fn(&mut Sample)| {
        let mut samples = good.clone();
        change(&mut samples[3]);
        run(&samples, &plain, dims, 0.5, needed)
    };
    assert_eq!(
        run(&good, &plain, [dims[0] + 1, dims[1]], 0.5, needed),
        Error::DimensionMismatch { expected: dims[0] as u32, found: dims[0] as u32 + 1 }
    );
    assert_eq!(run(&good, &plain, dims, f32::NAN, needed), Error::NotFinite { index: 0 });
    let short = Error::WorkspaceTooSmall { needed: needed as u32, given: needed as u32 - 1 };
    assert_eq!(run(&good, &plain, dims, 0.5, needed - 1), short);
    assert_eq!(run(&[], &plain, dims, 0.5, needed), Error::Empty);
    assert_eq!(run(&good[..2], &plain, dims, 0.5, needed), Error::Degenerate);
    for kappa in [0.0, -1.0, f32::NAN] {
        assert_eq!(with(&|options| options.kappa = kappa), Error::BadOption { option: 1 });
    }
    for omega in [-1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(with(&|options| options.omega = omega), Error::BadOption { option: 2 });
    }
    assert_eq!(with(&|options| options.passes = 0), Error::BadOption { option: 3 });
    assert_eq!(with(&|options| options.levels = 1..1), Error::BadOption { option: 3 });
    assert_eq!(with(&|options| options.levels = 1..3), Error::IndexOutOfRange { index: 2, limit: 2 });
    let few = Waves::new([3, 4], 0).file(2);
    let few = WaveletOptions { pose: Model::open(&few).unwrap().spread(Mode::Pose), ..plain.clone() };
    let mismatch = Error::DimensionMismatch { expected: dims[1] as u32, found: 24 };
    assert_eq!(run(&good, &few, dims, 0.5, needed), mismatch);
    assert_eq!(one(&|sample| sample.target[1] = f32::NAN), Error::NotFinite { index: 3 });
    assert_eq!(one(&|sample| sample.normal = Some([0.0; 3])), Error::BadSample { index: 3 });
    assert_eq!(one(&|sample| sample.point.barycentric = [0.5, 0.5, 0.0]), Error::BadSample { index: 3 });
    assert_eq!(one(&|sample| sample.point.barycentric = [0.5, 0.0, 0.0]), Error::BadSample { index: 3 });
    assert_eq!(one(&|sample| sample.point.vertices[0] = 35), Error::IndexOutOfRange { index: 35, limit: 35 });
    struct Many;
    impl Samples for Many {
        fn len(&self) -> usize {
            1 << 24
        }
        fn get(&self, _: usize) -> Option<Sample> {
            None
        }
    }
    let (mut identity, mut pose) = (vec![0.5; dims[0]], vec![0.5; dims[1]]);
    let mut place = Similarity::IDENTITY;
    let refused = fit_wavelet(&generator, &Many, &plain, &mut identity, &mut pose, &mut place, &mut []);
    assert_eq!(refused, Err(Error::LimitExceeded { found: 1 << 24, limit: (1 << 24) - 1 }));
    let fixed = WaveletOptions { frame: Frame::Fixed, ..plain.clone() };
    assert_eq!(run(&good, &fixed, dims, 0.25, needed), Error::NotFinite { index: 0 });
}
