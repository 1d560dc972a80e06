//! The file layer on real files: their counts are those that their descriptions state.

use std::path::Path;

use habitus::io::landmarks::{FACE_LANDMARKS, LandmarkFile};
use habitus::io::{landmarks, mesh, npy};
use habitus::mesh::{Mesh, Scalar};
use habitus_tests::data::dir_or_skip;

/// Reads a mesh and checks that every format that is read and written gives it back.
fn read(path: &Path) -> Mesh {
    let original = mesh::read(path).expect("a real mesh is read");
    original.check().expect("its parts fit together");
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["a.ply", "a.obj", "a.off"] {
        let copy = folder.path().join(name);
        mesh::write(&copy, &original).expect("it is written");
        assert_eq!(mesh::read(&copy).expect("the copy is read"), original, "{} as {name}", path.display());
    }
    mesh::write(folder.path().join("a.glb"), &original).expect("it is written as GLB");
    original
}

#[test]
fn real_meshes_have_the_documented_counts() {
    let Some(data) = dir_or_skip("real_meshes_have_the_documented_counts") else { return };
    let counts = |name: &str| {
        let mesh = read(&data.join(name));
        (mesh.positions.len(), mesh.faces.len())
    };
    assert_eq!(counts("faces/model_neutral.ply"), (9409, 18460));
    assert_eq!(counts("bodies/model/average_body.ply"), (13380, 26756));
    assert_eq!(counts("bodies/model/average_body_dec.ply"), (6404, 12804));
    let described = std::fs::read(data.join("meshes/meshes.json")).expect("the description");
    let described: serde_json::Value = serde_json::from_slice(&described).expect("JSON");
    let meshes = described["meshes"].as_array().expect("a list of meshes");
    assert!(!meshes.is_empty());
    for entry in meshes {
        let number = |key: &str| entry[key].as_u64().expect("a count") as usize;
        let name = format!("meshes/{}", entry["file"].as_str().expect("a name"));
        assert_eq!(counts(&name), (number("vertices"), number("triangles")), "{name}");
    }
}

#[test]
fn real_scans_are_read_with_their_labels() {
    let Some(data) = dir_or_skip("real_scans_are_read_with_their_labels") else { return };
    for (scan, has_faces) in [("00", true), ("02", false)] {
        let mesh = mesh::read(data.join(format!("faces/scans/scan_{scan}.ply"))).expect("a scan");
        assert!((7_000..=25_000).contains(&mesh.positions.len()));
        assert_eq!(!mesh.faces.is_empty(), has_faces);
        let [label] = &mesh.attributes[..] else { panic!("one attribute") };
        assert_eq!((&label.name[..], label.scalar), ("label", Scalar::U8));
        assert!(label.values.iter().all(|&label| label <= 2.0) && label.values.contains(&1.0));
    }
}

#[test]
fn real_arrays_have_the_documented_shapes() {
    let Some(data) = dir_or_skip("real_arrays_have_the_documented_shapes") else { return };
    let (shape, values) = npy::read_f64(data.join("faces/tensor_test.npy")).expect("the test tensor");
    assert_eq!((shape, values.len()), (vec![12, 10, 2800, 3], 12 * 10 * 2800 * 3));
    assert!(values.iter().all(|x| x.is_finite() && x.abs() < 300.0));
    let (shape, triangles) = npy::read_u32(data.join("faces/dec_triangles.npy")).expect("the triangles");
    assert_eq!(shape, [5382, 3]);
    assert_eq!(triangles.iter().max(), Some(&2799));
    let (shape, _) = npy::read_f64(data.join("faces/model_expression_i16.npy")).expect("16-bit integers");
    assert_eq!(shape, [55, 9409, 3]);
}

#[test]
fn real_landmarks_snap_back_to_their_vertices() {
    let Some(data) = dir_or_skip("real_landmarks_snap_back_to_their_vertices") else { return };
    let file = landmarks::read(data.join("faces/model.json")).expect("the landmarks");
    let LandmarkFile::Vertices { names: Some(names), vertices } = &file else { panic!("vertices of the model") };
    assert_eq!(names[..], FACE_LANDMARKS);
    let face = mesh::read(data.join("faces/model_neutral.ply")).expect("the mean face");
    let mut text = "13\n".to_owned();
    for (name, &vertex) in names.iter().zip(vertices) {
        let [x, y, z] = face.positions[vertex as usize];
        text += &format!("{name}\n{x} {y} {z}\n");
    }
    let points = landmarks::parse(text.as_bytes(), Path::new("list")).expect("a labelled list");
    let snapped = points.snapped_to(&face).expect("vertices");
    assert_eq!(snapped, file.snapped_to(&face).expect("vertices"));
    let names = landmarks::read(data.join("faces/dec.json")).expect("the landmarks").names().map(<[_]>::to_vec);
    assert_eq!(names.expect("names"), FACE_LANDMARKS);
}
