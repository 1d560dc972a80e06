//! An order of positions in which neighbours in the list are neighbours in space: along a Morton curve.

use rayon::prelude::*;

/// Indices of the positions along the curve, which runs through their bounding box; equal cells by index. What is not finite comes where
/// it comes.
pub(super) fn along_curve(positions: &[[f64; 3]]) -> Vec<u32> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in positions {
        for axis in 0..3 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
    }
    let width = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    // Cells are cubes: a flat cloud is a plane curve. The cast of NaN is 0.
    let cell = |x: f64, low: f64| ((x - low) / width * f64::from(CELLS)) as u32;
    let key = |p: &[f64; 3]| (0..3).fold(0, |key, axis| key | spread(cell(p[axis], low[axis]).min(CELLS - 1)) << axis);
    let mut keyed: Vec<(u32, u32)> =
        positions.par_iter().enumerate().map(|(index, p)| (key(p), index as u32)).collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, index)| index).collect()
}

/// Cells along an axis.
const CELLS: u32 = 1 << 10;

/// The ten lower bits with two zeros after each.
fn spread(x: u32) -> u32 {
    [(16, 0x0300_00ff), (8, 0x0300_f00f), (4, 0x030c_30c3), (2, 0x0924_9249)]
        .into_iter()
        .fold(x, |x, (shift, mask)| (x | x << shift) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_a_cube_come_along_the_curve() {
        let corner = |i: usize| [0, 1, 2].map(|axis| (i >> axis & 1) as f64);
        let positions: Vec<[f64; 3]> = [5, 3, 0, 7, 1, 6, 2, 4].map(corner).to_vec();
        assert_eq!(along_curve(&positions), [2, 4, 6, 1, 7, 0, 5, 3]);
    }

    #[test]
    fn bits_are_spread() {
        let slowly = |x: u32| (0..10).fold(0, |sum, bit| sum | (x >> bit & 1) << (3 * bit));
        assert!((0..CELLS).all(|x| spread(x) == slowly(x)));
    }

    #[test]
    fn every_index_comes_once_for_any_input() {
        let positions = [[f64::NAN; 3], [f64::INFINITY, 0.0, 0.0], [1e300; 3], [-1e300; 3], [0.0; 3]];
        for n in 0..=positions.len() {
            let mut order = along_curve(&positions[..n]);
            order.sort_unstable();
            assert_eq!(order, (0..n as u32).collect::<Vec<_>>());
        }
    }
}
