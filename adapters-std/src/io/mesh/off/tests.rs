//! Tests of the OFF reader and writer.

use super::super::samples::{any_mesh, assail, kept, meshes, rich_files};
use super::*;
use proptest::prelude::*;

fn file(text: &str) -> MeshFile {
    parse(text.as_bytes(), Path::new("t.off"), &ReadOptions::default()).expect("an OFF file")
}

fn mesh(text: &str) -> Mesh {
    file(text).mesh
}

fn written(mesh: &Mesh) -> Vec<u8> {
    format(&mesh.clone().into(), &WriteOptions::default()).expect("any mesh is written").bytes
}

fn error(text: &str) -> String {
    parse(text.as_bytes(), Path::new("t.off"), &ReadOptions::default()).expect_err("must be refused").to_string()
}

#[test]
fn counts_stand_behind_the_keyword_or_below() {
    let body = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    for head in ["OFF\n4 1 0\n", "OFF 4 1 0\n", "OFF4 1 0\n", "# c\r\n\r\nOFF # c\r\n# c\r\n4 1\r\n"] {
        let mesh = mesh(&format!("{head}{body}"));
        assert_eq!((mesh.positions.len(), mesh.faces), (4, vec![[0, 1, 2], [0, 2, 3]]), "{head}");
    }
}

#[test]
fn colours_are_bytes_or_fractions() {
    assert_eq!(mesh("COFF\n2 0 0\n0 0 0 255 1 0 255\n0 0 0 1 1 1 255").colours, [[255, 1, 0], [1, 1, 1]]);
    assert_eq!(mesh("COFF\n2 0 0\n0 0 0 1 0 0\n0 0 0 0.5 1 1 1").colours, [[255, 0, 0], [128, 255, 255]]);
    let mesh = mesh("CNOFF\n1 0 0\n0 0 0 0 0 1 9 8 7 255");
    assert_eq!((mesh.normals, mesh.colours), (vec![[0.0, 0.0, 1.0]], vec![[9, 8, 7]]));
}

#[test]
fn colours_of_faces_are_passed_over() {
    assert_eq!(mesh("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 0.5 0.5 0.5\n").faces, [[0, 1, 2]]);
}

#[test]
fn errors_name_the_line_and_the_remedy() {
    for (text, message) in [
        ("", "line 1: the file ends before its keyword OFF"),
        ("4 1 0", "line 1: \"4 1 0\" where OFF, COFF"),
        ("OFF BINARY\n", "save it as text OFF"),
        ("NCOFF 1 0 0\n", "\"NCOFF 1 0 0\" where OFF, COFF"),
        ("ST4nOFF\n", "project them"),
        ("nOFF 3\n", "project them"),
        ("STOFF 1 0 0\n0 0 0 1", "line 2: the texture coordinates of the vertex have no number v"),
        ("OFF\nx", "line 2: \"x\" where the counts"),
        ("OFF # c\n\n0 0 0", "line 3: there is no vertex"),
        ("OFF 2 0 0\n0 0 0\n", "ends before vertex 1 of the 2"),
        ("OFF 4294967295 0 0\n0 0 0\n", "ends before vertex 1 of the 4294967295"),
        ("OFF 99999999999999999 0 0\n0 0 0\n", "it has 99999999999999999 vertices; at most"),
        ("OFF 1 0 0\n0 0 0\0", "byte 15: a zero byte"),
        ("OFF 1 0 0\n0 0 inf", "line 2: the vertex has \"inf\""),
        ("OFF 1 1 0\n0 0 0\n3 0 0 1", "line 3: a face names vertex 1; 0 to 0 are expected"),
        ("OFF 1 1 0\n0 0 0\n3 0 -1 0", "line 3: a face names vertex -1"),
        ("OFF 1 1 0\n0 0 0\nx 0 0", "line 3: \"x\" where a face's number of corners"),
        ("OFF 1 1 0\n0 0 0\n4 0 0 0", "a face of 4 corners has only 3"),
        ("OFF 1 0 0\n0 0 0\n3 0 0 0", "line 3: \"3 0 0 0\" follows the last face"),
        ("COFF 1 0 0\n0 0 0 256 0 0", "line 2: a colour"),
    ] {
        assert!(error(text).contains(message), "{text:?}: {}", error(text));
    }
}

#[test]
fn what_is_left_out_is_counted() {
    let text = "STCNOFF 4 4 0\n0 0 0 0 0 1 0.1 0.5 1.0 0.5 0 1\n1 0 0 0 0 1 0 0 0 1 1\n1 1 0 0 0 1 1 1 1 1 0 0 7\n\
                0 1 0 0 0 1 0 0 0 1 0 0\n4 0 1 2 3\n2 0 1\n1 0\n3 0 1 2 0.5 0.5 0.5\n";
    assert_eq!(
        file(text).left_out.join("; "),
        "1 colour finer than 8 bits a channel (rounded); 1 opacity of a vertex; 4 texture coordinates; \
         1 vertex's further numbers; 1 polygon with more than 3 corners (divided into triangles); \
         2 faces of fewer than 3 corners; 1 colour of a face"
    );
    assert_eq!((file(text).mesh.faces.len(), file(text).mesh.colours[2]), (3, [255; 3]));
    assert!(file("COFF 1 0 0\n0 0 0 255 1 0 255").left_out.is_empty());
}

#[test]
fn every_line_end_is_read() {
    let text = "\u{feff}OFF\n# c\n3 1 0\n0 0 0\n\n1\t0 0\n0 1 0\n3 0 1 2\n";
    for end in ["\n", "\r\n", "\r"] {
        assert_eq!(mesh(&text.replace('\n', end)).faces, [[0, 1, 2]]);
        assert!(error(&format!("{text}3").replace('\n', end)).contains("line 9: \"3\" follows"));
    }
}

#[test]
fn what_is_not_finite_is_kept_on_demand() {
    let mesh = kept(b"NOFF 1 0 0\nnan 0 1.#INF -1.#IND 0 0", parse).expect("kept");
    assert!(mesh.positions[0][0].is_nan() && mesh.positions[0][2] == f64::INFINITY && mesh.normals[0][0].is_nan());
    assert!(error("OFF 1 0 0\nnan 0 0").contains("habitus clean"));
}

#[test]
fn what_off_cannot_hold_is_named() {
    let named =
        rich_files().into_iter().map(|file| format(&file, &WriteOptions::default()).expect("written").left_out.len());
    assert!(named.eq([8, 10]));
}

#[test]
fn hostile_bytes_are_refused_or_harmless() {
    for mesh in meshes() {
        assail(&written(&mesh), parse);
    }
    assail(b"STCOFF 3 2 0\n0 0 0 1 0.5 1 1 0 0\n1 0 0 0 0 0 0 0\n0 1 nan 0 0 0 1 1 2\n3 0 1 2 7\n1 0\n", parse);
}

proptest! {
    #[test]
    fn meshes_read_back(mesh in any_mesh()) {
        let file = parse(&written(&mesh), Path::new("t.off"), &ReadOptions::default()).unwrap();
        prop_assert_eq!((file.mesh, file.left_out), (Mesh { attributes: vec![], ..mesh }, vec![]));
    }
}
