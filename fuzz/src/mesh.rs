//! Mesh readers: any bytes are refused with an error that names the file, or are a mesh that fits together, is written
//! in every encoding of its format, and reads back with equal bits and nothing left out.
//!
//! Bytes that are refused for a coordinate that is not finite are read with it.

use std::path::Path;

use habitus::Error;
use habitus::io::mesh::{
    Encoding, Formatted, MeshFile, NonFinite, ReadOptions, WriteOptions, gltf, npy_cloud, obj, off, ply, stl,
};
use habitus::mesh::Mesh;

use crate::bits::{assert_same_numbers, assert_same_vectors};

type Parse = fn(&[u8], &Path, &ReadOptions) -> Result<MeshFile, Error>;
type Format = fn(&MeshFile, &WriteOptions) -> Result<Formatted, String>;

/// Wavefront OBJ.
pub fn check_obj(bytes: &[u8]) {
    check(bytes, obj::parse, obj::format, &[Encoding::Text]);
}

/// PLY in its three encodings.
pub fn check_ply(bytes: &[u8]) {
    check(bytes, ply::parse, ply::format, &[Encoding::Binary, Encoding::BigEndian, Encoding::Text]);
}

/// OFF with and without normals and colours.
pub fn check_off(bytes: &[u8]) {
    check(bytes, off::parse, off::format, &[Encoding::Text]);
}

/// Clouds as NPY.
pub fn check_npy_cloud(bytes: &[u8]) {
    check(bytes, npy_cloud::parse, npy_cloud::format, &[Encoding::Binary]);
}

/// STL as text, which holds every digit, and binary, which may round.
pub fn check_stl(bytes: &[u8]) {
    check(bytes, stl::parse, stl::format, &[Encoding::Text]);
    if let Some(file) = accepted(bytes, stl::parse, NonFinite::Refuse) {
        check_settled(&file, stl::parse, stl::format);
    }
}

/// glTF as one binary file and as text. Metres become millimetres and colours sRGB, so that numbers may be rounded once.
pub fn check_gltf(bytes: &[u8]) {
    let Some(file) = accepted(bytes, gltf::parse, NonFinite::Refuse) else {
        if let Some(file) = accepted(bytes, gltf::parse, NonFinite::Keep) {
            check_kept(file, gltf::format, &[Encoding::Binary]);
        }
        return;
    };
    if let Err(error) = file.mesh.check() {
        panic!("an accepted mesh does not fit together: {error}");
    }
    check_settled(&file, gltf::parse, gltf::format);
    check_settled(&file, gltf::parse, gltf::format_json);
}

/// What was written is read; from then on nothing changes any more.
fn check_settled(file: &MeshFile, parse: Parse, format: Format) {
    let Ok(written) = format(file, &WriteOptions::default()) else { return };
    let mut settled = accepted(&written.bytes, parse, NonFinite::Refuse).expect("what was written is read");
    // Frames of joints are inverted on the way and may be rounded again, and with them the vertices.
    if settled.skin.take().is_some() {
        let plain = format(&settled, &WriteOptions::default()).expect("what was read is written");
        settled = accepted(&plain.bytes, parse, NonFinite::Refuse).expect("what was written is read");
    }
    let again = format(&settled, &WriteOptions::default()).expect("what was read is written");
    let again = accepted(&again.bytes, parse, NonFinite::Refuse).expect("what was written is read");
    assert_same(&again.mesh, &settled.mesh);
    assert_eq!(again.morphs, settled.morphs);
}

fn check(bytes: &[u8], parse: Parse, format: Format, encodings: &[Encoding]) {
    let Some(file) = accepted(bytes, parse, NonFinite::Refuse) else {
        if let Some(file) = accepted(bytes, parse, NonFinite::Keep) {
            check_kept(file, format, encodings);
        }
        return;
    };
    if let Err(error) = file.mesh.check() {
        panic!("an accepted mesh does not fit together: {error}");
    }
    for &encoding in encodings {
        let written = format(&file, &WriteOptions { encoding }).expect("an accepted mesh is written");
        assert!(written.left_out.is_empty(), "the format does not hold what it read: {:?}", written.left_out);
        let again = accepted(&written.bytes, parse, NonFinite::Refuse).expect("what was written is read");
        assert!(again.left_out.is_empty(), "what was written is not read: {:?}", again.left_out);
        assert_same(&again.mesh, &file.mesh);
        let rewritten = format(&again, &WriteOptions { encoding }).expect("a mesh is written twice");
        assert_eq!(rewritten.bytes, written.bytes, "the same mesh is written as other bytes");
    }
}

/// What the reader accepted; an error must be one of the file and name it.
fn accepted(bytes: &[u8], parse: Parse, non_finite: NonFinite) -> Option<MeshFile> {
    match parse(bytes, Path::new("any.bytes"), &ReadOptions { non_finite }) {
        Ok(file) => Some(file),
        Err(error @ Error::Malformed { .. }) => {
            assert!(error.to_string().starts_with("any.bytes"), "the error does not name the file: {error}");
            None
        }
        Err(error) => panic!("not an error of the file: {error}"),
    }
}

/// A mesh that only coordinates spoil fits together without them.
fn check_kept(mut file: MeshFile, format: Format, encodings: &[Encoding]) {
    // A normal that no vertex uses is left out.
    assert!(file.mesh.check().is_err() || !file.left_out.is_empty(), "refused, but nothing is wrong with it");
    for &encoding in encodings {
        // What cannot be written must not end the program either.
        let _ = format(&file, &WriteOptions { encoding });
    }
    let coordinates = file.mesh.positions.iter_mut().chain(&mut file.mesh.normals).flatten();
    coordinates.filter(|x| !x.is_finite()).for_each(|x| *x = 0.0);
    if let Err(error) = file.mesh.check() {
        panic!("a kept mesh does not fit together: {error}");
    }
}

fn assert_same(found: &Mesh, expected: &Mesh) {
    assert_same_vectors("positions", &found.positions, &expected.positions);
    assert_same_vectors("normals", &found.normals, &expected.normals);
    assert_eq!((&found.faces, &found.colours), (&expected.faces, &expected.colours));
    assert_eq!(found.attributes.len(), expected.attributes.len(), "attributes");
    for (found, expected) in found.attributes.iter().zip(&expected.attributes) {
        assert_eq!((&found.name, found.scalar), (&expected.name, expected.scalar));
        assert_same_numbers(&found.name, &found.values, &expected.values);
    }
}
