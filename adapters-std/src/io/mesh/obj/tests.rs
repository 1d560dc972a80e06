//! Tests of the OBJ reader and writer.

use super::super::samples::{any_mesh, assail, kept, meshes};
use super::*;
use crate::mesh::Mesh;
use proptest::prelude::*;

fn file(text: &str) -> MeshFile {
    parse(text.as_bytes(), Path::new("t.obj"), &ReadOptions::default()).expect("an OBJ file")
}

fn mesh(text: &str) -> Mesh {
    file(text).mesh
}

fn left_out(text: &str) -> String {
    file(text).left_out.join("; ")
}

fn error(text: &str) -> String {
    parse(text.as_bytes(), Path::new("t.obj"), &ReadOptions::default()).expect_err("must be refused").to_string()
}

fn written(mesh: &Mesh) -> Vec<u8> {
    format(&mesh.clone().into(), &WriteOptions::default()).expect("any mesh is written").bytes
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn every_form_of_corner_and_polygon_is_read() {
    let tail = "vt 0 0\nvn 0 0 1\n";
    for face in [
        "f 1 2 3 4",
        "f 1/1 2/1 3/1 4/1",
        "f 1//1 2//1 3//1 4//1",
        "f 1/1/1 2/1/1 3/1/1 4/1/1",
        "f -4 -3 -2 -1",
        "f -4/-1/-1 -3/-1/-1 -2//-1 -1//-1",
        "f\t1  2 \\\n 3\\\r\n4",
    ] {
        let mesh = mesh(&format!("{SQUARE}{tail}{face}\n"));
        assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3]], "{face}");
        assert_eq!(
            mesh.normals.len(),
            if face.contains("-1/-1") || face.contains("/1/1") || face.contains("//1") { 4 } else { 0 }
        );
    }
}

#[test]
fn what_is_not_geometry_is_passed_over() {
    let text = "# C:\\models\\\nmtllib a b.mtl\no head\ng a b\ns off\nusemtl skin\nv 0 0 0 1.0 # w\r\n\
                v 1 0 0\r\nl 1 2\nv 0 1 0\nf 1 2 3";
    let mesh = mesh(text);
    assert_eq!((mesh.positions.len(), mesh.faces), (3, vec![[0, 1, 2]]));
}

#[test]
fn unused_and_equal_vertices_stay() {
    let mesh = mesh("v 0 0 0\nv 0 0 0\nv 1 0 0\nv 9 9 9\nv 0 1 0\nf 5 3 2\n");
    assert_eq!((mesh.positions.len(), mesh.positions[3], mesh.faces), (5, [9.0; 3], vec![[4, 2, 1]]));
}

#[test]
fn normals_need_to_be_one_per_vertex() {
    let normals = "vn 0 0 1\nvn 1 0 0\nvn 0 0 1\n";
    let of = |face: &str| mesh(&format!("{SQUARE}{normals}{face}")).normals;
    assert_eq!(of("f 1//2 2//1 3//1 4//1")[0], [1.0, 0.0, 0.0]);
    assert!(of("f 1//1 2//1 3//1\nf 1//2 3//1 4//1").is_empty(), "a crease");
    assert_eq!(of("f 1//1 2//1 3//1\nf 1//3 3//1 4//1").len(), 4, "the same normal written twice");
    assert!(of("f 1//1 2//1 3//1").is_empty(), "vertex 4 has none");
    assert!(of("f 1//1 2//1 3//1 4").is_empty(), "a corner has none");
    assert!(mesh("v 0 0 0\nvn 0 0 1\nv 1 0 0\nvn 0 1 0\n").normals.len() == 2, "a point cloud");
}

#[test]
fn colours_run_to_one_or_to_255() {
    assert_eq!(mesh("v 0 0 0 1 0.5 0\nv 0 0 0 0 0 0.25").colours, [[255, 128, 0], [0, 0, 64]]);
    assert_eq!(mesh("v 0 0 0 255 128 0\nv 0 0 0 1 1 1").colours, [[255, 128, 0], [1, 1, 1]]);
    assert!(mesh("v 0 0 0 1 1 1\nv 0 0 0").colours.is_empty());
    assert!(error("v 0 0 0 1 1 -1").contains("line 1: a colour"));
}

#[test]
fn errors_name_the_line_and_the_remedy() {
    for (text, message) in [
        ("", "t.obj, line 1: there is no vertex"),
        ("# c\nf 1 2 3", "t.obj, line 2: there is no vertex"),
        ("v 0 0 0\n\0", "t.obj, byte 8: a zero byte, which text does not have: the file is binary"),
        ("\u{feff}v\0", "t.obj, byte 4: a zero byte"),
        ("v 0 0 nan", "line 1: the vertex has \"nan\" where a finite number"),
        ("v 0 0", "line 1: the vertex ends before its z"),
        ("v 0 0 0 0 0", "line 1: a vertex of 5 numbers"),
        ("v 0 0 0\nv 1 \\\n 0 0\nv 0 1 0\n\nf 1 2 4", "line 6: a face names vertex 4, but the file has 3"),
        ("v 0 0 0\nf 1 1 0", "line 2: \"0\" names vertex 0; indices count from 1"),
        ("v 0 0 0\nf 1 1 -2", "line 2: \"-2\" names vertex -2, but 1 precede"),
        ("v 0 0 0\nf 1 1", "line 2: a face of 2 corners"),
        ("v 0 0 0\nf 1 1 x", "line 2: \"x\" is no corner"),
        ("v 0 0 0\nf 1 1 1/x", "line 2: \"1/x\" is no corner"),
        ("v 0 0 0\nf 1 1 1/1/1/1", "line 2: \"1/1/1/1\" is no corner"),
        ("v 0 0 0\nf 1//1 1//1 1//1", "line 2: a face names normal 1, but the file has 0"),
        ("v 0 0 0\nf 1 1 99999999999999999999", "is no corner"),
        ("v 0 0 0\nf 1 1 99999999999", "names vertex 99999999999"),
    ] {
        assert!(error(text).contains(message), "{text:?}: {}", error(text));
    }
}

#[test]
fn utf_16_is_told() {
    let text: Vec<u8> = "\u{feff}v 0 0 0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let error = parse(&text, Path::new("t.obj"), &ReadOptions::default()).expect_err("must be refused");
    assert_eq!(error.to_string(), "t.obj, byte 0: the text is UTF-16: save it as UTF-8");
}

#[test]
fn what_is_left_out_is_counted() {
    let text = "mtllib a\no b\ng c\ng d\nusemtl e\nvt 0 0\nvt 1 0\nvp 0\nwind 1\nv 0 0 0 0.5\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
                vn 0 0 1\nf 1/1 2 3//1 4\nl 1 2\np 1\n";
    assert_eq!(
        left_out(text),
        "1 normal (3 corners of faces have none); 1 weight of a vertex other than 1; 1 polygon with more than 3 corners \
         (divided into triangles); 2 texture coordinates; 2 lines of groups; 1 object name; 1 change of the material; \
         1 material library; 1 polyline; 1 point element; 1 line of free-form curves and surfaces; \
         1 line \"wind\", which OBJ does not know"
    );
    assert_eq!(left_out("v 0 0 0 1\nv 1 0 0 1 1 1\n"), "1 colour (not every vertex has one)");
    assert_eq!(
        left_out("v 0 0 0 0.5 0 0 0.5\n"),
        "1 colour finer than 8 bits a channel (rounded); 1 opacity of a vertex"
    );
    assert_eq!(left_out("v 0 0 0 0 0 255 255\nv 0 0 0 1 1 1 0\n"), "1 opacity of a vertex");
    let crease = format!("{SQUARE}vn 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//2 3//1 4//1");
    assert_eq!(left_out(&crease), "2 normals (1 corners of faces disagree with others of their vertex)");
    assert_eq!(left_out("v 0 0 0\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\nf 1//2 1//2 1//2"), "2 normals that no face uses");
    let words: String = ('a'..'f').map(|c| format!("{c}{c}\n")).collect();
    assert!(left_out(&format!("v 0 0 0\n{words}xx\nyy\naa\n")).ends_with("2 other lines that OBJ does not know"));
    assert_eq!(left_out(SQUARE), "");
}

#[test]
fn faces_may_stand_before_what_they_name() {
    let mesh = mesh(&format!("f 1//1 2//2 3//1 4//1\nvn 0 0 1\nvn 0 1 0\n{SQUARE}"));
    assert_eq!((mesh.faces.len(), mesh.normals[1]), (2, [0.0, 1.0, 0.0]));
}

#[test]
fn every_line_end_is_read() {
    let text = format!("\u{feff}# made by hand\n{SQUARE}f 1 2 \\\n3 4\n");
    for end in ["\n", "\r\n", "\r"] {
        assert_eq!(mesh(&text.replace('\n', end)).faces.len(), 2);
        assert!(error(&format!("{text}v 1").replace('\n', end)).contains("line 8: the vertex ends"));
    }
}

#[test]
fn what_is_not_finite_is_kept_on_demand() {
    let bytes = b"v nan -nan(ind) 0\nv 1.#INF 1 1\nv 1 1 1\nvn -1.#IND 0 0\nf 1 2 3";
    let mesh = kept(bytes, parse).expect("kept");
    assert!(mesh.positions[0][1].is_nan() && mesh.positions[1][0] == f64::INFINITY);
    assert!(error("v nan 0 0").contains("line 1") && error("v nan 0 0").contains("habitus clean"));
}

#[test]
fn what_obj_cannot_hold_is_named() {
    for file in super::super::samples::rich_files() {
        let left_out = format(&file, &WriteOptions::default()).expect("written").left_out;
        assert_eq!(
            left_out.len(),
            file.mesh.attributes.len() + usize::from(!file.morphs.is_empty()) + usize::from(file.skin.is_some())
        );
    }
}

#[test]
fn hostile_bytes_are_refused_or_harmless() {
    for mesh in meshes() {
        assail(&written(&mesh), parse);
    }
    assail(b"o a\nv 0 0 0 1 1 1\nv 1 0 0 0 0 0\nv 0 1 0 1 0 1\nvn 0 0 1\nf 1/1/1 -2//1 \\\n3/2/1\n# e", parse);
}

proptest! {
    #[test]
    fn meshes_read_back(mesh in any_mesh()) {
        let file = parse(&written(&mesh), Path::new("t.obj"), &ReadOptions::default()).unwrap();
        prop_assert_eq!((file.mesh, file.left_out), (Mesh { attributes: vec![], ..mesh }, vec![]));
    }
}
