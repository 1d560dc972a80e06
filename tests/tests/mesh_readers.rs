//! The readers of OBJ and PLY against those of other authors, on real meshes in every encoding and on tricky files.
//!
//! The other OBJ reader numbers the vertices anew, so that corners are compared by their coordinates; both it and the
//! other PLY reader hold 32-bit numbers where the file means such.

use std::path::{Path, PathBuf};

use habitus::io::mesh::{self, Encoding, MeshFile, ReadOptions, WriteOptions, obj, ply};
use habitus::mesh::Mesh;
use habitus_tests::data::dir_or_skip;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

/// All meshes, a body, and scans with labels, with and without triangles.
fn real_files(data: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(data.join("meshes")).expect("the meshes");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "ply"));
    paths.sort();
    assert!(paths.len() > 5);
    for name in ["bodies/model/average_body_dec.ply", "faces/scans/scan_02.ply", "bodies/scans/scan_10.ply"] {
        paths.push(data.join(name));
    }
    paths
}

/// The corners of all triangles as another reader has them, in file order.
fn corners_by_tobj(bytes: &[u8]) -> Vec<[f32; 3]> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    let no_materials = |_: &Path| Err(tobj::LoadError::GenericFailure);
    let (models, _) = tobj::load_obj_buf(&mut &bytes[..], &options, no_materials).expect("the other reader reads it");
    let corners = models.iter().flat_map(|model| {
        let positions = model.mesh.positions.as_chunks::<3>().0;
        model.mesh.indices.iter().map(|&vertex| positions[vertex as usize])
    });
    corners.collect()
}

fn assert_same_obj(bytes: &[u8], what: &str) -> Mesh {
    let mesh = obj::parse(bytes, Path::new(what), &ReadOptions::default()).expect("we read it").mesh;
    let corners = mesh.faces.iter().flatten().map(|&vertex| mesh.positions[vertex as usize].map(|x| x as f32));
    assert!(corners.eq(corners_by_tobj(bytes)), "{what}: the corners differ");
    mesh
}

#[test]
fn real_meshes_as_obj_have_the_corners_that_another_reader_sees() {
    let Some(data) = dir_or_skip("real_meshes_as_obj_have_the_corners_that_another_reader_sees") else { return };
    for path in real_files(&data) {
        let file = mesh::read_file(&path, &ReadOptions::default()).expect("a real mesh");
        let written = obj::format(&file, &WriteOptions::default()).expect("it is written");
        let again = assert_same_obj(&written.bytes, &path.display().to_string());
        assert_eq!((again.positions, again.faces), (file.mesh.positions, file.mesh.faces));
    }
}

#[test]
fn tricky_obj_files_have_the_corners_that_another_reader_sees() {
    let vertices = "v 0.1 0.2 0.3\nv 1e0 -0.0 1\nv 1 1 .5\nv 0 1 -1.5e-3\nv -1 0.5 7\n";
    for (what, text) in [
        ("polygons", format!("{vertices}f 1 2 3 4 5\nf 5 4 3 2\nf 1 3 2\n")),
        ("negative indices", format!("{vertices}f -5 -4 -3\nv 9 9 9\nf -1 -2 -3 -4\n")),
        (
            "all forms of corners",
            format!("{vertices}vt 0 0\nvn 0 0 1\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\nf 1/1/1 2/1/1 5/1/1\n"),
        ),
        ("groups, objects, lines, points", format!("o a\n{vertices}g b c\ns 1\nf 1 2 3\nl 1 2\np 4\no d\nf 3 4 5\n")),
        // Behind a face the other reader knows no comment.
        ("comments and blank lines", format!("# a\n\n{vertices}\n# b\nf 1 2 3\n#c\n")),
        ("carriage returns", format!("{vertices}f 1 2 3 4\n").replace('\n', "\r\n")),
        ("tabs and spaces", "v\t0  0 0 \nv 1\t0 0\n v 0 1 0\nf 1  2\t3 \n".to_owned()),
        ("colours", "v 0 0 0 1 0.5 0\nv 1 0 0 0 0 0\nv 0 1 0 1 1 1\nf 1 2 3\n".to_owned()),
    ] {
        let mesh = assert_same_obj(text.as_bytes(), what);
        assert!(!mesh.faces.is_empty(), "{what}");
    }
}

/// A number as an `f64`, and whether the other reader holds it in 32 bits.
fn number(property: &Property) -> (f64, bool) {
    match *property {
        Property::Char(x) => (x.into(), false),
        Property::UChar(x) => (x.into(), false),
        Property::Short(x) => (x.into(), false),
        Property::UShort(x) => (x.into(), false),
        Property::Int(x) => (x.into(), false),
        Property::UInt(x) => (x.into(), false),
        Property::Float(x) => (x.into(), true),
        Property::Double(x) => (x, false),
        _ => panic!("a list where a number is expected"),
    }
}

fn indices(property: &Property) -> Vec<i64> {
    match property {
        Property::ListChar(list) => list.iter().map(|&x| x.into()).collect(),
        Property::ListUChar(list) => list.iter().map(|&x| x.into()).collect(),
        Property::ListShort(list) => list.iter().map(|&x| x.into()).collect(),
        Property::ListUShort(list) => list.iter().map(|&x| x.into()).collect(),
        Property::ListInt(list) => list.iter().map(|&x| x.into()).collect(),
        Property::ListUInt(list) => list.iter().map(|&x| x.into()).collect(),
        _ => panic!("no list of integers"),
    }
}

/// Compares positions, normals, colours in bytes, attributes and faces with what another reader sees.
fn assert_same_ply(bytes: &[u8], what: &str) -> MeshFile {
    let file = ply::parse(bytes, Path::new(what), &ReadOptions::default()).expect("we read it");
    let other = Parser::<DefaultElement>::new().read_ply(&mut &bytes[..]).expect("the other reader reads it");
    let mesh = &file.mesh;
    let vertices = &other.payload["vertex"];
    assert_eq!(mesh.positions.len(), vertices.len(), "{what}");
    let assert_column = |name: &str, value: &dyn Fn(usize) -> f64| {
        for (vertex, element) in vertices.iter().enumerate() {
            let (expected, is_short) = number(&element[name]);
            let found = value(vertex);
            let found = if is_short { f64::from(found as f32) } else { found };
            assert!(
                found == expected || found.is_nan() && expected.is_nan(),
                "{what}: {name} of {vertex}: {found} {expected}"
            );
        }
    };
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        assert_column(name, &|vertex| mesh.positions[vertex][axis]);
    }
    for (axis, name) in ["nx", "ny", "nz"].into_iter().enumerate().filter(|_| !mesh.normals.is_empty()) {
        assert_column(name, &|vertex| mesh.normals[vertex][axis]);
    }
    for (channel, name) in ["red", "green", "blue"].into_iter().enumerate().filter(|_| !mesh.colours.is_empty()) {
        assert_column(name, &|vertex| f64::from(mesh.colours[vertex][channel]));
    }
    for attribute in &mesh.attributes {
        assert_column(&attribute.name, &|vertex| attribute.values[vertex]);
    }
    let mut triangles = Vec::new();
    for face in other.payload.get("face").into_iter().flatten() {
        let polygon = indices(face.get("vertex_indices").or(face.get("vertex_index")).expect("corners"));
        triangles.extend((2..polygon.len()).map(|at| [polygon[0], polygon[at - 1], polygon[at]]));
    }
    assert!(mesh.faces.iter().map(|face| face.map(i64::from)).eq(triangles), "{what}: the faces differ");
    file
}

#[test]
fn real_meshes_as_ply_are_what_another_reader_sees() {
    let Some(data) = dir_or_skip("real_meshes_as_ply_are_what_another_reader_sees") else { return };
    let mut n_attributes = 0;
    for path in real_files(&data) {
        let what = path.display().to_string();
        let file = assert_same_ply(&std::fs::read(&path).expect("a real file"), &what);
        n_attributes += file.mesh.attributes.len();
        for encoding in [Encoding::Binary, Encoding::BigEndian, Encoding::Text] {
            let written = ply::format(&file, &WriteOptions { encoding }).expect("it is written");
            assert_eq!(written.left_out, [""; 0]);
            assert_eq!(assert_same_ply(&written.bytes, &what), file, "{what}: {encoding:?}");
        }
    }
    assert_eq!(n_attributes, 2, "the labels of the scans");
}

#[test]
fn tricky_ply_files_are_what_another_reader_sees() {
    let vertex = "element vertex 4\nproperty short x\nproperty uchar label\nproperty double y\nproperty float32 z\n\
                  property int8 nx\nproperty float ny\nproperty float64 nz\nproperty uint8 red\nproperty uchar green\n\
                  property uchar blue\nproperty uchar alpha\nproperty list uchar int16 tags\n";
    let face = "element face 2\nproperty uint flags\nproperty list uint8 ushort vertex_index\n";
    let vertices = "-7 1 0.25 1.5 0 0 1 255 0 7 9 0\n0 2 1e-3 -0.5 1 0 0 0 0 0 255 2 -1 -2\n\
                    1 3 0 0 -1 0.1 0 1 2 3 4 0\n9 4 1e300 3 0 1 0 9 9 9 9 1 5\n";
    let faces = "7 3 0 1 2\n8 4 3 2 1 0\n";
    let head = "ply\nformat ascii 1.0\ncomment a\nobj_info b\n";
    for (what, text) in [
        ("vertices first", format!("{head}{vertex}{face}end_header\n{vertices}{faces}")),
        ("faces first", format!("{head}{face}{vertex}end_header\n{faces}{vertices}")),
        ("carriage returns", format!("{head}{vertex}{face}end_header\n{vertices}{faces}").replace('\n', "\r\n")),
        ("a cloud", format!("{head}{vertex}end_header\n{vertices}")),
    ] {
        let file = assert_same_ply(text.as_bytes(), what);
        assert_eq!(file.mesh.attributes.len(), 2, "{what}");
        for encoding in [Encoding::Binary, Encoding::BigEndian, Encoding::Text] {
            let written = ply::format(&file, &WriteOptions { encoding }).expect("it is written");
            assert_eq!(assert_same_ply(&written.bytes, what).mesh, file.mesh, "{what}: {encoding:?}");
        }
    }
}
