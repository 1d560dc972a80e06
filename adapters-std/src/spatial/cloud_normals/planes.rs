//! The plane in which a point of a cloud and its neighbours lie, by principal components.

use glam::DVec3;
use habitus_core::linalg::symmetric_eigen::diagonalise_in_place;
use rayon::prelude::*;

use crate::spatial::points::PointTree;

/// Points that one thread takes at a time.
const CHUNK: usize = 256;

/// A spread this much smaller than the largest, as a variance, is none: the points lie on a line.
const NO_SPREAD: f64 = 1e-12;

/// The neighbourhoods of the points of a cloud.
pub(super) struct Planes {
    /// Unit vectors of either sign; zero where the neighbours have no plane.
    pub normals: Vec<DVec3>,
    /// The distance of the farthest neighbour.
    pub radii: Vec<f64>,
    /// `n_neighbours` indices for each point, nearest first.
    pub neighbours: Vec<u32>,
    /// How many neighbours each point has; fewer than asked for in a small cloud.
    pub n_neighbours: usize,
}

impl Planes {
    /// Those of the points, from `k` neighbours of each.
    pub fn of(tree: &PointTree, points: &[[f64; 3]], k: usize) -> Self {
        let n_neighbours = k.min(points.len() - 1);
        let neighbourhood = |index: usize| {
            let mut near = tree.nearest_n(points[index], n_neighbours + 1);
            // The point is one of its nearest, or as far as all of them: where many lie in one place.
            let itself = near.iter().position(|other| other.index as usize == index).unwrap_or(n_neighbours);
            near.remove(itself);
            let radius = near.last().map_or(0.0, |farthest| farthest.distance);
            let indices: Vec<u32> = near.iter().map(|other| other.index).collect();
            (normal(points, index, &indices, radius), radius, indices)
        };
        let all: Vec<(DVec3, f64, Vec<u32>)> =
            (0..points.len()).into_par_iter().with_min_len(CHUNK).map(neighbourhood).collect();
        let mut planes = Planes { normals: Vec::new(), radii: Vec::new(), neighbours: Vec::new(), n_neighbours };
        for (normal, radius, indices) in all {
            planes.normals.push(normal);
            planes.radii.push(radius);
            planes.neighbours.extend(indices);
        }
        planes
    }

    /// The neighbours of a point.
    pub fn of_point(&self, index: usize) -> &[u32] {
        &self.neighbours[index * self.n_neighbours..(index + 1) * self.n_neighbours]
    }

    /// The area of the surface for which a point stands: an equal share of the disc that holds its neighbours.
    pub fn area(&self, index: usize) -> f64 {
        std::f64::consts::PI * self.radii[index] * self.radii[index] / self.n_neighbours.max(1) as f64
    }
}

/// The direction of least spread about the mean. Distances are taken in radii, so that no product over- or underflows.
fn normal(points: &[[f64; 3]], index: usize, neighbours: &[u32], radius: f64) -> DVec3 {
    if !(radius > 0.0) || neighbours.len() < 2 {
        return DVec3::ZERO;
    }
    let here = DVec3::from_array(points[index]);
    let relative = |&other: &u32| (DVec3::from_array(points[other as usize]) - here) / radius;
    let n = neighbours.len() as f64 + 1.0;
    let mean = neighbours.iter().map(relative).sum::<DVec3>() / n;
    let mut spread = [0.0; 9];
    for d in neighbours.iter().map(relative).chain([DVec3::ZERO]).map(|d| (d - mean).to_array()) {
        for (entry, value) in spread.iter_mut().enumerate() {
            *value += d[entry / 3] * d[entry % 3];
        }
    }
    let mut vectors = [0.0; 9];
    match diagonalise_in_place(&mut spread, &mut vectors, 3) {
        Ok(()) if spread[4] > NO_SPREAD * spread[0] => DVec3::new(vectors[6], vectors[7], vectors[8]),
        _ => DVec3::ZERO,
    }
}
