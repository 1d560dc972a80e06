//! Meshes and hostile bytes for the tests of every format.

use std::path::Path;

use proptest::prelude::*;

use super::{Joint, MeshFile, MorphTarget, NonFinite, ReadOptions, Skin};
use crate::Error;
use crate::mesh::{Attribute, Mesh, Scalar};

/// Small meshes with every combination of faces, normals and colours, and with numbers that are hard to print.
pub(super) fn meshes() -> Vec<Mesh> {
    let positions = vec![[0.1, -2.5e-7, 1e22], [1.0, 0.0, -0.0], [1.0 / 3.0, 5e-324, f64::MAX], [7.0, 8.0, 9.25]];
    let plain = Mesh { positions, faces: vec![[0, 1, 2], [2, 1, 3]], ..Mesh::default() };
    let normals = vec![[0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [0.0, -1.0, 0.0], [1.0 / 3.0, 0.1, 0.2]];
    let colours = vec![[0, 1, 2], [255, 254, 253], [128, 127, 126], [3, 200, 100]];
    let mut meshes = Vec::new();
    for mask in 0..8 {
        let mut mesh = plain.clone();
        if mask & 1 != 0 {
            mesh.normals = normals.clone();
        }
        if mask & 2 != 0 {
            mesh.colours = colours.clone();
        }
        if mask & 4 != 0 {
            mesh.faces.clear();
        }
        meshes.push(mesh);
    }
    meshes
}

/// Any mesh that passes [`Mesh::check`], of up to 40 vertices.
pub(super) fn any_mesh() -> impl Strategy<Value = Mesh> {
    let real = || {
        prop_oneof![
            -1e3..1e3,
            any::<f64>().prop_filter("finite", |x| x.is_finite()),
            any::<f32>().prop_filter_map("finite", |x| x.is_finite().then_some(f64::from(x)))
        ]
    };
    let vector = move || [real(), real(), real()];
    (1usize..40, any::<[bool; 3]>()).prop_flat_map(move |(n, [normals, colours, attributed])| {
        let vertex = 0..n as u32;
        (
            prop::collection::vec(vector(), n),
            prop::collection::vec([vertex.clone(), vertex.clone(), vertex], 0..60),
            prop::collection::vec(vector(), if normals { n } else { 0 }),
            prop::collection::vec(any::<[u8; 3]>(), if colours { n } else { 0 }),
            prop::collection::vec(real(), n),
        )
            .prop_map(move |(positions, faces, normals, colours, values)| Mesh {
                positions,
                faces,
                normals,
                colours,
                attributes: if attributed { attributes(n, &values) } else { Vec::new() },
            })
    })
}

/// A mesh with an attribute of every type, and that mesh with a morph target and a skin.
pub(super) fn rich_files() -> Vec<MeshFile> {
    let mut mesh = meshes().swap_remove(3);
    mesh.attributes = attributes(4, &[0.25, -1.5, 1e300, 7.0]);
    let morphs = vec![MorphTarget { name: "smile".into(), displacements: vec![[1.0; 3]; 4] }];
    let bind = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
    let joints = vec![Joint { name: "root".into(), parent: None, bind }];
    let skin = Some(Skin { joints, influences: vec![vec![(0, 1.0)]; 4] });
    vec![mesh.clone().into(), MeshFile { mesh, morphs, skin, left_out: Vec::new() }]
}

/// An attribute of each type, whose values are those given, in turn, as that type holds them.
fn attributes(n: usize, values: &[f64]) -> Vec<Attribute> {
    type Held = fn(f64) -> f64;
    let types: [(Scalar, Held); 8] = [
        (Scalar::I8, |x| f64::from(x as i8)),
        (Scalar::U8, |x| f64::from(x as u8)),
        (Scalar::I16, |x| f64::from(x as i16)),
        (Scalar::U16, |x| f64::from(x as u16)),
        (Scalar::I32, |x| f64::from(x as i32)),
        (Scalar::U32, |x| f64::from(x as u32)),
        (Scalar::F32, |x| f64::from((x as f32).clamp(f32::MIN, f32::MAX))),
        (Scalar::F64, |x| x),
    ];
    let attribute = |(at, &(scalar, held)): (usize, &(Scalar, Held))| Attribute {
        name: format!("{scalar:?}").to_lowercase(),
        scalar,
        values: (0..n).map(|vertex| held(values[(vertex + at) % values.len()])).collect(),
    };
    types.iter().enumerate().map(attribute).collect()
}

/// The mesh of the bytes, with coordinates that are not finite.
pub(super) fn kept(bytes: &[u8], parse: super::Parse) -> Result<Mesh, Error> {
    Ok(parse(bytes, Path::new("kept"), &ReadOptions { non_finite: NonFinite::Keep })?.mesh)
}

/// Parses every truncation of `bytes` and `bytes` with each byte changed in several ways: no panic, and whatever is
/// accepted is a mesh that fits together.
pub(super) fn assail(bytes: &[u8], parse: super::Parse) {
    let path = Path::new("hostile");
    let judge = |bytes: &[u8]| match parse(bytes, path, &ReadOptions::default()) {
        Ok(file) => file.mesh.check().expect("an accepted mesh fits together"),
        Err(error @ Error::Malformed { .. }) => {
            let text = error.to_string();
            assert!(text.starts_with("hostile, line ") || text.starts_with("hostile, byte "), "{text}");
            // What is refused for a coordinate alone is accepted but for it.
            if let Ok(mut mesh) = kept(bytes, parse) {
                assert!(mesh.check().is_err(), "{error}");
                let vectors = mesh.positions.iter_mut().chain(&mut mesh.normals).flatten();
                vectors.filter(|x| !x.is_finite()).for_each(|x| *x = 0.0);
                mesh.check().expect("a kept mesh fits together but for its coordinates");
            }
        }
        Err(error) => panic!("not an error of the file: {error}"),
    };
    for length in 0..bytes.len() {
        judge(&bytes[..length]);
    }
    let mut changed = bytes.to_vec();
    for at in 0..bytes.len() {
        for flip in [0x01, 0x10, 0x20, 0x80, 0xFF] {
            changed[at] ^= flip;
            judge(&changed);
            changed[at] ^= flip;
        }
        for byte in *b"\n 9-.\\" {
            changed[at] = byte;
            judge(&changed);
            changed[at] = bytes[at];
        }
    }
}
