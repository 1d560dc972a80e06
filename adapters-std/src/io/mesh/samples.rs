//! Meshes and hostile bytes for the tests of every format.

use std::path::Path;

use proptest::prelude::*;

use crate::Error;
use crate::mesh::Mesh;

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
    (1usize..40, any::<[bool; 2]>()).prop_flat_map(move |(n, [normals, colours])| {
        let vertex = 0..n as u32;
        (
            prop::collection::vec(vector(), n),
            prop::collection::vec([vertex.clone(), vertex.clone(), vertex], 0..60),
            prop::collection::vec(vector(), if normals { n } else { 0 }),
            prop::collection::vec(any::<[u8; 3]>(), if colours { n } else { 0 }),
        )
            .prop_map(|(positions, faces, normals, colours)| Mesh {
                positions,
                faces,
                normals,
                colours,
                ..Mesh::default()
            })
    })
}

/// Parses every truncation of `bytes` and `bytes` with each byte changed in several ways: no panic, and whatever is
/// accepted is a mesh that fits together.
pub(super) fn assail(bytes: &[u8], parse: fn(&[u8], &Path) -> Result<Mesh, Error>) {
    let path = Path::new("hostile");
    let judge = |bytes: &[u8]| match parse(bytes, path) {
        Ok(mesh) => mesh.check().expect("an accepted mesh fits together"),
        Err(error @ Error::Malformed { .. }) => assert!(error.to_string().starts_with("hostile"), "{error}"),
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
