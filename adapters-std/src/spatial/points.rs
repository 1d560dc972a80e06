//! The points of a cloud that are nearest to a position: the kd-tree of the crate kiddo, with an order for equal distances.
//!
//! The crate leaves open which of several equally near points it returns. So where it finds two that are about equally near, its answer
//! only says how far to look: all points at that distance are then looked at, and the smallest index wins. Points at one place, as
//! scanners write where they saw nothing, are one point of the tree.

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
    /// None when all points are at different places: then the items of the tree are the points.
    places: Option<Places>,
}

/// Places with the points there.
#[derive(Debug)]
struct Places {
    /// Where the points of each place begin in `points`, and the end.
    starts: Vec<u32>,
    /// Place by place, in each the smallest index first.
    points: Vec<u32>,
}

impl Places {
    /// None when no two points are at one place.
    fn of(points: &[[f64; 3]]) -> Option<Self> {
        // Both zeros are one place.
        let bits = |index: u32| points[index as usize].map(|x| (x + 0.0).to_bits());
        let mut keys: Vec<u64> = (0..points.len() as u32)
            .map(|index| {
                let mixed = bits(index)
                    .into_iter()
                    .fold(0_u64, |hash, bits| (hash.rotate_left(23) ^ bits).wrapping_mul(0x9E37_79B9_7F4A_7C15));
                mixed & !u64::from(u32::MAX) | u64::from(index)
            })
            .collect();
        keys.sort_unstable();
        let is_shared =
            keys.windows(2).any(|pair| pair[0] >> 32 == pair[1] >> 32 && bits(pair[0] as u32) == bits(pair[1] as u32));
        if !is_shared {
            // Equal points whose keys have another between them are only where a third has the same key: rare, and slow alone.
            return None;
        }
        let mut order: Vec<u32> = keys.into_iter().map(|key| key as u32).collect();
        let hash_free = |index: &u32| (bits(*index), *index);
        order.sort_by_cached_key(hash_free);
        let mut starts = vec![0];
        starts.extend((1..order.len() as u32).filter(|&at| bits(order[at as usize]) != bits(order[at as usize - 1])));
        starts.push(order.len() as u32);
        Some(Places { starts, points: order })
    }

    fn at(&self, place: u32) -> &[u32] {
        &self.points[self.starts[place as usize] as usize..self.starts[place as usize + 1] as usize]
    }
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
        let places = Places::of(points);
        let different: Vec<[f64; 3]>;
        let searched = match &places {
            None => points,
            Some(places) => {
                let firsts = places.starts[..places.starts.len() - 1].iter();
                different = firsts.map(|&at| points[places.points[at as usize] as usize]).collect();
                &different
            }
        };
        let tree = ImmutableKdTree::new_from_slice(searched)
            .map_err(|error| Error::input(format!("{} points cannot be searched: {error}", points.len())))?;
        Ok(PointTree { tree, points: points.to_vec(), places })
    }

    /// The points of an item of the tree, the smallest index first, and at most so many.
    fn points_at(&self, item: u32, most: usize) -> impl Iterator<Item = u32> {
        let all = self.places.as_ref().map(|places| places.at(item));
        let alone = all.is_none().then_some(item);
        alone.into_iter().chain(all.unwrap_or_default().iter().copied()).take(most)
    }

    /// The first point of an item of the tree.
    fn first_at(&self, item: u32) -> u32 {
        self.places.as_ref().map_or(item, |places| places.at(item)[0])
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
        self.nearer(position, 0, found.iter().map(|found| (found.distance, self.first_at(found.item))))
    }

    /// [`Self::nearest`], found faster when it is not much farther than the point `hint`. The result does not depend on the hint; one
    /// that is no point is no hint.
    pub fn nearest_from(&self, position: [f64; 3], hint: u32) -> Neighbour {
        let Some(point) = self.points.get(hint as usize).filter(|_| searchable(position)) else {
            return self.nearest(position);
        };
        let bound = squared(*point, position) * ROUNDING;
        let found = self.tree.query(&position).nearest_n::<SquaredEuclidean<f64>>(TWO).within(bound).execute();
        self.nearer(position, hint, found.iter().map(|found| (found.distance, self.first_at(found.item))))
    }

    /// The `n` nearest points, or all when there are fewer, sorted by distance, then by index; none from a position that is not finite.
    pub fn nearest_n(&self, position: [f64; 3], n: usize) -> Vec<Neighbour> {
        let Some(n) = NonZero::new(n.min(self.points.len())).filter(|_| searchable(position)) else {
            return Vec::new();
        };
        let found = self.tree.query(&position).nearest_n::<SquaredEuclidean<f64>>(n).execute();
        let farthest = found
            .iter()
            .map(|found| squared(self.points[self.first_at(found.item) as usize], position))
            .fold(0.0, f64::max);
        let mut all = self.around(position, farthest.sqrt(), n.get());
        all.truncate(n.get());
        all
    }

    /// All points at most `radius` away, sorted by distance, then by index; none from a position that is not finite.
    pub fn within(&self, position: [f64; 3], radius: f64) -> Vec<Neighbour> {
        if searchable(position) && radius >= 0.0 { self.around(position, radius, usize::MAX) } else { Vec::new() }
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
            let other = self.neighbour(position, self.first_at(found.item));
            if (other.distance, other.index) < (first.distance, first.index) {
                first = other;
            }
        });
        first
    }

    /// The points at most `radius` away, in order; at most so many of each place.
    fn around(&self, position: [f64; 3], radius: f64, most: usize) -> Vec<Neighbour> {
        let mut all = Vec::new();
        let squared = radius * radius * ROUNDING;
        self.tree.query(&position).within::<SquaredEuclidean<f64>>(squared).unsorted().visit(|found| {
            let first = self.neighbour(position, self.first_at(found.item));
            if first.distance <= radius {
                all.extend(self.points_at(found.item, most).map(|index| Neighbour { index, ..first }));
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
        check(&[[0.0, 1.0, -0.0], [-0.0, 1.0, 0.0], [3.0, 0.0, 0.0]], &[[0.0; 3], [2.0, 1.0, 0.0]]);
    }

    #[test]
    fn very_many_points_at_one_place_are_no_more_work_than_one() {
        // Where a scanner saw nothing it may write zeros: with each query looking at all of them this would take minutes.
        let mut points = vec![[0.0; 3]; 200_000];
        points.push([1.0, 0.0, 0.0]);
        let tree = PointTree::new(&points).expect("points");
        assert!(tree.nearest_all(&points).iter().take(200_000).all(|neighbour| neighbour.index == 0));
        assert_eq!(tree.nearest_n([0.9, 0.0, 0.0], 3).iter().map(|n| n.index).collect::<Vec<_>>(), [200_000, 0, 1]);
        assert_eq!(tree.within([0.0; 3], 0.5).len(), 200_000);
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
