//! Householder QR factorisation `A P = Q R` of a tall matrix, in place, with or without column pivoting.

use super::{at, set};
use crate::workspace::{check_len, part, part_mut, saturated};
use crate::{Error, Real};

/// Replaces `a` (row-major, `n_rows x n_columns`, at least as many rows as columns) by its QR factors: `R` on and above the diagonal, below
/// it the Householder vectors `v_k`, whose entry on the diagonal is 1 and not stored; `Q = H_0 H_1 ...` with `H_k = I - tau_k v_k v_k^T`.
///
/// With an `order` of `n_columns` entries the columns are exchanged, `A P = Q R`: step k takes the column of the largest norm below row k (the
/// first of equals), so that the diagonal of `R` descends in magnitude and shows the rank; `order[k]` is the column that stands at k. With an
/// empty `order` they stay in place.
///
/// Source: G. H. Golub, C. F. Van Loan, Matrix Computations, algorithms 5.1.1, 5.2.1 and 5.4.1; norms are computed anew in each step, where
/// theirs are updated and can cancel. Order of operations: `m` is the [`Real::binade`] of the largest magnitude in column k from row k on, the
/// norm is `m sqrt(sum (a_ik / m)^2)` summed from zero by ascending row, `r_kk` the norm, negated where
/// `a_kk > 0`; `v_ik = a_ik / (a_kk - r_kk)` and `tau_k = (r_kk - a_kk) / r_kk`. Each later column, from left to right,
/// loses `tau_k (a_kj + sum v_ik a_ij) v_k`, rows ascending. A column of zeros has `tau = 0`.
///
/// | argument | shape | note |
/// |---|---|---|
/// | `a` | `n_rows x n_columns` | overwritten |
/// | `tau` | `n_columns` | result |
/// | `order` | `n_columns` or empty | result |
///
/// Cost: `2 n^2 (m - n / 3)` operations for m rows and n columns, with pivoting a quarter more; no workspace.
/// Accuracy: `|A P - Q R| <= 8 n eps |A|` in the Frobenius norm (test `factors_random_matrices`).
/// Errors: `DimensionMismatch` (more columns than rows: the columns are expected); `NotFinite` with the first entry of `a` that is not finite; nothing is written then.
/// Columns whose norm exceeds the largest number give factors that are not finite. Panics: never.
pub fn factor_in_place<R: Real>(
    a: &mut [R],
    n_rows: usize,
    n_columns: usize,
    tau: &mut [R],
    order: &mut [u32],
) -> Result<(), Error> {
    let n = n_columns;
    check_len(n, n.min(n_rows))?;
    check_len(n_rows.saturating_mul(n), a.len())?;
    check_len(n, tau.len())?;
    if !order.is_empty() {
        check_len(n, order.len())?;
    }
    if let Some(index) = a.iter().position(|entry| !entry.is_finite()) {
        return Err(Error::NotFinite { index: saturated(index) });
    }
    for (column, entry) in order.iter_mut().enumerate() {
        *entry = saturated(column);
    }
    for k in 0..n {
        let rest = part_mut(a, k * n, (n_rows - k) * n)?;
        let mut length = norm(rest, n, k);
        if !order.is_empty() {
            let mut longest = k;
            for j in k + 1..n {
                let other = norm(rest, n, j);
                if other > length {
                    (longest, length) = (j, other);
                }
            }
            // The finished rows above take part in the exchange.
            exchange(a, n, k, longest);
            let taken = order.get(longest).copied().unwrap_or_default();
            let given = order.get_mut(k).map_or(taken, |entry| core::mem::replace(entry, taken));
            if let Some(entry) = order.get_mut(longest) {
                *entry = given;
            }
        }
        let rest = part_mut(a, k * n, (n_rows - k) * n)?;
        set(tau, k, reflect(rest, n, k, length));
    }
    Ok(())
}

/// Makes column k of `rest` (rows from k on) zero below its first entry, applies the reflection to the later columns and returns its factor.
fn reflect<R: Real>(rest: &mut [R], n: usize, k: usize, length: R) -> R {
    if !(length > R::ZERO) {
        return R::ZERO;
    }
    let head = at(rest, k);
    let diagonal = if head > R::ZERO { -length } else { length };
    let divisor = head - diagonal;
    let (first, below) = rest.split_at_mut_checked(n).unwrap_or_default();
    for row in below.chunks_exact_mut(n.max(1)) {
        let value = at(row, k) / divisor;
        set(row, k, value);
    }
    let factor = (diagonal - head) / diagonal;
    set(first, k, diagonal);
    for j in k + 1..n {
        let mut sum = at(first, j);
        for row in below.chunks_exact(n.max(1)) {
            sum += at(row, k) * at(row, j);
        }
        sum *= factor;
        let value = at(first, j) - sum;
        set(first, j, value);
        for row in below.chunks_exact_mut(n.max(1)) {
            let value = at(row, j) - sum * at(row, k);
            set(row, j, value);
        }
    }
    factor
}

/// Norm of a column of `rows`, without overflow or underflow of its squares.
pub(super) fn norm<R: Real>(rows: &[R], n: usize, column: usize) -> R {
    let entries = || rows.iter().skip(column).step_by(n.max(1));
    let scale = entries().fold(R::ZERO, |largest, entry| entry.abs().max(largest)).binade();
    if !(scale > R::ZERO) {
        return R::ZERO;
    }
    let square = entries().fold(R::ZERO, |sum, &entry| sum + (entry / scale) * (entry / scale));
    scale * square.sqrt()
}

fn exchange<R: Real>(a: &mut [R], n: usize, i: usize, j: usize) {
    if i != j {
        for row in a.chunks_exact_mut(n.max(1)) {
            let (x, y) = (at(row, i), at(row, j));
            set(row, i, y);
            set(row, j, x);
        }
    }
}

/// Replaces `b` (as many entries as rows) by `Q^T b`, with the factors as [`factor_in_place`] leaves them: for k ascending, `b` loses
/// `tau_k (b_k + sum v_ik b_i) v_k`, rows ascending.
///
/// Errors: `DimensionMismatch`. Panics: never.
pub fn transpose_applied_in_place<R: Real>(a: &[R], tau: &[R], b: &mut [R]) -> Result<(), Error> {
    check_factors(a, tau, b.len())?;
    (0..tau.len()).for_each(|k| reflected(a, tau, b, k));
    Ok(())
}

/// Replaces `b`, one number for each row of the matrix, by `Q b`: the reflections of [`transpose_applied_in_place`] for k descending.
///
/// Errors: `DimensionMismatch`. Panics: never.
pub fn applied_in_place<R: Real>(a: &[R], tau: &[R], b: &mut [R]) -> Result<(), Error> {
    check_factors(a, tau, b.len())?;
    (0..tau.len()).rev().for_each(|k| reflected(a, tau, b, k));
    Ok(())
}

fn check_factors<R: Real>(a: &[R], tau: &[R], n_rows: usize) -> Result<(), Error> {
    check_len(tau.len(), tau.len().min(n_rows))?;
    check_len(n_rows.saturating_mul(tau.len()), a.len())
}

fn reflected<R: Real>(a: &[R], tau: &[R], b: &mut [R], k: usize) {
    let n = tau.len();
    let Some(vector) = a.get((k + 1) * n..) else { return };
    let vector = || vector.iter().skip(k).step_by(n.max(1));
    let Some((head, below)) = b.get_mut(k..).and_then(<[R]>::split_first_mut) else { return };
    let sum = at(tau, k) * vector().zip(below.iter()).fold(*head, |sum, (&v, &b)| sum + v * b);
    *head -= sum;
    for (b, &v) in below.iter_mut().zip(vector()) {
        *b -= sum * v;
    }
}

/// Solves `R x = b` for the leading `b.len()` columns in place of `b`, with `R` in `a` of `n_columns` columns; each row, from the last one, subtracts the
/// known `r_ij x_j` by ascending j and divides by the diagonal.
///
/// Errors: `DimensionMismatch`; `RankDeficient` at the last column whose diagonal is zero or NaN; nothing is written then. Panics: never.
pub fn back_substituted_in_place<R: Real>(a: &[R], n_columns: usize, b: &mut [R]) -> Result<(), Error> {
    let n = b.len();
    check_len(n, n.min(n_columns))?;
    part(a, 0, n.saturating_mul(n_columns))?;
    for k in (0..n).rev() {
        if !(at(a, k * n_columns + k).abs() > R::ZERO) {
            return Err(Error::RankDeficient { index: saturated(k) });
        }
    }
    for k in (0..n).rev() {
        let row = part(a, k * n_columns, n_columns)?;
        let mut value = at(b, k);
        for j in k + 1..n {
            value -= at(row, j) * at(b, j);
        }
        set(b, k, value / at(row, k));
    }
    Ok(())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::testing::cases;
    use proptest::prelude::*;
    use std::vec::Vec;

    #[test]
    fn known_factors() {
        // The columns (3, 4) and (1, 2): r_00 = -5, Q^T (1, 2) = (-11/5, ...).
        let mut a = [3.0, 1.0, 4.0, 2.0];
        let mut tau = [0.0; 2];
        factor_in_place(&mut a, 2, 2, &mut tau, &mut []).unwrap();
        assert_eq!((a[0], a[2], tau[0]), (-5.0f64, 0.5, 1.6));
        assert!((a[1] + 2.2).abs() < 1e-15 && (a[3].abs() - 0.4).abs() < 1e-15);
        let mut b = [3.0, 4.0];
        transpose_applied_in_place(&a, &tau, &mut b).unwrap();
        assert!((b[0] + 5.0).abs() < 1e-15 && b[1].abs() < 1e-15);
        applied_in_place(&a, &tau, &mut b).unwrap();
        assert!((b[0] - 3.0).abs() < 1e-15 && (b[1] - 4.0).abs() < 1e-15);
    }

    #[test]
    fn refusals() {
        let mismatch = |expected, found| Error::DimensionMismatch { expected, found };
        let mut tau = [9.0f64; 2];
        assert_eq!(factor_in_place(&mut [1.0; 2], 1, 2, &mut tau, &mut []), Err(mismatch(2, 1)));
        assert_eq!(factor_in_place(&mut [1.0; 3], 2, 2, &mut tau, &mut []), Err(mismatch(4, 3)));
        assert_eq!(factor_in_place(&mut [1.0; 4], 2, 2, &mut tau[..1], &mut []), Err(mismatch(2, 1)));
        assert_eq!(factor_in_place(&mut [1.0; 4], 2, 2, &mut tau, &mut [0]), Err(mismatch(2, 1)));
        let mut a = [1.0, 2.0, f64::NAN, 4.0];
        assert_eq!(factor_in_place(&mut a, 2, 2, &mut tau, &mut []), Err(Error::NotFinite { index: 2 }));
        assert!(a[0] == 1.0 && a[3] == 4.0 && tau == [9.0; 2]);
        assert_eq!(transpose_applied_in_place(&[1.0; 4], &tau, &mut [1.0; 3]), Err(mismatch(6, 4)));
        assert_eq!(applied_in_place(&[1.0; 2], &tau, &mut [1.0]), Err(mismatch(2, 1)));
        let mut b = [5.0, 6.0];
        assert_eq!(back_substituted_in_place(&[1.0, 2.0, 0.0, 0.0], 2, &mut b), Err(Error::RankDeficient { index: 1 }));
        assert_eq!(back_substituted_in_place(&[1.0; 2], 1, &mut b), Err(mismatch(2, 1)));
        assert_eq!(back_substituted_in_place(&[1.0; 3], 2, &mut b), Err(Error::IndexOutOfRange { index: 4, limit: 3 }));
        assert_eq!(b, [5.0, 6.0]);
    }

    /// Shape, entries and scale of a random tall matrix.
    pub(crate) fn tall() -> impl Strategy<Value = (usize, usize, Vec<f64>, i32)> {
        (1usize..8, 0usize..6, proptest::collection::vec(-1.0f64..1.0, 8 * 13 + 13), -150i32..150)
            .prop_map(|(n, more, entries, power)| (n + more, n, entries, power))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(cases()))]

        #[test]
        fn factors_random_matrices((m, n, entries, power) in tall(), pivoted in any::<bool>()) {
            let scale = 10f64.powi(power);
            let a: Vec<f64> = entries[..m * n].iter().map(|x| x * scale).collect();
            let (mut qr, mut tau, mut order) = (a.clone(), vec![0.0; n], vec![0; if pivoted { n } else { 0 }]);
            factor_in_place(&mut qr, m, n, &mut tau, &mut order).unwrap();
            let size = a.iter().map(|x| (x / scale) * (x / scale)).sum::<f64>().sqrt();
            let mut square = 0.0;
            for j in 0..n {
                let mut column: Vec<f64> = (0..m).map(|i| if i <= j { qr[i * n + j] } else { 0.0 }).collect();
                applied_in_place(&qr, &tau, &mut column).unwrap();
                let from = order.get(j).map_or(j, |&j| j as usize);
                square += (0..m).map(|i| ((column[i] - a[i * n + from]) / scale).powi(2)).sum::<f64>();
            }
            prop_assert!(square.sqrt() <= 8.0 * n as f64 * f64::EPSILON * size);
            if pivoted {
                for k in 1..n {
                    prop_assert!(qr[k * n + k].abs() <= qr[(k - 1) * n + k - 1].abs() * (1.0 + 1e-14));
                }
                order.sort();
                prop_assert!(order.iter().enumerate().all(|(k, &column)| column as usize == k));
            }
        }

    }
}
