//! Meshes for tests: a closed surface, and triangles on a lattice, where distances are equal more often than not.

use proptest::prelude::*;

/// A closed surface of `8 n^2` faces, oriented outwards: an octahedron, divided, made round and uneven.
pub fn bumpy_sphere(n: usize) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut index = std::collections::BTreeMap::new();
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let mut vertex = |p: [i64; 3]| {
        *index.entry(p).or_insert_with(|| {
            let q = p.map(|x| x as f64);
            let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            let [x, y, z] = q.map(|x| x / length);
            let radius = 1.0 + 0.05 * (5.0 * x + 1.0).sin() * (4.0 * y).cos() + 0.05 * (6.0 * z + x).sin();
            positions.push([radius * x, 1.3 * radius * y, 0.8 * radius * z]);
            positions.len() as u32 - 1
        })
    };
    let n = n as i64;
    for octant in 0..8 {
        let sign = [0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { -1 } else { 1 });
        let mut at = |i: i64, j: i64| vertex([sign[0] * i, sign[1] * j, sign[2] * (n - i - j)]);
        let mut push = |face: [u32; 3]| {
            let [a, b, c] = face;
            faces.push(if sign.iter().product::<i64>() > 0 { [a, b, c] } else { [a, c, b] });
        };
        for i in 0..n {
            for j in 0..n - i {
                push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 2 <= n {
                    push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
    (positions, faces)
}

/// Vertices for [`lattice_faces`].
pub fn lattice_positions() -> impl Strategy<Value = Vec<[f64; 3]>> {
    prop::collection::vec(prop::array::uniform3(-3_i8..4).prop_map(|p| p.map(f64::from)), 12)
}

/// Some triangles among twelve vertices, many of them degenerate.
pub fn lattice_faces() -> impl Strategy<Value = Vec<[u32; 3]>> {
    prop::collection::vec(prop::array::uniform3(0_u32..12), 1..40)
}

/// Vertices as [`lattice_positions`], each stretched on its own by up to twelve orders of magnitude.
pub fn wild_positions() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let stretch = prop_oneof![Just(1.0), Just(1.0), Just(1e-6), Just(1e-3), Just(1e3), Just(1e6)];
    let position = (prop::array::uniform3(-3_i8..4), stretch);
    prop::collection::vec(position.prop_map(|(p, stretch)| p.map(|x| f64::from(x) * stretch)), 12)
}
