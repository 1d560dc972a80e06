//! The bilinear kernel against the slow reference: evaluation, derivatives, prepared forms, normal equations and fits give the
//! same bits, and where one refuses the other refuses with the same error.

use habitus_core::Error;
use habitus_core::fit::{Sample, fit_landmarks, fit_points, fit_points_req, normal_equations, normal_equations_req};
use habitus_core::format::limits::{MAX_COEFFICIENT, MAX_WEIGHT};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::bilinear::Bilinear;
use habitus_core::generator::prepared::{Prepared, prepared_req};
use habitus_core::generator::{Generator, LANES, NUMBERS, Weights};
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::Status;
use habitus_reference::bilinear::value_of_prepared;
use habitus_reference::fit::fit as reference_fit;
use habitus_reference::model_file;
use habitus_reference::normal_equations::{Sample as ReferenceSample, equations};
use habitus_reference::placement::Placement;

use crate::bits::assert_same;
use crate::case::Case;

/// Value of outputs that must stay untouched.
const UNTOUCHED: f32 = -77.25;

/// Compares the kernel with the reference on the case that the bytes make.
pub fn check(bytes: &[u8]) {
    if let Some(case) = Case::of(bytes) {
        check_case(&case);
    }
}

/// How far a case comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reached {
    /// The model file is refused.
    File,
    /// The fit is refused.
    Refusal,
    /// The fit ends.
    Fit,
}

fn check_case(case: &Case) -> Reached {
    let sections = model_file::sections(&case.model, &case.extras);
    let first_wrong = sections[0].bytes.as_chunks::<4>().0.iter().position(|raw| {
        let coefficient = f32::from_le_bytes(*raw);
        !(coefficient.abs() <= MAX_COEFFICIENT)
    });
    let file = model_file::bytes(&case.model, &sections);
    let model = match (Model::open(&file), first_wrong) {
        (Ok(model), None) => model,
        (Err(error), Some(index)) => {
            assert_eq!(error, Error::BadContent { section: 1, index: index as u32 });
            return Reached::File;
        }
        (outcome, _) => panic!("opened: {:?}, first wrong coefficient: {first_wrong:?}", outcome.err()),
    };
    let generator = model.bilinear().expect("an opened model has a generator");
    check_evaluated(case, &generator);
    if case.weights_refused().is_none() {
        check_linearised(case, &generator);
        check_prepared(case, &generator);
    }
    check_equations(case, &generator);
    check_fit(case, &model, &generator)
}

fn check_evaluated(case: &Case, generator: &Bilinear<'_>) {
    let weights = Weights { identity: &case.identity, pose: &case.pose };
    let (n, range) = (case.model.n(), case.range.clone());
    let refused = case.weights_refused().or_else(|| {
        let beyond = range.start > range.end || range.end > n;
        beyond.then(|| Error::IndexOutOfRange { index: range.start.max(range.end) as u32, limit: n as u32 })
    });
    let mut out = vec![UNTOUCHED; 3 * range.end.saturating_sub(range.start)];
    let outcome = generator.evaluate(weights, range.clone(), &mut out);
    assert_eq!(outcome.err(), refused);
    if refused.is_some() {
        assert!(out.iter().all(|&number| number == UNTOUCHED), "outputs of a refused call were touched");
        return;
    }
    let expected: Vec<f32> = range.clone().flat_map(|v| case.model.value(&case.identity, &case.pose, v)).collect();
    assert_same("positions", &out, &expected);
    let mut long = vec![UNTOUCHED; out.len() + 1];
    let refused = Error::DimensionMismatch { expected: out.len() as u32, found: long.len() as u32 };
    assert_eq!(generator.evaluate(weights, range, &mut long), Err(refused));
    assert!(long.iter().all(|&number| number == UNTOUCHED), "outputs of a refused call were touched");
}

/// Positions or one column of the derivatives at the vertices of the blocks, without what lies behind the last vertex.
fn points_of_blocks(numbers: &[f32], n: usize) -> Vec<f32> {
    (0..n).flat_map(|v| [0, 1, 2].map(|axis| numbers[(v / LANES * 3 + axis) * LANES + v % LANES])).collect()
}

fn check_linearised(case: &Case, generator: &Bilinear<'_>) {
    let weights = Weights { identity: &case.identity, pose: &case.pose };
    let (n, dim, blocks) = (case.model.n(), generator.dim(), generator.block_count());
    let mut values = vec![0.0; blocks * NUMBERS];
    let mut jacobian = vec![0.0; blocks * NUMBERS * dim];
    generator.linearise(weights, 0..blocks, &mut values, &mut jacobian).expect("all blocks");
    let expected: Vec<_> = (0..n).map(|v| case.model.linearised(&case.identity, &case.pose, v)).collect();
    let positions: Vec<f32> = expected.iter().flat_map(|vertex| vertex.value).collect();
    assert_same("linearised positions", &points_of_blocks(&values, n), &positions);
    for k in 0..dim {
        let column: Vec<f32> =
            jacobian.chunks_exact(NUMBERS * dim).flat_map(|block| &block[NUMBERS * k..][..NUMBERS]).copied().collect();
        let expected: Vec<f32> = expected.iter().flat_map(|vertex| vertex.derivatives[k]).collect();
        assert_same("derivatives", &points_of_blocks(&column, n), &expected);
    }
    let at = generator.begin(weights, true, &mut []).expect("weights that were checked");
    let mut of_vertex = vec![[0.0; 3]; dim];
    for (v, expected) in expected.iter().enumerate() {
        let position = generator.linearised_vertex_unchecked(at, v, &mut of_vertex).expect("a vertex");
        assert_same("position of a vertex", &position, &expected.value);
        assert_same("derivatives of a vertex", of_vertex.as_flattened(), expected.derivatives.as_flattened());
    }
}

fn check_prepared(case: &Case, generator: &Bilinear<'_>) {
    let (n, limit) = (case.model.n(), generator.block_count());
    let blocks = case.range.start / LANES..case.range.end.div_ceil(LANES);
    for (fixed, given, free) in [(Mode::Identity, &case.identity, &case.pose), (Mode::Pose, &case.pose, &case.identity)]
    {
        let mut memory = vec![0.0; prepared_req(generator, fixed, &blocks).numbers()];
        let outcome = Prepared::new(generator, fixed, given, blocks.clone(), &mut memory);
        if blocks.start > blocks.end || blocks.end > limit {
            let index = blocks.start.max(blocks.end) as u32;
            assert_eq!(outcome.err(), Some(Error::IndexOutOfRange { index, limit: limit as u32 }));
            continue;
        }
        let prepared = outcome.expect("blocks of the model");
        let weights = match fixed {
            Mode::Identity => Weights { identity: &[], pose: free },
            Mode::Pose => Weights { identity: free, pose: &[] },
        };
        let vertices = LANES * blocks.start..n.min(LANES * blocks.end);
        let expected: Vec<f32> = vertices
            .map(|v| match fixed {
                Mode::Identity => case.model.with_identity(given, v),
                Mode::Pose => case.model.with_pose(given, v),
            })
            .flat_map(|vertex| value_of_prepared(&vertex, free))
            .collect();
        let mut out = vec![0.0; 3 * prepared.vertex_count()];
        prepared.evaluate(weights, 0..prepared.vertex_count(), &mut out).expect("all vertices");
        assert_same("positions of a prepared form", &out, &expected);
    }
}

fn core_sample(sample: &ReferenceSample) -> Sample {
    Sample {
        point: habitus_core::fit::SurfacePoint { vertices: sample.corners, barycentric: sample.barycentric },
        target: sample.target,
        normal: sample.normal,
        weight: sample.weight,
    }
}

struct Sparse(Vec<Option<Sample>>);

impl habitus_core::fit::Samples for Sparse {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn get(&self, index: usize) -> Option<Sample> {
        *self.0.get(index)?
    }
}

fn core_samples(case: &Case) -> Sparse {
    Sparse(case.samples.iter().map(|sample| sample.as_ref().map(core_sample)).collect())
}

fn core_placement(placement: &Placement<f32>) -> Similarity<f32> {
    Similarity { scale: placement.scale, rotation: placement.rotation, translation: placement.translation }
}

fn numbers_of(placement: &Similarity<f32>) -> Vec<f32> {
    let rotation = placement.rotation.iter().flatten().copied();
    std::iter::once(placement.scale).chain(rotation).chain(placement.translation).collect()
}

/// Fails unless the error has the code that the reference gives; of its numbers, those that the documentation fixes are compared.
fn assert_refused(found: Option<Error>, expected: [u32; 3]) {
    let Some(error) = found else { panic!("accepted, where the reference refuses with {expected:?}") };
    assert_eq!(error.code() as u32, expected[0], "{error:?}, the reference refuses with {expected:?}");
}

fn check_equations(case: &Case, generator: &Bilinear<'_>) {
    let weights = Weights { identity: &case.identity, pose: &case.pose };
    let m = generator.dim() + case.frame.dim();
    let (mut jtj, mut jtr) = (vec![UNTOUCHED; m * m], vec![UNTOUCHED; m]);
    let mut workspace = vec![UNTOUCHED; normal_equations_req(generator.dim(), case.core_frame()).numbers()];
    let outcome = normal_equations(
        generator,
        weights,
        &core_samples(case),
        &core_placement(&case.placement),
        case.core_frame(),
        &mut jtj,
        &mut jtr,
        &mut workspace,
    );
    let refused = case.weights_refused().or_else(|| case.placement_refused()).or_else(|| case.first_sample_refused());
    if refused.is_some() {
        assert_eq!(outcome.err(), refused);
    } else {
        let (energy, matrix, vector) =
            equations(&case.model, &case.identity, &case.pose, &case.samples, &case.placement, case.frame);
        let matrix: Vec<f32> = matrix.into_iter().flatten().collect();
        if [energy].iter().chain(&matrix).chain(&vector).all(|sum| sum.is_finite()) {
            assert_same("energy", &[outcome.expect("finite sums")], &[energy]);
            assert_same("J^T J", &jtj, &matrix);
            assert_same("J^T r", &jtr, &vector);
            return;
        }
        assert_refused(outcome.err(), [103, 0, 0]);
    }
    assert!(jtj.iter().chain(&jtr).all(|&number| number == UNTOUCHED), "outputs of a refused call were touched");
}

fn check_fit(case: &Case, model: &Model<'_>, generator: &Bilinear<'_>) -> Reached {
    let (mut identity, mut pose) = (case.identity.clone(), case.pose.clone());
    let mut placement = core_placement(&case.placement);
    let options = case.core_options(model);
    let (di, dp) = case.model.dims();
    let mut workspace = vec![UNTOUCHED; fit_points_req(di, dp, case.core_frame()).numbers()];
    let outcome = if case.landmarks_only {
        let targets: Vec<_> = case.samples.iter().map(|sample| sample.as_ref().map(|sample| sample.target)).collect();
        fit_landmarks(model, generator, &targets, &options, &mut identity, &mut pose, &mut placement, &mut workspace)
    } else {
        let samples = core_samples(case);
        fit_points(generator, &samples, &options, &mut identity, &mut pose, &mut placement, &mut workspace)
    };
    let expected = match case.fit_refused() {
        Some(error) => Err([error.code() as u32, 0, 0]),
        None => {
            let options = case.options();
            reference_fit(&case.model, &case.samples, &options, &case.identity, &case.pose, &case.placement)
        }
    };
    match (outcome, expected) {
        (Ok(report), Ok(fit)) => {
            let status = [Status::Converged, Status::IterationLimit, Status::Stalled];
            assert_eq!((report.iterations, report.status), (fit.iterations, status[fit.status as usize]));
            let found = [report.rms, report.energy, report.start_energy];
            assert_same("root mean square, energy, first energy", &found, &[fit.rms, fit.energy, fit.start_energy]);
            assert_same("fitted identity", &identity, &fit.identity);
            assert_same("fitted pose", &pose, &fit.pose);
            assert_same("fitted placement", &numbers_of(&placement), &fit.placement.numbers());
            assert!(identity.iter().chain(&pose).all(|weight| weight.abs() <= MAX_WEIGHT), "weights beyond the limit");
            Reached::Fit
        }
        (outcome, Err(refusal)) => {
            assert_refused(outcome.err(), refusal);
            assert_same("identity after a refusal", &identity, &case.identity);
            assert_same("pose after a refusal", &pose, &case.pose);
            assert_same("placement after a refusal", &numbers_of(&placement), &case.placement.numbers());
            Reached::Refusal
        }
        (Err(error), Ok(_)) => panic!("refused with {error:?}, where the reference fits"),
    }
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
        let mut ends = [0; 3];
        for _ in 0..400 {
            let bytes: Vec<u8> = (0..400).map(|_| byte()).collect();
            if let Some(case) = Case::of(&bytes) {
                ends[check_case(&case) as usize] += 1;
            }
        }
        assert!(ends.iter().all(|&count| count >= 10), "file refused, fit refused, fitted: {ends:?}");
    }
}
