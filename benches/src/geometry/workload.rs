//! Deterministic surfaces from ten thousand to a million elements, and positions to search from. Millimetres.
//!
//! All coordinates are representable in 32 bits, so that programs of either width are given the same numbers.

use std::collections::HashMap;

use habitus::mesh::Mesh;
use habitus::spatial::Ray;

use crate::workload::noise;

/// Queries of a measurement.
pub const QUERIES: usize = 100_000;

/// The corners of an icosahedron are these and their cyclic permutations: `(0, +-1, +-t)`, `t` the golden ratio.
const GOLDEN: f64 = 1.618_033_988_749_895;

/// How far positions near the surface are from it: the standard deviation along each axis.
const NEAR: f64 = 10.0;

/// A closed surface of `20 frequency^2` faces and `10 frequency^2 + 2` vertices, about 2 m across, oriented outwards: an icosahedron,
/// divided, made round and uneven by twelve waves.
pub fn bumpy_sphere(frequency: usize) -> Mesh {
    let corners = icosahedron();
    let waves: Vec<([f64; 3], f64)> = (0..12)
        .map(|wave| ([0, 1, 2].map(|axis| 4.0 * normal(8 * wave + axis)), 6.0 * real(8 * wave + 3).abs()))
        .collect();
    let mut mesh = Mesh::default();
    let mut known = HashMap::new();
    let mut vertex = |corner: [usize; 3], weight: [usize; 3]| {
        // Neighbouring faces of the icosahedron name a point of their common side by the same two corners and weights.
        let mut key = [0, 1, 2].map(|k| (weight[k], corner[k])).map(|(w, c)| if w == 0 { (0, 0) } else { (w, c + 1) });
        key.sort_by_key(|&(_, c)| c);
        *known.entry(key).or_insert_with(|| {
            let mut p = [0.0; 3];
            for (w, c) in key.into_iter().filter(|&(w, _)| w > 0) {
                (0..3).for_each(|axis| p[axis] += w as f64 * corners[c - 1][axis]);
            }
            mesh.positions.push(uneven(p, &waves));
            mesh.positions.len() as u32 - 1
        })
    };
    let mut faces = Vec::with_capacity(20 * frequency * frequency);
    for corner in sides(&corners) {
        let mut at = |i: usize, j: usize| vertex(corner, [frequency - i - j, i, j]);
        for i in 0..frequency {
            for j in 0..frequency - i {
                faces.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 2 <= frequency {
                    faces.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
    mesh.faces = faces;
    mesh
}

/// The surface without what joins it: each face has three vertices of its own, as in STL files.
pub fn soup(mesh: &Mesh) -> Mesh {
    let positions = mesh.faces.iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
    let faces = (0..mesh.faces.len() as u32).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
    Mesh { positions, faces, ..Mesh::default() }
}

/// The positions in an order that has nothing to do with where they are, as of a cloud put together.
pub fn shuffled(mut positions: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    for at in (1..positions.len()).rev() {
        positions.swap(at, index(at, at + 1));
    }
    positions
}

/// Positions about 10 mm from points of `surface`.
pub fn near(surface: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let beside = |k: usize| {
        let p = surface[index(k, surface.len())];
        [0, 1, 2].map(|axis| rounded(p[axis] + NEAR * normal(3 * k + axis)))
    };
    (0..QUERIES).map(beside).collect()
}

/// Positions anywhere in a cube of 3 m.
pub fn far() -> Vec<[f64; 3]> {
    (0..QUERIES).map(|k| [0, 1, 2].map(|axis| rounded(1500.0 * real(3 * k + axis)))).collect()
}

/// Positions that have moved a little, as from one step of a registration to the next.
pub fn moved(positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let step = |k: usize| [0, 1, 2].map(|axis| rounded(positions[k][axis] + real(7 * k + axis)));
    (0..positions.len()).map(step).collect()
}

/// Rays from anywhere in the cube to a point near the middle.
pub fn rays() -> Vec<Ray> {
    let ray = |(k, origin): (usize, [f64; 3])| {
        let direction = [0, 1, 2].map(|axis| rounded(500.0 * real(5 * k + axis) - origin[axis]));
        Ray { origin, direction, longest: f64::INFINITY }
    };
    far().into_iter().enumerate().map(ray).collect()
}

/// A number below `n` that is a function of `k`.
fn index(k: usize, n: usize) -> usize {
    let mixed = (k as u64 ^ 0x5851).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 24) as usize % n
}

fn real(k: usize) -> f64 {
    f64::from(noise(k))
}

/// About a normal deviate: the sum of three of equal distribution.
fn normal(k: usize) -> f64 {
    real(3 * k + 10_000_000) + real(3 * k + 10_000_001) + real(3 * k + 10_000_002)
}

fn rounded(x: f64) -> f64 {
    f64::from(x as f32)
}

fn uneven(p: [f64; 3], waves: &[([f64; 3], f64)]) -> [f64; 3] {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let unit = p.map(|x| x / dot(p, p).sqrt());
    let radius = 1.0 + waves.iter().map(|&(k, phase)| 0.05 * (dot(unit, k) + phase).sin()).sum::<f64>();
    [0, 1, 2].map(|axis| rounded([1000.0, 1300.0, 800.0][axis] * radius * unit[axis]))
}

fn icosahedron() -> Vec<[f64; 3]> {
    let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let turned = |p: [f64; 3], by: usize| [0, 1, 2].map(|axis| p[(axis + 3 - by) % 3]);
    (0..3).flat_map(|by| signs.map(|(one, golden)| turned([0.0, one, golden * GOLDEN], by))).collect()
}

/// The faces of the icosahedron: corners that are 2 apart from each other, counter-clockwise seen from outside.
fn sides(corners: &[[f64; 3]]) -> Vec<[usize; 3]> {
    let minus = |a: usize, b: usize| [0, 1, 2].map(|axis| corners[a][axis] - corners[b][axis]);
    let adjacent = |a: usize, b: usize| (minus(a, b).iter().map(|x| x * x).sum::<f64>() - 4.0).abs() < 1e-9;
    let outwards = |a: usize, b: usize, c: usize| {
        let (u, v, [x, y, z]) = (minus(b, a), minus(c, a), corners[a]);
        x * (u[1] * v[2] - u[2] * v[1]) + y * (u[2] * v[0] - u[0] * v[2]) + z * (u[0] * v[1] - u[1] * v[0]) > 0.0
    };
    let mut sides = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if adjacent(a, b) && adjacent(b, c) && adjacent(c, a) {
                    sides.push(if outwards(a, b, c) { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    sides
}

#[cfg(test)]
mod tests {
    use super::*;
    use habitus::mesh::Topology;

    #[test]
    fn the_surface_is_closed_and_outwards_and_has_the_size_it_says() {
        for frequency in [1, 2, 7] {
            let mesh = bumpy_sphere(frequency);
            let counts = (mesh.positions.len(), mesh.faces.len());
            assert_eq!(counts, (10 * frequency * frequency + 2, 20 * frequency * frequency));
            assert!(Topology::new(counts.0, &mesh.faces).is_closed());
            assert!(mesh.signed_volume() > 1e9);
        }
    }

    #[test]
    fn shuffling_keeps_every_position() {
        let before: Vec<[f64; 3]> = (0..500).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        let mut after = shuffled(before.clone());
        assert_ne!(before, after);
        after.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert_eq!(before, after);
    }
}
