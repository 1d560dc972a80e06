//! How well a scan lies on a template after a rotation between axes and a rigid motion from there.

use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::procrustes::Moments;

use crate::Error;
use crate::mesh::Mesh;
use crate::mesh::sampling::{farthest_points, interpolated, uniform_points};
use crate::spatial::PointTree;

/// Random points of a mesh, which are searched among.
const N_RANDOM: usize = 10_000;
/// Part of the pairs that count, of those from the scan and of those from the template: a scan has clutter and lacks parts.
const KEPT_OF_SCAN: f64 = 0.8;
const KEPT_OF_TEMPLATE: f64 = 0.6;

/// How far an alignment is carried.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Points that are moved, of either surface.
    pub n_points: usize,
    /// Limit of the steps.
    pub max_steps: usize,
    /// The change of the motion below which it has settled, relative to the size of the template.
    pub settled: f64,
}

/// A matrix by rows.
pub(super) type Matrix = [[f64; 3]; 3];

/// Points of a surface, the structure to search them, and some that are spread evenly.
pub(super) struct Points {
    all: Vec<[f64; 3]>,
    /// One per point, or empty.
    normals: Vec<[f64; 3]>,
    tree: PointTree,
    /// Indices of evenly spread points. Each first part of them is spread evenly too.
    even: Vec<u32>,
    mean: [f64; 3],
    radius: f64,
}

impl Points {
    /// Points of the mesh, or of the cloud, multiplied by `scale`; the `n_even` of them that are moved. The seed must be
    /// another one for the scan than for the template, whose points else coincide when the two are the same mesh.
    pub fn new(mesh: &Mesh, scale: f64, n_even: usize, seed: u64) -> Result<Self, Error> {
        let sampled = match mesh.faces.is_empty() {
            true => mesh.clone(),
            false => interpolated(mesh, &uniform_points(mesh, N_RANDOM, seed)?)?,
        };
        let all: Vec<[f64; 3]> = sampled.positions.into_iter().map(|p| p.map(|x| x * scale)).collect();
        let even = farthest_points(&all, n_even)?.iter().map(|point| point.index).collect();
        Self::of(all, sampled.normals, even)
    }

    fn of(all: Vec<[f64; 3]>, normals: Vec<[f64; 3]>, even: Vec<u32>) -> Result<Self, Error> {
        let share = 1.0 / even.len() as f64;
        let mean = even
            .iter()
            .map(|&index| all[index as usize])
            .fold([0.0; 3], |sum: [f64; 3], p| std::array::from_fn(|axis| sum[axis] + p[axis] * share));
        let radius = even.iter().map(|&index| distance(all[index as usize], mean)).fold(0.0, f64::max);
        Ok(Points { tree: PointTree::new(&all)?, all, normals, even, mean, radius })
    }

    /// The same points, reflected in x.
    pub fn mirrored(&self) -> Result<Self, Error> {
        let reflected = |vectors: &[[f64; 3]]| vectors.iter().map(|&[x, y, z]| [-x, y, z]).collect();
        Self::of(reflected(&self.all), reflected(&self.normals), self.even.clone())
    }

    /// The mean distance of the evenly spread points from their nearest others: the part of a residual that comes from where the
    /// points happen to lie.
    pub fn spacing(&self) -> f64 {
        let others =
            self.even(self.even.len()).map(|(_, p)| self.tree.nearest_n(p, 2).last().map_or(0.0, |near| near.distance));
        others.sum::<f64>() / self.even.len() as f64
    }

    fn even(&self, n: usize) -> impl Iterator<Item = (usize, [f64; 3])> {
        self.even.iter().take(n).map(|&index| (index as usize, self.all[index as usize]))
    }

    fn nearest(&self, position: [f64; 3]) -> (f64, usize) {
        let near = self.tree.nearest(position);
        (near.distance, near.index as usize)
    }
}

/// The rigid motion of a scan onto a template, and the residuals after it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    pub motion: Similarity<f64>,
    /// Mean distance of the nearest 80 % of the scan's points from those of the template.
    pub of_scan: f64,
    /// Mean distance of the nearest 60 % of the template's points from those of the scan.
    pub of_template: f64,
}

/// The motion that carries the mean of the scan to that of the template with this rotation.
pub(super) fn start(scan: &Points, template: &Points, rotation: Matrix) -> Similarity<f64> {
    let turned = Similarity { rotation, ..Similarity::IDENTITY }.applied(scan.mean);
    Similarity { rotation, scale: 1.0, translation: std::array::from_fn(|a| template.mean[a] - turned[a]) }
}

/// Improves a motion by iterated closest points (`besl1992`) in both directions, of which the nearest parts count.
pub(super) fn fit(scan: &Points, template: &Points, from: Similarity<f64>, effort: Effort) -> Fit {
    let Effort { n_points, max_steps, settled } = effort;
    let mut motion = from;
    for _ in 0..max_steps {
        let mut moments = Moments::new();
        for (source, target) in pairs(scan, template, &motion, n_points) {
            moments.add(source, target, 1.0);
        }
        // Points that leave the rotation open leave it where it was; other starts then do as well, which is noticed.
        let Ok(next) = moments.similarity(false) else { break };
        let change = scan.even(12).map(|(_, p)| distance(next.applied(p), motion.applied(p))).fold(0.0, f64::max);
        motion = next;
        if change < settled * template.radius {
            break;
        }
    }
    let of_scan = scan.even(n_points).map(|(_, p)| template.nearest(motion.applied(p)).0).collect();
    let of_template = template.even(n_points).map(|(_, q)| scan.nearest(motion.inverse_applied(q)).0).collect();
    Fit { motion, of_scan: trimmed(of_scan, KEPT_OF_SCAN), of_template: trimmed(of_template, KEPT_OF_TEMPLATE) }
}

/// Pairs of points, from the scan to the template: the nearest part of those found from either.
fn pairs(scan: &Points, template: &Points, motion: &Similarity<f64>, n: usize) -> Vec<([f64; 3], [f64; 3])> {
    let from_scan = scan.even(n).map(|(_, p)| {
        let (distance, index) = template.nearest(motion.applied(p));
        (distance, p, template.all[index])
    });
    let from_template = template.even(n).map(|(_, q)| {
        let (distance, index) = scan.nearest(motion.inverse_applied(q));
        (distance, scan.all[index], q)
    });
    let kept = |mut pairs: Vec<(f64, [f64; 3], [f64; 3])>, part: f64| {
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        pairs.truncate(kept_of(pairs.len(), part));
        pairs.into_iter().map(|(_, source, target)| (source, target))
    };
    kept(from_scan.collect(), KEPT_OF_SCAN).chain(kept(from_template.collect(), KEPT_OF_TEMPLATE)).collect()
}

fn kept_of(n: usize, part: f64) -> usize {
    (part * n as f64).ceil() as usize
}

/// The mean of the smallest part.
fn trimmed(mut distances: Vec<f64>, part: f64) -> f64 {
    distances.sort_by(f64::total_cmp);
    distances.truncate(kept_of(distances.len(), part));
    distances.iter().sum::<f64>() / distances.len() as f64
}

/// Of the scan's nearest points, the part whose normals point to the same side as those of the template; `None` where one
/// of the two has no normals.
pub(super) fn normals_agree(scan: &Points, template: &Points, motion: &Similarity<f64>, n: usize) -> Option<f64> {
    if scan.normals.is_empty() || template.normals.is_empty() {
        return None;
    }
    let rotation = Similarity { rotation: motion.rotation, ..Similarity::IDENTITY };
    let product = |(index, p): (usize, [f64; 3])| {
        let (distance, near) = template.nearest(motion.applied(p));
        let (a, b) = (rotation.applied(scan.normals[index]), template.normals[near]);
        (distance, (0..3).map(|axis| a[axis] * b[axis]).sum::<f64>())
    };
    let mut products: Vec<(f64, f64)> = scan.even(n).map(product).collect();
    products.sort_by(|a, b| a.0.total_cmp(&b.0));
    products.truncate(kept_of(products.len(), KEPT_OF_SCAN));
    Some(products.iter().filter(|product| product.1 > 0.0).count() as f64 / products.len() as f64)
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_motion_is_found_again() {
        let positions: Vec<[f64; 3]> = (0..400)
            .map(|i| (f64::from(i) * 0.37, f64::from(i) * 2.4))
            .map(|(z, angle)| [30.0 * angle.cos(), 10.0 * angle.sin() + 0.1 * z, z])
            .collect();
        let moved = Similarity::IDENTITY.moved([0.1, -0.05, 0.2], [4.0, 5.0, -6.0], 0.0);
        let scan = Mesh { positions: positions.iter().map(|p| moved.inverse_applied(*p)).collect(), ..Mesh::default() };
        let template = Points::new(&Mesh { positions, ..Mesh::default() }, 1.0, 300, 1).unwrap();
        let scan = Points::new(&scan, 1.0, 300, 2).unwrap();
        let effort = Effort { n_points: 300, max_steps: 60, settled: 1e-9 };
        let found = fit(&scan, &template, start(&scan, &template, Similarity::<f64>::IDENTITY.rotation), effort);
        assert!(found.of_scan < 1e-6 && found.of_template < 1e-6, "{found:?}");
        for row in 0..3 {
            assert!((0..3).all(|k| (found.motion.rotation[row][k] - moved.rotation[row][k]).abs() < 1e-6));
        }
        assert!(normals_agree(&scan, &template, &found.motion, 300).is_none());
    }

    #[test]
    fn the_largest_distances_do_not_count() {
        assert_eq!(trimmed(vec![9.0, 1.0, f64::NAN, 2.0, 3.0], 0.6), 2.0);
    }
}
