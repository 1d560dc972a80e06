//! Tests of the PLY reader and writer: tricky files in all encodings, and hostile ones.

use super::super::samples::{any_mesh, assail, meshes};
use super::*;
use proptest::prelude::*;

fn outcome(bytes: &[u8]) -> Result<Mesh, Error> {
    parse(bytes, Path::new("t.ply"))
}

fn error(bytes: &[u8]) -> String {
    outcome(bytes).expect_err("must be refused").to_string()
}

/// A header of vertices, faces and other elements that use every type; the values follow as text or binary.
const RICH: &str = "element camera 1\nproperty list ushort double view\nproperty char c\n\
    element vertex 4\nproperty short x\nproperty uchar quality\nproperty double y\nproperty list uint8 int16 tags\n\
    property float32 z\nproperty float nx\nproperty float ny\nproperty double nz\n\
    property uint16 red\nproperty float green\nproperty uint blue\n\
    element face 2\nproperty int flags\nproperty list uint ushort vertex_index\nproperty list uchar float texcoord\n\
    element nothing 99999999999\nelement edge 1\nproperty int32 vertex1\nproperty uint32 vertex2\nend_header\n";

fn rich_text() -> Vec<u8> {
    let values = "2 0.5 nan -1\n\
        -7 9 0.25 0 1.5 0 0 1 65535 1.0 0\n0 9 0.25 2 -1 -2 1.5 0 0 1 0 0.0 255\n\
        1 9 0 0 0 0 0 1 0 0 0\n2 9 1e-3 0 0 0 0 1 257 0.5 7\n\
        -1 3 0 1 2 0\n5 4 0 1 2\n3 2 0.5 0.5\n1 2\n";
    format!("ply\nformat ascii 1.0\ncomment made by hand\n{RICH}{values}").into_bytes()
}

fn rich_binary(big: bool) -> Vec<u8> {
    let name = if big { "big" } else { "little" };
    let mut bytes = format!("ply\r\nformat binary_{name}_endian 1.0\r\nobj_info x\r\n{RICH}").into_bytes();
    macro_rules! put {
        ($($value:expr),*) => {$(
            bytes.extend_from_slice(&if big { $value.to_be_bytes() } else { $value.to_le_bytes() });
        )*};
    }
    put!(2u16, 0.5f64, f64::NAN, -1i8);
    put!(-7i16, 9u8, 0.25f64, 0u8, 1.5f32, 0f32, 0f32, 1f64, 65535u16, 1f32, 0u32);
    put!(0i16, 9u8, 0.25f64, 2u8, -1i16, -2i16, 1.5f32, 0f32, 0f32, 1f64, 0u16, 0f32, 255u32);
    put!(1i16, 9u8, 0f64, 0u8, 0f32, 0f32, 0f32, 1f64, 0u16, 0f32, 0u32);
    put!(2i16, 9u8, 1e-3f64, 0u8, 0f32, 0f32, 0f32, 1f64, 257u16, 0.5f32, 7u32);
    put!(-1i32, 3u32, 0u16, 1u16, 2u16, 0u8);
    put!(5i32, 4u32, 0u16, 1u16, 2u16, 3u16, 2u8, 0.5f32, 0.5f32);
    put!(1i32, 2u32);
    bytes
}

fn rich_mesh() -> Mesh {
    Mesh {
        positions: vec![[-7.0, 0.25, 1.5], [0.0, 0.25, 1.5], [1.0, 0.0, 0.0], [2.0, 1e-3, 0.0]],
        faces: vec![[0, 1, 2], [0, 1, 2], [0, 2, 3]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        colours: vec![[255, 255, 0], [0, 0, 255], [0, 0, 0], [1, 128, 7]],
        ..Mesh::default()
    }
}

#[test]
fn all_types_and_encodings_are_read() {
    for bytes in [rich_text(), rich_binary(false), rich_binary(true)] {
        assert_eq!(outcome(&bytes).expect("a PLY file"), rich_mesh());
    }
}

#[test]
fn faces_may_stand_before_the_vertices() {
    let bytes = b"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 3\n\
        property float x\nproperty float y\nproperty float z\nend_header\n3 2 1 0\n0 0 0\n1 0 0\n0 1 0";
    assert_eq!(outcome(bytes).expect("a PLY file").faces, [[2, 1, 0]]);
}

#[test]
fn positions_are_short_only_when_exact() {
    let mut mesh = Mesh { positions: vec![[0.5, -0.0, 1024.0]], ..Mesh::default() };
    assert!(format(&mesh).windows(16).any(|bytes| bytes == b"property float x"));
    mesh.positions[0][2] = 0.1;
    assert!(format(&mesh).windows(17).any(|bytes| bytes == b"property double x"));
    assert_eq!(outcome(&format(&mesh)).expect("a PLY file"), mesh);
}

/// A text file of one vertex at the origin, one face and the rest of the header as given.
fn small(vertex: &str, face: &str) -> Vec<u8> {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n{vertex}\n{face}\n"
    )
    .into_bytes()
}

#[test]
fn errors_name_the_place_and_the_remedy() {
    for (bytes, message) in [
        (small("0 0 nan 0 0 0", "3 0 0 0"), "line 13: the z is \"nan\"; a finite number"),
        (small("0 0 0 0 0 256", "3 0 0 0"), "a colour channel of 256; 0 to 255"),
        (small("0 0 0 0 0 0", "3 0 1 0"), "line 14: a face names vertex 1, but the file has 1, counted from 0"),
        (small("0 0 0 0 0 0", "3 0 -1 0"), "line 14: the vertex of a face is -1; a whole number"),
        (small("0 0 0 0 0 0", "3 0 0.5 0"), "the vertex of a face is 0.5"),
        (small("0 0 0 0 0 0", "3 0 99999999999 0"), "a face names vertex 99999999999"),
        (small("0 0 0 0 0 0", "2 0 0"), "a face of 2 corners"),
        (small("0 0 0 0 0 0", "4 0 0 0"), "the file ends before the vertex of a face"),
        (small("0 0 0 0 0 0", "3 0 0 0 7"), "bytes follow the last element"),
        (b"ply\nformat ascii 1.0\nend_header\n".to_vec(), "there is no vertex"),
        (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n".to_vec(), "no property \"y\""),
        (
            b"ply\nformat ascii 1.0\nelement face 1\nproperty int a\nend_header\n1\n".to_vec(),
            "no list \"vertex_indices\"",
        ),
        (
            b"ply\nformat binary_little_endian 1.0\nelement tristrips 1\nproperty list int int vertex_indices\n\
              end_header\n\0\0\0\0"
                .to_vec(),
            "triangle strips are not read",
        ),
    ] {
        assert!(error(&bytes).contains(message), "{message}: {}", error(&bytes));
    }
    let mut bytes = rich_binary(false);
    bytes.extend_from_slice(b"rubbish");
    assert!(error(&bytes).contains("7 bytes follow the last element"));
    bytes.truncate(bytes.len() - 9);
    let message = format!("byte {}: 1 elements \"edge\" cannot lie in the 6 bytes that remain", bytes.len() - 6);
    assert!(error(&bytes).contains(&message), "{}", error(&bytes));
    let bytes = b"ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar int vertex_indices\n\
        end_header\n\x03\0\0\0\0\0\0";
    let message = format!("byte {}: the file ends inside the vertex of a face", bytes.len() - 2);
    assert!(error(bytes).contains(&message), "{}", error(bytes));
}

#[test]
fn a_count_beyond_the_file_allocates_nothing() {
    for count in [u64::MAX, 1 << 40, 1 << 33] {
        for encoding in ["ascii", "binary_little_endian"] {
            let text = format!(
                "ply\nformat {encoding} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
                 property float z\nend_header\n0 0 0\n"
            );
            assert!(error(text.as_bytes()).contains("cannot lie in the 6 bytes that remain"));
        }
    }
    let list = "ply\nformat binary_big_endian 1.0\nelement a 1\nproperty list uint double b\nend_header\n";
    let bytes = [list.as_bytes(), &[0xFF; 12]].concat();
    assert!(error(&bytes).contains("4294967295 b cannot lie in the 8 bytes"), "{}", error(&bytes));
}

#[test]
fn hostile_bytes_are_refused_or_harmless() {
    for bytes in [rich_text(), rich_binary(false), rich_binary(true)] {
        assail(&bytes, parse);
    }
    for mesh in meshes() {
        assail(&format(&mesh), parse);
    }
}

proptest! {
    #[test]
    fn meshes_read_back(mesh in any_mesh()) {
        prop_assert_eq!(outcome(&format(&mesh)).unwrap(), mesh);
    }
}
