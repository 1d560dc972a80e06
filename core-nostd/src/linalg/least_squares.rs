//! Linear least squares by QR factorisation, also of matrices whose columns depend on each other.
//!
//! Source: Golub and Van Loan, Matrix Computations, 4th edition 2013, sections 5.3 and 5.5.

use super::qr::{back_substituted_in_place, factor_in_place, norm, transpose_applied_in_place};
use super::{at, set};
use crate::workspace::{Requirement, Workspace, check_len, part, part_mut, saturated};
use crate::{Error, Real};

/// What [`least_squares_in_place`] found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution<R> {
    /// Columns that are independent to the tolerance; the others have the coefficient zero.
    pub rank: u32,
    /// Length of `A x - b`.
    pub residual: R,
}

/// Scratch of [`least_squares_in_place`].
pub const fn least_squares_req(n_columns: usize) -> Requirement {
    Requirement::of(n_columns)
}

/// Writes the `x` that minimises `|A x - b|` for a matrix of full rank; with pivoting also a minimiser for any other: the dependent columns, those
/// whose diagonal of `R` is at most `tolerance` times the first one, get the coefficient zero (a basic solution, not the shortest).
///
/// `a` and `b` end as [`factor_in_place`] and [`transpose_applied_in_place`] leave them. A usual tolerance is `n_rows eps`; zero takes every column whose
/// diagonal is not zero for independent.
///
/// | argument | shape | note |
/// |---|---|---|
/// | `a` | `b.len() x x.len()` | overwritten |
/// | `b` | right-hand side | overwritten |
/// | `x` | unknowns | result |
/// | `order` | `x.len()` or empty | with an empty one there is no pivoting, and a dependent column is an error |
/// | `workspace` | [`least_squares_req`] | |
///
/// The residual is the norm of `Q^T b` from entry `rank` on, as the norm of a column. Accuracy: the error of x is that of a matrix changed by
/// `8 n eps |A|` (test `solves_like_another_library`).
/// Errors: `DimensionMismatch`, `WorkspaceTooSmall`, `BadOption` (0) for a tolerance that is negative or no number, `NotFinite` (an entry of `a`; or of `b`, counted
/// behind those of `a`), all before anything is written; `RankDeficient` with the first dependent column, without pivoting, with `x` untouched; `NotFinite` with the
/// column of an unknown that exceeds the largest number. Panics: never.
pub fn least_squares_in_place<R: Real>(
    a: &mut [R],
    b: &mut [R],
    x: &mut [R],
    order: &mut [u32],
    tolerance: R,
    workspace: &mut [R],
) -> Result<Solution<R>, Error> {
    let n = x.len();
    least_squares_req(n).check(workspace.len())?;
    if !(tolerance >= R::ZERO && tolerance.is_finite()) {
        return Err(Error::BadOption { option: 0 });
    }
    check_len(b.len().saturating_mul(n), a.len())?;
    if let Some(index) = a.iter().chain(b.iter()).position(|entry| !entry.is_finite()) {
        return Err(Error::NotFinite { index: saturated(index) });
    }
    let tau = Workspace::new(workspace).take(n)?;
    factor_in_place(a, b.len(), n, tau, order)?;
    transpose_applied_in_place(a, tau, b)?;
    let diagonal = |k: usize| at(a, k * n + k).abs();
    let smallest = tolerance * (0..n).fold(R::ZERO, |largest, k| diagonal(k).max(largest));
    let rank = (0..n).take_while(|&k| diagonal(k) > smallest).count();
    if rank < n && order.is_empty() {
        return Err(Error::RankDeficient { index: saturated(rank) });
    }
    // What is left of b is kept apart from the solution.
    let solved = part_mut(tau, 0, rank)?;
    for (to, &from) in solved.iter_mut().zip(b.iter()) {
        *to = from;
    }
    back_substituted_in_place(part(a, 0, rank * n)?, n, solved)?;
    let column = |k: usize| order.get(k).map_or(k, |&column| column as usize);
    if let Some(k) = solved.iter().position(|value| !value.is_finite()) {
        return Err(Error::NotFinite { index: saturated(column(k)) });
    }
    x.fill(R::ZERO);
    for (k, &value) in solved.iter().enumerate() {
        set(x, column(k), value);
    }
    let residual = norm(part(b, rank, b.len() - rank)?, 1, 0);
    Ok(Solution { rank: saturated(rank), residual })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::qr::tests::tall;
    use crate::testing::cases;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    #[test]
    fn line_through_points() {
        // y = 1 + 2 t, and one point off the line by (1, -2, 1) / 6: the residual is orthogonal to both columns.
        let (mut a, mut b) = ([1.0f64, 0.0, 1.0, 1.0, 1.0, 2.0], [2.0, 1.0, 6.0]);
        let mut x = [0.0; 2];
        let found = least_squares_in_place(&mut a, &mut b, &mut x, &mut [0; 2], 1e-14, &mut [0.0; 2]).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-14 && (x[1] - 2.0).abs() < 1e-14);
        assert!(found.rank == 2 && (found.residual - 6f64.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn dependent_columns() {
        // The third column is the sum of the others.
        let a = [1.0f64, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, -1.0, 1.0];
        let b = [1.0, 2.0, 3.0, 0.0];
        let mut x = [7.0; 3];
        let run = |order: &mut [u32], x: &mut [f64]| {
            least_squares_in_place(&mut a.clone(), &mut b.clone(), x, order, 1e-14, &mut [0.0; 3])
        };
        assert_eq!(run(&mut [], &mut x), Err(Error::RankDeficient { index: 2 }));
        assert_eq!(x, [7.0; 3]);
        let found = run(&mut [0; 3], &mut x).unwrap();
        assert_eq!((found.rank, x.iter().filter(|&&x| x == 0.0).count()), (2, 1));
        assert!(found.residual < 1e-14);
        let mut zero = [0.0f32; 4];
        let found = least_squares_in_place(&mut zero, &mut [3.0, 4.0], &mut [1.0; 2], &mut [0; 2], 0.0, &mut [0.0; 2]);
        assert_eq!(found, Ok(Solution { rank: 0, residual: 5.0 }));
        let found = least_squares_in_place(&mut [], &mut [3.0f32], &mut [], &mut [], 0.0, &mut []);
        assert_eq!(found, Ok(Solution { rank: 0, residual: 3.0 }));
    }

    #[test]
    fn refusals() {
        let mismatch = |expected, found| Error::DimensionMismatch { expected, found };
        let run = |b: &[f64], tolerance, workspace: usize| {
            let (mut a, mut b, mut x) = ([1.0, 2.0, 3.0, 5.0], b.to_vec(), [7.0; 2]);
            let found = least_squares_in_place(&mut a, &mut b, &mut x, &mut [], tolerance, &mut vec![0.0; workspace]);
            assert!(found.is_ok() || (a == [1.0, 2.0, 3.0, 5.0] && x == [7.0; 2]));
            found.map(|found| found.rank)
        };
        assert_eq!(run(&[1.0, 2.0], 0.0, 2), Ok(2));
        assert_eq!(run(&[1.0, 2.0], 0.0, 1), Err(Error::WorkspaceTooSmall { needed: 2, given: 1 }));
        assert_eq!(run(&[1.0, 2.0], -1.0, 2), Err(Error::BadOption { option: 0 }));
        assert_eq!(run(&[1.0, 2.0], f64::NAN, 2), Err(Error::BadOption { option: 0 }));
        assert_eq!(run(&[1.0, f64::INFINITY], 0.0, 2), Err(Error::NotFinite { index: 5 }));
        assert_eq!(run(&[1.0], 0.0, 2), Err(mismatch(2, 4)));
        let mut x = [0.0f32];
        let far = least_squares_in_place(&mut [1e-30], &mut [1e30], &mut x, &mut [], 0.0, &mut [0.0]);
        assert_eq!((far, x), (Err(Error::NotFinite { index: 0 }), [0.0]));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(cases()))]

        #[test]
        fn solves_like_another_library((m, n, entries, _) in tall(), pivoted in any::<bool>()) {
            let (a, b) = (&entries[..m * n], &entries[8 * 13..8 * 13 + m]);
            let matrix = DMatrix::from_row_slice(m, n, a);
            let singular = matrix.singular_values();
            let condition = singular[0] / singular[n - 1];
            if !(condition < 1e6) {
                return Ok(());
            }
            let qr = matrix.clone().qr();
            let other = qr.r().solve_upper_triangular(&(qr.q().transpose() * DVector::from_row_slice(b))).unwrap();
            let (mut x, mut order) = (vec![0.0; n], vec![0; if pivoted { n } else { 0 }]);
            let found = least_squares_in_place(&mut a.to_vec(), &mut b.to_vec(), &mut x, &mut order, 1e-12, &mut vec![0.0; n]).unwrap();
            let off = (&matrix * &other - DVector::from_row_slice(b)).norm();
            prop_assert!(found.rank as usize == n && (found.residual - off).abs() < 1e-13 * (1.0 + other.norm()));
            let distance = (DVector::from_vec(x) - &other).norm();
            // Perturbation bound of least squares: condition times the solution, its square times the residual.
            let bound = condition * (other.norm() + condition * off / singular[0]);
            prop_assert!(distance <= 100.0 * f64::EPSILON * (bound + 1.0), "{distance:e} {bound:e}");
        }

        /// A product of thin matrices has the rank of their inner size, and no other x fits better.
        #[test]
        fn rank_is_found((m, n, entries, power) in tall(), rank in 1usize..4) {
            let (rank, scale) = (rank.min(n), 10f64.powi(power));
            let left = DMatrix::from_fn(m, rank, |i, k| entries[i * 8 + k]);
            let right = DMatrix::from_fn(rank, n, |k, j| entries[103 - (k * 8 + j)]);
            let product = &left * &right;
            let singular = product.singular_values();
            if !(singular[rank - 1] > 1e-4) {
                return Ok(());
            }
            let mut a: std::vec::Vec<f64> = product.transpose().iter().map(|x| x * scale).collect();
            let b = &entries[104..104 + m];
            let mut x = vec![0.0; n];
            let found = least_squares_in_place(&mut a, &mut b.to_vec(), &mut x, &mut vec![0; n], 1e-11, &mut vec![0.0; n]).unwrap();
            prop_assert_eq!(found.rank as usize, rank);
            // The residual is orthogonal to every column: no other x is better.
            let left_over = (&product * scale) * DVector::from_vec(x) - DVector::from_row_slice(b);
            prop_assert!((found.residual - left_over.norm()).abs() < 1e-10);
            prop_assert!((product.transpose() * left_over).norm() < 1e-10);
        }

        #[test]
        fn never_panics(a in proptest::collection::vec(any::<f32>(), 12), b in proptest::collection::vec(any::<f32>(), 4)) {
            let _ = least_squares_in_place(&mut a.clone(), &mut b.clone(), &mut [0.0; 3], &mut [0; 3], 1e-6, &mut [0.0; 3]);
        }
    }
}
