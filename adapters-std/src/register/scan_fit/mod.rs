//! From a raw scan with landmarks to the weights and the placement of a model (ch. 12; `bolkart2015` for the loop of correspondences).
//!
//! [`start`](self) from the landmarks, then rounds of "pair the model with the scan both ways, improve": the pairs are gated by distance,
//! normals and boundaries and weighed down by a robust loss that becomes stricter; the number of free identity weights grows. All
//! numerical work is the kernel's: its normal equations, its Levenberg-Marquardt, its priors.

mod correspondences;
mod held;
mod options;
mod problem;
mod start;
mod state;
mod target;

pub use options::ScanFitOptions;

use habitus_core::fit::Frame;
use habitus_core::format::Model;
use habitus_core::generator::Generator;

use crate::Error;
use crate::mesh::Mesh;
use crate::register::rigid::Similarity;
use crate::spatial::frame_recovery::Unit;
use correspondences::{Gates, Pairs};
use held::Held;
use problem::{improved, widened};
use start::{Start, bilinear, landmark_samples, residuals, rms};
use state::Priors;
use target::{Target, boundary_vertices};

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
    /// Robust standard deviation of the distances along the normals, mm.
    pub sigma: f64,
    /// Median of these distances' magnitudes, mm.
    pub median: f64,
    /// Share of the model's area that has a partner in the scan.
    pub coverage: f64,
    /// Points of the scan that took part.
    pub n_points: usize,
}

/// Fits `model` to `scan`; `landmarks` are in the order of the model and in the unit and frame of the scan, `None` where one was not marked.
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
    scan.check()?;
    let faces: Vec<[u32; 3]> = model.faces().map(|faces| faces.iter().collect()).unwrap_or_default();
    if faces.is_empty() {
        return Err(Error::input("the model has no triangles, so it cannot be fitted to a scan; train it with --template"));
    }
    let priors = Priors::of(model)?;
    let generator = bilinear(model)?;
    let start = Start::new(model, &priors, landmarks, options.unit, options.landmark_sigma)?;
    let target = Target::new(scan, &start.region, options.cell, options.max_points)?;
    let n_vertices = generator.vertex_count();
    let model_boundary =
        boundary_vertices(&Mesh { positions: vec![[0.0; 3]; n_vertices], faces: faces.clone(), ..Mesh::default() });

    let mut state = start.state;
    let mut last = None;
    for round in options.rounds(generator.identity_dim()) {
        let held = Held::new(&generator, &state, round.identity_dim)?;
        let gates = Gates {
            distance: round.distance,
            cosine: options.max_angle.to_radians().cos(),
            robust: round.robust,
            sigma: [options.sigma, round.max_sigma],
            independent_area: options.independent_area,
            scan_share: options.scan_share,
        };
        let pairs = Pairs::new(&held, &faces, &model_boundary, &state.placement, &target, &gates)?;
        let mut samples = pairs.samples;
        samples.extend(landmark_samples(&held, &start.landmarks, &state.placement, options.landmark_sigma));
        state = improved(&held, &samples, &priors, options.prior_factor, Frame::Rigid, &state, 3)?;
        last = Some((pairs.sigma, pairs.median, pairs.coverage));
    }
    let (sigma, median, coverage) = last.ok_or_else(|| Error::input("a fit of no rounds: give at least one"))?;
    let held = Held::new(&generator, &state, 0)?;
    let landmark_residuals = residuals(&held, &start.landmarks, &state.placement);
    let _ = rms;
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
        landmark_residuals,
        sigma,
        median,
        coverage,
        n_points: target.points.len(),
    })
}
