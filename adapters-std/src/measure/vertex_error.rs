//! Distances between corresponding vertices, mm.

use crate::dense::{columns, multiply};
use rayon::prelude::*;

/// Coordinates of the residuals that are held at a time: a multiple of 3.
const BLOCK: usize = 768;

/// Mean distance of corresponding vertices of two shapes: `d(c, c') = (1/n) sum_v |c_v - c'_v|` (xyz after xyz, mm).
///
/// # Panics
/// When the lengths differ.
pub fn mean_vertex_distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let (a, b) = (a.as_chunks::<3>().0, b.as_chunks::<3>().0);
    a.iter().zip(b).map(|(a, b)| length([a[0] - b[0], a[1] - b[1], a[2] - b[2]])).sum::<f64>() / a.len() as f64
}

/// The distances `d` of many pairs of shapes of `shape_len` coordinates, which lie one after another in `a` and `b`.
///
/// # Panics
/// When the lengths differ.
pub fn mean_vertex_distances(a: &[f64], b: &[f64], shape_len: usize) -> Vec<f64> {
    assert_eq!(a.len(), b.len());
    let pairs = a.par_chunks_exact(shape_len).zip(b.par_chunks_exact(shape_len));
    pairs.map(|(a, b)| mean_vertex_distance(a, b)).collect()
}

/// A mean over shapes, with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanError {
    /// Mean, mm.
    pub mean: f64,
    /// Standard error of the mean, `sd / sqrt(count)`, mm; 0 for a single value.
    pub standard_error: f64,
    /// Largest value, mm.
    pub largest: f64,
    /// Number of values.
    pub count: usize,
}

impl MeanError {
    /// Of `values`, summed in their order. `None` when there are none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = values.len();
        if count == 0 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / count as f64;
        let square: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        let standard_error = if count > 1 { (square / ((count - 1) * count) as f64).sqrt() } else { 0.0 };
        let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Some(MeanError { mean, standard_error, largest, count })
    }
}

/// `(1/n) sum_v |r_v|` of residual shapes that are linear combinations of training shapes: column after column of
/// `coefficients` (one number per shape in `shapes`). One thread; a few hundred kB beside the result.
pub(crate) fn mean_lengths_of_combinations(shapes: &[f64], shape_len: usize, coefficients: &[f64]) -> Vec<f64> {
    let n_shapes = shapes.len() / shape_len;
    let n = coefficients.len() / n_shapes;
    let mut sums = vec![0.0; n];
    let mut residuals = vec![0.0; BLOCK * n];
    for start in (0..shape_len).step_by(BLOCK) {
        let width = BLOCK.min(shape_len - start);
        let residuals = &mut residuals[..width * n];
        let block = columns(&shapes[start..], width, n_shapes, shape_len);
        multiply(residuals, 0.0, &block, &columns(coefficients, n_shapes, n, n_shapes));
        for (sum, residual) in sums.iter_mut().zip(residuals.chunks_exact(width)) {
            *sum += residual.as_chunks::<3>().0.iter().map(|&r| length(r)).sum::<f64>();
        }
    }
    sums.iter_mut().for_each(|sum| *sum /= (shape_len / 3) as f64);
    sums
}

/// Length of a vector.
pub(crate) fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_is_the_mean_over_vertices() {
        let (a, b) = ([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], [3.0, 4.0, 0.0, 1.0, 1.0, 2.0]);
        assert_eq!(mean_vertex_distance(&a, &b), 3.0);
        assert_eq!(mean_vertex_distances(&[a, a].concat(), &[b, a].concat(), 6), [3.0, 0.0]);
    }

    #[test]
    fn standard_error_follows_its_definition() {
        let found = MeanError::of(&[1.0, 2.0, 3.0, 6.0]).unwrap();
        assert_eq!((found.mean, found.largest, found.count), (3.0, 6.0, 4));
        assert!((found.standard_error - (14.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-15);
        assert_eq!(MeanError::of(&[2.0]).unwrap().standard_error, 0.0);
        assert_eq!(MeanError::of(&[]), None);
    }

    #[test]
    fn combinations_equal_explicit_residuals() {
        let len = 3 * 700;
        let shapes: Vec<f64> = (0..7 * len).map(|x| ((x * x) as f64 * 0.01).sin()).collect();
        let coefficients: Vec<f64> = (0..7 * 8).map(|x| ((x * 5) % 9) as f64 - 4.0).collect();
        let found = mean_lengths_of_combinations(&shapes, len, &coefficients);
        for (column, found) in coefficients.chunks_exact(7).zip(found) {
            let mut residual = vec![0.0; len];
            for (shape, c) in shapes.chunks_exact(len).zip(column) {
                residual.iter_mut().zip(shape).for_each(|(r, x)| *r += c * x);
            }
            assert!((mean_vertex_distance(&residual, &vec![0.0; len]) - found).abs() < 1e-12);
        }
    }
}
