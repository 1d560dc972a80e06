//! Broken files of the formats that are not text: STL, GLB, NPY.

use habitus::io::mesh::{MeshFile, WriteOptions, gltf};
use habitus::mesh::Mesh;

use super::table::{Row, cleaned, refused};

const CORNERS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const OUTWARD: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
const TETRAHEDRON: [usize; 5] = [4, 4, 1, 0, 0];

/// A tetrahedron as STL of text.
fn stl_text() -> String {
    let facet = |face: &[u32; 3]| {
        let vertex = |corner: &u32| {
            let [x, y, z] = CORNERS[*corner as usize];
            format!("vertex {x} {y} {z}\n")
        };
        let corners: String = face.iter().map(vertex).collect();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    };
    format!("solid a\n{}endsolid a\n", OUTWARD.iter().map(facet).collect::<String>())
}

/// A tetrahedron as binary STL whose header begins with this.
fn stl_binary(begin: &[u8]) -> Vec<u8> {
    let mut bytes = begin.to_vec();
    bytes.resize(80, b' ');
    bytes.extend(4_u32.to_le_bytes());
    for face in OUTWARD {
        let corners = face.iter().flat_map(|&corner| CORNERS[corner as usize]);
        let numbers = [0.0; 3].into_iter().chain(corners);
        bytes.extend(numbers.flat_map(|number| (number as f32).to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

/// A tetrahedron as GLB.
fn glb() -> Vec<u8> {
    let mesh = Mesh { positions: CORNERS.to_vec(), faces: OUTWARD.to_vec(), ..Mesh::default() };
    gltf::format(&MeshFile::from(mesh), &WriteOptions::default()).expect("a tetrahedron can be written").bytes
}

/// The GLB with a piece of its JSON replaced by one of the same length.
fn glb_with(piece: &str, other: &str) -> Vec<u8> {
    assert_eq!(piece.len(), other.len());
    let mut bytes = glb();
    let at = bytes.windows(piece.len()).position(|window| window == piece.as_bytes()).expect("the piece is there");
    bytes[at..at + piece.len()].copy_from_slice(other.as_bytes());
    bytes
}

/// The GLB with other bytes at a place.
fn glb_at(place: usize, other: &[u8]) -> Vec<u8> {
    let mut bytes = glb();
    bytes[place..place + other.len()].copy_from_slice(other);
    bytes
}

/// An NPY file whose header announces this shape, with so many numbers behind it.
fn npy(shape: &str, n_numbers: usize) -> Vec<u8> {
    let mut header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend((0..n_numbers).flat_map(|i| (i as f64).to_le_bytes()));
    bytes
}

const OLD: &str = "{\n  \"asset\": {\"version\": \"1.0\"}\n}\n";

pub fn rows() -> Vec<Row> {
    let (text, binary, glb) = (stl_text(), stl_binary(b"made by hand"), glb());
    let half = text.lines().take(10).map(|line| format!("{line}\n")).collect::<String>();
    vec![
        cleaned("STL, text", "a.stl", text.clone(), TETRAHEDRON, &[]),
        refused("STL, text, truncated", "a.stl", half, &["a.stl, line 11", "endsolid", "truncated"]),
        refused(
            "STL, text, coordinate that is no number",
            "a.stl",
            text.replacen("vertex 1 0 0", "vertex 1 o 0", 1),
            &["line 6", "\"o\""],
        ),
        refused("STL, text, facet of two corners", "a.stl", text.replacen("vertex 1 0 0\n", "", 1), &["2 corners"]),
        cleaned("STL, binary", "a.stl", binary.clone(), TETRAHEDRON, &[]),
        cleaned("STL, binary, begins with \"solid\"", "a.stl", stl_binary(b"solid but binary"), TETRAHEDRON, &[]),
        refused(
            "STL, binary, truncated",
            "a.stl",
            binary[..binary.len() - 30].to_vec(),
            &["byte 80", "4 triangles take 200 bytes, but 170 follow", "truncated"],
        ),
        refused("STL, binary, without triangles", "a.stl", vec![0; 84], &["byte 80", "no vertex"]),
        refused("STL, text, without facets", "a.stl", "solid a\nendsolid a\n", &["line 3", "no vertex"]),
        refused("STL, shorter than a header", "a.stl", binary[..50].to_vec(), &["byte 0", "50 bytes"]),
        cleaned("GLB", "a.glb", glb.clone(), TETRAHEDRON, &[]),
        refused("GLB, truncated", "a.glb", glb[..glb.len() - 8].to_vec(), &["byte 8", "truncated"]),
        refused("GLB, announced too long", "a.glb", glb_at(8, &[0xff, 0xff]), &["byte 8", "65535 bytes", "truncated"]),
        refused("GLB, chunk too long", "a.glb", glb_at(12, &[0xff, 0xff]), &["byte 12", "a chunk of 65535 bytes"]),
        refused("GLB, version 1", "a.glb", glb_at(4, &[1]), &["byte 4", "version 1", "2.0"]),
        refused(
            "GLB, accessor longer than its view",
            "a.glb",
            glb_with("\"count\":4,", "\"count\":9,"),
            &["a.glb, byte ", "accessors[0]", "9 elements of 12 bytes", "the view has 48"],
        ),
        refused(
            "GLB, accessor of an unknown type",
            "a.glb",
            glb_with("\"componentType\":5126", "\"componentType\":5999"),
            &["accessors[", "componentType: 5999"],
        ),
        refused(
            "GLB, accessor of an absent view",
            "a.glb",
            glb_with("\"bufferView\":0", "\"bufferView\":7"),
            &["accessors[", "bufferView"],
        ),
        refused("GLB, JSON that is none", "a.glb", glb_with("\"asset\":", "\"asset\";"), &["a.glb, byte "]),
        refused("GLB without its magic", "a.glb", glb_at(0, b"X"), &["a.glb, byte 0", "neither begins with", "JSON"]),
        refused("glTF, UTF-16", "a.gltf", b"\xff\xfe{\0}\0".to_vec(), &["a.gltf, byte 0", "UTF-8"]),
        refused("glTF of another version", "a.gltf", OLD, &["a.gltf, line 2, column 24: asset.version"]),
        refused("glTF without meshes", "a.gltf", OLD.replace("1.0", "2.0"), &["a.gltf, line 1, column 1", "no vertex"]),
        cleaned("NPY, cloud", "a.npy", npy("(4, 3)", 12), [4, 0, 0, 0, 0], &[]),
        refused("NPY, transposed", "a.npy", npy("(3, 4)", 12), &["a.npy, byte 60", "[3, 4]", "[n, 3]", "transpose"]),
        refused("NPY, one dimension", "a.npy", npy("(12,)", 12), &["a.npy, byte 60", "[12]", "[n, 3]"]),
        refused("NPY without points", "a.npy", npy("(0, 3)", 0), &["a.npy, byte 60", "no vertex"]),
        refused(
            "NPY, truncated",
            "a.npy",
            npy("(4, 3)", 11),
            &["a.npy, byte 128", "[4, 3] of 8 bytes each", "88 bytes follow"],
        ),
        refused("NPY, no shape", "a.npy", npy("(4, three)", 12), &["a.npy", "shape"]),
    ]
}
