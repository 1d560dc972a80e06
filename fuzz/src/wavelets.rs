//! The wavelet kernel against the slow reference, in every storage: levels, windows, derivatives, prepared forms and fits give the same bits; what
//! is refused is refused for the reason that is documented, and leaves outputs and state alone.

use habitus_core::fit::{
    Frame as CoreFrame, Sample as CoreSample, SurfacePoint, WaveletOptions, fit_wavelet, fit_wavelet_req,
};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::wavelet::{Multiscale, Stored, with_fixed, with_fixed_req};
use habitus_core::generator::{Generator, LANES, Weights};
use habitus_core::quantise::Storage;
use habitus_core::rotation::similarity::Similarity;
use habitus_reference::bilinear::Linearised;
use habitus_reference::normal_equations::{Frame, Sample};
use habitus_reference::wavelet_fit::{Options, fit};

use crate::bits::assert_same;
use crate::bodies::{Reached, UNTOUCHED, check_generator};
use crate::body_case::file_refused;
use crate::wavelet_case::{Case, Choice, Fit};

/// Compares the kernel with the reference on the case that the bytes make.
pub fn check(bytes: &[u8]) {
    if let Some(choice) = Choice::of(bytes) {
        check_case(&choice.case());
    }
}

fn check_case(case: &Case) -> Reached {
    let (sections, file) = case.file();
    let model = match (Model::open(&file), file_refused(&sections)) {
        (Ok(model), None) => model,
        (Err(error), Some(expected)) => {
            assert_eq!(error, expected);
            return Reached::File;
        }
        (outcome, expected) => panic!("opened: {:?}, expected: {expected:?}", outcome.err()),
    };
    match model.generator().expect("an opened model has a generator") {
        AnyGenerator::WaveletF32(generator) => check_stored(case, &model, generator),
        AnyGenerator::WaveletF16(generator) => check_stored(case, &model, generator),
        AnyGenerator::WaveletI8(generator) => check_stored(case, &model, generator),
        other => panic!("a wavelet model, not {other:?}"),
    }
}

fn check_stored<'a, S: Storage<'a>>(case: &Case, model: &Model<'a>, whole: Multiscale<Stored<'a, S>>) -> Reached {
    let reference = &case.model;
    let generator = whole.with_levels(reference.detail, reference.resolution).expect("levels of the grid");
    let [columns, rows] = reference.window.map(|[from, to]| from..to);
    let generator = generator.with_window(columns, rows).expect("a window of the grid");
    let weights = Weights { identity: &case.identity, pose: &case.pose };
    let refused = case.weights_refused();
    let n = generator.vertex_count();
    let (positions, derivatives) = match refused {
        None => (reference.positions(&case.identity, &case.pose), all_derivatives(case, n)),
        Some(_) => (Vec::new(), Vec::new()),
    };
    let expected = |v: usize| Linearised { value: positions[v], derivatives: derivatives[v].concat() };
    let reached = check_generator(&case.range, &generator, weights, refused, n, expected);
    if refused.is_some() {
        return reached;
    }
    let blocks = case.range.start.min(n) / LANES..case.range.end.min(n).div_ceil(LANES);
    let blocks = blocks.start.min(blocks.end)..blocks.end;
    let first = LANES * blocks.start;
    let count = n.min(LANES * blocks.end).saturating_sub(first);
    let range = case.range.start % (count + 2)..case.range.end % (count + 2);
    let of_fixed = reference.positions_of_fixed(&case.identity, &case.pose);
    for (fixed, own, free) in [
        (Mode::Identity, &case.identity, Weights { identity: &[], pose: &case.pose }),
        (Mode::Pose, &case.pose, Weights { identity: &case.identity, pose: &[] }),
    ] {
        let mut memory = vec![UNTOUCHED; with_fixed_req(&generator, fixed).numbers()];
        let form = with_fixed(&generator, fixed, own, &blocks, &mut memory).expect("blocks of the model");
        let expected = |v: usize| match fixed {
            Mode::Identity => Linearised { value: of_fixed[first + v], derivatives: derivatives[first + v][1].clone() },
            Mode::Pose => Linearised { value: positions[first + v], derivatives: derivatives[first + v][0].clone() },
        };
        check_generator(&range, &form, free, None, count, expected);
    }
    if let Some(fit) = &case.fit {
        check_fit(case, fit, model, &generator);
    }
    reached
}

/// By identity and by pose, for every vertex.
fn all_derivatives(case: &Case, n: usize) -> Vec<[Vec<[f32; 3]>; 2]> {
    (0..n).map(|v| case.model.derivatives(&case.identity, &case.pose, v)).collect()
}

/// A sample as the kernel takes it; one that is left out has no weight.
fn core_sample(sample: &Option<Sample>) -> CoreSample {
    let none = CoreSample { point: SurfacePoint::vertex(0), target: [0.0; 3], normal: None, weight: 0.0 };
    sample.as_ref().map_or(none, |sample| CoreSample {
        point: SurfacePoint { vertices: sample.corners, barycentric: sample.barycentric },
        target: sample.target,
        normal: sample.normal,
        weight: sample.weight,
    })
}

fn check_fit<'a, S: Storage<'a>>(case: &Case, of: &Fit, model: &Model<'a>, generator: &Multiscale<Stored<'a, S>>) {
    let spread = |mode: usize| case.spreads[mode].as_ref().filter(|_| of.free[mode]);
    let options = Options {
        frame: of.frame,
        spreads: [spread(0), spread(1)],
        kappa: of.kappa,
        omega: of.omega,
        levels: of.levels.clone(),
        passes: of.passes,
    };
    let expected = fit(&case.model, &of.samples, &options, &case.identity, &case.pose, &of.start);
    let core_options = WaveletOptions {
        frame: [CoreFrame::Fixed, CoreFrame::Rigid, CoreFrame::Similarity][match of.frame {
            Frame::Fixed => 0,
            Frame::Rigid => 1,
            Frame::Similarity => 2,
        }],
        identity: model.spread(Mode::Identity).filter(|_| of.free[0]),
        pose: model.spread(Mode::Pose).filter(|_| of.free[1]),
        kappa: of.kappa,
        omega: of.omega,
        levels: of.levels.clone(),
        passes: of.passes,
    };
    let samples: Vec<CoreSample> = of.samples.iter().map(core_sample).collect();
    let mut memory = vec![f32::NAN; fit_wavelet_req(generator, samples.len(), &of.levels).numbers()];
    let (mut identity, mut pose) = (case.identity.clone(), case.pose.clone());
    let start = of.start;
    let mut place = Similarity { scale: start.scale, rotation: start.rotation, translation: start.translation };
    let all = samples.as_slice();
    let found = fit_wavelet(generator, all, &core_options, &mut identity, &mut pose, &mut place, &mut memory);
    match (found, expected) {
        (Err(error), Err(refusal)) => assert_eq!(error.code() as u32, refusal[0]),
        (Ok(found), Ok(expected)) => {
            assert_same("fitted identity", &identity, &expected.identity);
            assert_same("fitted pose", &pose, &expected.pose);
            assert_same("root mean squares", &[found.rms, found.start_rms], &[expected.rms, expected.start_rms]);
            assert_same("translation", &place.translation, &expected.placement.translation);
            assert_same("rotation", place.rotation.as_flattened(), expected.placement.rotation.as_flattened());
            assert_eq!((found.passes, found.reached), (expected.passes, expected.reached));
        }
        (found, expected) => panic!("fitted: {:?}, expected: {:?}", found.err(), expected.err()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The comparison is worth something only if many cases come to its end, and to a fit.
    #[test]
    fn random_bytes_reach_every_end() {
        let mut state = 7u32;
        let mut byte = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        let (mut ends, mut fits) = ([0; 3], 0);
        for k in 0..600 {
            // Without coefficients of their own, every other case.
            let length = if k % 2 == 0 { 120 } else { 29 };
            let bytes: Vec<u8> = (0..length).map(|_| byte()).collect();
            if let Some(choice) = Choice::of(&bytes) {
                let case = choice.case();
                fits += usize::from(case.fit.is_some());
                ends[check_case(&case) as usize] += 1;
            }
        }
        assert!(ends.iter().all(|&count| count >= 10), "file refused, weights refused, compared: {ends:?}");
        assert!(fits >= 50, "{fits} fits");
    }
}
