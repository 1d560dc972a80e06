//! `fit` and `prior` of the kernel.

use crate::memory::{Input, Output, status};
use habitus_core::Error;
use habitus_core::fit::{
    FitOptions, FitReport, Frame, Sample, SurfacePoint, WaveletOptions, fit_landmarks, fit_landmarks_req, fit_points,
    fit_points_req, fit_wavelet, fit_wavelet_req, normal_equations, normal_equations_req,
};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::{Generator, Weights};
use habitus_core::prior::Prior;
use habitus_core::quantise::{F16, F32, I8, Storage};
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::Limits;

/// What all these calls take; the numbers choose among the enumerations.
#[repr(C)]
struct Problem {
    bytes: Input<u8>,
    points: Input<[f32; 8]>,
    identity: Output<f32>,
    pose: Output<f32>,
    jtj: Output<f32>,
    jtr: Output<f32>,
    workspace: Output<f32>,
    frame: u32,
    prior: u32,
    factor: f32,
    max_iterations: u32,
    place: bool,
}

fn frame(number: u32) -> Frame {
    match number {
        0 => Frame::Fixed,
        1 => Frame::Rigid,
        _ => Frame::Similarity,
    }
}

fn prior<'a>(number: u32, model: &Model<'a>, mode: Mode, factor: f32) -> Prior<'a> {
    if let (3, Some((lower, upper))) = (number, model.pose_bounds()) {
        return Prior::Bounds(lower, upper);
    }
    match (number, model.gaussian(mode)) {
        (1, Some(gaussian)) => Prior::Gaussian(gaussian, factor),
        (2, Some(gaussian)) => Prior::Box(gaussian.spread(), factor),
        _ => Prior::None,
    }
}

fn options<'a>(problem: &Problem, model: &Model<'a>) -> FitOptions<'a> {
    FitOptions {
        frame: frame(problem.frame),
        place: problem.place,
        identity_prior: prior(problem.prior, model, Mode::Identity, problem.factor),
        pose_prior: prior(problem.prior, model, Mode::Pose, problem.factor),
        noise: problem.factor,
        limits: Limits { max_iterations: problem.max_iterations, ..Limits::default() },
    }
}

fn sample(numbers: &[f32; 8]) -> Sample {
    let [a, x, y, z, weight, u, v, w] = *numbers;
    let point = SurfacePoint { vertices: [a as u32, u as u32, v as u32], barycentric: [u, v, w] };
    Sample { point, target: [x, y, z], normal: (w > 0.5).then_some([u, v, w]), weight }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn check_fit_points(problem: Problem) -> i32 {
    // SAFETY: the caller's promise.
    reported(unsafe { points(problem) })
}

unsafe fn points(problem: Problem) -> Result<FitReport, Error> {
    // SAFETY: the caller's promise.
    let model = Model::open(unsafe { problem.bytes.slice() })?;
    let options = options(&problem, &model);
    // SAFETY: the caller's promise.
    let numbers = unsafe { problem.points.slice() };
    // SAFETY: the caller's promise.
    let (identity, pose, workspace) =
        unsafe { (problem.identity.slice(), problem.pose.slice(), problem.workspace.slice()) };
    let mut samples = [sample(&[0.0; 8]); 40];
    for (sample_, numbers) in samples.iter_mut().zip(numbers) {
        *sample_ = sample(numbers);
    }
    let samples = samples.get(..numbers.len()).ok_or(Error::Empty)?;
    fit_points_req(identity.len(), pose.len(), options.frame).check(workspace.len())?;
    let mut placement = Similarity::IDENTITY;
    fit_points(&model.generator()?, samples, &options, identity, pose, &mut placement, workspace)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn check_fit_landmarks(problem: Problem) -> i32 {
    // SAFETY: the caller's promise.
    reported(unsafe { landmarks(problem) })
}

unsafe fn landmarks(problem: Problem) -> Result<FitReport, Error> {
    // SAFETY: the caller's promise.
    let model = Model::open(unsafe { problem.bytes.slice() })?;
    let options = options(&problem, &model);
    // SAFETY: the caller's promise.
    let numbers = unsafe { problem.points.slice() };
    // SAFETY: the caller's promise.
    let (identity, pose, workspace) =
        unsafe { (problem.identity.slice(), problem.pose.slice(), problem.workspace.slice()) };
    let mut targets = [None; 40];
    for (target, &[x, y, z, weight, ..]) in targets.iter_mut().zip(numbers) {
        *target = (weight > 0.0).then_some([x, y, z]);
    }
    let targets = targets.get(..numbers.len()).ok_or(Error::Empty)?;
    fit_landmarks_req(identity.len(), pose.len(), options.frame).check(workspace.len())?;
    let mut placement = Similarity::IDENTITY;
    fit_landmarks(&model, &model.generator()?, targets, &options, identity, pose, &mut placement, workspace)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn check_normal_equations(problem: Problem) -> i32 {
    // SAFETY: the caller's promise.
    status(unsafe { equations(problem) })
}

unsafe fn equations(problem: Problem) -> Result<f32, Error> {
    // SAFETY: the caller's promise.
    let model = Model::open(unsafe { problem.bytes.slice() })?;
    let frame = frame(problem.frame);
    let generator = model.generator()?;
    // SAFETY: the caller's promise.
    let (identity, pose, workspace) =
        unsafe { (problem.identity.slice(), problem.pose.slice(), problem.workspace.slice()) };
    // SAFETY: the caller's promise.
    let (numbers, jtj, jtr) = unsafe { (problem.points.slice(), problem.jtj.slice(), problem.jtr.slice()) };
    normal_equations_req(generator.dim(), frame).check(workspace.len())?;
    let samples = [sample(numbers.first().ok_or(Error::Empty)?)];
    let weights = Weights { identity, pose };
    normal_equations(&generator, weights, samples.as_slice(), &Similarity::IDENTITY, frame, jtj, jtr, workspace)
}

/// A prior on its own: bounds, and its part of normal equations of any stride.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_prior(problem: Problem, stride: usize, first: usize) -> f32 {
    // SAFETY: the caller's promise.
    let Ok(model) = Model::open(unsafe { problem.bytes.slice() }) else { return 0.0 };
    // SAFETY: the caller's promise.
    let (weights, jtj, jtr) = unsafe { (problem.identity.slice(), problem.jtj.slice(), problem.jtr.slice()) };
    let prior = prior(problem.prior, &model, mode(problem.place), problem.factor);
    let energy = prior.add_to(weights, jtj, jtr, stride, first);
    prior.write_bounds(jtj, jtr);
    if prior.check(weights.len()).is_ok() { energy } else { 0.0 }
}

fn mode(identity: bool) -> Mode {
    if identity { Mode::Identity } else { Mode::Pose }
}

fn by_levels<'a, S: Storage<'a>>(problem: Problem) -> Result<f32, Error> {
    // SAFETY: the caller's promise.
    let model = Model::open(unsafe { problem.bytes.slice() })?;
    // SAFETY: the caller's promise.
    let numbers = unsafe { problem.points.slice() };
    // SAFETY: the caller's promise.
    let (identity, pose, workspace) =
        unsafe { (problem.identity.slice(), problem.pose.slice(), problem.workspace.slice()) };
    let generator = model.wavelet::<S>()?;
    let options = WaveletOptions {
        frame: frame(problem.frame),
        identity: model.spread(Mode::Identity).filter(|_| problem.place),
        pose: model.spread(Mode::Pose),
        kappa: problem.factor,
        omega: problem.factor,
        levels: 0..problem.prior as usize,
        passes: problem.max_iterations,
    };
    let mut samples = [sample(&[0.0; 8]); 40];
    for (sample_, numbers) in samples.iter_mut().zip(numbers) {
        *sample_ = sample(numbers);
    }
    let samples = samples.get(..numbers.len()).ok_or(Error::Empty)?;
    fit_wavelet_req(&generator, samples.len(), &options.levels).check(workspace.len())?;
    let mut placement = Similarity::IDENTITY;
    let report = fit_wavelet(&generator, samples, &options, identity, pose, &mut placement, workspace)?;
    Ok(report.rms + report.start_rms + report.reached as f32)
}

macro_rules! levels {
    ($($name:ident = $storage:ident;)*) => {$(
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $name(problem: Problem) -> i32 {
            status(by_levels::<$storage<'_>>(problem))
        }
    )*};
}

levels! {
    check_fit_wavelet_f32 = F32;
    check_fit_wavelet_f16 = F16;
    check_fit_wavelet_i8 = I8;
}

fn reported(result: Result<FitReport, Error>) -> i32 {
    match result {
        Ok(report) => (report.rms + report.energy) as i32,
        Err(error) => error.code() as i32,
    }
}
