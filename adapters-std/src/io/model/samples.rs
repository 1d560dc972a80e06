//! Model files that the tests of this folder share.

use std::f64::consts::PI;
use std::path::Path;

use super::{Coefficients, JointSource, LinearForm, ModelSource, SkinSource, hab};

/// A small model of the project, such as `body-i8`.
pub fn firmware_model(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/firmware/models");
    std::fs::read(folder.join(format!("{name}.hab"))).expect("the file is part of the project")
}

/// A body of 20 vertices whose second joint, a hinge that bends from 0.5 to 1.5, corrects the rest shape.
pub fn corrected_body() -> Vec<u8> {
    body(true)
}

/// The same without corrections.
pub fn plain_body() -> Vec<u8> {
    body(false)
}

fn body(corrected: bool) -> Vec<u8> {
    let n = 20;
    let numbers = |count: usize, size: f64| -> Vec<f64> {
        (0..count).map(|k| size * ((k * k % 101) as f64 / 101.0 - 0.5)).collect()
    };
    let joint = |name: &str, parent, axis, y| JointSource {
        name: name.into(),
        parent,
        axis: Some(axis),
        position: [0.0, y, 0.0],
        basis: Vec::new(),
    };
    let skin = SkinSource {
        joints: vec![joint("root", None, [0.0, 1.0, 0.0], 0.0), joint("knee", Some(0), [1.0, 0.0, 0.0], 100.0)],
        weights: (0..n).map(|v| vec![(0, 1.0 - v as f64 / n as f64), (1, v as f64 / n as f64)]).collect(),
        bounds: Some((vec![-PI, 0.5], vec![PI, 1.5])),
        dual_quaternion: false,
    };
    let (mean, components) = (numbers(3 * n, 200.0), numbers(2 * 3 * n, 10.0));
    let corrections = if corrected { numbers(2 * 9 * 3 * n, 40.0) } else { Vec::new() };
    let form = LinearForm { mean: &mean, components: &components };
    let source = ModelSource::new(Coefficients::Skinned(form, &corrections, &skin));
    hab::bytes(&source).expect("a model")
}
