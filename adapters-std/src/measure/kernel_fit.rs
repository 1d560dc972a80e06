//! How well a model file describes unseen faces, fitted through the kernel as a device would do it.

use habitus_core::fit::{FitOptions, Frame, Sample, SurfacePoint, fit_points_req};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::{Generator, Weights};
use habitus_core::prior::Prior;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::Limits;
use rayon::prelude::*;

use crate::Error;
use crate::evaluate::fit_points;
use crate::face::tensor::ShapeTensor;
use crate::measure::vertex_error::{MeanError, mean_vertex_distances};

/// Iterations that every start makes before the starts are compared.
const SCREENING: u32 = 3;
/// Faces that are fitted between two calls of the progress function.
const BATCH: usize = 8;

/// Mean vertex distance, mm, between unseen faces and the kernel's least-squares fits of them: correspondences known, no prior, `f32`.
///
/// With `align` each face's placement is sought too (rigid). Starts are the mean weights and those of every training expression; the best after
/// three iterations is followed. `progress` is told how many of how many faces are done.
///
/// Errors: another topology than the model's, a model without the statistics of its weights.
pub fn unseen_error_through_kernel(
    model: &Model<'_>,
    unseen: &ShapeTensor,
    align: bool,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<MeanError, Error> {
    let n = model.header().n_vertices as usize;
    if unseen.n_vertices() != n {
        return Err(Error::input(format!(
            "the test shapes have {} vertices, the model {n}; give shapes in the model's topology",
            unseen.n_vertices()
        )));
    }
    let starts = starts(model)?;
    let kernel = |error| Error::Kernel { what: "unseen faces cannot be fitted".into(), error };
    // The kernels of one storage each: `f32` is not to pay for the others.
    let fitted = |shape: &[f64]| match model.generator().map_err(kernel)? {
        AnyGenerator::BilinearF16(generator) => fitted_error(&generator, &starts, shape, align),
        AnyGenerator::BilinearI8(generator) => fitted_error(&generator, &starts, shape, align),
        _ => fitted_error(&model.bilinear().map_err(kernel)?, &starts, shape, align),
    };
    let mut errors = Vec::with_capacity(unseen.n_shapes());
    for batch in unseen.data().chunks(BATCH * unseen.shape_len()) {
        progress(errors.len(), unseen.n_shapes());
        let found: Vec<Result<f64, Error>> = batch.par_chunks_exact(unseen.shape_len()).map(fitted).collect();
        for error in found {
            errors.push(error?);
        }
    }
    progress(errors.len(), unseen.n_shapes());
    MeanError::of(&errors).ok_or_else(|| Error::Internal("no test shapes".into()))
}

/// The mean identity weights, and the pose weights to start from.
struct Starts {
    identity: Vec<f32>,
    poses: Vec<Vec<f32>>,
}

fn starts(model: &Model<'_>) -> Result<Starts, Error> {
    let mean = |mode| {
        let gaussian = model.gaussian(mode);
        gaussian.map(|gaussian| gaussian.mean.iter().collect::<Vec<f32>>()).ok_or_else(|| {
            Error::input("the model does not say how its weights are distributed; train it with this program")
        })
    };
    let mut poses = vec![mean(Mode::Pose)?];
    if let Some(rows) = model.pose_starts() {
        let all: Vec<f32> = rows.iter().collect();
        poses.extend(all.chunks_exact(model.header().pose_dim as usize).map(<[f32]>::to_vec));
    }
    Ok(Starts { identity: mean(Mode::Identity)?, poses })
}

fn fitted_error<G: Generator>(generator: &G, starts: &Starts, shape: &[f64], align: bool) -> Result<f64, Error> {
    let kernel = |error| Error::Kernel { what: "an unseen face cannot be fitted".into(), error };
    let samples: Vec<Sample> = shape
        .as_chunks::<3>()
        .0
        .iter()
        .enumerate()
        .map(|(vertex, point)| Sample {
            point: SurfacePoint::vertex(vertex as u32),
            target: point.map(|value| value as f32),
            normal: None,
            weight: 1.0,
        })
        .collect();
    let frame = if align { Frame::Rigid } else { Frame::Fixed };
    let (d_id, d_pose) = (generator.identity_dim(), generator.pose_dim());
    let mut workspace = vec![0.0; fit_points_req(d_id, d_pose, frame).numbers()];
    let mut run = |mut fit: Found, place: bool, max_iterations: u32| -> Result<Found, Error> {
        let options = FitOptions {
            frame,
            place,
            identity_prior: Prior::None,
            pose_prior: Prior::None,
            noise: 1.0,
            limits: Limits { max_iterations, ..Limits::default() },
        };
        let Found { identity, pose, placement, .. } = &mut fit;
        let report = fit_points(generator, &samples[..], &options, identity, pose, placement, &mut workspace);
        fit.energy = report.map_err(kernel)?.energy;
        Ok(fit)
    };
    let mut best: Option<Found> = None;
    for pose in &starts.poses {
        let start = Found {
            identity: starts.identity.clone(),
            pose: pose.clone(),
            placement: Similarity::IDENTITY,
            energy: f32::MAX,
        };
        let found = run(start, align, SCREENING)?;
        if best.as_ref().is_none_or(|best| found.energy < best.energy) {
            best = Some(found);
        }
    }
    let best = best.ok_or_else(|| Error::Internal("no start".into()))?;
    let best = run(best, false, 60)?;
    let mut positions = vec![0.0; shape.len()];
    let weights = Weights { identity: &best.identity, pose: &best.pose };
    generator.evaluate(weights, 0..generator.vertex_count(), &mut positions).map_err(kernel)?;
    let placed: Vec<f64> =
        positions.as_chunks::<3>().0.iter().flat_map(|&point| best.placement.applied(point)).map(f64::from).collect();
    Ok(mean_vertex_distances(shape, &placed, shape.len())[0])
}

struct Found {
    identity: Vec<f32>,
    pose: Vec<f32>,
    placement: Similarity<f32>,
    energy: f32,
}
