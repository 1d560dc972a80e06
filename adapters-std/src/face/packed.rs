//! Symmetric matrices in packed storage: entry `(i, j)`, `i <= j`, is number `j (j + 1) / 2 + i`.
//!
//! The leading `n x n` part of a matrix is then the first `n (n + 1) / 2` numbers of its storage, so a model that is cut to
//! fewer weights uses the same arrays.
//!
//! Everything is inlined, so that callers can have it compiled for the vectors of the machine; the bits stay the same.

use crate::dense::dot;

/// Numbers in a packed `n x n` matrix.
pub(crate) const fn packed_len(n: usize) -> usize {
    n * (n + 1) / 2
}

/// Position of entry `(i, j)`, `i <= j`.
pub(crate) const fn packed_index(i: usize, j: usize) -> usize {
    j * (j + 1) / 2 + i
}

/// Cholesky factor `R` of `A = R^T R` in place, `R` upper triangular; `false` when a pivot is not positive.
#[inline(always)]
pub(crate) fn cholesky_in_place(a: &mut [f64], n: usize) -> bool {
    for j in 0..n {
        let (before, column) = a.split_at_mut(packed_len(j));
        let column = &mut column[..j + 1];
        for i in 0..j {
            let factor = &before[packed_len(i)..packed_len(i + 1)];
            column[i] = (column[i] - dot(&factor[..i], &column[..i])) / factor[i];
        }
        let pivot = column[j] - dot(&column[..j], &column[..j]);
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        column[j] = pivot.sqrt();
    }
    true
}

/// Solves `R^T x = b` in place, given the factor of [`cholesky_in_place`].
#[inline(always)]
pub(crate) fn forward_solve_in_place(factor: &[f64], b: &mut [f64]) {
    for j in 0..b.len() {
        let column = &factor[packed_len(j)..packed_len(j + 1)];
        b[j] = (b[j] - dot(&column[..j], &b[..j])) / column[j];
    }
}

/// Solves `R^T R x = b` in place, given the factor of [`cholesky_in_place`].
#[inline(always)]
pub(crate) fn solve_in_place(factor: &[f64], b: &mut [f64]) {
    let n = b.len();
    forward_solve_in_place(factor, b);
    for j in (0..n).rev() {
        let column = &factor[packed_len(j)..packed_len(j + 1)];
        let x = b[j] / column[j];
        b[j] = x;
        b[..j].iter_mut().zip(column).for_each(|(b, r)| *b -= r * x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solution_satisfies_the_system() {
        let n = 13;
        let entry = |i: usize, j: usize| if i == j { 8.0 + i as f64 } else { ((i * j + 1) as f64).sin() };
        let mut a: Vec<f64> = (0..n).flat_map(|j| (0..=j).map(move |i| entry(i, j))).collect();
        assert_eq!(a[packed_index(3, 7)], entry(3, 7));
        let b: Vec<f64> = (0..n).map(|i| i as f64 - 4.0).collect();
        let mut x = b.clone();
        assert!(cholesky_in_place(&mut a, n));
        solve_in_place(&a, &mut x);
        for (i, b) in b.iter().enumerate() {
            let ax: f64 = (0..n).map(|j| entry(i.min(j), i.max(j)) * x[j]).sum();
            assert!((ax - b).abs() < 1e-12);
        }
    }

    #[test]
    fn indefinite_matrix_is_refused() {
        assert!(!cholesky_in_place(&mut [1.0, 2.0, 1.0], 2));
        assert!(!cholesky_in_place(&mut [f64::NAN], 1));
    }
}
