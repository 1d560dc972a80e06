//! What the tests of this folder share: a model of a small procedural population, and scans of its faces.

use std::sync::OnceLock;

use habitus_core::format::{Mode, Model};

use super::held::Held;
use super::problem::widened;
use super::start::bilinear;
use super::state::{Prior, Priors, State};
use super::target::{Region, Target};
use crate::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use crate::face::tensor::ShapeTensor;
use crate::generate::{positions, weights_from_deviations};
use crate::io::model::{ModelSource, hab};
use crate::mesh::Mesh;
use crate::synth::face_grid::LANDMARKS;
use crate::synth::faces::{FaceOptions, FacePopulation};

/// A model with 4 identity weights and 3 expression weights, 1617 vertices, triangles and the thirteen landmarks.
pub fn model() -> Model<'static> {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    let bytes = BYTES.get_or_init(|| {
        let options = FaceOptions { identities: 6, seed: 3, level: 3 };
        let population = FacePopulation::of(&options).expect("a population");
        let [people, expressions, n, _] = population.extents();
        let data = population.tensor.iter().map(|&x| f64::from(x)).collect();
        let shapes = ShapeTensor::from_shapes(people, expressions, n, data).expect("a tensor");
        let (identity, expression) = (ModeSize::Dimension(4), ModeSize::Dimension(3));
        let trained = hosvd(&shapes, &HosvdOptions { identity, expression, hooi: None }).expect("a model");
        let mut source = ModelSource::of_multilinear(&trained.model);
        source.faces = population.faces;
        source.landmarks = population.landmarks.to_vec();
        source.landmark_names = LANDMARKS.map(str::to_owned).to_vec();
        hab::bytes(&source).expect("bytes")
    });
    Model::open(bytes).expect("a model")
}

pub fn faces() -> Vec<[u32; 3]> {
    model().faces().expect("triangles").iter().collect()
}

/// The face of these weights, in standard deviations, mm.
pub fn face(identity: &[f64], expression: &[f64]) -> Mesh {
    let model = model();
    let identity = weights_from_deviations(&model, Mode::Identity, identity).expect("weights");
    let pose = weights_from_deviations(&model, Mode::Pose, expression).expect("weights");
    let positions = positions(&model, &identity, &pose).expect("positions");
    let positions = positions.as_chunks::<3>().0.iter().map(|p| p.map(f64::from)).collect();
    Mesh { positions, faces: faces(), ..Mesh::default() }
}

/// The face of weights that the model's priors make likely: independent standard normal deviates of both.
pub fn likely_face(identity: &[f64], expression: &[f64]) -> Mesh {
    let priors = Priors::of(&model()).expect("priors");
    // With P = L L^T, m + L^-T z has the covariance P^-1.
    let weights = |prior: &Prior, deviates: &[f64]| -> Vec<f32> {
        let d = prior.mean.len();
        let precision = nalgebra::DMatrix::from_row_slice(d, d, &prior.precision);
        let lower = nalgebra::Cholesky::new(precision).expect("a definite precision").l();
        let moved = lower.tr_solve_lower_triangular(&nalgebra::DVector::from_column_slice(deviates)).expect("regular");
        prior.mean.iter().zip(moved.iter()).map(|(mean, step)| (mean + step) as f32).collect()
    };
    let (identity, pose) = (weights(&priors.identity, identity), weights(&priors.pose, expression));
    let positions = positions(&model(), &identity, &pose).expect("positions");
    let positions = positions.as_chunks::<3>().0.iter().map(|p| p.map(f64::from)).collect();
    Mesh { positions, faces: faces(), ..Mesh::default() }
}

/// The landmarks of a face of the model.
pub fn landmarks(face: &Mesh) -> Vec<Option<[f64; 3]>> {
    let vertices = model().landmarks().expect("landmarks");
    vertices.iter().map(|vertex| Some(face.positions[vertex as usize])).collect()
}

pub fn mean_state() -> State {
    Priors::of(&model()).expect("priors").mean_state()
}

/// The whole model at the weights of `state`.
pub fn held(state: &State) -> Held {
    Held::new(&bilinear(&model()).expect("a generator"), state, usize::MAX).expect("linear")
}

/// Where a mesh stands that lies as the model does.
pub fn region() -> Region {
    Region { unit_mm: 1.0, centre: [0.0; 3], radius: 200.0, front: [0.0, 0.0, 1.0] }
}

pub fn target(scan: &Mesh) -> Target {
    Target::new(scan, &region(), 2.5, 6000, 0.9).expect("a target")
}

/// Mean distance of corresponding points.
pub fn mean_distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let distance = |(p, q): (&[f64; 3], &[f64; 3])| glam::DVec3::from_array(*p).distance(glam::DVec3::from_array(*q));
    a.iter().zip(b).map(distance).sum::<f64>() / a.len() as f64
}

/// The vertices of the model in `state`, placed.
pub fn placed(state: &State) -> Vec<[f64; 3]> {
    let place = widened(&state.placement);
    held(state).positions().into_iter().map(|p| place.applied(p)).collect()
}
