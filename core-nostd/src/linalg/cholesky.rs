//! Cholesky factorisation `A = L L^T` of a symmetric positive definite matrix, in place, and its solution.

use super::{at, set};
use crate::workspace::{check_len, part, part_mut, saturated};
use crate::{Error, Real};

/// Replaces the lower triangle of `a` (row-major, `n x n`) by the Cholesky factor `L`; the strict upper triangle is not touched.
///
/// Source: the row variant (Cholesky-Banachiewicz). Sums run over k ascending and start from the entry of `a`:
/// `((a_ij - l_i0 l_j0) - l_i1 l_j1) - ...`, on every target.
///
/// Cost: `n^3 / 6` multiplications, no workspace.
/// Errors: `DimensionMismatch` when `a` has not `n * n` entries; `NonPositivePivot` at the first pivot that is not positive (NaN
/// included), with `a` partly overwritten.
/// Panics: never.
pub fn factor_in_place<R: Real>(a: &mut [R], n: usize) -> Result<(), Error> {
    check_len(n.saturating_mul(n), a.len())?;
    for i in 0..n {
        let (done, rest) = a.split_at_mut_checked(i * n).unwrap_or_default();
        let row_i = part_mut(rest, 0, n)?;
        for j in 0..i {
            let row_j = part(done, j * n, n)?;
            let entry = minus_dot(at(row_i, j), part(row_i, 0, j)?, part(row_j, 0, j)?);
            set(row_i, j, entry / at(row_j, j));
        }
        let before = part(row_i, 0, i)?;
        let pivot = minus_dot(at(row_i, i), before, before);
        if !(pivot > R::ZERO && pivot.is_finite()) {
            return Err(Error::NonPositivePivot { index: saturated(i) });
        }
        set(row_i, i, pivot.sqrt());
    }
    Ok(())
}

/// Solves `L L^T x = b` in place of `b`, with `L` in the lower triangle of `l` as [`factor_in_place`] leaves it.
///
/// Both substitutions subtract in ascending order of the column that is already known (forward) and of the row (backward).
///
/// Errors: `DimensionMismatch`. Panics: never.
pub fn solve_in_place<R: Real>(l: &[R], b: &mut [R]) -> Result<(), Error> {
    let n = b.len();
    check_len(n.saturating_mul(n), l.len())?;
    for i in 0..n {
        let row = part(l, i * n, n)?;
        let value = minus_dot(at(b, i), part(row, 0, i)?, part(b, 0, i)?) / at(row, i);
        set(b, i, value);
    }
    for i in (0..n).rev() {
        let mut value = at(b, i);
        for k in i + 1..n {
            value -= at(l, k * n + i) * at(b, k);
        }
        set(b, i, value / at(l, i * n + i));
    }
    Ok(())
}

/// `start - x0 y0 - x1 y1 - ...`, in this order.
#[inline(always)]
fn minus_dot<R: Real>(start: R, x: &[R], y: &[R]) -> R {
    x.iter().zip(y).fold(start, |sum, (&x, &y)| sum - x * y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    #[test]
    fn known_factor() {
        let mut a = [4.0, 0.0, 0.0, 2.0, 5.0, 0.0, 2.0, 5.0, 14.0];
        factor_in_place(&mut a, 3).unwrap();
        assert_eq!(a, [2.0, 0.0, 0.0, 1.0, 2.0, 0.0, 1.0, 2.0, 3.0]);
        let mut b = [8.0, 21.0, 52.0];
        solve_in_place(&a, &mut b).unwrap();
        let back = [4.0 * b[0] + 2.0 * b[1] + 2.0 * b[2], 2.0 * b[0] + 5.0 * b[1] + 5.0 * b[2]];
        assert!((back[0] - 8.0f64).abs() < 1e-12 && (back[1] - 21.0).abs() < 1e-12);
    }

    #[test]
    fn refuses_what_is_not_positive_definite() {
        assert_eq!(factor_in_place(&mut [1.0, 2.0, 2.0, 1.0], 2), Err(Error::NonPositivePivot { index: 1 }));
        assert_eq!(factor_in_place(&mut [f64::NAN], 1), Err(Error::NonPositivePivot { index: 0 }));
        assert_eq!(factor_in_place(&mut [f32::INFINITY], 1), Err(Error::NonPositivePivot { index: 0 }));
        assert_eq!(factor_in_place(&mut [1.0f32; 3], 2), Err(Error::DimensionMismatch { expected: 4, found: 3 }));
        assert_eq!(
            solve_in_place(&[1.0f32; 3], &mut [1.0; 2]),
            Err(Error::DimensionMismatch { expected: 4, found: 3 })
        );
    }

    proptest! {
        /// Solving with A = B B^T + I gives back x, to the accuracy that the condition number allows.
        #[test]
        fn solves_random_systems(n in 1usize..12, seed in proptest::collection::vec(-1.0f64..1.0, 12 * 12 + 12)) {
            let b = |i: usize, j: usize| seed[i * 12 + j];
            let mut a = vec![0.0; n * n];
            for i in 0..n { for j in 0..n {
                a[i * n + j] = (0..n).map(|k| b(i, k) * b(j, k)).sum::<f64>() + if i == j { 1.0 } else { 0.0 };
            } }
            let x: Vec<f64> = (0..n).map(|i| seed[144 + i]).collect();
            let mut rhs: Vec<f64> = (0..n).map(|i| (0..n).map(|j| a[i * n + j] * x[j]).sum()).collect();
            factor_in_place(&mut a, n).unwrap();
            solve_in_place(&a, &mut rhs).unwrap();
            for (found, expected) in rhs.iter().zip(&x) {
                prop_assert!((found - expected).abs() < 1e-10);
            }
        }
    }
}
