//! Shapes whose geometry is known, for tests.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use glam::DVec3;

use crate::mesh::Mesh;

/// `(n + 1)^2` vertices of the square from 0 to 1; vertex `(i, j)` has the number `i + (n + 1) j`.
pub fn square(n: u32) -> Mesh {
    bent(n, n, false, |x, y| [x, y, 0.0])
}

/// A cylinder of radius 1 and height 1 round the y axis, open at both ends, with `n` vertices round it.
pub fn cylinder(n: u32, rows: u32) -> Mesh {
    // Seen from outside with y up, x grows to the right.
    bent(n, rows, true, |x, y| [(TAU * x).sin(), y, (TAU * x).cos()])
}

/// A grid of `columns` by `rows` squares over the unit square, brought into space; closed in x when asked.
fn bent(columns: u32, rows: u32, closed: bool, place: impl Fn(f64, f64) -> [f64; 3]) -> Mesh {
    let width = if closed { columns } else { columns + 1 };
    let mut mesh = Mesh::default();
    for j in 0..=rows {
        mesh.positions
            .extend((0..width).map(|i| place(f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows))));
    }
    for j in 0..rows {
        for i in 0..columns {
            let at = |i: u32, j: u32| i % width + width * j;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            // Diagonals in both directions, so that no direction is singled out.
            mesh.faces.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    mesh
}

/// A cone of `n` faces with the apex at the origin, vertex 0, whose faces have this angle at the apex; sides of length 1.
pub fn cone(n: u32, angle: f64) -> Mesh {
    let radius = (angle / 2.0).sin() / (TAU / f64::from(2 * n)).sin();
    let height = (1.0 - radius * radius).sqrt();
    let rim = |i: u32| {
        let turn = TAU * f64::from(i) / f64::from(n);
        [radius * turn.sin(), -height, radius * turn.cos()]
    };
    let positions = std::iter::once([0.0; 3]).chain((0..n).map(rim)).collect();
    let faces = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
    Mesh { positions, faces, ..Mesh::default() }
}

/// The unit sphere from an icosahedron whose faces were divided in four so many times, with its exact normals.
pub fn icosphere(level: u32) -> Mesh {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let corners = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ];
    let mut positions: Vec<DVec3> = corners.iter().map(|&p| DVec3::from_array(p).normalize()).collect();
    let mut faces = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..level {
        let mut middles = BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let [d, e, f] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
            })
            .collect();
    }
    let positions: Vec<[f64; 3]> = positions.iter().map(|p| p.to_array()).collect();
    Mesh { normals: positions.clone(), positions, faces, ..Mesh::default() }
}

/// Points spread evenly over the unit sphere along a spiral (Fibonacci), with their normals.
pub fn spiral_sphere(n: u32) -> Mesh {
    let golden = TAU * (1.0 - 1.0 / ((1.0 + 5.0_f64.sqrt()) / 2.0));
    let place = |i: u32| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
        let (radius, turn) = ((1.0 - y * y).sqrt(), golden * f64::from(i));
        [radius * turn.cos(), y, radius * turn.sin()]
    };
    let positions: Vec<[f64; 3]> = (0..n).map(place).collect();
    Mesh { normals: positions.clone(), positions, ..Mesh::default() }
}
