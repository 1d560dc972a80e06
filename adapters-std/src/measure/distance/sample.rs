//! Where the surface of a mesh is sampled: points spread over its area, and how much area its vertices stand for.

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

use crate::Error;
use crate::mesh::Mesh;

/// Area of each face, 0 where it is degenerate.
fn face_areas(mesh: &Mesh) -> Vec<f64> {
    let area = |face: usize| {
        let [a, b, c] = mesh.triangle(face).map(DVec3::from_array);
        (b - a).cross(c - a).length() / 2.0
    };
    (0..mesh.faces.len()).map(area).collect()
}

/// A third of the area of the faces at each vertex. The faces must name existing vertices.
pub(super) fn vertex_areas(mesh: &Mesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.positions.len()];
    for (face, area) in mesh.faces.iter().zip(face_areas(mesh)) {
        face.iter().for_each(|&vertex| areas[vertex as usize] += area / 3.0);
    }
    areas
}

/// `n` points spread evenly over the area of a mesh: one in each of `n` equal parts of it, at random inside, so that their mean varies less than that
/// of independent points.
///
/// # Errors
/// [`Error::Input`] for a mesh whose faces have no area.
pub(super) fn area_uniform(mesh: &Mesh, n: usize, seed: u64) -> Result<Vec<[f64; 3]>, Error> {
    let mut total = 0.0;
    let ends: Vec<f64> = face_areas(mesh)
        .into_iter()
        .map(|area| {
            total += area;
            total
        })
        .collect();
    if !(total > 0.0 && total.is_finite()) {
        return Err(Error::input("its faces have no area, or too large a one, so no points can be drawn on them"));
    }
    let mut stream = ChaCha12Rng::seed_from_u64(seed);
    let mut face = 0;
    let points = (0..n).map(|part| {
        let [place, u, v]: [f64; 3] = std::array::from_fn(|_| stream.random());
        let at = (part as f64 + place) / n as f64 * total;
        while face + 1 < ends.len() && ends[face] <= at {
            face += 1;
        }
        let [a, b, c] = mesh.triangle(face).map(DVec3::from_array);
        // Uniform in the triangle: Turk 1990, "Generating random points in triangles".
        let root = u.sqrt();
        (a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v)).to_array()
    });
    Ok(points.collect())
}
