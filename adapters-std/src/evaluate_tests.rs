//! The dispatched kernels against the plain ones: bits, threads, alignment, refusals.

use super::*;
use crate::io::model::{Coefficients, ModelSource, WaveletForm, hab};
use habitus_core::fit::{self, FitOptions, Frame, Sample, SurfacePoint, fit_points_req, normal_equations_req};
use habitus_core::format::{ElementType, Header, Kind, Model, SectionId, SectionSource, write, written_len};
use habitus_core::prior::Prior;
use habitus_core::quantise::F32;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::Limits;
use habitus_core::wavelet::transform;

const N: usize = 203;
const DIM: (usize, usize) = (6, 7);

/// A number in -1..1 that is a function of `k`.
fn noise(k: usize) -> f32 {
    let mixed = (k as u32 ^ 0x9e37).wrapping_mul(0x85eb_ca6b);
    let mixed = (mixed ^ (mixed >> 13)).wrapping_mul(0xc2b2_ae35);
    (mixed >> 8) as f32 / 8_388_608.0 - 1.0
}

fn file(linear: bool) -> Vec<u8> {
    let header = Header {
        kind: Kind::Bilinear,
        n_vertices: N as u32,
        identity_dim: DIM.0 as u32,
        pose_dim: DIM.1 as u32,
        identity_linear: linear,
        pose_linear: linear,
        dual_quaternion: false,
    };
    let (blocks, terms) = (header.n_blocks(), header.n_terms());
    let size = |k: usize| if (k / NUMBERS).is_multiple_of(terms) { 100.0 } else { 5.0 };
    let bytes: Vec<u8> = (0..blocks * terms * NUMBERS).flat_map(|k| (size(k) * noise(k)).to_le_bytes()).collect();
    let shape = [blocks as u32, terms as u32, 3, 16];
    let id = SectionId::Coefficients as u32;
    let source = SectionSource { id, may_ignore: false, element: ElementType::F32, shape: &shape, bytes: &bytes };
    let mut out = vec![0; written_len(&[source]).unwrap()];
    write(&header, &[source], &mut out).unwrap();
    out
}

fn weights() -> (Vec<f32>, Vec<f32>) {
    ((0..DIM.0).map(|k| noise(1000 + k)).collect(), (0..DIM.1).map(|k| noise(2000 + k)).collect())
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn every_width_and_number_of_threads_gives_the_bits_of_the_kernel() {
    let (identity, pose) = weights();
    for linear in [false, true] {
        let file = file(linear);
        let model = Model::open(&file).unwrap().bilinear().unwrap();
        for fixed in [None, Some(Mode::Identity), Some(Mode::Pose)] {
            match fixed {
                None => same_bits(&model, Weights { identity: &identity, pose: &pose }),
                Some(mode) => {
                    let (given, weights) = match mode {
                        Mode::Identity => (&identity, Weights { identity: &[], pose: &pose }),
                        Mode::Pose => (&pose, Weights { identity: &identity, pose: &[] }),
                    };
                    let blocks = 1..model.block_count();
                    let len = prepared::prepared_req(&model, mode, &blocks).numbers();
                    let mut plain = vec![0.0; len];
                    Prepared::new(&model, mode, given, blocks.clone(), &mut plain).unwrap();
                    for threads in [0, 1, 2, 3, 40] {
                        let mut memory = vec![f32::NAN; len + 3];
                        let form =
                            prepared_parallel(&model, mode, given, blocks.clone(), &mut memory, threads).unwrap();
                        same_bits(&form, weights);
                        assert_eq!(bits(&memory[..len]), bits(&plain));
                    }
                }
            }
        }
    }
}

fn same_bits<G: Generator + Sync>(generator: &G, weights: Weights<'_>) {
    for range in [0..generator.vertex_count(), 5..150, 17..18, 9..9] {
        let mut expected = vec![0.0; 3 * range.len()];
        generator.evaluate(weights, range.clone(), &mut expected).unwrap();
        for threads in [0, 1, 2, 3, 5, 64] {
            let mut out = vec![f32::NAN; expected.len()];
            evaluate_parallel(generator, weights, range.clone(), &mut out, threads).unwrap();
            assert_eq!(bits(&out), bits(&expected));
        }
    }
    for blocks in [0..generator.block_count(), 2..5, 3..3] {
        let numbers = NUMBERS * blocks.len();
        let mut expected = (vec![0.0; numbers], vec![0.0; numbers * generator.dim()]);
        generator.linearise(weights, blocks.clone(), &mut expected.0, &mut expected.1).unwrap();
        for threads in [0, 1, 2, 3, 64] {
            let (mut values, mut jacobian) = (vec![f32::NAN; numbers], vec![f32::NAN; numbers * generator.dim()]);
            linearise_parallel(generator, weights, blocks.clone(), &mut values, &mut jacobian, threads).unwrap();
            assert_eq!(bits(&values), bits(&expected.0));
            assert_eq!(bits(&jacobian), bits(&expected.1));
        }
    }
}

#[test]
fn any_alignment_gives_the_same_bits() {
    let file = file(true);
    let (identity, pose) = weights();
    let weights = Weights { identity: &identity, pose: &pose };
    let mut results = Vec::new();
    for shift in 0..5 {
        let mut moved = vec![0; shift];
        moved.extend_from_slice(&file);
        let model = Model::open(&moved[shift..]).unwrap().bilinear().unwrap();
        let mut out = vec![0.0; 3 * N];
        evaluate(&model, weights, 0..N, &mut out).unwrap();
        let blocks = 0..model.block_count();
        let (mut values, mut jacobian) =
            (vec![0.0; NUMBERS * blocks.len()], vec![0.0; NUMBERS * blocks.len() * model.dim()]);
        linearise(&model, weights, blocks, &mut values, &mut jacobian).unwrap();
        results.push((bits(&out), bits(&values), bits(&jacobian)));
    }
    assert!(results.iter().all(|result| *result == results[0]));
}

#[test]
fn refusals_leave_the_output_alone() {
    let file = file(false);
    let model = Model::open(&file).unwrap().bilinear().unwrap();
    let (mut identity, pose) = weights();
    let mut out = vec![7.0; 3 * N];
    let run = |identity: &[f32], range, out: &mut [f32]| {
        evaluate_parallel(&model, Weights { identity, pose: &pose }, range, out, 2)
    };
    let expected = Error::IndexOutOfRange { index: N as u32 + 1, limit: N as u32 };
    assert_eq!(run(&identity, 1..N + 1, &mut out), Err(expected));
    let expected = Error::DimensionMismatch { expected: 3 * N as u32 - 3, found: 3 * N as u32 };
    assert_eq!(run(&identity, 1..N, &mut out), Err(expected));
    identity[2] = f32::NAN;
    assert_eq!(run(&identity, 0..N, &mut out), Err(Error::NotFinite { index: 2 }));
    assert!(out.iter().all(|&value| value == 7.0));
    let blocks = model.block_count();
    let (mut values, mut jacobian) = (vec![7.0; NUMBERS * blocks], vec![7.0; NUMBERS * blocks * 13]);
    let weights = Weights { identity: &identity, pose: &pose };
    let run = linearise_parallel(&model, weights, 0..blocks, &mut values, &mut jacobian, 2);
    assert_eq!(run, Err(Error::NotFinite { index: 2 }));
    let run = linearise_parallel(&model, weights, 0..blocks, &mut values, &mut jacobian[1..], 2);
    assert_eq!(run, Err(Error::NotFinite { index: 2 }));
    assert!(values.iter().chain(&jacobian).all(|&value| value == 7.0));
    let mut short = vec![0.0; 5];
    let run = prepared_parallel(&model, Mode::Pose, &pose, 0..blocks, &mut short, 2);
    assert!(matches!(run, Err(Error::WorkspaceTooSmall { .. })));
}

#[test]
fn fits_have_the_bits_of_the_kernel() {
    let file = file(false);
    let model = Model::open(&file).unwrap().bilinear().unwrap();
    let (identity, pose) = weights();
    let weights = Weights { identity: &identity, pose: &pose };
    let mut shape = vec![0.0; 3 * N];
    evaluate(&model, weights, 0..N, &mut shape).unwrap();
    let sample = |vertex: usize| Sample {
        point: SurfacePoint::vertex(vertex as u32),
        target: [0, 1, 2].map(|axis| shape[3 * vertex + axis] + noise(vertex)),
        normal: vertex.is_multiple_of(5).then_some([0.6, 0.0, 0.8]),
        weight: 1.0,
    };
    let samples: Vec<Sample> = (0..N).map(sample).collect();
    let placement = Similarity::IDENTITY;
    let frame = Frame::Similarity;
    let all = DIM.0 + DIM.1 + frame.dim();
    let mut workspace = vec![0.0; normal_equations_req(DIM.0 + DIM.1, frame).numbers()];
    let mut run = |wide: bool| {
        let (mut jtj, mut jtr) = (vec![0.0; all * all], vec![0.0; all]);
        let call = if wide { normal_equations } else { fit::normal_equations };
        let energy =
            call(&model, weights, &samples[..], &placement, frame, &mut jtj, &mut jtr, &mut workspace).unwrap();
        (energy.to_bits(), bits(&jtj), bits(&jtr))
    };
    assert_eq!(run(true), run(false));

    let options = FitOptions {
        frame,
        place: true,
        identity_prior: Prior::None,
        pose_prior: Prior::None,
        noise: 1.0,
        limits: Limits::default(),
    };
    let mut workspace = vec![0.0; fit_points_req(DIM.0, DIM.1, frame).numbers()];
    let mut run = |wide: bool| {
        let (mut identity, mut pose) = (vec![0.1; DIM.0], vec![0.1; DIM.1]);
        let mut placement = Similarity::IDENTITY;
        let call = if wide { fit_points } else { fit::fit_points };
        let report = call(&model, &samples[..], &options, &mut identity, &mut pose, &mut placement, &mut workspace);
        (report.unwrap(), bits(&identity), bits(&pose), placement)
    };
    let (report, ..) = run(true);
    assert!(report.energy < report.start_energy);
    assert_eq!(run(true), run(false));
}

#[test]
fn batches_have_the_same_bits_on_any_number_of_threads() {
    let file = file(false);
    let model = Model::open(&file).unwrap().bilinear().unwrap();
    let all: Vec<_> =
        (0..5).map(|k| [DIM.0, DIM.1].map(|dim| (0..dim).map(|i| noise(100 * k + i)).collect())).collect();
    let ats: Vec<At<'_>> = all
        .iter()
        .map(|[identity, pose]: &[Vec<f32>; 2]| model.begin(Weights { identity, pose }, false, &mut []).unwrap())
        .collect();
    for range in [0..N, 7..60, 9..9] {
        let mut expected = vec![0.0; 5 * 3 * range.len()];
        model.evaluate_batch_at(&ats, range.clone(), &mut expected).unwrap();
        for threads in [0, 1, 2, 3, 9] {
            let mut out = vec![f32::NAN; expected.len()];
            evaluate_batch_at_parallel(&model, &ats, range.clone(), &mut out, threads).unwrap();
            assert_eq!(bits(&out), bits(&expected));
        }
    }
    let mut out = vec![7.0; 3 * 5 * N];
    let run = evaluate_batch_at_parallel(&model, &ats[1..], 0..N, &mut out, 2);
    assert_eq!(run, Err(Error::DimensionMismatch { expected: 12 * N as u32, found: 15 * N as u32 }));
    assert!(out.iter().all(|&value| value == 7.0));
}

#[test]
fn surfaces_have_the_same_bits_on_any_number_of_threads() {
    let grid = Grid::new(4, 5, 3).unwrap();
    let coefficients: Vec<f32> = (0..2 * grid.len()).map(noise).collect();
    for wavelet in [Wavelet::Cubic, Wavelet::Bilinear] {
        for level in 0..=3 {
            let mut expected = vec![0.0; 2 * grid.node_count(level)];
            let mut workspace = vec![0.0; synthesis_req(&grid, level).numbers()];
            transform::synthesis(&grid, wavelet, level, &coefficients, &mut expected, &mut workspace).unwrap();
            for threads in [0, 1, 2, 3, 64] {
                let mut out = vec![f32::NAN; expected.len()];
                wavelet_synthesis_parallel(&grid, wavelet, level, &coefficients, &mut out, threads).unwrap();
                assert_eq!(bits(&out), bits(&expected));
            }
        }
    }
    let mut out = vec![7.0; 2 * grid.len()];
    let mut run = |level, from: usize| {
        wavelet_synthesis_parallel(&grid, Wavelet::Cubic, level, &coefficients[from..], &mut out, 2)
    };
    assert_eq!(run(4, 0), Err(Error::IndexOutOfRange { index: 4, limit: 4 }));
    assert!(matches!(run(3, 1), Err(Error::DimensionMismatch { .. })));
    assert!(matches!(run(3, grid.len()), Err(Error::DimensionMismatch { .. })));
    assert!(out.iter().all(|&value| value == 7.0));
}

#[test]
fn wavelet_models_have_the_same_bits_on_any_number_of_threads() {
    let file = waves();
    let model = Model::open(&file).unwrap().wavelet::<F32<'_>>().unwrap();
    let (identity, pose): (Vec<f32>, Vec<f32>) = (
        (0..Generator::identity_dim(&model)).map(noise).collect(),
        (0..Generator::pose_dim(&model)).map(noise).collect(),
    );
    let weights = Weights { identity: &identity, pose: &pose };
    for model in [model, model.with_window(2..9, 3..17).unwrap()] {
        let n = model.vertex_count();
        let mut state = vec![0.0; model.state_req(false).numbers()];
        let mut expected = vec![0.0; 3 * n];
        let at = model.begin(weights, false, &mut state).unwrap();
        model.evaluate_at(at, 0..n, &mut expected).unwrap();
        for threads in [0, 1, 2, 3, 64] {
            let mut out = vec![f32::NAN; 3 * n];
            evaluate_surface_parallel(&model, weights, &mut out, threads).unwrap();
            assert_eq!(bits(&out), bits(&expected));
        }
        let mut out = vec![7.0; 3 * n];
        let short = Weights { identity: &identity[1..], pose: &pose };
        assert!(matches!(evaluate_surface_parallel(&model, short, &mut out, 2), Err(Error::DimensionMismatch { .. })));
        let run = evaluate_surface_parallel(&model, weights, &mut out[1..], 2);
        assert!(matches!(run, Err(Error::DimensionMismatch { .. })));
        assert!(out.iter().all(|&value| value == 7.0));
    }
}

/// A wavelet model of 13 x 17 nodes, three identity and two pose weights a coefficient.
fn waves() -> Vec<u8> {
    let grid = Grid::new(4, 5, 2).unwrap();
    let [identity_dim, pose_dim] = [3, 2];
    let mean: Vec<f64> = (0..3 * grid.len()).map(|k| noise(k).into()).collect();
    let core: Vec<f64> = (0..3 * grid.len() * identity_dim * pose_dim).map(|k| noise(9000 + k).into()).collect();
    let form = WaveletForm { grid, wavelet: Wavelet::Cubic, identity_dim, pose_dim, mean: &mean, core: &core };
    hab::bytes(&ModelSource::new(Coefficients::Wavelet(form))).unwrap()
}
