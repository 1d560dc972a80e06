//! Readable files whose surface is broken.

use super::table::{Row, cleaned, refused};

/// An OFF file.
fn off<S: AsRef<str>>(vertices: &[S], faces: &[S]) -> String {
    let lines = |begin: &str, lines: &[S]| -> String {
        lines.iter().map(|line| format!("{begin}{}\n", line.as_ref())).collect()
    };
    format!("OFF\n{} {} 0\n{}{}", vertices.len(), faces.len(), lines("", vertices), lines("3 ", faces))
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
        cleaned(
            "edge with four faces",
            "a.off",
            off(
                &[&CORNERS[..], &["0 -1 0", "0 0 -1"]].concat(),
                &[&OUTWARD[..], &["0 4 1", "0 1 5", "0 5 4", "1 4 5"]].concat(),
            ),
            [8, 8, 2, 0, 0],
            &[
                "2 vertices with several fans",
                "1 edges with more than two faces cut, 1 of them into two sheets",
                "2 vertices added",
            ],
        ),
        cleaned("torus", "a.off", torus(8, 6), [48, 96, 1, 0, 1], &[]),
        // The faces of a vertex that was pulled far out of a sheet: they go, and leave a hole.
        cleaned(
            "spikes to a stray vertex",
            "a.off",
            sheet(8, 40),
            [80, 122, 1, 2, 0],
            &["6 spikes removed", "1 vertices without a face that is left removed (40)"],
        ),
        cleaned(
            "conflicting labels",
            "a.ply",
            labelled(),
            [4, 2, 1, 1, 0],
            &["2 vertices welded", "1 welded vertices had another \"label\""],
        ),
    ]
}

/// Two triangles that have two corners each for themselves, of which one pair has the same label and the other has not.
pub fn labelled() -> String {
    let header = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar label\nproperty float quality\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
    let vertices = "0 0 0 1 0.5\n1 0 0 1 0.25\n1 1 0 2 0\n0 0 0 1 0.5\n1 1 0 7 0\n0 1 0 3 4\n";
    format!("{header}{vertices}3 0 1 2\n3 3 4 5\n")
}

/// A torus of `n` times `m` quads, outwards.
fn torus(n: u32, m: u32) -> String {
    let turn = |i: u32, n: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let at = |i: u32, j: u32| {
        let reach = 3.0 + turn(j, m).cos();
        format!("{} {} {}", reach * turn(i, n).cos(), reach * turn(i, n).sin(), turn(j, m).sin())
    };
    let corner = |i: u32, j: u32| i % n * m + j % m;
    let cells = || (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let halves = |(i, j): (u32, u32)| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        [format!("{a} {b} {c}"), format!("{a} {c} {d}")]
    };
    let (vertices, faces): (Vec<_>, Vec<_>) =
        (cells().map(|(i, j)| at(i, j)).collect(), cells().flat_map(halves).collect());
    off(&vertices, &faces)
}

/// A flat sheet of `n` times `n` quads, one vertex of which lies far above.
fn sheet(n: u32, stray: u32) -> String {
    let vertices = (0..(n + 1) * (n + 1)).map(|vertex| {
        let height = if vertex == stray { 60 } else { 0 };
        format!("{} {} {height}", vertex % (n + 1), vertex / (n + 1))
    });
    let faces = (0..n * n).flat_map(|cell| {
        let a = cell / n * (n + 1) + cell % n;
        let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
        [format!("{a} {b} {c}"), format!("{a} {c} {d}")]
    });
    let (vertices, faces): (Vec<_>, Vec<_>) = (vertices.collect(), faces.collect());
    off(&vertices, &faces)
}
