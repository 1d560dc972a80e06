//! Eigenvalues and eigenvectors of a small symmetric matrix by cyclic Jacobi rotations.

use super::{at, set};
use crate::workspace::check_len;
use crate::{Error, Real};

/// Sweeps after which the iteration gives up; a well-scaled matrix of a few dozen rows needs six to ten.
const MAX_SWEEPS: u32 = 32;

/// Diagonalises the symmetric matrix `a` (row-major, `n x n`) in place: `a` ends with the eigenvalues on its diagonal, and row `k` of
/// `vectors` is the unit eigenvector of the `k`-th.
///
/// Eigenpairs are sorted by descending eigenvalue; each vector's component of largest magnitude (the first of equals) is positive.
///
/// Source: Jacobi's cyclic method, rotations in the order (0,1), (0,2), ..., (n-2,n-1), with the small root of the rotation's tangent.
/// A rotation is skipped, and its off-diagonal entry set to zero, when the entry is zero, at most `eps/2 (sqrt|a_pp| sqrt|a_qq|)`, or at most
/// `(eps/2)^2 (|a_pp| + |a_qq|)`. Otherwise `theta = (a_qq - a_pp) / (2 a_pq)`, `t = 1 / (|theta| + sqrt(theta^2 + 1))` with the sign of theta (beyond
/// 1e15: `1 / (2 theta)`), `c = 1 / sqrt(t^2 + 1)`, `s = t c`; rows and vectors become `c p - s q` and `s p + c q`, the diagonal
/// `a_pp - t a_pq` and `a_qq + t a_pq`. A sweep without a rotation ends the iteration; then a selection sort swaps pairs, the first of equals first.
/// Cost: about `6 n^3` operations a sweep, at most 32 sweeps, no workspace.
/// Accuracy: `|A v - lambda v| <= 8 n eps |A|` (test `eigenpairs_of_random_matrices`).
/// Errors: `DimensionMismatch`; `NotFinite` when `a` holds NaN or an infinity; `NotConverged`.
/// Panics: never.
pub fn diagonalise_in_place<R: Real>(a: &mut [R], vectors: &mut [R], n: usize) -> Result<(), Error> {
    let size = n.saturating_mul(n);
    check_len(size, a.len())?;
    check_len(size, vectors.len())?;
    if let Some(index) = a.iter().position(|entry| !entry.is_finite()) {
        return Err(Error::NotFinite { index: crate::workspace::saturated(index) });
    }
    vectors.fill(R::ZERO);
    for entry in vectors.iter_mut().step_by(n.saturating_add(1)) {
        *entry = R::ONE;
    }
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                rotated |= annihilate(a, vectors, n, p, q);
            }
        }
        if !rotated {
            sort(a, vectors, n);
            fix_signs(vectors, n);
            return Ok(());
        }
    }
    Err(Error::NotConverged { iterations: MAX_SWEEPS })
}

/// One rotation in the plane (p, q) that makes `a[p][q]` zero; false when it is zero to rounding already.
fn annihilate<R: Real>(a: &mut [R], vectors: &mut [R], n: usize, p: usize, q: usize) -> bool {
    let (app, aqq, apq) = (at(a, p * n + p), at(a, q * n + q), at(a, p * n + q));
    let small = R::EPSILON * R::from_f64(0.5);
    let scale = app.abs().sqrt() * aqq.abs().sqrt();
    // The second test ends the rotations inside a block that is zero to rounding against the rest of its two rows.
    if apq == R::ZERO || apq.abs() <= small * scale || apq.abs() <= small * small * (app.abs() + aqq.abs()) {
        set(a, p * n + q, R::ZERO);
        set(a, q * n + p, R::ZERO);
        return false;
    }
    let two = R::from_f64(2.0);
    let theta = (aqq - app) / (two * apq);
    let t = if theta.abs() > R::from_f64(1e15) {
        R::ONE / (two * theta)
    } else {
        let root = theta.abs() + (theta * theta + R::ONE).sqrt();
        if theta < R::ZERO { -(R::ONE / root) } else { R::ONE / root }
    };
    let c = R::ONE / (t * t + R::ONE).sqrt();
    let s = t * c;
    for k in 0..n {
        if k != p && k != q {
            let (akp, akq) = (at(a, k * n + p), at(a, k * n + q));
            let (new_p, new_q) = (c * akp - s * akq, s * akp + c * akq);
            set(a, k * n + p, new_p);
            set(a, p * n + k, new_p);
            set(a, k * n + q, new_q);
            set(a, q * n + k, new_q);
        }
        let (vp, vq) = (at(vectors, p * n + k), at(vectors, q * n + k));
        set(vectors, p * n + k, c * vp - s * vq);
        set(vectors, q * n + k, s * vp + c * vq);
    }
    set(a, p * n + p, app - t * apq);
    set(a, q * n + q, aqq + t * apq);
    set(a, p * n + q, R::ZERO);
    set(a, q * n + p, R::ZERO);
    true
}

/// Selection sort of the pairs by descending eigenvalue; the first of equals stays first.
fn sort<R: Real>(a: &mut [R], vectors: &mut [R], n: usize) {
    for i in 0..n {
        let mut largest = i;
        for k in i + 1..n {
            if at(a, k * n + k) > at(a, largest * n + largest) {
                largest = k;
            }
        }
        if largest != i {
            let (x, y) = (at(a, i * n + i), at(a, largest * n + largest));
            set(a, i * n + i, y);
            set(a, largest * n + largest, x);
            for k in 0..n {
                let (x, y) = (at(vectors, i * n + k), at(vectors, largest * n + k));
                set(vectors, i * n + k, y);
                set(vectors, largest * n + k, x);
            }
        }
    }
}

fn fix_signs<R: Real>(vectors: &mut [R], n: usize) {
    if n == 0 {
        return;
    }
    for row in vectors.chunks_exact_mut(n) {
        let mut largest = R::ZERO;
        for &entry in row.iter() {
            if entry.abs() > largest.abs() {
                largest = entry;
            }
        }
        if largest < R::ZERO {
            for entry in row.iter_mut() {
                *entry = -*entry;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    #[test]
    fn two_by_two() {
        let mut a = [2.0f64, 1.0, 1.0, 2.0];
        let mut v = [0.0; 4];
        diagonalise_in_place(&mut a, &mut v, 2).unwrap();
        assert!((a[0] - 3.0).abs() < 1e-15 && (a[3] - 1.0).abs() < 1e-15);
        assert!((v[0] - v[1]).abs() < 1e-15 && (v[2] + v[3]).abs() < 1e-15);
    }

    #[test]
    fn extremes() {
        let mut none: [f32; 0] = [];
        diagonalise_in_place(&mut none, &mut [], 0).unwrap();
        let mut zero = [0.0f32; 9];
        diagonalise_in_place(&mut zero, &mut [0.0; 9], 3).unwrap();
        let mut graded = [1e20f64, 1.0, 1.0, 1e-20];
        diagonalise_in_place(&mut graded, &mut [0.0; 4], 2).unwrap();
        assert!(graded[0] == 1e20 && graded[3].abs() < 1e-4);
        assert_eq!(diagonalise_in_place(&mut [f32::NAN], &mut [0.0], 1), Err(Error::NotFinite { index: 0 }));
        assert_eq!(
            diagonalise_in_place(&mut [0.0f32; 4], &mut [0.0], 2),
            Err(Error::DimensionMismatch { expected: 4, found: 1 })
        );
    }

    fn check(n: usize, entries: &[f64]) {
        let full: Vec<f64> = (0..n * n).map(|k| entries[(k / n).min(k % n) * 10 + (k / n).max(k % n)]).collect();
        let (mut a, mut v) = (full.clone(), vec![0.0; n * n]);
        diagonalise_in_place(&mut a, &mut v, n).unwrap();
        let norm = full.iter().map(|x| x * x).sum::<f64>().sqrt();
        for k in 0..n {
            let row = &v[k * n..(k + 1) * n];
            for i in 0..n {
                let image: f64 = (0..n).map(|j| full[i * n + j] * row[j]).sum();
                assert!((image - a[k * n + k] * row[i]).abs() <= 8.0 * n as f64 * f64::EPSILON * norm);
            }
            assert!(k == 0 || a[(k - 1) * n + k - 1] >= a[k * n + k]);
        }
    }

    proptest! {
        #[test]
        fn eigenpairs_of_random_matrices(n in 1usize..10, entries in proptest::collection::vec(-1.0f64..1.0, 100)) {
            check(n, &entries);
        }

        #[test]
        fn never_panics_and_ends(entries in proptest::collection::vec(any::<f32>(), 16)) {
            let mut a: Vec<f32> = (0..16).map(|k| entries[(k / 4).min(k % 4) * 4 + (k / 4).max(k % 4)]).collect();
            let _ = diagonalise_in_place(&mut a, &mut [0.0; 16], 4);
        }
    }
}
