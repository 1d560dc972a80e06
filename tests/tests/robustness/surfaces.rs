//! Readable files whose surface is broken.

use super::table::{Row, cleaned, refused};

/// An OFF file.
fn off(vertices: &[&str], faces: &[&str]) -> String {
    let faces: Vec<String> = faces.iter().map(|face| format!("3 {face}\n")).collect();
    format!("OFF\n{} {} 0\n{}\n{}", vertices.len(), faces.len(), vertices.join("\n"), faces.concat())
}

const CORNERS: [&str; 4] = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];
const OUTWARD: [&str; 4] = ["0 2 1", "0 1 3", "0 3 2", "1 2 3"];

/// A tetrahedron with more vertices and faces.
fn tetrahedron_and(vertices: &[&str], faces: &[&str]) -> String {
    off(&[&CORNERS, vertices].concat(), &[&OUTWARD, faces].concat())
}

pub fn rows() -> Vec<Row> {
    let square = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"];
    vec![
        cleaned("sound tetrahedron", "a.off", tetrahedron_and(&[], &[]), [4, 4, 1, 0, 0], &[]),
        cleaned("one triangle", "a.off", off(&CORNERS[..3], &["0 1 2"]), [3, 1, 1, 1, 0], &[]),
        cleaned(
            "NaN vertex",
            "a.off",
            tetrahedron_and(&["nan 0 0"], &["0 1 4"]),
            [4, 4, 1, 0, 0],
            &["1 vertices with coordinates that are not finite", "1 faces of vertices that are not finite"],
        ),
        cleaned(
            "infinite vertex",
            "a.off",
            tetrahedron_and(&["0 -inf 0"], &["0 1 4"]),
            [4, 4, 1, 0, 0],
            &["1 vertices with coordinates that are not finite", "1 faces of vertices that are not finite"],
        ),
        refused("all vertices NaN", "a.off", off(&["nan 0 0"; 3], &["0 1 2"]), &["left"]),
        cleaned(
            "two components",
            "a.off",
            off(&["0 0 0", "1 0 0", "0 1 0", "5 0 0", "6 0 0", "5 1 0"], &["0 1 2", "3 4 5"]),
            [6, 2, 2, 2, 0],
            &[],
        ),
        cleaned(
            "bow-tie vertex",
            "a.off",
            off(&["0 0 0", "1 0 0", "0 1 0", "-1 0 0", "0 -1 0"], &["0 1 2", "0 3 4"]),
            [6, 2, 2, 2, 0],
            &["1 vertices with several fans", "1 vertices added"],
        ),
        cleaned(
            "faces flipped in part",
            "a.off",
            off(&CORNERS, &["0 1 2", "0 1 3", "0 3 2", "1 2 3"]),
            [4, 4, 1, 0, 0],
            &["1 faces turned"],
        ),
        cleaned(
            "everything inside out",
            "a.off",
            off(&CORNERS, &["0 1 2", "0 3 1", "0 2 3", "1 3 2"]),
            [4, 4, 1, 0, 0],
            &["4 faces turned"],
        ),
        cleaned("duplicate face", "a.off", tetrahedron_and(&[], &["2 1 0"]), [4, 4, 1, 0, 0], &["1 duplicate faces"]),
        cleaned(
            "face on the back of another",
            "a.off",
            tetrahedron_and(&[], &["1 2 0"]),
            [4, 4, 1, 0, 0],
            &["1 faces on the back"],
        ),
        cleaned(
            "repeated index",
            "a.off",
            tetrahedron_and(&[], &["1 1 2"]),
            [4, 4, 1, 0, 0],
            &["1 faces with a vertex twice"],
        ),
        cleaned(
            "zero area",
            "a.off",
            off(&["0 0 0", "1 0 0", "1 1 0", "0 1 0", "3 0 0", "4 0 0", "5 0 0"], &["0 1 2", "0 2 3", "4 5 6"]),
            [4, 2, 1, 1, 0],
            &["1 faces without area", "3 vertices without a face"],
        ),
        cleaned(
            "duplicate vertex",
            "a.off",
            off(&[&square[..], &["0 0 0", "1 1 0"]].concat(), &["0 1 2", "4 5 3"]),
            [4, 2, 1, 1, 0],
            &["2 vertices welded"],
        ),
        cleaned(
            "near-duplicate vertex",
            "a.off",
            off(&[&square[..], &["0 0 1e-9", "1 1 -1e-9"]].concat(), &["0 1 2", "4 5 3"]),
            [4, 2, 1, 1, 0],
            &["2 vertices welded"],
        ),
        cleaned(
            "unreferenced vertex",
            "a.off",
            tetrahedron_and(&["9 9 9"], &[]),
            [4, 4, 1, 0, 0],
            &["1 vertices without faces removed"],
        ),
        cleaned(
            "Moebius strip",
            "a.off",
            off(
                &["1 0 0", "2 0 0", "-.5 .9 -.5", "-.5 .9 .5", "-.5 -.9 .5", "-.8 -1.2 -.5"],
                &["0 1 2", "1 3 2", "2 3 4", "3 5 4", "4 5 1", "5 0 1"],
            ),
            [6, 6, 1, 1, 0],
            &["1 components cannot be oriented"],
        ),
        cleaned("cloud of one point", "a.off", off(&["1 2 3"], &[]), [1, 0, 0, 0, 0], &[]),
        cleaned("cloud of equal points", "a.off", off(&["1 2 3"; 5], &[]), [1, 0, 0, 0, 0], &["4 vertices welded"]),
        cleaned("collinear cloud", "a.off", off(&["0 0 0", "1 0 0", "2 0 0"], &[]), [3, 0, 0, 0, 0], &[]),
        cleaned(
            "cloud with NaN",
            "a.off",
            off(&["0 0 0", "1 0 0", "nan 0 0"], &[]),
            [2, 0, 0, 0, 0],
            &["1 vertices with coordinates that are not finite"],
        ),
        cleaned(
            "edge with three faces",
            "a.off",
            off(&["0 0 0", "1 0 0", "0 1 0", "0 -1 0", "0 0 1"], &["0 1 2", "1 0 3", "0 1 4"]),
            [9, 3, 3, 3, 0],
            &["2 vertices with several fans", "1 edges with more than two faces", "4 vertices added"],
        ),
    ]
}
