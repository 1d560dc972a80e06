//! Points spread over a mesh by area: at random, or at random but evenly (a Poisson-disk set).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::SurfacePoint;
use crate::Error;
use crate::mesh::Mesh;
use crate::spatial::PointTree;

/// Random points from which each point of a Poisson-disk set is chosen.
const CANDIDATES: usize = 5;
/// Exponent of the weights, and the two numbers that limit them; the values of `yuksel2015`.
const ALPHA: i32 = 8;
const BETA: f64 = 0.65;
const GAMMA: f64 = 1.5;

/// `n` independent points, uniform by area.
///
/// The same seed gives the same points everywhere (ChaCha8).
///
/// # Errors
/// Those of [`Mesh::check`]; [`Error::Input`] for a mesh without area, or more than 2^32 - 1 points.
pub fn uniform_points(mesh: &Mesh, n: usize, seed: u64) -> Result<Vec<SurfacePoint>, Error> {
    if u32::try_from(n).is_err() {
        return Err(Error::input(format!("{n} points on a surface: ask for at most {}", u32::MAX)));
    }
    let sums = area_sums(mesh)?;
    let total = sums[sums.len() - 1];
    let last = sums.partition_point(|&sum| sum < total);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut point = || {
        let [place, u, v]: [f64; 3] = random.random();
        // A sum that is not above the place belongs to an earlier face; so faces without area are never chosen.
        let face = sums.partition_point(|&sum| sum <= place * total).min(last);
        let root = u.sqrt();
        SurfacePoint { face: face as u32, barycentric: [1.0 - root, root * (1.0 - v), root * v] }
    };
    Ok((0..n).map(|_| point()).collect())
}

/// The areas of the faces, each with all before it; the last is positive.
fn area_sums(mesh: &Mesh) -> Result<Vec<f64>, Error> {
    mesh.check()?;
    let area = |face| {
        let [a, b, c] = mesh.triangle(face).map(glam::DVec3::from_array);
        0.5 * (b - a).cross(c - a).length()
    };
    let mut total = 0.0;
    let sum = |face| {
        total += area(face);
        total
    };
    let sums: Vec<f64> = (0..mesh.faces.len()).map(sum).collect();
    if !(total > 0.0 && total.is_finite()) {
        return Err(Error::input(format!(
            "points cannot be spread over a surface of area {total}: give a mesh with faces, or thin the cloud instead"
        )));
    }
    Ok(sums)
}

/// `n` points, uniform by area and nowhere close together.
///
/// Of `5 n` random points the most crowded is removed until `n` are left; crowded is a point with a large sum of weights
/// `(1 - d / 2 r)^8` over the others at distances `d < 2 r`, where `r = sqrt(area / (2 sqrt(3) n))` is the largest possible
/// radius. Distances are straight lines, so that two thin layers thin out one another.
///
/// Source: `yuksel2015`, with its limit of the weights.
///
/// Cost: `O(n log n)`, about 90 neighbours of 12 bytes per point of memory. Determinism: the same seed gives the same
/// points, in the order in which they were drawn; of equally crowded points the first drawn goes first.
///
/// # Errors
/// As [`uniform_points`]; [`Error::Input`] for more than 800 million points.
pub fn poisson_disk_points(mesh: &Mesh, n: usize, seed: u64) -> Result<Vec<SurfacePoint>, Error> {
    let area = area_sums(mesh)?.pop().unwrap_or_default();
    if n > 800_000_000 {
        return Err(Error::input(format!("{n} points of a Poisson-disk set: ask for at most 800000000")));
    }
    let candidates = uniform_points(mesh, n * CANDIDATES, seed)?;
    if n == 0 {
        return Ok(candidates);
    }
    let reach = 2.0 * (area / (2.0 * 3.0_f64.sqrt() * n as f64)).sqrt();
    let nearest = reach * BETA * (1.0 - (CANDIDATES as f64).powf(-GAMMA));
    let positions: Vec<[f64; 3]> = candidates.iter().map(|point| point.position(mesh)).collect();
    let tree = PointTree::new(&positions)?;
    let neighbours: Vec<Vec<(u32, f64)>> = positions
        .par_iter()
        .enumerate()
        .map(|(index, &position)| {
            let others = tree.within(position, reach).into_iter().filter(|other| other.index as usize != index);
            others.map(|o| (o.index, (1.0 - o.distance.max(nearest) / reach).powi(ALPHA))).collect()
        })
        .collect();
    let kept = uncrowded(&neighbours, n);
    Ok(candidates.into_iter().zip(kept).filter(|(_, kept)| *kept).map(|(point, _)| point).collect())
}

/// Which points are left when the most crowded is removed until there are `n`.
fn uncrowded(neighbours: &[Vec<(u32, f64)>], n: usize) -> Vec<bool> {
    let mut crowding: Vec<f64> = neighbours.iter().map(|others| others.iter().map(|other| other.1).sum()).collect();
    let mut kept = vec![true; neighbours.len()];
    let mut queue: BinaryHeap<Crowded> =
        crowding.iter().enumerate().map(|(index, &crowding)| Crowded { crowding, index }).collect();
    let mut n_left = neighbours.len();
    while n_left > n {
        let Some(first) = queue.pop() else { break };
        // Crowding only falls, so an entry that is out of date stands too early in the queue, never too late.
        if first.crowding != crowding[first.index] {
            queue.push(Crowded { crowding: crowding[first.index], ..first });
            continue;
        }
        kept[first.index] = false;
        n_left -= 1;
        for &(other, weight) in &neighbours[first.index] {
            crowding[other as usize] -= weight;
        }
    }
    kept
}

/// An entry of the queue; the most crowded is the largest, of equal ones that with the smallest index.
struct Crowded {
    crowding: f64,
    index: usize,
}

impl Ord for Crowded {
    fn cmp(&self, other: &Self) -> Ordering {
        self.crowding.total_cmp(&other.crowding).then(other.index.cmp(&self.index))
    }
}

impl PartialOrd for Crowded {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Crowded {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Crowded {}

#[cfg(test)]
mod tests {
    use super::super::tests::square;
    use super::*;

    /// Two triangles of areas 3 and 1, and one without area between them.
    fn uneven() -> Mesh {
        let positions = vec![[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0], [-1.0, 0.0, 0.0]];
        Mesh { positions, faces: vec![[0, 1, 2], [0, 1, 1], [0, 2, 3]], ..Mesh::default() }
    }

    #[test]
    fn faces_get_points_by_their_area() {
        let points = uniform_points(&uneven(), 4000, 7).unwrap();
        let count = |face| points.iter().filter(|point| point.face == face).count();
        assert_eq!(count(1), 0);
        // Three standard deviations of a binomial distribution.
        assert!((count(0) as f64 - 3000.0).abs() < 3.0 * (4000.0 * 0.75 * 0.25_f64).sqrt(), "{}", count(0));
        let mut mean = [0.0; 3];
        for point in points.iter().filter(|point| point.face == 0) {
            assert!(point.barycentric.iter().all(|b| (0.0..=1.0).contains(b)));
            assert!((point.barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            mean = std::array::from_fn(|k| mean[k] + point.barycentric[k] / count(0) as f64);
        }
        // The standard deviation of one barycentric coordinate is 1 / sqrt(18).
        assert!(mean.iter().all(|m| (m - 1.0 / 3.0).abs() < 3.0 / (18.0 * 3000.0_f64).sqrt()), "{mean:?}");
    }

    #[test]
    fn the_seed_decides() {
        let points = |seed| uniform_points(&uneven(), 10, seed).unwrap();
        assert_eq!(points(1), points(1));
        assert_ne!(points(1), points(2));
    }

    #[test]
    fn poisson_disk_points_keep_apart_and_cover() {
        let n = 100;
        let points = poisson_disk_points(&square(), n, 3).unwrap();
        assert_eq!(points.len(), n);
        let positions: Vec<[f64; 3]> = points.iter().map(|point| point.position(&square())).collect();
        let distance = |a: [f64; 3], b: [f64; 3]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let nearest = |p: [f64; 3]| {
            let others = positions.iter().filter(|q| **q != p).map(|q| distance(p, *q));
            others.fold(f64::INFINITY, f64::min)
        };
        let largest = 2.0 * (4.0 / (2.0 * 3.0_f64.sqrt() * n as f64)).sqrt();
        let closest = positions.iter().map(|p| nearest(*p)).fold(f64::INFINITY, f64::min);
        // Random points come within a hundredth of this; the paper reports about 0.7 for sets in the plane.
        assert!(closest > 0.6 * largest, "{}", closest / largest);
        let grid = (0..400).map(|i| [0.05 + 0.1 * f64::from(i % 20), 0.05 + 0.1 * f64::from(i / 20), 0.0]);
        let widest = grid.map(nearest).fold(0.0, f64::max);
        assert!(widest < 1.3 * largest, "{}", widest / largest);
        assert_eq!(points, poisson_disk_points(&square(), n, 3).unwrap());
        assert!(poisson_disk_points(&square(), 0, 3).unwrap().is_empty());
    }

    #[test]
    fn a_surface_without_area_is_refused() {
        let cloud = Mesh { faces: Vec::new(), ..square() };
        for result in [uniform_points(&cloud, 3, 0), poisson_disk_points(&cloud, 3, 0)] {
            assert!(result.unwrap_err().to_string().contains("area 0"));
        }
        for many in [uniform_points(&square(), usize::MAX, 0), poisson_disk_points(&square(), usize::MAX, 0)] {
            assert!(many.unwrap_err().to_string().contains("at most"));
        }
    }
}
