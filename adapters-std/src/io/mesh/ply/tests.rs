//! Tests of the PLY reader and writer: tricky files in all encodings, and hostile ones.

use super::super::samples::{any_mesh, assail, kept, meshes, rich_files};
use super::super::{Encoding, WriteOptions};
use super::*;
use crate::mesh::{Attribute, Scalar};
use proptest::prelude::*;

fn file(bytes: &[u8]) -> Result<MeshFile, Error> {
    parse(bytes, Path::new("t.ply"), &ReadOptions::default())
}

fn outcome(bytes: &[u8]) -> Result<Mesh, Error> {
    Ok(file(bytes)?.mesh)
}

fn written_as(mesh: &Mesh, encoding: Encoding) -> Vec<u8> {
    format(&mesh.clone().into(), &WriteOptions { encoding }).expect("any mesh is written").bytes
}

fn written(mesh: &Mesh) -> Vec<u8> {
    written_as(mesh, Encoding::Binary)
}

const ENCODINGS: [Encoding; 3] = [Encoding::Binary, Encoding::BigEndian, Encoding::Text];

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
        attributes: vec![Attribute { name: "quality".into(), scalar: Scalar::U8, values: vec![9.0; 4] }],
    }
}

#[test]
fn all_types_and_encodings_are_read() {
    for bytes in [rich_text(), rich_binary(false), rich_binary(true)] {
        let file = file(&bytes).expect("a PLY file");
        assert_eq!(file.mesh, rich_mesh());
        assert_eq!(
            file.left_out.join("; "),
            "1 element \"camera\"; 1 colour finer than 8 bits a channel (rounded); the list \"tags\" of 4 vertices; \
             1 polygon with more than 3 corners (divided into triangles); the property \"flags\" of 2 faces; \
             the list \"texcoord\" of 2 faces; 1 element \"edge\""
        );
    }
}

#[test]
fn what_else_is_left_out_is_counted() {
    let text = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 1\nproperty int x\nproperty int y\n\
        property int z\nproperty int x\nproperty uchar nx\nelement face 2\nproperty list int int vertex_index\nend_header\n\
        1 2 3 4 5\n2 0 0\n0\n";
    let file = file(text.as_bytes()).expect("a PLY file");
    assert_eq!(
        file.left_out.join("; "),
        "the property \"x\" of 1 vertices; 2 faces of fewer than 3 corners; 1 texture file"
    );
    let nx = Attribute { name: "nx".into(), scalar: Scalar::U8, values: vec![5.0] };
    assert_eq!((file.mesh.positions, file.mesh.attributes), (vec![[1.0, 2.0, 3.0]], vec![nx]));
}

#[test]
fn a_text_that_says_more_than_its_type_is_believed() {
    let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar label\nproperty float quality\nproperty float time\nend_header\n0 0 0.1 1 0.5 nan\n0 0 0 1.5 1 -1.#INF\n";
    let mesh = outcome(text.as_bytes()).expect("a PLY file");
    let scalars: Vec<Scalar> = mesh.attributes.iter().map(|attribute| attribute.scalar).collect();
    assert_eq!(scalars, [Scalar::F64, Scalar::F32, Scalar::F32]);
    assert_eq!((mesh.positions[0][2], mesh.attributes[0].values[1]), (0.1, 1.5));
    assert!(mesh.attributes[2].values[0].is_nan() && mesh.attributes[2].values[1] == f64::NEG_INFINITY);
    for encoding in ENCODINGS {
        let again = outcome(&written_as(&mesh, encoding)).expect("what was written is read");
        assert!(again.attributes[2].values[0].is_nan() && again.attributes[..2] == mesh.attributes[..2]);
    }
}

#[test]
fn what_is_not_finite_is_kept_on_demand() {
    let header =
        "ply\nformat FORMAT 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let text = header.replace("FORMAT", "ascii") + "0 nan(ind) -inf\n";
    let little =
        [header.replace("FORMAT", "binary_little_endian").as_bytes(), &[0, 0, 0, 0, 0, 0, 192, 127, 0, 0, 128, 255]]
            .concat();
    for (bytes, place) in [(text.as_bytes(), "line 8: the y is NaN"), (&little, "byte 119: the y is NaN")] {
        let message = error(bytes);
        assert!(message.contains(place) && message.contains("habitus clean"), "{message}");
        let mesh = kept(bytes, parse).expect("kept");
        assert!(mesh.positions[0][1].is_nan() && mesh.positions[0][2] == f64::NEG_INFINITY);
    }
}

#[test]
fn every_line_end_is_read() {
    let text = String::from_utf8(rich_text()).expect("text");
    for end in ["\n", "\r\n", "\r"] {
        let text = text.replace('\n', end);
        assert_eq!(outcome(text.as_bytes()).expect("a PLY file"), rich_mesh());
        let damaged = text.replace("-1 3 0 1 2", "-1 3 0 1 9");
        assert!(error(damaged.as_bytes()).contains("line 33: a face names vertex 9"), "{}", error(damaged.as_bytes()));
        let mut binary = [b"\xEF\xBB\xBF", &rich_binary(true)[..]].concat();
        assert_eq!(outcome(&binary).expect("a PLY file behind a byte order mark"), rich_mesh());
        binary.pop();
        assert!(error(&binary).contains(&format!("byte {}", binary.len() - 7)), "{}", error(&binary));
    }
}

#[test]
fn what_ply_cannot_hold_is_named() {
    let attribute = |name: &str| Attribute { name: name.into(), scalar: Scalar::U8, values: vec![0.5] };
    let names = ["red", "green", "blue", "x", "nx", "a b", "", "a\0b", "ä"];
    let attributes = names.map(attribute).into();
    let mesh = Mesh { positions: vec![[0.0; 3]], attributes, ..Mesh::default() };
    for encoding in ENCODINGS {
        let formatted = format(&mesh.clone().into(), &WriteOptions { encoding }).expect("written");
        assert_eq!(formatted.left_out.len(), 7);
        assert!(formatted.left_out[0].contains("\"a b\", whose name is no word"), "{:?}", formatted.left_out);
        assert!(formatted.left_out[3].contains("\"red\", whose name PLY has for something else"));
        let file = file(&formatted.bytes).expect("what was written is read");
        let kept: Vec<_> = file.mesh.attributes.iter().map(|a| (&a.name[..], a.scalar, a.values[0])).collect();
        assert_eq!(kept, [("nx", Scalar::F64, 0.5), ("ä", Scalar::F64, 0.5)]);
    }
    let rich = &rich_files()[1];
    assert_eq!(format(rich, &WriteOptions::default()).expect("written").left_out.len(), 2);
}

/// Found by fuzzing: such a name in a text file would make it binary.
#[test]
fn a_zero_byte_in_the_header_is_refused_in_every_encoding() {
    for encoding in ["ascii", "binary_little_endian"] {
        let bytes = format!("ply\nformat {encoding} 1.0\nelement vertex 0\nproperty float \0x\nend_header\n");
        let said = outcome(bytes.as_bytes()).expect_err("refused").to_string();
        assert!(said.contains(&format!("byte {}: a zero byte", bytes.find('\0').expect("one"))), "{said}");
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
    assert!(written(&mesh).windows(16).any(|bytes| bytes == b"property float x"));
    mesh.positions[0][2] = 0.1;
    assert!(written(&mesh).windows(17).any(|bytes| bytes == b"property double x"));
    assert_eq!(outcome(&written(&mesh)).expect("a PLY file"), mesh);
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
        (small("0 0 nan 0 0 0", "3 0 0 0"), "line 13: the z is NaN; a finite number"),
        (small("0 0 0 0 0 256", "3 0 0 0"), "a colour channel of 256; 0 to 255"),
        (small("0 0 0 0 0 0", "3 0 1 0"), "line 14: a face names vertex 1, but the file has 1, counted from 0"),
        (small("0 0 0 0 0 0", "3 0 -1 0"), "line 14: the vertex of a face is -1; a whole number"),
        (small("0 0 0 0 0 0", "3 0 0.5 0"), "the vertex of a face is 0.5"),
        (small("0 0 0 0 0 0", "3 0 99999999999 0"), "a face names vertex 99999999999"),
        (small("0 0 0 0 0 0", "4 0 0 0"), "the file ends before the vertex of a face"),
        (small("0 0 0 0 0 0", "3 0 0 0 7"), "bytes follow the last element"),
        (b"ply\nformat ascii 1.0\nend_header\n".to_vec(), "t.ply, line 3: there is no vertex"),
        (b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n".to_vec(), "line 3: there is no vertex"),
        (small("0 0 \0 0 0 0", "3 0 0 0"), "a zero byte, which text does not have"),
        (b"\xFF\xFEp\0l\0y\0".to_vec(), "t.ply, byte 0: the text is UTF-16"),
        (
            b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n".to_vec(),
            "line 3: the vertices have no property \"y\"",
        ),
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
        assail(&written(&mesh), parse);
    }
}

proptest! {
    #[test]
    fn meshes_read_back(mesh in any_mesh()) {
        for encoding in ENCODINGS {
            let file = file(&written_as(&mesh, encoding)).unwrap();
            prop_assert_eq!((&file.mesh, &file.left_out), (&mesh, &vec![]));
        }
    }
}
