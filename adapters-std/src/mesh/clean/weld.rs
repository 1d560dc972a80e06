//! Vertices at the same place become one.

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
    let mut grid = Grid::new(taking_part().count(), positions.len());
    let width = 8.0 * distance;
    for vertex in taking_part() {
        let p = positions[vertex];
        if !(width > 0.0) {
            // A cell is a position; adding 0.0 makes the two zeros one.
            let cell = (p + 0.0).to_array().map(|x| x.to_bits() as i64);
            match grid.first(cell, |other| positions[other] == p) {
                NONE => grid.insert(cell, vertex as u32),
                found => welded_to[vertex] = found,
            }
            continue;
        }
        // Not below 0, so that the cast is the floor; what is a little below 0 has no neighbour there.
        let cell = |place: DVec3| (place / width).to_array().map(|x| x as i64);
        let (place, reach) = (p - low, 1.001 * distance);
        let (begin, end) = (cell(place - reach), cell(place + reach));
        // Axis by axis first: of small numbers the squares are 0.
        let is_near = |other: usize| {
            let away = positions[other] - p;
            away.abs().max_element() <= distance && away.length() <= distance
        };
        let mut found = NONE;
        for x in begin[0]..=end[0] {
            for y in begin[1]..=end[1] {
                for z in begin[2]..=end[2] {
                    found = found.min(grid.first([x, y, z], is_near));
                }
            }
        }
        match found {
            NONE => grid.insert(cell(place), vertex as u32),
            found => welded_to[vertex] = found,
        }
    }
    welded_to
}

/// Vertices by cells. Cells share a bucket where their numbers mix to the same; whoever asks looks at the vertices themselves.
struct Grid {
    /// The last vertex of each bucket; a power of two of them.
    last: Vec<u32>,
    /// The vertex in the bucket before each vertex.
    previous: Vec<u32>,
    shift: u32,
}

impl Grid {
    /// For so many vertices of all, of which many will be welded.
    fn new(n: usize, n_all: usize) -> Self {
        let n_buckets = (n / 2).next_power_of_two().max(16);
        Grid { last: vec![NONE; n_buckets], previous: vec![NONE; n_all], shift: 64 - n_buckets.trailing_zeros() }
    }

    fn bucket(&self, cell: [i64; 3]) -> usize {
        // Odd multipliers and a rotation spread every bit over the upper end, from which the bucket is taken.
        let mixed = cell
            .iter()
            .fold(0_u64, |mixed, &number| (mixed.rotate_left(23) ^ number as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        ((mixed ^ mixed >> 32).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> self.shift) as usize
    }

    /// The first vertex in the cell for which `is_wanted` holds, or [`NONE`].
    fn first(&self, cell: [i64; 3], is_wanted: impl Fn(usize) -> bool) -> u32 {
        let (mut first, mut candidate) = (NONE, self.last[self.bucket(cell)]);
        while candidate != NONE {
            // Later ones come first.
            if is_wanted(candidate as usize) {
                first = candidate;
            }
            candidate = self.previous[candidate as usize];
        }
        first
    }

    fn insert(&mut self, cell: [i64; 3], vertex: u32) {
        let bucket = self.bucket(cell);
        self.previous[vertex as usize] = self.last[bucket];
        self.last[bucket] = vertex;
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
