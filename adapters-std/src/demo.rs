//! The demonstration that needs nothing: a procedural population, a model of it, and fits of people that it has not seen.

use std::path::Path;

use habitus_core::fit::{FitOptions, Frame, LandmarkSamples, Sample, SurfacePoint, fit_points_req};
use habitus_core::format::{Mode, Model};
use habitus_core::prior::Prior;
use habitus_core::rotation::axis_angle::rotation_matrix;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::Limits;
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal};
use serde::Serialize;

use crate::Error;
use crate::evaluate::fit_points;
use crate::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use crate::face::multilinear::MultilinearModel;
use crate::face::tensor::ShapeTensor;
use crate::generate::{mesh, positions, weights_from_deviations, weights_of_expression};
use crate::io::model::{ModelSource, hab, opened};
use crate::io::{atomic, mesh as mesh_files};
use crate::measure::vertex_error::{MeanError, mean_vertex_distances};
use crate::mesh::Mesh;
use crate::register::gpa::{GpaOptions, align_in_place};
use crate::register::rigid::alignment;
use crate::report::View;
use crate::report::portrait::LINING;
use crate::report::sheet::contact_sheet;
use crate::synth::face_grid::LANDMARKS;
use crate::synth::face_motion::EXPRESSIONS;
use crate::synth::faces::{FaceOptions, FacePopulation};

/// How large the demonstration is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DemoOptions {
    /// People to learn from.
    pub identities: usize,
    /// People to fit, drawn from another seed.
    pub unseen: usize,
    /// Seed.
    pub seed: u64,
}

impl Default for DemoOptions {
    fn default() -> Self {
        DemoOptions { identities: 100, unseen: 8, seed: 1 }
    }
}

/// What the demonstration measured. All errors are mean distances between corresponding vertices, mm, against the known truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DemoFigures {
    /// The population is procedural: no person was scanned.
    pub procedural: bool,
    /// People learned from.
    pub identities: usize,
    /// Expressions of each.
    pub expressions: usize,
    /// Vertices of a face.
    pub vertices: usize,
    /// Identity weights of the model.
    pub identity_dim: usize,
    /// Expression weights of the model.
    pub expression_dim: usize,
    /// Bytes of the model file.
    pub model_bytes: usize,
    /// Training faces reproduced by the model.
    pub training_error_mm: f64,
    /// Unseen faces against the mean face, placed on them by least squares over all vertices: what a fit must beat.
    pub unseen_mean_face_error_mm: f64,
    /// Unseen faces fitted to 13 landmarks with 1 mm of noise, in an unknown placement.
    pub unseen_landmark_fit_error_mm: f64,
    /// Unseen faces fitted to all their vertices, in an unknown placement.
    pub unseen_point_fit_error_mm: f64,
    /// Seconds of each stage.
    pub seconds: Vec<(String, f64)>,
}

/// Standard deviation of the demonstration's landmarks per axis, mm.
const LANDMARK_NOISE: f32 = 1.0;

/// Runs the demonstration and leaves everything in `folder`. `progress` is told the name of each stage as it starts.
///
/// Errors: [`Error::Write`].
pub fn run(options: &DemoOptions, folder: &Path, progress: &mut dyn FnMut(&str)) -> Result<DemoFigures, Error> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.to_owned(), source })?;
    let mut clock = Clock::new(progress);
    clock.stage("population");
    let drawn = FacePopulation::of(&FaceOptions { identities: options.identities, seed: options.seed, level: 4 })?;
    let unseen =
        FacePopulation::of(&FaceOptions { identities: options.unseen, seed: options.seed.wrapping_add(1), level: 4 })?;
    clock.stage("training");
    let (trained, training_error) = trained(&drawn)?;
    let bytes = hab::bytes(&source(&trained, &drawn, options))?;
    atomic::write(folder.join("face.hab"), &bytes)?;
    let model = opened(&bytes, &folder.join("face.hab"))?;
    clock.stage("fitting");
    let fits = Fits::of(&model, &unseen, options.seed)?;
    clock.stage("pictures and meshes");
    write_meshes(&model, &fits, folder)?;
    write_picture(&model, &fits, &folder.join("faces.png"))?;
    let seconds = clock.end();
    let figures = DemoFigures {
        procedural: true,
        identities: options.identities,
        expressions: EXPRESSIONS.len(),
        vertices: trained.n_vertices(),
        identity_dim: trained.identity.dim,
        expression_dim: trained.expression.dim,
        model_bytes: bytes.len(),
        training_error_mm: training_error,
        unseen_mean_face_error_mm: mean(&fits.all, |fit| fit.mean_face_error),
        unseen_landmark_fit_error_mm: mean(&fits.all, |fit| fit.landmark_error),
        unseen_point_fit_error_mm: mean(&fits.all, |fit| fit.point_error),
        seconds,
    };
    let text = serde_json::to_string_pretty(&figures).map_err(|error| Error::Internal(error.to_string()))?;
    atomic::write(folder.join("figures.json"), text.as_bytes())?;
    Ok(figures)
}

/// Seconds of the stages.
struct Clock<'a> {
    progress: &'a mut dyn FnMut(&str),
    stages: Vec<(String, f64)>,
    started: std::time::Instant,
}

impl<'a> Clock<'a> {
    fn new(progress: &'a mut dyn FnMut(&str)) -> Self {
        Clock { progress, stages: Vec::new(), started: std::time::Instant::now() }
    }

    fn stage(&mut self, name: &str) {
        self.close();
        (self.progress)(name);
        self.stages.push((name.to_owned(), 0.0));
    }

    fn close(&mut self) {
        if let Some(last) = self.stages.last_mut() {
            last.1 = self.started.elapsed().as_secs_f64();
        }
        self.started = std::time::Instant::now();
    }

    fn end(mut self) -> Vec<(String, f64)> {
        self.close();
        self.stages
    }
}

fn trained(population: &FacePopulation) -> Result<(MultilinearModel, f64), Error> {
    let (d2, d3, n) = (population.factors.len(), EXPRESSIONS.len(), population.grid.n_vertices());
    let mut shapes = ShapeTensor::from_array(d2, d3, n, &population.tensor)?;
    align_in_place(shapes.data_mut(), 3 * n, &GpaOptions::default())?;
    let options = HosvdOptions {
        identity: ModeSize::Dimension(30.min(d2)),
        expression: ModeSize::Dimension(7.min(d3)),
        hooi: None,
    };
    let model = hosvd(&shapes, &options)?.model;
    let errors = mean_vertex_distances(shapes.data(), &model.training_shapes()?, 3 * n);
    let error = MeanError::of(&errors).map_or(0.0, |error| error.mean);
    Ok((model, error))
}

fn source<'a>(trained: &'a MultilinearModel, population: &FacePopulation, options: &DemoOptions) -> ModelSource<'a> {
    let mut source = ModelSource::of_multilinear(trained);
    source.faces = population.faces.clone();
    source.landmarks = population.landmarks.to_vec();
    source.landmark_names = LANDMARKS.map(str::to_owned).to_vec();
    source.mirror = population.mirror.clone();
    source.pose_names = EXPRESSIONS.map(str::to_owned).to_vec();
    source.provenance = format!(
        "habitus {} demo; a procedural population of {} people (seed {}): no person was scanned",
        env!("CARGO_PKG_VERSION"),
        options.identities,
        options.seed
    );
    source
}

/// One unseen face and what was found of it, in the frame of the scan.
struct Fit {
    expression: usize,
    truth: Mesh,
    by_landmarks: Mesh,
    by_points: Mesh,
    mean_face_error: f64,
    landmark_error: f64,
    point_error: f64,
}

struct Fits {
    all: Vec<Fit>,
}

impl Fits {
    /// Every unseen person, each with another expression, in another placement.
    fn of(model: &Model<'_>, unseen: &FacePopulation, seed: u64) -> Result<Self, Error> {
        let mut stream = ChaCha12Rng::seed_from_u64(seed.wrapping_add(2));
        let all = (0..unseen.factors.len())
            .map(|person| Fit::of(model, unseen, person, person % EXPRESSIONS.len(), &mut stream));
        Ok(Fits { all: all.collect::<Result<_, Error>>()? })
    }
}

impl Fit {
    fn of(
        model: &Model<'_>,
        unseen: &FacePopulation,
        person: usize,
        expression: usize,
        stream: &mut ChaCha12Rng,
    ) -> Result<Self, Error> {
        let kernel = |error| Error::Kernel { what: "the demonstration's fit".into(), error };
        let mut truth =
            unseen.mesh(person, expression).ok_or_else(|| Error::Internal("no such procedural face".into()))?;
        let turn = Normal::new(0.0, 0.4).map_err(|error| Error::Internal(error.to_string()))?;
        let noise = Normal::new(0.0, f64::from(LANDMARK_NOISE)).map_err(|error| Error::Internal(error.to_string()))?;
        let placed = Similarity {
            scale: 1.0,
            rotation: rotation_matrix(std::array::from_fn(|_| turn.sample(stream))),
            translation: [40.0, -25.0, -600.0],
        };
        truth.positions.iter_mut().for_each(|point| *point = placed.applied(*point));
        let targets: Vec<Option<[f32; 3]>> = unseen
            .landmarks
            .iter()
            .map(|&vertex| Some(truth.positions[vertex as usize].map(|value| (value + noise.sample(stream)) as f32)))
            .collect();
        let samples: Vec<Sample> = truth
            .positions
            .iter()
            .enumerate()
            .map(|(vertex, point)| Sample {
                point: SurfacePoint::vertex(vertex as u32),
                target: point.map(|value| value as f32),
                normal: None,
                weight: 1.0,
            })
            .collect();

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
            noise: LANDMARK_NOISE,
            limits: Limits::default(),
        };
        let mut workspace = vec![0.0; fit_points_req(d_id, d_pose, Frame::Rigid).numbers()];
        let mut identity = weights_from_deviations(model, Mode::Identity, &[])?;
        let mut pose = weights_from_deviations(model, Mode::Pose, &[])?;
        let mut placement = Similarity::IDENTITY;
        let start = positions(model, &identity, &pose)?;
        let landmarks = LandmarkSamples::new(model, &targets).map_err(kernel)?;
        fit_points(&generator, &landmarks, &options, &mut identity, &mut pose, &mut placement, &mut workspace)
            .map_err(kernel)?;
        let mut mean_face = mesh(model, &start);
        let motion = alignment(mean_face.positions.as_flattened(), truth.positions.as_flattened(), None, false)?;
        mean_face.positions.iter_mut().for_each(|point| *point = motion.point(*point));
        let by_landmarks = placed_mesh(model, &positions(model, &identity, &pose)?, &placement);
        // The points continue from the landmarks' result, with a noise that lets the data speak.
        let options = FitOptions { place: false, noise: 0.5, ..options };
        fit_points(&generator, &samples[..], &options, &mut identity, &mut pose, &mut placement, &mut workspace)
            .map_err(kernel)?;
        let by_points = placed_mesh(model, &positions(model, &identity, &pose)?, &placement);
        let error = |found: &Mesh| {
            mean_vertex_distances(
                truth.positions.as_flattened(),
                found.positions.as_flattened(),
                3 * truth.positions.len(),
            )[0]
        };
        let (mean_face_error, landmark_error, point_error) =
            (error(&mean_face), error(&by_landmarks), error(&by_points));
        Ok(Fit { expression, mean_face_error, landmark_error, point_error, truth, by_landmarks, by_points })
    }
}

/// The model's mesh in the frame of the scan.
fn placed_mesh(model: &Model<'_>, vertices: &[f32], placement: &Similarity<f32>) -> Mesh {
    let placed: Vec<f32> = vertices.as_chunks::<3>().0.iter().flat_map(|&point| placement.applied(point)).collect();
    mesh(model, &placed)
}

fn mean(fits: &[Fit], value: impl Fn(&Fit) -> f64) -> f64 {
    fits.iter().map(value).sum::<f64>() / fits.len().max(1) as f64
}

/// The mean face, every expression of it, and each fit beside its truth.
fn write_meshes(model: &Model<'_>, fits: &Fits, folder: &Path) -> Result<(), Error> {
    let identity = weights_from_deviations(model, Mode::Identity, &[])?;
    for name in EXPRESSIONS {
        let mut face = mesh(model, &positions(model, &identity, &weights_of_expression(model, name)?)?);
        face.normals = face.vertex_normals();
        mesh_files::write(folder.join(format!("mean_{name}.glb")), &face)?;
    }
    for (index, fit) in fits.all.iter().enumerate() {
        let name = EXPRESSIONS[fit.expression];
        mesh_files::write(folder.join(format!("unseen_{index}_{name}_truth.ply")), &fit.truth)?;
        mesh_files::write(folder.join(format!("unseen_{index}_{name}_landmark_fit.ply")), &fit.by_landmarks)?;
        mesh_files::write(folder.join(format!("unseen_{index}_{name}_point_fit.ply")), &fit.by_points)?;
    }
    Ok(())
}

/// One picture: the mean face with every expression; unseen faces; their fits to landmarks and to points.
fn write_picture(model: &Model<'_>, fits: &Fits, path: &Path) -> Result<(), Error> {
    let identity = weights_from_deviations(model, Mode::Identity, &[])?;
    let upright = |mesh: &Mesh, truth: &Mesh, neutral: &Mesh| -> Result<Mesh, Error> {
        // Shown in the model's frame: the truth's rigid motion onto the mean face is taken off.
        let motion = alignment(truth.positions.as_flattened(), neutral.positions.as_flattened(), None, false)?;
        let mut shown = Mesh { colours: Vec::new(), ..mesh.clone() };
        shown.positions.iter_mut().for_each(|point| *point = motion.point(*point));
        Ok(shown)
    };
    let mean_row: Vec<Mesh> = EXPRESSIONS
        .iter()
        .map(|name| Ok(mesh(model, &positions(model, &identity, &weights_of_expression(model, name)?)?)))
        .collect::<Result<_, Error>>()?;
    let rows: Vec<Vec<Mesh>> = [
        fits.all.iter().map(|fit| upright(&fit.truth, &fit.truth, &mean_row[0])).collect::<Result<_, Error>>()?,
        fits.all
            .iter()
            .map(|fit| upright(&fit.by_landmarks, &fit.truth, &mean_row[0]))
            .collect::<Result<_, Error>>()?,
        fits.all.iter().map(|fit| upright(&fit.by_points, &fit.truth, &mean_row[0])).collect::<Result<_, Error>>()?,
    ]
    .into();
    let all: Vec<Vec<Mesh>> = std::iter::once(mean_row.clone()).chain(rows).collect();
    contact_sheet(&all, &[View { yaw: 0.32, ..View::THREE_QUARTER }], [220, 280], Some(LINING)).write_png(path)
}
