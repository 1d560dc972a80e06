//! Which point of the model belongs to which point of the scan, with gates and robust weights; and how the two agree in the end.
//!
//! Pairs go from the scan to the model: its points average their noise, and what has no counterpart (neck, hair, holes) is told by the model's
//! boundary. From the model to the scan as well they are not better (`tests/tests/face_fit.rs`, simulated scans), and take twice the time.

use glam::DVec3;
use habitus_core::fit::{Sample, SurfacePoint};
use habitus_core::rotation::similarity::Similarity;
use rayon::prelude::*;

use super::held::Held;
use super::problem::widened;
use super::target::Target;
use crate::Error;
use crate::mesh::Mesh;
use crate::spatial::TriangleTree;

/// When a pair counts, and how much.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gates {
    /// Farthest pairs, mm.
    pub distance: f64,
    /// Cosine of the largest angle between the normals.
    pub cosine: f64,
    /// Residual at which the weight of a pair has fallen to a quarter, in standard deviations (Geman, McClure 1987).
    pub robust: f64,
    /// Smallest and largest standard deviation, mm.
    pub sigma: [f64; 2],
    /// Area of surface whose points count as one observation, mm^2.
    pub independent_area: f64,
}

/// The pairs of one round.
pub(super) struct Pairs {
    /// Samples, point to plane, with weights in 1/mm^2.
    pub samples: Vec<Sample>,
    /// Robust standard deviation of the residuals, mm.
    pub sigma: f64,
}

/// How a fit agrees with the scan.
pub(super) struct Agreement {
    /// Share of the model's area that has a partner in the scan.
    pub coverage: f64,
    /// Median of the residuals' magnitudes, mm.
    pub median: f64,
}

/// The model's surface where it stands now, in the frame of the target.
struct Surface {
    mesh: Mesh,
    normals: Vec<[f64; 3]>,
    areas: Vec<f64>,
}

struct Pair {
    point: SurfacePoint,
    target: [f64; 3],
    normal: DVec3,
    residual: f64,
}

impl Pairs {
    /// Pairs of the model at the start of `held`, placed, with `target`.
    pub(super) fn new(
        held: &Held,
        faces: &[[u32; 3]],
        placement: &Similarity<f32>,
        target: &Target,
        gates: &Gates,
    ) -> Result<Self, Error> {
        let surface = Surface::new(held, faces, placement);
        let pairs = surface.pairs_of_scan(target, gates)?;
        let median = median_magnitude(&pairs);
        let sigma = (1.4826 * median).clamp(gates.sigma[0], gates.sigma[1]);
        let base = target.cell * target.cell / (gates.independent_area * sigma * sigma);
        let sample = |pair: &Pair| {
            let limit = gates.robust * sigma;
            let robust = limit * limit / (limit * limit + pair.residual * pair.residual);
            Sample {
                point: pair.point,
                target: pair.target.map(|x| x as f32),
                normal: Some(pair.normal.to_array().map(|x| x as f32)),
                weight: (base * robust * robust) as f32,
            }
        };
        Ok(Pairs { samples: pairs.iter().map(sample).collect(), sigma })
    }
}

impl Agreement {
    /// How the model at the start of `held`, placed, agrees with `target`, seen from its own vertices.
    pub(super) fn new(
        held: &Held,
        faces: &[[u32; 3]],
        model_boundary: &[bool],
        placement: &Similarity<f32>,
        target: &Target,
        gates: &Gates,
    ) -> Self {
        let surface = Surface::new(held, faces, placement);
        let pairs = surface.pairs_of_model(model_boundary, target, gates);
        let covered: f64 = pairs.iter().map(|&(_, area)| area).sum();
        let total: f64 = surface.areas.iter().sum();
        let pairs: Vec<Pair> = pairs.into_iter().map(|(pair, _)| pair).collect();
        Agreement { median: median_magnitude(&pairs), coverage: covered / total.max(f64::MIN_POSITIVE) }
    }
}

fn median_magnitude(pairs: &[Pair]) -> f64 {
    let mut magnitudes: Vec<f64> = pairs.iter().map(|pair| pair.residual.abs()).collect();
    magnitudes.sort_by(f64::total_cmp);
    magnitudes.get(magnitudes.len() / 2).copied().unwrap_or(f64::INFINITY)
}

impl Surface {
    fn new(held: &Held, faces: &[[u32; 3]], placement: &Similarity<f32>) -> Self {
        let place = widened(placement);
        let positions = held.positions().into_iter().map(|p| place.applied(p)).collect();
        let mesh = Mesh { positions, faces: faces.to_vec(), ..Mesh::default() };
        Surface { normals: mesh.vertex_normals(), areas: mesh.vertex_areas(), mesh }
    }

    fn pairs_of_scan(&self, target: &Target, gates: &Gates) -> Result<Vec<Pair>, Error> {
        let tree = TriangleTree::new(&self.mesh.positions, &self.mesh.faces)?;
        let closest = tree.closest_all(&target.points);
        let pair = |(index, closest): (usize, &crate::spatial::Closest)| {
            if closest.on_boundary || target.at_boundary[index] || !(closest.distance <= gates.distance) {
                return None;
            }
            let corners = self.mesh.faces[closest.face as usize];
            let normal: DVec3 = corners
                .iter()
                .zip(closest.barycentric)
                .map(|(&vertex, part)| part * DVec3::from_array(self.normals[vertex as usize]))
                .sum();
            let normal = normal.try_normalize()?;
            if !(normal.dot(DVec3::from_array(target.normals[index])) >= gates.cosine) {
                return None;
            }
            let point = target.points[index];
            Some(Pair {
                point: SurfacePoint { vertices: corners, barycentric: closest.barycentric.map(|x| x as f32) },
                target: point,
                normal,
                residual: normal.dot(DVec3::from_array(point) - DVec3::from_array(closest.point)),
            })
        };
        Ok(closest.par_iter().enumerate().map(pair).collect::<Vec<_>>().into_iter().flatten().collect())
    }

    fn pairs_of_model(&self, model_boundary: &[bool], target: &Target, gates: &Gates) -> Vec<(Pair, f64)> {
        let found = target.tree.nearest_all(&self.mesh.positions);
        let pair = |(vertex, near): (usize, &crate::spatial::Neighbour)| {
            let index = near.index as usize;
            if target.at_boundary[index] || model_boundary[vertex] || !(near.distance <= gates.distance) {
                return None;
            }
            let normal = DVec3::from_array(self.normals[vertex]);
            let of_scan = DVec3::from_array(target.normals[index]);
            if !(normal.dot(of_scan) >= gates.cosine) {
                return None;
            }
            let offset = DVec3::from_array(target.points[index]) - DVec3::from_array(self.mesh.positions[vertex]);
            let residual = normal.dot(offset);
            // Beside a hole the nearest point lies aside, not in front.
            if (offset - residual * normal).length() > 1.5 * target.cell {
                return None;
            }
            let point = SurfacePoint::vertex(vertex as u32);
            Some((Pair { point, target: target.points[index], normal, residual }, self.areas[vertex]))
        };
        found.iter().enumerate().filter_map(pair).collect()
    }
}
