//! Normal equations, priors, fits.

use habitus_core::fit as core;
use habitus_core::fit::{FitOptions, FitReport, Frame, fit_points_req, normal_equations_req};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::{Generator, Weights};
use habitus_core::prior::Prior;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::{Limits, Status};

use super::Context;
use crate::backend::Backend;
use crate::memory::{array, integer, number};
use crate::result::{Problem, Tally};
use crate::samples::TextSamples;
use crate::text::{Case, decimal};

pub(super) fn normal_equations<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { backend, models, case, pieces, tally } = context;
    let (_, model) = super::wavelet::generator(pieces, case, models)?;
    let weights = Weights { identity: pieces.numbers(case, "identity")?, pose: pieces.numbers(case, "pose")? };
    let samples = TextSamples::new(case, pieces)?;
    let frame = frame(case)?;
    let m = model.dim() + frame.dim();
    let (jtj, jtr) = (pieces.zeros(m * m)?, pieces.zeros(m)?);
    let req = normal_equations_req(model.dim(), frame).and(model.state_req(true));
    let workspace = pieces.zeros(req.numbers())?;
    let place = placement(case, "placement")?;
    let energy = backend.normal_equations(&model, weights, &samples, &place, frame, jtj, jtr, workspace)?;
    tally.compare("energy", &[energy])?;
    tally.compare("jtr", jtr)?;
    tally.compare("jtj", jtj)
}

pub(super) fn prior<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { models, case, pieces, tally, .. } = context;
    let model = Model::open(pieces.model(case, models)?)?;
    let mode = if case.word("mode") == Some("identity") { Mode::Identity } else { Mode::Pose };
    let prior = prior_of(case, "prior", &model, mode)?;
    let weights: &[f32] = pieces.numbers(case, "weights")?;
    prior.check(weights.len())?;
    let (jtj, jtr) = (pieces.numbers(case, "jtj_before")?, pieces.numbers(case, "jtr_before")?);
    let (lower, upper) = (pieces.zeros(weights.len())?, pieces.zeros(weights.len())?);
    let first = integer(case, "first")? as usize;
    prior.write_bounds(lower, upper);
    let energy = prior.add_to(weights, jtj, jtr, jtr.len(), first);
    tally.compare("energy", &[energy])?;
    tally.compare::<f32>("jtj", jtj)?;
    tally.compare::<f32>("jtr", jtr)?;
    tally.compare("lower", lower)?;
    tally.compare("upper", upper)
}

pub(super) fn fit_points<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { backend, models, case, pieces, tally } = context;
    let (model, generator) = super::wavelet::generator(pieces, case, models)?;
    let samples = TextSamples::new(case, pieces)?;
    let options = options(case, &model)?;
    let (identity, pose) = (pieces.numbers(case, "identity")?, pieces.numbers(case, "pose")?);
    let mut place = placement(case, "placement")?;
    let req = fit_points_req(generator.identity_dim(), generator.pose_dim(), options.frame);
    let req = req.and(generator.state_req(true));
    let workspace = pieces.zeros(req.numbers())?;
    let report = backend.fit_points(&generator, &samples, &options, identity, pose, &mut place, workspace)?;
    compare_fit(tally, identity, pose, &place, &report)
}

/// Landmarks of a case; the model of the vectors has at most so many.
const MOST_LANDMARKS: usize = 16;

pub(super) fn fit_landmarks<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { models, case, pieces, tally, .. } = context;
    let (model, generator) = super::wavelet::generator(pieces, case, models)?;
    let options = options(case, &model)?;
    let mut targets = [None; MOST_LANDMARKS];
    let kinds = pieces.integers(case, "kinds")?;
    let positions = pieces.numbers(case, "targets")?.as_chunks().0;
    for (target, (&kind, &position)) in targets.iter_mut().zip(kinds.iter().zip(positions)) {
        *target = (kind > 0).then_some(position);
    }
    let targets = targets.get(..kinds.len()).ok_or(Problem::Memory)?;
    let (identity, pose) = (pieces.numbers(case, "identity")?, pieces.numbers(case, "pose")?);
    let mut place = placement(case, "placement")?;
    let req = fit_points_req(generator.identity_dim(), generator.pose_dim(), options.frame);
    let req = req.and(generator.state_req(true));
    let workspace = pieces.zeros(req.numbers())?;
    let report = core::fit_landmarks(&model, &generator, targets, &options, identity, pose, &mut place, workspace)?;
    compare_fit(tally, identity, pose, &place, &report)
}

fn compare_fit(
    tally: &mut Tally<'_>,
    identity: &[f32],
    pose: &[f32],
    placement: &Similarity<f32>,
    report: &FitReport,
) -> Result<(), Problem> {
    let status = status_number(report.status);
    tally.compare_integers("iterations_status", &[report.iterations, status])?;
    tally.compare("rms_energy_start", &[report.rms, report.energy, report.start_energy])?;
    tally.compare("identity_fitted", identity)?;
    tally.compare("pose_fitted", pose)?;
    tally.compare("placement_fitted", &numbers_of_placement(placement))
}

pub(super) fn status_number(status: Status) -> u32 {
    match status {
        Status::Converged => 0,
        Status::IterationLimit => 1,
        Status::Stalled => 2,
    }
}

pub(super) fn frame(case: &Case<'_>) -> Result<Frame, Problem> {
    match case.word("frame") {
        Some("fixed") => Ok(Frame::Fixed),
        Some("rigid") => Ok(Frame::Rigid),
        Some("similarity") => Ok(Frame::Similarity),
        _ => Err(Problem::Text("frame")),
    }
}

/// `KEY none`, `KEY gaussian FACTOR`, `KEY box FACTOR`.
fn prior_of<'a>(case: &Case<'_>, key: &'static str, model: &Model<'a>, mode: Mode) -> Result<Prior<'a>, Problem> {
    let mut words = case.field(key).ok_or(Problem::Text(key))?;
    let kind = words.next();
    if kind == Some("none") {
        return Ok(Prior::None);
    }
    let gaussian = model.gaussian(mode).ok_or(Problem::Text("model"))?;
    let factor = words.next().and_then(|word| crate::text::hexadecimal(word, 8)).ok_or(Problem::Text(key))?;
    let factor = f32::from_bits(factor as u32);
    match kind {
        Some("gaussian") => Ok(Prior::Gaussian(gaussian, factor)),
        Some("box") => Ok(Prior::Box(gaussian.spread(), factor)),
        _ => Err(Problem::Text(key)),
    }
}

fn options<'a>(case: &Case<'_>, model: &Model<'a>) -> Result<FitOptions<'a>, Problem> {
    Ok(FitOptions {
        frame: frame(case)?,
        place: integer(case, "place")? > 0,
        identity_prior: prior_of(case, "identity_prior", model, Mode::Identity)?,
        pose_prior: prior_of(case, "pose_prior", model, Mode::Pose)?,
        noise: number(case, "noise")?,
        limits: limits(case)?,
    })
}

/// Limits of the solver from the fields `max_iterations`, `relative_decrease`, `damping`.
pub(super) fn limits<R: crate::memory::Number>(case: &Case<'_>) -> Result<Limits<R>, Problem> {
    Ok(Limits {
        max_iterations: case.word("max_iterations").and_then(decimal).ok_or(Problem::Text("max_iterations"))?,
        relative_decrease: number(case, "relative_decrease")?,
        damping: number(case, "damping")?,
    })
}

/// Scale, rotation by rows, translation.
pub(super) fn placement<R: crate::memory::Number>(
    case: &Case<'_>,
    key: &'static str,
) -> Result<Similarity<R>, Problem> {
    let [scale, a, b, c, d, e, f, g, h, i, x, y, z] = array(case, key)?;
    Ok(Similarity { scale, rotation: [[a, b, c], [d, e, f], [g, h, i]], translation: [x, y, z] })
}

pub(super) fn numbers_of_placement<R: crate::memory::Number>(placement: &Similarity<R>) -> [R; 13] {
    let [[a, b, c], [d, e, f], [g, h, i]] = placement.rotation;
    let [x, y, z] = placement.translation;
    [placement.scale, a, b, c, d, e, f, g, h, i, x, y, z]
}
