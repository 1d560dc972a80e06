//! The points of a cloud that are nearest to a position: the kd-tree of the crate kiddo, with an order for equal distances.
//!
//! The crate leaves open which of several equally near points it returns. So where it finds two that are about equally near, its answer
//! only says how far to look: all points at that distance are then looked at, and the smallest index wins.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::bvh::LARGEST;
use super::order::along_curve;
use crate::Error;

/// Positions that one thread takes at a time.
const CHUNK: usize = 256;

/// A squared distance times this includes all that have the same square root, and those that the crate rounds otherwise.
const ROUNDING: f64 = 1.0 + 8.0 * f64::EPSILON;

/// The nearest point and the next: that is little more work than the nearest alone, and less than to look for its equals afterwards.
const TWO: NonZero<usize> = NonZero::<usize>::MIN.saturating_add(1);

/// A point of the cloud and how far it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Index of the point.
    pub index: u32,
    /// Distance, in the unit of the cloud.
    pub distance: f64,
}

/// A search structure over points.
///
/// Memory: about 60 bytes a point. Time of building: `n log n`.
#[derive(Debug)]
pub struct PointTree {
    tree: ImmutableKdTree<f64, 3>,
    points: Vec<[f64; 3]>,
}

impl PointTree {
    /// The structure over these points.
    ///
    /// # Errors
    /// [`Error::Input`] without points, with more than 2^32 - 1, or for a coordinate that is not finite or beyond 1e70.
    pub fn new(points: &[[f64; 3]]) -> Result<Self, Error> {
        if points.is_empty() {
            return Err(Error::input("no point to search among: give at least one"));
        }
        if let Some(index) = points.iter().position(|&p| !searchable(p)) {
            let point = points[index];
            return Err(Error::input(format!(
                "point {index} is at {point:?}: coordinates must be finite and at most {LARGEST:e}; remove the point"
            )));
        }
        let tree = ImmutableKdTree::new_from_slice(points)
            .map_err(|error| Error::input(format!("{} points cannot be searched: {error}", points.len())))?;
        Ok(PointTree { tree, points: points.to_vec() })
    }

    /// The number of points.
    pub fn n_points(&self) -> usize {
        self.points.len()
    }

    /// The nearest point; of several equally near ones the one with the smallest index.
    ///
    /// From a position that is not finite, or beyond 1e70, every point is at a distance of NaN.
    pub fn nearest(&self, position: [f64; 3]) -> Neighbour {
        if !searchable(position) {
            return Neighbour { index: 0, distance: f64::NAN };
        }
        let found = self.tree.query(&position).nearest_n::<SquaredEuclidean<f64>>(TWO).execute();
        self.nearer(position, 0, found.iter().map(|found| (found.distance, found.item)))
    }

    /// [`Self::nearest`], found faster when it is not much farther than the point `hint`. The result does not depend on the hint; one
    /// that is no point is no hint.
    pub fn nearest_from(&self, position: [f64; 3], hint: u32) -> Neighbour {
        let Some(point) = self.points.get(hint as usize).filter(|_| searchable(position)) else {
            return self.nearest(position);
        };
        let bound = squared(*point, position) * ROUNDING;
        let found = self.tree.query(&position).nearest_n::<SquaredEuclidean<f64>>(TWO).within(bound).execute();
        self.nearer(position, hint, found.iter().map(|found| (found.distance, found.item)))
    }

    /// The `n` nearest points, or all when there are fewer, sorted by distance, then by index; none from a position that is not finite.
    pub fn nearest_n(&self, position: [f64; 3], n: usize) -> Vec<Neighbour> {
        let Some(n) = NonZero::new(n.min(self.points.len())).filter(|_| searchable(position)) else {
            return Vec::new();
        };
        let found = self.tree.query(&position).nearest_n::<SquaredEuclidean<f64>>(n).execute();
        let farthest =
            found.iter().map(|found| squared(self.points[found.item as usize], position)).fold(0.0, f64::max);
        let mut all = self.around(position, farthest.sqrt());
        all.truncate(n.get());
        all
    }

    /// All points at most `radius` away, sorted by distance, then by index; none from a position that is not finite.
    pub fn within(&self, position: [f64; 3], radius: f64) -> Vec<Neighbour> {
        if searchable(position) && radius >= 0.0 { self.around(position, radius) } else { Vec::new() }
    }

    /// [`Self::nearest`] of each position, over all threads; positions are taken in an order in which memory is near.
    pub fn nearest_all(&self, positions: &[[f64; 3]]) -> Vec<Neighbour> {
        let order = along_curve(positions);
        let found: Vec<Vec<Neighbour>> = order
            .par_chunks(CHUNK)
            .map(|chunk| chunk.iter().map(|&index| self.nearest(positions[index as usize])).collect())
            .collect();
        let mut placed = vec![Neighbour { index: 0, distance: f64::NAN }; positions.len()];
        for (&index, neighbour) in order.iter().zip(found.into_iter().flatten()) {
            placed[index as usize] = neighbour;
        }
        placed
    }

    fn neighbour(&self, position: [f64; 3], index: u32) -> Neighbour {
        Neighbour { index, distance: squared(self.points[index as usize], position).sqrt() }
    }

    /// The nearest point, when the crate has found these two, with their squared distances, nearest first; `otherwise` when it has found
    /// none. Only where the second is hardly farther than the first are there equals to look for.
    fn nearer(&self, position: [f64; 3], otherwise: u32, mut found: impl Iterator<Item = (f64, u32)>) -> Neighbour {
        let Some((squared, index)) = found.next() else {
            return self.first_of_equals(position, self.neighbour(position, otherwise));
        };
        let nearest = self.neighbour(position, index);
        let is_alone = found.next().is_none_or(|(second, _)| second > squared * ROUNDING * ROUNDING);
        if is_alone { nearest } else { self.first_of_equals(position, nearest) }
    }

    /// The point with the smallest index among those as near as `nearest`, to which none is nearer.
    fn first_of_equals(&self, position: [f64; 3], nearest: Neighbour) -> Neighbour {
        let mut first = nearest;
        let radius = nearest.distance * nearest.distance * ROUNDING;
        self.tree.query(&position).within::<SquaredEuclidean<f64>>(radius).unsorted().visit(|found| {
            let other = self.neighbour(position, found.item);
            if (other.distance, other.index) < (first.distance, first.index) {
                first = other;
            }
        });
        first
    }

    fn around(&self, position: [f64; 3], radius: f64) -> Vec<Neighbour> {
        let mut all = Vec::new();
        let squared = radius * radius * ROUNDING;
        self.tree.query(&position).within::<SquaredEuclidean<f64>>(squared).unsorted().visit(|found| {
            let neighbour = self.neighbour(position, found.item);
            if neighbour.distance <= radius {
                all.push(neighbour);
            }
        });
        all.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then(a.index.cmp(&b.index)));
        all
    }
}

fn searchable(position: [f64; 3]) -> bool {
    position.iter().all(|x| x.abs() <= LARGEST)
}

fn squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// All points, sorted by distance, then by index.
    fn slowly(points: &[[f64; 3]], position: [f64; 3]) -> Vec<Neighbour> {
        let mut all: Vec<Neighbour> = points
            .iter()
            .enumerate()
            .map(|(index, &p)| Neighbour { index: index as u32, distance: squared(p, position).sqrt() })
            .collect();
        all.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.index.cmp(&b.index)));
        all
    }

    fn check(points: &[[f64; 3]], positions: &[[f64; 3]]) {
        let tree = PointTree::new(points).expect("points");
        let found: Vec<Neighbour> = positions.iter().map(|&p| tree.nearest(p)).collect();
        for (&p, &nearest) in positions.iter().zip(&found) {
            let all = slowly(points, p);
            assert_eq!(nearest, all[0]);
            for hint in [0, points.len() as u32 / 2, u32::MAX] {
                assert_eq!(tree.nearest_from(p, hint), nearest);
            }
            for n in [0, 1, 2, 7, points.len(), usize::MAX] {
                assert_eq!(tree.nearest_n(p, n), all[..n.min(all.len())]);
            }
            for radius in [0.0, nearest.distance, all[all.len() / 3].distance, f64::INFINITY] {
                let n = all.iter().filter(|neighbour| neighbour.distance <= radius).count();
                assert_eq!(tree.within(p, radius), all[..n]);
            }
        }
        assert_eq!(tree.nearest_all(positions), found);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn neighbours_are_those_of_every_point_in_turn(
            points in prop::collection::vec(prop::array::uniform3(-3_i8..4), 1..150),
            positions in prop::collection::vec(prop::array::uniform3(-5_i8..6), 1..8),
            (scale, shift) in prop_oneof![Just((1.0, 0.0)), Just((0.1, 1e5)), Just((1e-50, 0.0)), Just((1e60, 0.0))],
            dimensions in 0_usize..4,
        ) {
            // On a lattice, so that many are equally near; also all on a plane, a line or one place.
            let place = |p: &[i8; 3]| [0, 1, 2].map(|k| if k < dimensions { f64::from(p[k]) * scale + shift } else { shift });
            check(
                &points.iter().map(place).collect::<Vec<_>>(),
                &positions.iter().map(|p| p.map(|x| f64::from(x) * 0.5 * scale + shift)).collect::<Vec<_>>(),
            );
        }
    }

    #[test]
    fn many_points_on_few_places() {
        // More equal coordinates than a leaf of the tree holds.
        let points: Vec<[f64; 3]> = (0..3000).map(|i| [f64::from(i % 2), 0.0, f64::from(i % 3)]).collect();
        check(&points, &[[0.5, 0.0, 1.0], [0.0, 0.0, 0.0], [7.0, 7.0, 7.0]]);
        check(&vec![[1.0, 2.0, 3.0]; 1000], &[[1.0, 2.0, 3.0], [0.0; 3]]);
    }

    #[test]
    fn any_number_of_threads_finds_the_same() {
        let place = |i: u32| [0.37, 0.61, 0.83].map(|step: f64| (step * f64::from(i) + 0.1).fract());
        let points: Vec<[f64; 3]> = (0..20_000).map(place).collect();
        let positions: Vec<[f64; 3]> = (20_000..21_000).map(place).collect();
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| PointTree::new(&points).expect("points").nearest_all(&positions))
        };
        assert_eq!(on(1), on(3));
    }

    #[test]
    fn what_is_no_position_has_no_neighbours() {
        let tree = PointTree::new(&[[0.0; 3]]).expect("a point");
        for spoilt in [f64::NAN, f64::INFINITY, -1e80] {
            let p = [spoilt, 0.0, 0.0];
            assert!(tree.nearest(p).distance.is_nan() && tree.nearest_from(p, 0).distance.is_nan());
            assert_eq!((tree.nearest_n(p, 1), tree.within(p, f64::INFINITY)), (vec![], vec![]));
        }
        assert_eq!((tree.within([0.0; 3], f64::NAN), tree.within([0.0; 3], -1.0)), (vec![], vec![]));
        assert_eq!(tree.nearest_all(&[]), []);
    }

    #[test]
    fn points_that_cannot_be_searched_are_named() {
        let message = |points: &[[f64; 3]]| PointTree::new(points).expect_err("must fail").to_string();
        assert!(message(&[]).contains("no point"));
        assert!(message(&[[0.0; 3], [0.0, f64::INFINITY, 0.0]]).contains("point 1 is at"));
        assert!(message(&[[1e71, 0.0, 0.0]]).contains("at most 1e70"));
    }
}
