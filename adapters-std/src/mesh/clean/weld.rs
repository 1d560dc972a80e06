//! Vertices at the same place become one.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use glam::DVec3;

use super::NONE;

/// For each vertex that takes part the one that replaces it: itself, or the first kept vertex within `distance` in the
/// order of the numbers.
///
/// A vertex is kept when no kept one is within `distance`, so that kept vertices are farther apart than that: nothing is
/// left to weld, and chains of close vertices do not run into one. Cost: `O(n)`, with a grid of cells of 8 distances that
/// holds the kept vertices.
pub(super) fn weld(positions: &[DVec3], takes_part: &[bool], distance: f64) -> Vec<u32> {
    let mut welded_to: Vec<u32> = (0..positions.len() as u32).collect();
    let taking_part = || (0..positions.len()).filter(|&vertex| takes_part[vertex]);
    let Some(first) = taking_part().next() else { return welded_to };
    let low = taking_part().fold(positions[first], |low, vertex| low.min(positions[vertex]));
    let n = taking_part().count();
    let mut newest =
        HashMap::<[i64; 3], u32, BuildHasherDefault<CellHasher>>::with_capacity_and_hasher(n, Default::default());
    let mut previous = vec![NONE; positions.len()];
    let width = 8.0 * distance;
    // Without a distance a cell is a position; adding 0.0 makes the two zeros one.
    let cell_at = |x: f64| if width > 0.0 { (x / width).floor() as i64 } else { (x + 0.0).to_bits() as i64 };
    let cell = |p: DVec3| [cell_at(p.x), cell_at(p.y), cell_at(p.z)];
    for vertex in taking_part() {
        let place = if width > 0.0 { positions[vertex] - low } else { positions[vertex] };
        let (begin, end) = (cell(place - distance), cell(place + distance));
        let mut found = NONE;
        for x in begin[0]..=end[0] {
            for y in begin[1]..=end[1] {
                for z in begin[2]..=end[2] {
                    let mut candidate = newest.get(&[x, y, z]).copied().unwrap_or(NONE);
                    while candidate != NONE {
                        if candidate < found && positions[candidate as usize].distance(positions[vertex]) <= distance {
                            found = candidate;
                        }
                        candidate = previous[candidate as usize];
                    }
                }
            }
        }
        if found != NONE {
            welded_to[vertex] = found;
        } else if let Some(before) = newest.insert(cell(place), vertex as u32) {
            previous[vertex] = before;
        }
    }
    welded_to
}

/// A short mixing of three cell numbers; the standard one takes as long as all else together.
#[derive(Default)]
struct CellHasher(u64);

impl Hasher for CellHasher {
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    fn write_u64(&mut self, value: u64) {
        // An odd multiplier and a rotation spread every bit over the upper half, from which the last step takes.
        self.0 = (self.0.rotate_left(23) ^ value).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }

    fn write_i64(&mut self, value: i64) {
        self.write_u64(value as u64);
    }

    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 32
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn welded(positions: &[[f64; 3]], distance: f64) -> Vec<u32> {
        let positions: Vec<DVec3> = positions.iter().copied().map(DVec3::from_array).collect();
        weld(&positions, &vec![true; positions.len()], distance)
    }

    #[test]
    fn chains_do_not_run_into_one() {
        let line: Vec<[f64; 3]> = (0..6).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        assert_eq!(welded(&line, 1.0), [0, 0, 2, 2, 4, 4]);
        assert_eq!(welded(&line, 0.9), [0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn without_a_distance_only_equal_positions_are_welded() {
        assert_eq!(welded(&[[0.0, 1.0, 2.0], [0.0, 1.0, 2.0 + 1e-15], [-0.0, 1.0, 2.0]], 0.0), [0, 1, 0]);
        assert_eq!(welded(&[], 0.0), Vec::<u32>::new());
    }

    proptest! {
        #[test]
        fn the_grid_finds_what_a_plain_search_finds(
            points in prop::collection::vec([-4i8..4, -4i8..4, -4i8..4], 0..60), distance in 0.0f64..2.5, unit in 0.3f64..1.0
        ) {
            let positions: Vec<[f64; 3]> = points.iter().map(|p| p.map(|x| f64::from(x) * unit + 7.0)).collect();
            let mut expected: Vec<u32> = Vec::new();
            for (vertex, p) in positions.iter().enumerate() {
                let near = |other: &usize| DVec3::from(positions[*other]).distance(DVec3::from(*p)) <= distance;
                let kept = (0..vertex).filter(|&other| expected[other] == other as u32);
                expected.push(kept.into_iter().find(near).unwrap_or(vertex) as u32);
            }
            prop_assert_eq!(welded(&positions, distance), expected);
        }
    }
}
