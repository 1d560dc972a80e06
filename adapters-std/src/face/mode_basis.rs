//! Eigenvectors of a mode covariance, ordered and signed so that the same data always give the same basis.

use crate::error::Error;
use nalgebra::{DMatrix, SymmetricEigen};

/// Limit of the QR iterations per eigenvalue; two or three are usual.
const ITERATIONS_PER_VALUE: usize = 100;

/// Eigen-decomposition of a mode covariance `C = U diag(L) U^T`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeBasis {
    /// Eigenvectors, one after another, the strongest first; each has its entry of largest magnitude positive.
    pub vectors: Vec<f64>,
    /// Eigenvalues, descending, not negative.
    pub values: Vec<f64>,
}

/// The basis of the symmetric `n x n` matrix `covariance`.
///
/// Errors: an internal fault when the iteration does not converge (finite matrices do).
pub fn mode_basis(covariance: &[f64], n: usize) -> Result<ModeBasis, Error> {
    let matrix = DMatrix::from_column_slice(n, n, covariance);
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, ITERATIONS_PER_VALUE * n)
        .ok_or_else(|| Error::Internal(format!("the eigenvalues of a {n} x {n} mode covariance did not converge")))?;
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let mut vectors = Vec::with_capacity(n * n);
    for &column in &order {
        let vector = eigen.eigenvectors.column(column);
        // The first of entries of equal magnitude decides; magnitudes within rounding count as equal.
        let largest = vector.amax() * (1.0 - 1e-9);
        let sign = vector.iter().find(|x| x.abs() >= largest).map_or(1.0, |x| x.signum());
        vectors.extend(vector.iter().map(|x| sign * x));
    }
    // A covariance has no negative eigenvalue: what is below zero is rounding.
    let values = order.iter().map(|&column| eigen.eigenvalues[column].max(0.0)).collect();
    Ok(ModeBasis { vectors, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn basis_is_ordered_signed_and_reproduces_the_matrix() {
        let n = 6;
        let a = DMatrix::from_fn(9, n, |i, j| ((i * j * 5 + j * j * 3 + i) as f64).sin());
        let c = a.transpose() * &a;
        let basis = mode_basis(c.as_slice(), n).unwrap();
        assert!(basis.values.windows(2).all(|w| w[0] >= w[1]));
        let u = DMatrix::from_column_slice(n, n, &basis.vectors);
        let d = DMatrix::from_diagonal(&nalgebra::DVector::from_column_slice(&basis.values));
        assert!((&u * d * u.transpose() - &c).amax() < 1e-12);
        for vector in basis.vectors.chunks_exact(n) {
            let largest = vector.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
            assert!(largest > 0.0);
        }
    }
}
