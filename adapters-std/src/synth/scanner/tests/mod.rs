//! The scanner against planes and spheres, of which all is known.

mod faults;
mod image;
mod limits;

use super::*;

/// A square of this half width that faces +z, at this depth.
fn plane(half: f64, z: f64) -> Mesh {
    let positions = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let positions = positions.map(|[x, y]| [x, y, z]).to_vec();
    Mesh { positions, faces: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
}

/// A ball about the origin: an octahedron, divided. Its faces are at most `radius * 1.3 / n^2` below the sphere.
fn ball(radius: f64, n: usize) -> Mesh {
    let (positions, faces) = crate::spatial::samples::bumpy_sphere(n);
    let round = |p: [f64; 3]| (DVec3::new(p[0], p[1] / 1.3, p[2] / 0.8).normalize() * radius).to_array();
    Mesh { positions: positions.into_iter().map(round).collect(), faces, ..Mesh::default() }
}

fn moved(mesh: Mesh, by: [f64; 3]) -> Mesh {
    let positions = mesh.positions.iter().map(|p| std::array::from_fn(|axis| p[axis] + by[axis])).collect();
    Mesh { positions, ..mesh }
}

fn together(mut a: Mesh, b: Mesh) -> Mesh {
    let first = a.positions.len() as u32;
    a.positions.extend(b.positions);
    a.faces.extend(b.faces.into_iter().map(|face| face.map(|vertex| vertex + first)));
    a
}

/// Without any fault, with pixels of this width.
fn faultless(pixel: f64) -> ScanOptions {
    ScanOptions { pixel, ..ScanOptions::faultless() }
}

fn values(scan: &Scan, attribute: usize) -> &[f64] {
    &scan.mesh.attributes[attribute].values
}

/// Mean and standard deviation.
fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, (values.map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt())
}
