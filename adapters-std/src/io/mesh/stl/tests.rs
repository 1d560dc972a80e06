//! Tests of the STL reader and writer.

use super::super::samples::{any_mesh, assail, kept};
use super::super::{Encoding, WriteOptions};
use super::*;
use crate::mesh::Mesh;
use proptest::prelude::*;

const SQUARE: &str = "solid a square\r\n facet normal 0 0 1\r\n  outer loop\r\n   vertex 0 0 0\r\n   vertex 1 0 0\r\n   \
    VERTEX 1 1 -0.0\r\n  endloop\r\n endfacet\r\nfacet normal 0 0 1 outer loop vertex 0 0 -0 vertex 1 1 0 vertex 0 1 0 \
    endloop endfacet\nendsolid a square\n";

fn outcome(bytes: &[u8]) -> Result<MeshFile, Error> {
    parse(bytes, Path::new("t.stl"), &ReadOptions::default())
}

fn error(bytes: &[u8]) -> String {
    outcome(bytes).expect_err("must be refused").to_string()
}

fn written(mesh: &Mesh, encoding: Encoding) -> super::super::Formatted {
    format(&mesh.clone().into(), &WriteOptions { encoding }).expect("a mesh is written")
}

fn square() -> Mesh {
    let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, -0.0], [0.0, 1.0, 0.0]];
    Mesh { positions, faces: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
}

#[test]
fn corners_at_one_place_are_one_vertex() {
    let file = outcome(SQUARE.as_bytes()).expect("a text");
    assert_eq!((file.mesh, file.left_out.len()), (square(), 0));
}

#[test]
fn both_encodings_read_back_what_they_wrote() {
    for encoding in [Encoding::Text, Encoding::Binary] {
        let written = written(&square(), encoding);
        assert!(written.left_out.is_empty(), "{:?}", written.left_out);
        let file = outcome(&written.bytes).expect("it is read");
        assert_eq!((file.mesh, file.left_out.len()), (square(), 0));
    }
}

#[test]
fn a_binary_file_may_begin_with_solid() {
    let mut bytes = written(&square(), Encoding::Binary).bytes;
    bytes[..12].copy_from_slice(b"solid square");
    assert_eq!(outcome(&bytes).expect("binary").mesh, square());
}

#[test]
fn what_is_not_kept_is_named() {
    let mut bytes = written(&square(), Encoding::Binary).bytes;
    bytes[84 + 48] = 7;
    bytes[84 + 8..84 + 12].copy_from_slice(&(-1.0f32).to_le_bytes());
    bytes.extend_from_slice(b"abc");
    let left_out = outcome(&bytes).expect("binary").left_out;
    assert_eq!(
        left_out,
        [
            "3 bytes behind the last triangle",
            "1 attribute of a triangle (colour)",
            "1 facet normal that is more than 5 degrees off its triangle's"
        ]
    );
    let two = format!("{SQUARE}solid b\nendsolid\n");
    assert_eq!(outcome(two.as_bytes()).unwrap().left_out, ["the division into 2 solids (joined)"]);
    let quad = "solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\n\
        endfacet\nendsolid";
    let file = outcome(quad.as_bytes()).unwrap();
    assert_eq!((file.mesh.faces.len(), &file.left_out[0][..9]), (2, "1 polygon"));
}

#[test]
fn what_cannot_be_written_is_named_or_refused() {
    let mut mesh = square();
    mesh.positions[1][0] = 0.1;
    mesh.positions.extend([[9.0; 3], [0.0; 3]]);
    mesh.faces.insert(0, [5, 1, 2]);
    mesh.colours = vec![[0; 3]; 6];
    assert_eq!(
        written(&mesh, Encoding::Binary).left_out,
        [
            "1 position rounded to f32, by 1.5e-9 at most",
            "1 vertex at the place of another (will be read as that one)",
            "1 vertex that no face has",
            "the order of the vertices (they will be read in the order of the triangles' corners)",
            "6 colours of vertices"
        ]
    );
    assert!(!written(&mesh, Encoding::Text).left_out[0].contains("rounded"));
    let refusal = |mesh: Mesh, encoding| format(&mesh.into(), &WriteOptions { encoding }).expect_err("must be refused");
    assert!(refusal(Mesh { faces: vec![], ..square() }, Encoding::Text).contains("no faces"));
    assert!(refusal(square(), Encoding::BigEndian).contains("no big-endian"));
    mesh.positions[0][0] = 1e300;
    assert!(refusal(mesh, Encoding::Binary).contains("position of vertex 0"));
}

#[test]
fn errors_name_the_place_and_the_remedy() {
    let binary = written(&square(), Encoding::Binary).bytes;
    for (bytes, message) in [
        (b"".to_vec(), "byte 0: 0 bytes are neither text"),
        (binary[..183].to_vec(), "byte 80: 2 triangles take 100 bytes, but 99 follow"),
        (b"solid a\n".to_vec(), "line 2: the file ends before \"endsolid\""),
        (b"solid a\nendsolid\n".to_vec(), "line 3: there is no vertex"),
        ([0; 84].to_vec(), "byte 80: there is no vertex"),
        (b"\xFF\xFEs\0o\0".to_vec(), "byte 0: the text is UTF-16"),
        (b"solid a\0\0".to_vec(), "byte 7: a zero byte"),
        (b"solid\nvertex".to_vec(), "line 2: \"vertex\" where facet or endsolid"),
        (b"solid\nfacet 0 0 1".to_vec(), "line 2: \"normal\" is expected"),
        (b"solid\nfacet normal 0 0".to_vec(), "line 2: the normal of the facet has fewer"),
        (b"solid\nfacet normal 0 0 x".to_vec(), "line 2: the normal of the facet has \"x\""),
        (b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n".to_vec(), "line 4: the vertex ends before its z"),
        (b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 nan".to_vec(), "line 4: the vertex has \"nan\""),
        (b"solid\nfacet normal 0 0 1\nouter loop\nendloop".to_vec(), "line 4: a facet of 0 corners"),
    ] {
        assert!(error(&bytes).contains(message), "{message}: {}", error(&bytes));
    }
    let mut bytes = binary;
    bytes[84 + 12..84 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(error(&bytes).contains("byte 96: a coordinate of triangle 0 is NaN"), "{}", error(&bytes));
    assert!(kept(&bytes, parse).expect("kept").positions[0][0].is_nan());
    bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(error(&bytes).contains("4294967295 triangles take 214748364750 bytes, but 100 follow"));
}

#[test]
fn hostile_bytes_are_refused_or_harmless() {
    assail(SQUARE.as_bytes(), parse);
    assail(&written(&square(), Encoding::Binary).bytes, parse);
}

proptest! {
    #[test]
    fn meshes_read_back_as_what_their_triangles_say(mesh in any_mesh()) {
        prop_assume!(!mesh.faces.is_empty());
        // What is read once stays as it is: vertices in the order of corners, one at each place.
        let first = parse(&written(&mesh, Encoding::Text).bytes, Path::new("t"), &ReadOptions::default()).unwrap();
        let same_place = |a: [[f64; 3]; 3], b: [[f64; 3]; 3]| a == b;
        prop_assert!((0..mesh.faces.len()).all(|face| same_place(mesh.triangle(face), first.mesh.triangle(face))));
        let again = written(&first.mesh, Encoding::Text);
        prop_assert!(again.left_out.is_empty(), "{:?}", again.left_out);
        prop_assert_eq!(parse(&again.bytes, Path::new("t"), &ReadOptions::default()).unwrap(), first);
    }
}
