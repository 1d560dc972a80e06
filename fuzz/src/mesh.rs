//! Mesh readers: any bytes are refused with an error that names the file, or are a mesh that fits together, is
//! written, and reads back with equal bits.

use std::path::Path;

use habitus::Error;
use habitus::io::mesh::{obj, off, ply};
use habitus::mesh::Mesh;

use crate::bits::assert_same_vectors;

type Parse = fn(&[u8], &Path) -> Result<Mesh, Error>;

/// Wavefront OBJ.
pub fn check_obj(bytes: &[u8]) {
    check(bytes, obj::parse, obj::format);
}

/// PLY in its three encodings.
pub fn check_ply(bytes: &[u8]) {
    check(bytes, ply::parse, ply::format);
}

/// OFF with and without normals and colours.
pub fn check_off(bytes: &[u8]) {
    check(bytes, off::parse, off::format);
}

fn check(bytes: &[u8], parse: Parse, format: fn(&Mesh) -> Vec<u8>) {
    let path = Path::new("any.bytes");
    let mesh = match parse(bytes, path) {
        Ok(mesh) => mesh,
        Err(error @ Error::Malformed { .. }) => {
            assert!(error.to_string().starts_with("any.bytes"), "the error does not name the file: {error}");
            return;
        }
        Err(error) => panic!("not an error of the file: {error}"),
    };
    if let Err(error) = mesh.check() {
        panic!("an accepted mesh does not fit together: {error}");
    }
    let written = format(&mesh);
    let again = parse(&written, path).expect("what was written is read");
    assert_same_vectors("positions", &again.positions, &mesh.positions);
    assert_same_vectors("normals", &again.normals, &mesh.normals);
    assert_eq!((&again.faces, &again.colours), (&mesh.faces, &mesh.colours));
    assert_eq!(format(&again), written, "the same mesh is written as other bytes");
}
