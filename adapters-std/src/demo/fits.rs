//! Fits of the model to unseen faces, and their errors: to the raw scan, and, for comparison, to landmarks alone and to all true points.

use habitus_core::fit::{FitOptions, Frame, LandmarkSamples, Sample, SurfacePoint, fit_points_req};
use habitus_core::format::{Mode, Model};
use habitus_core::prior::Prior;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::Limits;

use super::Clock;
use super::scans::{LANDMARK_NOISE, UnseenScan};
use crate::Error;
use crate::evaluate::fit_points;
use crate::generate::{mesh, positions, weights_from_deviations};
use crate::measure::vertex_error::length;
use crate::mesh::Mesh;
use crate::register::rigid::alignment;
use crate::register::scan_fit::{ScanFitOptions, fit_scan};

/// A shape that was found, in the frame of the scan, with the distance of each vertex from the truth, mm.
pub(super) struct Found {
    pub mesh: Mesh,
    pub errors: Vec<f64>,
}

impl Found {
    fn of(mesh: Mesh, truth: &Mesh) -> Self {
        let pairs = mesh.positions.iter().zip(&truth.positions);
        let errors = pairs.map(|(a, b)| length([0, 1, 2].map(|axis| a[axis] - b[axis]))).collect();
        Found { mesh, errors }
    }
}

/// What was found of one unseen face.
pub(super) struct FaceFit {
    /// The mean face, placed on the truth by least squares over all vertices: what a fit must beat.
    pub mean_face: Found,
    /// From all landmarks alone.
    pub by_landmarks: Found,
    /// From all true points with their correspondence: what the model can express.
    pub by_points: Found,
    /// From the raw scan and the landmarks that are on it.
    pub by_scan: Found,
}

impl FaceFit {
    pub fn all(model: &Model<'_>, scans: &[UnseenScan], clock: &mut Clock<'_>) -> Result<Vec<Self>, Error> {
        clock.stage("fitting the scans", scans.len());
        let fit = |(k, scan)| {
            let fit = FaceFit::of(model, scan);
            clock.done(k + 1);
            fit
        };
        scans.iter().enumerate().map(fit).collect()
    }

    fn of(model: &Model<'_>, scan: &UnseenScan) -> Result<Self, Error> {
        let marks = scan.landmarks.iter().zip(&scan.marked);
        let landmarks: Vec<Option<[f64; 3]>> = marks.map(|(&point, &marked)| marked.then_some(point)).collect();
        // What else a scan could be is known here, and small populations give models that ask for large weights.
        let options = ScanFitOptions { refuse: false, ..ScanFitOptions::default() };
        let fit = fit_scan(model, &scan.scan.mesh, &landmarks, &options)?;
        let by_scan = Mesh { positions: fit.vertices, ..mesh(model, &[]) };
        let [mean_face, by_landmarks, by_points] = by_kernel(model, scan)?;
        let found = |mesh| Found::of(mesh, &scan.truth);
        Ok(FaceFit {
            mean_face: found(mean_face),
            by_landmarks: found(by_landmarks),
            by_points: found(by_points),
            by_scan: found(by_scan),
        })
    }
}

/// The mean face where it fits best, and the kernel's fits to landmarks and then to all points.
fn by_kernel(model: &Model<'_>, scan: &UnseenScan) -> Result<[Mesh; 3], Error> {
    let kernel = |error| Error::Kernel { what: "the demonstration's fit".into(), error };
    let truth = &scan.truth.positions;
    let single = |point: &[f64; 3]| point.map(|x| x as f32);
    let targets: Vec<Option<[f32; 3]>> = scan.landmarks.iter().map(|point| Some(single(point))).collect();
    let sample = |(point, vertex): (&[f64; 3], u32)| Sample {
        point: SurfacePoint::vertex(vertex),
        target: single(point),
        normal: None,
        weight: 1.0,
    };
    let samples: Vec<Sample> = truth.iter().zip(0..).map(sample).collect();
    let generator = model.bilinear().map_err(kernel)?;
    let (d_id, d_pose) = (model.header().identity_dim as usize, model.header().pose_dim as usize);
    let gaussian = |mode| match model.gaussian(mode) {
        Some(gaussian) => Prior::Gaussian(gaussian, 1.0),
        None => Prior::None,
    };
    let options = FitOptions {
        frame: Frame::Rigid,
        place: true,
        identity_prior: gaussian(Mode::Identity),
        pose_prior: gaussian(Mode::Pose),
        noise: LANDMARK_NOISE as f32,
        limits: Limits::default(),
    };
    let mut workspace = vec![0.0; fit_points_req(d_id, d_pose, Frame::Rigid).numbers()];
    let mut identity = weights_from_deviations(model, Mode::Identity, &[])?;
    let mut pose = weights_from_deviations(model, Mode::Pose, &[])?;
    let mut placement = Similarity::IDENTITY;
    let mut mean_face = mesh(model, &positions(model, &identity, &pose)?);
    let motion = alignment(mean_face.positions.as_flattened(), truth.as_flattened(), None, false)?;
    mean_face.positions.iter_mut().for_each(|point| *point = motion.point(*point));

    let landmarks = LandmarkSamples::new(model, &targets).map_err(kernel)?;
    fit_points(&generator, &landmarks, &options, &mut identity, &mut pose, &mut placement, &mut workspace)
        .map_err(kernel)?;
    let by_landmarks = placed_mesh(model, &positions(model, &identity, &pose)?, &placement);
    // The points continue from the landmarks' result, with a noise that lets the data speak.
    let options = FitOptions { place: false, noise: 0.5, ..options };
    fit_points(&generator, &samples[..], &options, &mut identity, &mut pose, &mut placement, &mut workspace)
        .map_err(kernel)?;
    let by_points = placed_mesh(model, &positions(model, &identity, &pose)?, &placement);
    Ok([mean_face, by_landmarks, by_points])
}

/// The model's mesh in the frame of the scan.
fn placed_mesh(model: &Model<'_>, vertices: &[f32], placement: &Similarity<f32>) -> Mesh {
    let placed: Vec<f32> = vertices.as_chunks::<3>().0.iter().flat_map(|&point| placement.applied(point)).collect();
    mesh(model, &placed)
}
