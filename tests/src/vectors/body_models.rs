//! Linear and skinned models of the vectors in every storage, and bilinear ones in half precision and bytes; small, because firmware links them.

use super::models::{Model, gaussian};
use super::stream::Stream;
use crate::reference::bilinear::Bilinear;
use crate::reference::linear::Linear;
use crate::reference::model_file::Extras;
use crate::reference::skeleton::{Joint, Skeleton};
use crate::reference::skin_file::{linear_head, linear_sections, skinned_head, skinned_sections};
use crate::reference::skinned::Skinned;
use crate::reference::storage::{Storage, Term};
use crate::reference::stored_bilinear::StoredBilinear;

/// All of them.
pub fn bodies() -> Vec<Model> {
    let mut all = Vec::new();
    for (n, storage) in [
        (1, Storage::F32),
        (1, Storage::I8),
        (15, Storage::I8),
        (16, Storage::F16),
        (17, Storage::F32),
        (17, Storage::I8),
        (33, Storage::F16),
        (33, Storage::I8),
    ] {
        all.push(components(format!("components_{n}_{}", word(storage)), n, 2, storage, Extras::default()));
    }
    let extras =
        Extras { identity: Some(gaussian("components", 3)), ..landmarks(vec![0, 3, 7, 12, 15, 16, 21, 30, 39]) };
    all.push(components("components_whole".into(), 40, 3, Storage::I8, extras));

    let plain = Shape { joints: 5, corrected: false, dual: false, follows: true, storage: Storage::F32 };
    for (name, n, d, shape) in [
        ("body_1", 1, 1, Shape { joints: 2, ..plain }),
        ("body_15_dual", 15, 2, Shape { dual: true, ..plain }),
        ("body_16_i8", 16, 2, Shape { joints: 3, storage: Storage::I8, ..plain }),
        ("body_17", 17, 2, plain),
        ("body_17_still_dual_f16", 17, 2, Shape { dual: true, follows: false, storage: Storage::F16, ..plain }),
        ("body_33_still_i8", 33, 1, Shape { follows: false, storage: Storage::I8, ..plain }),
        ("body_33_dual_i8", 33, 1, Shape { dual: true, storage: Storage::I8, ..plain }),
        ("corrected_16", 16, 1, Shape { joints: 2, corrected: true, ..plain }),
        ("corrected_17_f16", 17, 1, Shape { joints: 2, corrected: true, storage: Storage::F16, ..plain }),
        (
            "corrected_17_dual_i8",
            17,
            1,
            Shape { joints: 3, corrected: true, dual: true, storage: Storage::I8, ..plain },
        ),
    ] {
        all.push(body(name, n, d, shape, Extras::default()));
    }
    let extras = Extras {
        identity: Some(gaussian("body", 2)),
        pose: Some(gaussian("posture", 9)),
        ..landmarks(vec![0, 2, 5, 7, 12, 15, 16, 19, 21, 24, 30, 32])
    };
    all.push(body("body_whole", 33, 2, Shape { storage: Storage::I8, ..plain }, extras));

    for (n, dims, linear, storage) in [
        (15, [3, 1], [true, false], Storage::I8),
        (17, [2, 2], [true, true], Storage::F16),
        (33, [2, 2], [false, true], Storage::I8),
    ] {
        all.push(bilinear(format!("bilinear_{n}_{}", word(storage)), n, dims, linear, storage));
    }
    all
}

fn word(storage: Storage) -> String {
    format!("{storage:?}").to_lowercase()
}

fn landmarks(vertices: Vec<u32>) -> Extras {
    let landmark_names = (0..vertices.len()).map(|k| format!("point {k}")).collect::<Vec<_>>().join("\n");
    Extras { landmarks: vertices, landmark_names, ..Extras::default() }
}

fn padded(mut points: Vec<[f32; 3]>) -> Vec<[f32; 3]> {
    points.resize(points.len().next_multiple_of(16), [0.0; 3]);
    points
}

fn components(name: String, n: usize, d: usize, storage: Storage, extras: Extras) -> Model {
    let mut stream = Stream::of(&name);
    let mean = padded(stream.points(n, 100.0));
    let model = Linear { n, mean, components: (0..d).map(|_| storage.stored(&stream.points(n, 10.0))).collect() };
    let (head, sections) = (linear_head(&model), linear_sections(&model, &extras));
    Model::new(name, Box::new(model), head, sections, extras)
}

fn bilinear(name: String, n: usize, [di, dp]: [usize; 2], linear: [bool; 2], storage: Storage) -> Model {
    let mut stream = Stream::of(&name);
    let mut term = |size: f64| stream.points::<f32>(n, size);
    let plain = Bilinear {
        offset: term(100.0),
        pose_linear: linear[1].then(|| (0..dp).map(|_| term(10.0)).collect()),
        identity_linear: linear[0].then(|| (0..di).map(|_| term(10.0)).collect()),
        bilinear: (0..di).map(|_| (0..dp).map(|_| term(10.0)).collect()).collect(),
    };
    let model = StoredBilinear::new(&plain, storage);
    let sections = model.sections(&Extras::default());
    Model::new(name, Box::new(model.clone()), model.head(), sections, Extras::default())
}

/// What sort of body.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// The first so many of a root that is a ball, two hinges in a row, a ball behind them, and a hinge at the root.
    pub joints: usize,
    pub corrected: bool,
    pub dual: bool,
    /// Joints follow the identity.
    pub follows: bool,
    pub storage: Storage,
}

/// The skeleton, the terms and the weights of a body, from a stream.
pub fn skinned(name: &str, n: usize, d: usize, shape: Shape) -> Skinned {
    let mut stream = Stream::of(name);
    let term = |stream: &mut Stream| -> Term { shape.storage.stored(&stream.points(n, 10.0)) };
    let mean = padded(stream.points(n, 300.0));
    let components = (0..d).map(|_| term(&mut stream)).collect();
    let corrective = (0..if shape.corrected { 9 * shape.joints } else { 0 }).map(|_| term(&mut stream)).collect();
    let all = [
        (None, None),
        (Some(0), Some([1.0, 0.0, 0.0])),
        (Some(1), Some([0.0, 0.6, 0.8])),
        (Some(2), None),
        (Some(0), Some([0.0, 0.0, 1.0])),
    ];
    let joints: Vec<Joint> = all[..shape.joints]
        .iter()
        .map(|&(parent, axis)| Joint { parent, axis, position: stream.point(200.0) })
        .collect();
    let basis = shape.follows.then(|| joints.iter().map(|_| stream.points(d, 5.0)).collect());
    let weights = weights(&mut stream, n, shape.joints);
    let rest = Linear { n, mean, components };
    Skinned { rest, corrective, skeleton: Skeleton { joints, basis }, weights, dual: shape.dual }
}

/// Two or three joints a block, shares of each vertex; the first vertex of a block has one joint alone.
fn weights(stream: &mut Stream, n: usize, joints: usize) -> Vec<Vec<f32>> {
    let mut weights = vec![vec![0.0; n.next_multiple_of(16)]; joints];
    for v in 0..n {
        let block = v / 16;
        let count = (2 + block % 2).min(joints);
        let first = block % (joints - count + 1);
        let shares: Vec<f32> = (0..count).map(|_| 1.0625 + stream.number::<f32>(1.0)).collect();
        let total: f32 = shares.iter().sum();
        for (k, share) in shares.iter().enumerate() {
            let alone = if k == 0 { 1.0 } else { 0.0 };
            weights[first + k][v] = if v % 16 == 0 { alone } else { share / total };
        }
    }
    weights
}

fn body(name: &str, n: usize, d: usize, shape: Shape, extras: Extras) -> Model {
    let body = skinned(name, n, d, shape);
    let (head, sections) = (skinned_head(&body), skinned_sections(&body, &extras));
    Model::new(name.into(), Box::new(body), head, sections, extras)
}
