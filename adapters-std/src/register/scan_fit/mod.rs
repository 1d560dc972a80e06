//! From a raw scan with landmarks to the weights and the placement of a model (ch. 12; `bolkart2015` for the loop of correspondences).
//!
//! A start from the landmarks (`start`), then rounds of "pair the points of the scan with the model, improve": the pairs are gated by
//! distance, normals and boundaries and weighed down by a robust loss that becomes stricter; the number of free identity weights grows. In the last
//! rounds a smooth displacement stands for what the model cannot express (`displacement`). The normal equations and the solver are the kernel's.

mod correspondences;
mod displacement;
mod held;
mod judgement;
mod named;
mod options;
mod problem;
#[cfg(test)]
mod properties;
#[cfg(test)]
mod samples;
mod sides;
mod start;
mod state;
mod suspects;
mod target;

pub use named::in_model_order;
pub use options::ScanFitOptions;
pub use start::expect_bilinear;

use habitus_core::fit::Frame;
use habitus_core::format::Model;
use habitus_core::generator::Generator;

use crate::Error;
use crate::mesh::Mesh;
use crate::register::rigid::Similarity;
use crate::spatial::frame_recovery::Unit;
use correspondences::{Agreement, Pairs};
use displacement::Displacement;
use held::Held;
use problem::{Belief, stepped, widened};
use sides::boundary_vertices;
use start::{Start, bilinear, landmark_samples, residuals, spread};
use state::Priors;
use target::Target;

/// The result of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanFit {
    /// Identity weights.
    pub identity: Vec<f32>,
    /// Pose (expression) weights.
    pub pose: Vec<f32>,
    /// From the model to the scan as stored, in its unit and frame.
    pub placement: Similarity,
    /// Unit of the scan.
    pub unit: Unit,
    /// Vertices of the fitted model in the unit and frame of the scan.
    pub vertices: Vec<[f64; 3]>,
    /// Distances of the landmarks from those of the fitted model, mm, for those that were marked.
    pub landmark_residuals: Vec<f64>,
    /// Their mean, mm, those beyond 15 mm counted as 15; about 2 mm on faces.
    pub landmark_residual: f64,
    /// Robust standard deviation of the distances along the normals, mm.
    pub sigma: f64,
    /// Median of these distances' magnitudes at the end, seen from the vertices of the model, mm: by it the result is judged.
    pub median: f64,
    /// Share of the model's area that has a partner in the scan.
    pub coverage: f64,
    /// Root mean square distance of the landmarks from those of the model that was fitted to them alone, mm.
    pub start_residual: f64,
    /// Squared Mahalanobis distance of the identity weights from the mean.
    pub identity_energy: f64,
    /// The same of the pose weights.
    pub pose_energy: f64,
    /// Points of the scan that took part.
    pub n_points: usize,
}

/// Fits `model` to `scan` (maximum a posteriori, point to plane); `landmarks` are in the order of the model and in the unit and frame of the scan, `None` where one was not marked.
///
/// Determinism: the same result for any number of threads.
///
/// # Errors
/// [`Error::Input`] for a scan that is not sound ([`Mesh::check`]), a model without landmarks, triangles or statistics, too few landmarks, a
/// unit that cannot be told, landmarks whose sides are exchanged or that no face of the model has, and a scan that is not of the model's kind.
pub fn fit_scan(
    model: &Model<'_>,
    scan: &Mesh,
    landmarks: &[Option<[f64; 3]>],
    options: &ScanFitOptions,
) -> Result<ScanFit, Error> {
    fit_scan_watched(model, scan, landmarks, options, &mut |_| {})
}

/// What a fit is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Unit, placement and weights from the landmarks.
    Start,
    /// Points and normals of the scan.
    Target,
    /// The model and its derivatives at the weights of a round.
    Model,
    /// Pairs of points of scan and model.
    Pairs,
    /// Normal equations and steps.
    Steps,
    /// Agreement of the result with the scan.
    Judgement,
}

/// As [`fit_scan`]; `watch` is told what begins.
///
/// # Errors
/// As [`fit_scan`].
pub fn fit_scan_watched(
    model: &Model<'_>,
    scan: &Mesh,
    landmarks: &[Option<[f64; 3]>],
    options: &ScanFitOptions,
    watch: &mut dyn FnMut(Stage),
) -> Result<ScanFit, Error> {
    watch(Stage::Start);
    let generator = bilinear(model)?;
    scan.check()?;
    let faces: Vec<[u32; 3]> = model.faces().map(|faces| faces.iter().collect()).unwrap_or_default();
    if faces.is_empty() {
        return Err(Error::input(
            "the model has no triangles, so it cannot be fitted to a scan; train it with --template",
        ));
    }
    let priors = Priors::of(model)?;
    let start = Start::new(model, &priors, landmarks, options.unit, options.landmark_sigma)?;
    watch(Stage::Target);
    let target = Target::new(scan, &start.region, options.cell, options.max_points, options.coherence)?;
    watch(Stage::Model);
    let n_vertices = generator.vertex_count();
    let model_boundary =
        boundary_vertices(&Mesh { positions: vec![[0.0; 3]; n_vertices], faces: faces.clone(), ..Mesh::default() });

    let mean = Held::new(&generator, &priors.mean_state(), 0)?.positions();
    let surface = Mesh { positions: mean, faces: faces.clone(), ..Mesh::default() };
    let smooth = if options.displacement > 0.0 {
        let remainder: Vec<f32> = model.remainder().map(|all| all.iter().collect()).unwrap_or_default();
        let components = remainder.chunks_exact(3 * n_vertices).map(<[f32]>::to_vec).collect();
        Displacement::new(&surface.positions, surface.area(), options.displacement, options.correlation, components)?
    } else {
        Displacement::none()
    };
    let none = Displacement::none();
    let mut state = start.state;
    let mut sigma = options.sigma;
    for round in options.rounds(generator.identity_dim()) {
        watch(Stage::Model);
        let smooth = if round.displaced { &smooth } else { &none };
        state.amplitudes.resize(smooth.dim(), 0.0);
        let held = Held::new(&generator, &state, round.identity_dim)?.displaced(smooth, &state.amplitudes, &faces);
        watch(Stage::Pairs);
        let gates = options.gates(&round);
        let landmark_sigma = spread(&residuals(&held, &start.landmarks, &state.placement)).max(options.landmark_sigma);
        let pairs = Pairs::new(&held, &faces, &state.placement, &target, &gates)?;
        sigma = pairs.sigma;
        let mut samples = pairs.samples;
        samples.extend(landmark_samples(&held, &start.landmarks, &state.placement, landmark_sigma));
        watch(Stage::Steps);
        let factors = [options.identity_prior, options.pose_prior];
        let belief = Belief { of_weights: &priors, factors, smooth: &smooth.precision };
        state = stepped(&held, &samples, belief, Frame::Rigid, &state)?;
    }
    watch(Stage::Judgement);
    state.amplitudes.clear();
    let held = Held::new(&generator, &state, 0)?;
    let gates = options.last_gates();
    let agreement = Agreement::new(&held, &faces, &model_boundary, &state.placement, &target, &gates);
    let landmark_residuals = residuals(&held, &start.landmarks, &state.placement);
    let identity_energy = priors.identity.energy(&state.identity);
    let pose_energy = priors.pose.energy(&state.pose);
    if options.refuse {
        let lengths =
            [("identity", identity_energy, state.identity.len()), ("expression", pose_energy, state.pose.len())];
        judgement::refuse_other_kinds(&agreement, &landmark_residuals, lengths)?;
    }
    let (inner, unit_mm, centre) = (widened(&state.placement), start.region.unit_mm, start.region.centre);
    let placement = Similarity {
        scale: inner.scale / unit_mm,
        rotation: inner.rotation,
        translation: std::array::from_fn(|axis| inner.translation[axis] / unit_mm + centre[axis]),
    };
    Ok(ScanFit {
        vertices: held.positions().into_iter().map(|p| placement.point(p)).collect(),
        identity: state.identity,
        pose: state.pose,
        placement,
        unit: start.unit,
        landmark_residual: judgement::robust_mean(&landmark_residuals),
        landmark_residuals,
        sigma,
        median: agreement.median,
        coverage: agreement.coverage,
        start_residual: start.residual,
        identity_energy,
        pose_energy,
        n_points: target.points.len(),
    })
}
