//! Tests of whole glTF files: what was written reads back, what others write is read, hostile files are refused.

use proptest::prelude::*;
use serde_json::json;

use super::super::samples::{any_mesh, assail, kept};
use super::super::{Joint, MorphTarget, Skin};
use super::*;
use crate::mesh::{Attribute, Mesh, Scalar};

fn outcome(bytes: &[u8]) -> Result<MeshFile, Error> {
    parse(bytes, Path::new("t.glb"), &ReadOptions::default())
}

fn error(bytes: &[u8]) -> String {
    outcome(bytes).expect_err("must be refused").to_string()
}

/// A mesh with everything, in numbers that `f32` holds.
fn rich() -> MeshFile {
    let attribute =
        |name: &str, scalar, values: [f64; 4]| Attribute { name: name.into(), scalar, values: values.to_vec() };
    let mesh = Mesh {
        positions: vec![[0.0, 0.0, -0.0], [100.0, 0.0, 0.125], [100.0, 200.0, 0.0], [f64::from(0.1f32), 200.0, -1.0]],
        faces: vec![[0, 1, 2], [0, 2, 3]],
        normals: vec![[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
        colours: vec![[0, 1, 255], [10, 20, 30], [128, 128, 128], [255; 3]],
        attributes: vec![
            attribute("confidence", Scalar::F32, [0.5, 0.25, 1.0, 0.0]),
            attribute("label", Scalar::U8, [0.0, 1.0, 2.0, 255.0]),
        ],
    };
    let bind = |position: [f64; 3]| [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], position];
    let joint = |name: &str, parent, position| Joint { name: name.into(), parent, bind: bind(position) };
    let joints = vec![
        joint("hips", None, [50.0, 10.0, 0.0]),
        joint("spine", Some(0), [50.0, 100.0, 0.0]),
        joint("arm", Some(1), [90.0, 150.0, 8.0]),
    ];
    let mut influences = vec![vec![(0, 1.0)], vec![(0, 0.5), (2, 0.5)], vec![(1, 0.25), (2, 0.75)]];
    influences.push(vec![(2, 0.5), (1, 0.25), (0, 0.25)]);
    let morphs = vec![
        MorphTarget { name: "smile".into(), displacements: vec![[0.0; 3]; 4] },
        MorphTarget { name: "jaw \"open\"".into(), displacements: vec![[0.0, -3.5, 0.25]; 4] },
    ];
    MeshFile { mesh, morphs, skin: Some(Skin { joints, influences }), left_out: Vec::new() }
}

/// The file written in both forms.
fn written(file: &MeshFile) -> [Formatted; 2] {
    [format, format_json].map(|format| format(file, &WriteOptions::default()).expect("it is written"))
}

#[test]
fn everything_reads_back_with_equal_numbers() {
    let all = rich();
    let plain = MeshFile { skin: None, morphs: Vec::new(), ..all.clone() };
    let cloud = MeshFile { mesh: Mesh { faces: Vec::new(), ..all.mesh.clone() }, ..plain.clone() };
    let morphed = MeshFile { skin: None, ..all.clone() };
    for file in [all, plain, cloud, morphed] {
        for written in written(&file) {
            assert!(written.left_out.is_empty(), "{:?}", written.left_out);
            let read = outcome(&written.bytes).expect("it is read");
            assert_eq!(read, file);
            let bits =
                |mesh: &Mesh| -> Vec<u64> { mesh.positions.as_flattened().iter().map(|x| x.to_bits()).collect() };
            assert_eq!(bits(&read.mesh), bits(&file.mesh));
        }
    }
}

#[test]
fn the_node_scales_by_exactly_a_thousandth() {
    let text = String::from_utf8(written(&rich())[1].bytes.clone()).expect("text");
    assert!(text.contains("0.001") && !text.contains("0.00100"), "{text}");
}

#[test]
fn what_f32_does_not_hold_is_named() {
    let mut file = MeshFile::from(rich().mesh);
    file.mesh.positions[1][0] = 0.1;
    file.mesh.normals[0] = [0.0, 0.0, 2.0];
    file.mesh.normals[1] = [0.0; 3];
    file.mesh.attributes[0].scalar = Scalar::F64;
    file.mesh.attributes[0].values[0] = 1e300;
    let left_out = &written(&file)[0].left_out;
    for clause in [
        "1 position rounded to f32, by 1.5e-9 at most",
        "1 length of a normal (made 1)",
        "1 normal without a direction (made 0 1 0)",
        "the attribute \"confidence\", which has the value",
    ] {
        assert!(left_out.iter().any(|found| found.starts_with(clause)), "{clause}: {left_out:?}");
    }
    let refusal = |file: &MeshFile| format(file, &WriteOptions::default()).expect_err("must be refused");
    file.mesh.positions[2][1] = 1e300;
    assert!(refusal(&file).contains("the position of vertex 2"));
    let mut file = rich();
    file.morphs[1].displacements.pop();
    assert!(refusal(&file).contains("has 3 displacements for 4 vertices"));
    let mut file = rich();
    file.skin.as_mut().unwrap().influences[0][0].0 = 3;
    assert!(refusal(&file).contains("joint 3 moves vertex 0, but there are 3"));
    let mut file = rich();
    file.skin.as_mut().unwrap().joints[1].bind[0] = [1.0, 1.0, 0.0];
    assert!(refusal(&file).contains("joint 1: the axes of its frame are not perpendicular"));
}

/// A document of one triangle, in metres, whose numbers stand in a data URI; `change` spoils it.
fn triangle(change: impl Fn(&mut Value)) -> Vec<u8> {
    let numbers: Vec<u8> =
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let indices = [0u8, 1, 2, 0];
    let uri = base64::engine::general_purpose::STANDARD.encode([&numbers[..], &indices].concat());
    let mut root = json!({
        "asset": {"version": "2.0"},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 3}],
        "buffers": [{"byteLength": 40, "uri": format!("data:application/octet-stream;base64,{uri}")}],
    });
    change(&mut root);
    root.to_string().into_bytes()
}

#[test]
fn nodes_place_the_mesh_and_metres_become_millimetres() {
    let file = outcome(&triangle(|_| ())).expect("a triangle");
    assert_eq!(file.mesh.positions, [[0.0; 3], [1000.0, 0.0, 0.0], [0.0, 1000.0, 0.0]]);
    let file =
        outcome(&triangle(|root| root["nodes"] = json!([{"mesh": 0, "translation": [0, 0, 2], "scale": [-1, 1, 1]}])));
    let mesh = file.expect("a mirrored triangle").mesh;
    assert_eq!((mesh.positions[1], mesh.faces[0]), ([-1000.0, 0.0, 2000.0], [0, 2, 1]));
    let twice = triangle(|root| {
        root["nodes"] = json!([{"mesh": 0, "children": [1]}, {"mesh": 0, "translation": [1, 0, 0]}]);
    });
    let mesh = outcome(&twice).expect("two triangles").mesh;
    assert_eq!((mesh.positions.len(), mesh.faces[1], mesh.positions[3]), (6, [3, 4, 5], [1000.0, 0.0, 0.0]));
}

#[test]
fn strips_and_fans_become_triangles() {
    let of_mode = |mode: u32| {
        triangle(move |root| {
            root["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0}, "indices": 1, "mode": mode});
            root["accessors"][0] = json!({"bufferView": 0, "componentType": 5121, "count": 5, "type": "VEC3"});
            root["accessors"][1] = json!({"bufferView": 0, "componentType": 5121, "count": 5, "type": "SCALAR"});
            // Bytes 0 1 2 3 4: the indices, and among the numbers of the positions.
            let uri = base64::engine::general_purpose::STANDARD.encode((0..40).collect::<Vec<u8>>());
            root["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{uri}"));
        })
    };
    let faces = |mode: u32| outcome(&of_mode(mode)).expect("a mesh").mesh.faces;
    assert_eq!(faces(5), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    assert_eq!(faces(6), [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    assert!(faces(0).is_empty());
    assert!(error(&of_mode(4)).contains("indices"), "{}", error(&of_mode(4)));
    assert!(error(&of_mode(9)).contains("mode"), "{}", error(&of_mode(9)));
}

#[test]
fn errors_name_the_path_in_the_document_and_where_it_stands() {
    type Spoil = fn(&mut Value);
    let spoilt: [(Spoil, &str); 12] = [
        (|root| root["asset"]["version"] = json!("1.0"), "asset.version: \"1.0\"; 2.0 is read"),
        (|root| root["asset"] = Value::Null, "asset: it is missing"),
        (
            |root| root["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
            "extensionsRequired: \"KHR_draco_mesh_compression\" is not read: save the file without it",
        ),
        (|root| root["accessors"][0]["byteOffset"] = json!(4), "accessors[0].byteOffset: 3 elements of 12 bytes"),
        (|root| root["accessors"][0]["count"] = json!(4_000_000_000u64), "accessors[0].count: more numbers than"),
        (|root| root["accessors"][0]["componentType"] = json!(5130), "accessors[0].componentType: 5130"),
        (|root| root["accessors"][1]["count"] = json!(2), "2"),
        (|root| root["nodes"][0]["mesh"] = json!(1), "nodes[0].mesh: it names meshes[1], but there are 1"),
        (|root| root["nodes"][0]["children"] = json!([0]), "nodes[0]: it is below itself"),
        (|root| root["buffers"][0]["uri"] = json!("data:;base64,?"), "buffers[0]"),
        (|root| root["buffers"][0]["uri"] = json!("../../etc/passwd"), "buffers[0]"),
        (|root| root["buffers"][0]["byteLength"] = json!(400), "buffers[0]"),
    ];
    for (spoil, message) in spoilt {
        let error = error(&triangle(spoil));
        assert!(error.contains(message) && error.starts_with("t.glb, line 1, column "), "{message}: {error}");
    }
    assert!(
        error(b"{\n\"asset\": [1,}").contains("line 2, column 13: the JSON of the document is wrong: expected value")
    );
    for bytes in [&b"glTG\x02\0\0\0"[..], b"", b"\xFF\xFE{\0", b"[1]"] {
        assert!(
            error(bytes).contains("byte 0: the file neither begins with \"glTF\", as a GLB file does, nor is it JSON")
        );
    }
    let mut glb = written(&rich())[0].bytes.clone();
    glb[20] = b'?';
    assert!(error(&glb).contains("byte 20: the JSON of the document is wrong"), "{}", error(&glb));
}

#[test]
fn a_value_of_the_document_is_at_its_line_and_column() {
    let text = "\u{feff}{\n  \"asset\": {\n    \"version\": \"1.0\" }\n}";
    assert!(
        error(text.as_bytes()).starts_with("t.glb, line 3, column 16: asset.version: \"1.0\""),
        "{}",
        error(text.as_bytes())
    );
    let empty = b"{\"asset\": {\"version\": \"2.0\"},\n \"meshes\": []}";
    assert!(error(empty).starts_with("t.glb, line 2, column 12: there is no vertex"), "{}", error(empty));
}

/// The byte at which these bytes begin in others.
fn found(bytes: &[u8], wanted: &[u8]) -> usize {
    bytes.windows(wanted.len()).position(|window| window == wanted).expect("they are there")
}

#[test]
fn a_value_of_a_binary_file_is_at_its_byte() {
    let sound = written(&rich())[0].bytes.clone();
    let (key, wrong) = (&b"\"componentType\":5126"[..], &b"\"componentType\":5999"[..]);
    let at = found(&sound, key);
    let mut bytes = sound.clone();
    bytes[at..at + key.len()].copy_from_slice(wrong);
    let place = format!("byte {}: ", at + "\"componentType\":".len());
    assert!(error(&bytes).contains(&place) && error(&bytes).contains("componentType: 5999"), "{}", error(&bytes));
}

#[test]
fn a_number_of_a_buffer_is_at_its_byte() {
    let sound = written(&rich())[0].bytes.clone();
    let spoilt = |at: usize, other: &[u8]| {
        let mut bytes = sound.clone();
        bytes[at..at + other.len()].copy_from_slice(other);
        error(&bytes)
    };
    let y = found(&sound, &[100.0f32, 200.0, 0.0].map(f32::to_le_bytes).concat()) + 4;
    let message = spoilt(y, &f32::NAN.to_le_bytes());
    assert!(message.contains(&format!("byte {y}: ")) && message.contains("of vertex 2 is not finite"), "{message}");
    let indices = [
        [0u8, 1, 2, 0, 2, 3].to_vec(),
        [0u16, 1, 2, 0, 2, 3].map(u16::to_le_bytes).concat(),
        [0u32, 1, 2, 0, 2, 3].map(u32::to_le_bytes).concat(),
    ];
    let width = [1, 2, 4]
        .into_iter()
        .zip(&indices)
        .find(|(_, list)| sound.windows(list.len()).any(|window| window == &list[..]));
    let (size, list) = width.expect("the indices are there");
    let at = found(&sound, list) + 4 * size;
    let message = spoilt(at, &[9]);
    assert!(message.contains(&format!("byte {at}: ")) && message.contains("element 4 names vertex 9"), "{message}");
    // In a document of text the number has a byte of its buffer, and its accessor or attribute a line.
    let text = triangle(|root| {
        let mut numbers = [0u8; 40];
        numbers[37..39].copy_from_slice(&[1, 9]);
        let uri = base64::engine::general_purpose::STANDARD.encode(numbers);
        root["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{uri}"));
    });
    let message = error(&text);
    let column = 1 + found(&text, b"{\"bufferView\":1");
    assert!(message.starts_with(&format!("t.glb, line 1, column {column}: ")), "{message}");
    assert!(
        message.ends_with("accessors[1]: element 2 names vertex 9, but there are 3 (byte 38 of buffers[0])"),
        "{message}"
    );
}

#[test]
fn coordinates_that_are_not_finite_are_refused_or_kept() {
    let bytes = triangle(|root| {
        let mut numbers = [0u8; 40];
        numbers[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
        numbers[37..39].copy_from_slice(&[1, 2]);
        let uri = base64::engine::general_purpose::STANDARD.encode(numbers);
        root["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{uri}"));
    });
    assert!(error(&bytes).contains("habitus clean"), "{}", error(&bytes));
    assert!(kept(&bytes, parse).expect("kept").positions[0][1].is_nan());
}

#[test]
fn what_others_write_beside_the_mesh_is_named() {
    let file = outcome(&triangle(|root| {
        root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(0);
        root["meshes"][0]["primitives"][0]["material"] = json!(0);
        root["materials"] = json!([{}]);
        root["animations"] = json!([{"channels": [], "samplers": []}]);
        root["cameras"] = json!([{"type": "perspective"}]);
    }));
    let left_out = file.expect("a triangle").left_out.join("; ");
    for word in ["3 texture coordinates", "material", "animation", "camera"] {
        assert!(left_out.contains(word), "{word}: {left_out}");
    }
}

#[test]
fn hostile_bytes_are_refused_or_harmless() {
    let mut small = rich();
    small.mesh.attributes.pop();
    small.morphs.pop();
    assail(&written(&small)[0].bytes, parse);
    assail(&triangle(|_| ()), parse);
}

proptest! {
    #[test]
    fn meshes_of_f32_read_back(mesh in any_mesh()) {
        let short = |x: &f64| f64::from((*x as f32).clamp(f32::MIN, f32::MAX));
        let vector = |v: &[f64; 3]| [short(&v[0]), short(&v[1]), short(&v[2])];
        let mesh = Mesh {
            positions: mesh.positions.iter().map(vector).collect(),
            normals: mesh.normals.iter().map(|_| [0.0, 0.6f32.into(), 0.8f32.into()]).collect(),
            attributes: Vec::new(),
            ..mesh
        };
        for written in written(&mesh.clone().into()) {
            prop_assert!(written.left_out.is_empty(), "{:?}", written.left_out);
            prop_assert_eq!(&parse(&written.bytes, Path::new("t"), &ReadOptions::default()).unwrap().mesh, &mesh);
        }
    }
}
