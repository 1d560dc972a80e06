//! Files that break their format, or use its odd corners.

use super::table::{Row, cleaned, refused};

const PLY: &str = "ply\nformat ascii 1.0\ncomment c\nelement vertex 3\nproperty float x\nproperty float y\n\
    property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const TRIANGLE: [usize; 5] = [3, 1, 1, 1, 0];

/// A triangle as a big-endian PLY.
fn big_endian() -> Vec<u8> {
    let (header, _) = PLY.split_once("0 0 0\n").expect("the first vertex");
    let mut bytes = header.replace("ascii", "binary_big_endian").into_bytes();
    for value in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(value.to_be_bytes());
    }
    bytes.push(3);
    bytes.extend([0_i32, 1, 2].iter().flat_map(|index| index.to_be_bytes()));
    bytes
}

/// The first bytes of a picture.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";

/// The text as Windows calls Unicode.
fn utf_16(text: &str) -> Vec<u8> {
    format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect()
}

pub fn rows() -> Vec<Row> {
    let big = big_endian();
    let cut = big[..big.len() - 5].to_vec();
    let five_million = PLY.replace("vertex 3", "vertex 5000000").replace("ascii", "binary_little_endian");
    let header_end = five_million.find("0 0 0\n").expect("the first vertex");
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    vec![
        cleaned("ascii PLY with a comment", "a.ply", PLY, TRIANGLE, &[]),
        cleaned("PLY, CRLF", "a.ply", PLY.replace('\n', "\r\n"), TRIANGLE, &[]),
        cleaned("PLY, lone CR", "a.ply", PLY.replace('\n', "\r"), TRIANGLE, &[]),
        cleaned(
            "PLY, exotic types",
            "a.ply",
            PLY.replace("float x", "int16 x").replace("float y", "uint8 y").replace("uchar int", "int32 uint16"),
            TRIANGLE,
            &[],
        ),
        cleaned("PLY, big endian", "a.ply", big, TRIANGLE, &[]),
        refused("PLY, binary, truncated", "a.ply", cut, &["a.ply", "byte", "truncated"]),
        refused(
            "PLY, 5M vertices over 10 bytes",
            "a.ply",
            five_million.as_bytes()[..header_end + 10].to_vec(),
            &["a.ply", "5000000"],
        ),
        refused("PLY, header without end", "a.ply", "ply\nformat ascii 1.0\n", &["end_header", "truncated"]),
        refused("PLY, unknown format", "a.ply", PLY.replace("ascii", "morse"), &["line 2", "morse"]),
        refused("PLY, unknown type", "a.ply", PLY.replace("float y", "quad y"), &["line 6", "quad"]),
        refused("PLY, index out of range", "a.ply", PLY.replace("3 0 1 2", "3 0 1 7"), &["a.ply", "line 14", "7"]),
        refused("PLY, other magic", "a.ply", "plx\n", &["line 1", "ply"]),
        refused("empty PLY", "a.ply", "", &["a.ply, line 1"]),
        refused("empty OFF", "a.off", "", &["a.off, line 1"]),
        refused("empty OBJ", "a.obj", "", &["a.obj, line 1", "no vertex"]),
        refused("OBJ without vertices", "a.obj", "# c\no a\n", &["a.obj, line 3", "no vertex"]),
        refused("OBJ, UTF-16", "a.obj", utf_16(obj), &["a.obj, byte 0", "UTF-16", "UTF-8"]),
        refused("OBJ that is a PNG", "a.obj", PNG, &["a.obj, byte 8", "zero byte", "binary"]),
        refused("OFF that is a PNG", "a.off", PNG, &["a.off, byte 8", "zero byte", "binary"]),
        refused("PLY, UTF-16", "a.ply", utf_16(PLY), &["a.ply, byte 0", "UTF-16"]),
        refused("PLY without z", "a.ply", PLY.replace("float z", "float w"), &["line 4", "\"z\""]),
        refused("PLY without vertices", "a.ply", "ply\nformat ascii 1.0\nend_header\n", &["line 3", "no vertex"]),
        cleaned(
            "OBJ, negative indices",
            "a.obj",
            format!("{obj}f -4 -3 -2\n"),
            [3, 1, 1, 1, 0],
            &["1 vertices without faces removed"],
        ),
        cleaned("OBJ, polygon", "a.obj", format!("{obj}f 1 2 3 4\n"), [4, 2, 1, 1, 0], &[]),
        cleaned(
            "OBJ, materials, groups, continued line",
            "a.obj",
            format!("mtllib a.mtl\n{obj}g g\nusemtl m\nf 1 2 \\\n3 4\n"),
            [4, 2, 1, 1, 0],
            &[],
        ),
        cleaned(
            "OBJ, CRLF and comments",
            "a.obj",
            format!("# c\n{obj}\n# c\nf 1 2 3 4 # c\n").replace('\n', "\r\n"),
            [4, 2, 1, 1, 0],
            &[],
        ),
        refused("OBJ, index out of range", "a.obj", format!("{obj}f 1 2 9\n"), &["line 5", "vertex 9", "has 4"]),
        refused("OBJ, negative index out of range", "a.obj", format!("{obj}f 1 2 -9\n"), &["line 5", "-9", "precede"]),
        refused("OBJ, index 0", "a.obj", format!("{obj}f 0 1 2\n"), &["line 5", "count from 1"]),
        refused("OBJ, face of two corners", "a.obj", format!("{obj}f 1 2\n"), &["line 5", "at least 3"]),
        refused("OBJ, corner that is no number", "a.obj", format!("{obj}f 1 2 x\n"), &["line 5", "no corner"]),
        refused("OFF, count too large", "a.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", &["truncated"]),
        refused(
            "OFF, count too small",
            "a.off",
            "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n",
            &["line 7", "too few"],
        ),
        refused(
            "OFF, index out of range",
            "a.off",
            "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
            &["line 6", "0 to 2"],
        ),
        refused("zero vertices", "a.off", "OFF\n0 0 0\n", &["a.off, line 2"]),
        refused("unknown extension", "a.xyz", "0 0 0\n", &["a.xyz"]),
    ]
}
