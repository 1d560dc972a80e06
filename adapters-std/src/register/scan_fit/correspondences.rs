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
        // From plus zero: the sum of nothing is -0, which would be shown.
        let covered = pairs.iter().fold(0.0, |sum, &(_, area)| sum + area);
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

#[cfg(test)]
mod tests {
    use super::super::options::ScanFitOptions;
    use super::super::samples::{faces, held, mean_state, model, region, target};
    use super::super::sides::boundary_vertices;
    use super::*;

    /// The mean face, its points moved by `offset` along their normals.
    fn swollen(offset: f64) -> Mesh {
        let mut mesh = Mesh { positions: held(&mean_state()).positions(), faces: faces(), ..Mesh::default() };
        let normals = mesh.vertex_normals();
        mesh.positions.iter_mut().zip(normals).for_each(|(p, n)| *p = std::array::from_fn(|k| p[k] + offset * n[k]));
        mesh
    }

    fn gates(distance: f64) -> Gates {
        Gates { distance, ..ScanFitOptions::default().last_gates() }
    }

    fn pairs(target: &Target, gates: &Gates) -> Pairs {
        Pairs::new(&held(&mean_state()), &faces(), &Similarity::IDENTITY, target, gates).expect("pairs")
    }

    #[test]
    fn pairs_are_gated_by_distance() {
        let near = target(&swollen(1.0));
        let inner = near.at_boundary.iter().filter(|at_boundary| !**at_boundary).count();
        let found = pairs(&near, &gates(6.0));
        assert!(found.samples.len() > inner * 8 / 10, "{} of {inner}", found.samples.len());
        // Half of the points are 1 mm off.
        assert!((found.sigma - 1.4826).abs() < 0.1, "{}", found.sigma);
        assert!(pairs(&near, &gates(0.5)).samples.len() < found.samples.len() / 10);
        let far = pairs(&target(&swollen(9.0)), &gates(6.0));
        assert!(far.samples.len() < found.samples.len() / 5, "{}", far.samples.len());
    }

    #[test]
    fn pairs_are_gated_by_normals_and_borders() {
        let mut turned = target(&swollen(1.0));
        turned.normals.iter_mut().for_each(|n| *n = n.map(|x| -x));
        assert!(pairs(&turned, &gates(6.0)).samples.is_empty());
        // As in hair: no normal, no pair.
        turned.normals.fill([0.0; 3]);
        assert!(pairs(&turned, &gates(6.0)).samples.is_empty());
        let mut torn = target(&swollen(1.0));
        torn.at_boundary.fill(true);
        let none = pairs(&torn, &gates(6.0));
        assert!(none.samples.is_empty() && none.sigma == gates(6.0).sigma[1]);
    }

    /// The weight falls to a quarter at the robust limit.
    #[test]
    fn weights_are_robust() {
        let (scan, gates) = (target(&swollen(1.0)), gates(6.0));
        let found = pairs(&scan, &gates);
        let limit = gates.robust * found.sigma;
        let base = scan.cell * scan.cell / (gates.independent_area * found.sigma * found.sigma);
        let place = held(&mean_state()).positions();
        for sample in &found.samples {
            let corners = sample.point.vertices.map(|v| DVec3::from_array(place[v as usize]));
            let at: DVec3 = corners.iter().zip(sample.point.barycentric).map(|(p, b)| *p * f64::from(b)).sum();
            let normal = DVec3::from_array(sample.normal.expect("a normal").map(f64::from));
            let residual = normal.dot(DVec3::from_array(sample.target.map(f64::from)) - at);
            let expected = base * (limit * limit / (limit * limit + residual * residual)).powi(2);
            assert!((f64::from(sample.weight) - expected).abs() < 1e-3 * base, "{residual}");
        }
    }

    #[test]
    fn agreement_is_the_share_and_the_distance() {
        let state = mean_state();
        let border = boundary_vertices(&swollen(0.0));
        let of = |target: &Target| {
            Agreement::new(&held(&state), &faces(), &border, &Similarity::IDENTITY, target, &gates(6.0))
        };
        let whole = of(&target(&swollen(1.0)));
        assert!(whole.coverage > 0.8 && (whole.median - 1.0).abs() < 0.1, "{} {}", whole.coverage, whole.median);
        let mut left = swollen(1.0);
        left.faces.retain(|face| face.iter().all(|&v| left.positions[v as usize][0] > 0.0));
        let half = of(&Target::new(&left, &region(), 2.5, 6000, 0.9).expect("a target"));
        assert!((0.3..0.55).contains(&half.coverage), "{}", half.coverage);
        let far = of(&target(&swollen(40.0)));
        assert!(far.coverage < 0.2, "{}", far.coverage);
        assert_eq!(model().header().n_vertices as usize, border.len());
    }
}
