//! Statistics of the training weights of a mode, and the Gaussian prior that they give (ch. 12).
//!
//! The `d` training weights of a mode are the rows of a matrix `U` with orthonormal columns. So their mean is
//! `m = U^T 1 / d` and their covariance is exactly `S = I/d - m m^T`: no sample covariance has to be estimated, and its
//! inverse and square root have closed forms.

/// Below this value of `1 - d |m|^2` the covariance counts as singular along the mean.
const SINGULAR: f64 = 1e-6;
/// Relative ridge `r` of a singular covariance: `S + (r/d) I` is inverted.
const RIDGE: f64 = 1e-6;

/// Mean and covariance of the weights of one mode.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightStatistics {
    /// Number of training weights, `d`.
    pub count: usize,
    /// Their mean `m`.
    pub mean: Vec<f64>,
}

impl WeightStatistics {
    /// Statistics of the rows of `factors`, which holds orthonormal columns of length `count` one after another.
    pub fn of_factors(factors: &[f64], count: usize) -> Self {
        let mean = factors.chunks_exact(count).map(|column| column.iter().sum::<f64>() / count as f64).collect();
        WeightStatistics { count, mean }
    }

    /// Number of weights in the mode.
    pub fn dim(&self) -> usize {
        self.mean.len()
    }

    /// The statistics of the first `dim` weights alone.
    pub fn truncated(&self, dim: usize) -> Self {
        WeightStatistics { count: self.count, mean: self.mean[..dim].to_vec() }
    }

    /// One standard deviation of a weight up to the mean term, `1 / sqrt(d)`.
    pub fn scale(&self) -> f64 {
        1.0 / (self.count as f64).sqrt()
    }

    /// `S`, `dim x dim`, column after column.
    pub fn covariance(&self) -> Vec<f64> {
        self.rank_one(1.0 / self.count as f64, -1.0)
    }

    /// `1 - d |m|^2`: the part of the variance that is left along the mean, 0 when the mode is not truncated.
    pub fn variance_left_along_mean(&self) -> f64 {
        (1.0 - self.count as f64 * self.mean.iter().map(|m| m * m).sum::<f64>()).max(0.0)
    }

    /// The inverse of `S` by Sherman and Morrison, `dim x dim`, column after column; with a ridge where `S` is singular.
    pub fn precision(&self) -> Vec<f64> {
        let d = self.count as f64;
        let left = self.variance_left_along_mean();
        // S + (r/d) I = (a I - d m m^T) / d with a = 1 + r; its inverse is (d/a) (I + d m m^T / (a - d |m|^2)).
        let a = if left < SINGULAR { 1.0 + RIDGE } else { 1.0 };
        self.rank_one(d / a, d / a * d / (a - 1.0 + left))
    }

    /// `(w - m)^T P (w - m)` with `P` the [`precision`](Self::precision): the energy of the Gaussian prior.
    pub fn mahalanobis_squared(&self, weights: &[f64]) -> f64 {
        let d = self.count as f64;
        let left = self.variance_left_along_mean();
        let a = if left < SINGULAR { 1.0 + RIDGE } else { 1.0 };
        let (mut square, mut along) = (0.0, 0.0);
        for (w, m) in weights.iter().zip(&self.mean) {
            square += (w - m) * (w - m);
            along += (w - m) * m;
        }
        d / a * (square + d * along * along / (a - 1.0 + left))
    }

    /// `t = sqrt(d) (w - m)`: weights in standard deviations, for people.
    pub fn standardised(&self, weights: &[f64]) -> Vec<f64> {
        weights.iter().zip(&self.mean).map(|(w, m)| (w - m) / self.scale()).collect()
    }

    /// `w = m + t / sqrt(d)`: the inverse of [`standardised`](Self::standardised).
    pub fn from_standardised(&self, sigma: &[f64]) -> Vec<f64> {
        sigma.iter().zip(&self.mean).map(|(t, m)| m + t * self.scale()).collect()
    }

    /// Weights with mean `m` and covariance `S` from independent standard normal `deviates`.
    pub fn sample(&self, deviates: &[f64]) -> Vec<f64> {
        // S^(1/2) = (I - (1 - sqrt(left)) u u^T) / sqrt(d) with u the direction of the mean.
        let square: f64 = self.mean.iter().map(|m| m * m).sum();
        let along: f64 = deviates.iter().zip(&self.mean).map(|(t, m)| t * m).sum();
        let shrink = if square > 0.0 { (1.0 - self.variance_left_along_mean().sqrt()) * along / square } else { 0.0 };
        let turned: Vec<f64> = deviates.iter().zip(&self.mean).map(|(t, m)| t - shrink * m).collect();
        self.from_standardised(&turned)
    }

    /// `diagonal I + factor m m^T`.
    fn rank_one(&self, diagonal: f64, factor: f64) -> Vec<f64> {
        let n = self.dim();
        let mut matrix = vec![0.0; n * n];
        for column in 0..n {
            for row in 0..n {
                matrix[column * n + row] = factor * (self.mean[row] * self.mean[column]);
            }
            matrix[column * n + column] += diagonal;
        }
        matrix
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn factors(d: usize, dim: usize) -> DMatrix<f64> {
        let q = DMatrix::from_fn(d, d, |i, j| ((i * i * 17 + i * j * 29 + j * j * 5 + 3) as f64).sin() + 0.2).qr().q();
        q.columns(0, dim).into_owned()
    }

    #[test]
    fn closed_forms_equal_the_sample_statistics() {
        for dim in [1, 4, 9] {
            let u = factors(9, dim);
            let stats = WeightStatistics::of_factors(u.as_slice(), 9);
            let mean = DVector::from_fn(dim, |j, _| u.column(j).mean());
            let mut covariance = DMatrix::zeros(dim, dim);
            for row in u.row_iter() {
                let w = row.transpose() - &mean;
                covariance += &w * w.transpose() / 9.0;
            }
            let closed = DMatrix::from_column_slice(dim, dim, &stats.covariance());
            assert!((&closed - &covariance).amax() < 1e-15);
            let precision = DMatrix::from_column_slice(dim, dim, &stats.precision());
            assert_eq!(stats.variance_left_along_mean() < SINGULAR, dim == 9);
            let ridge = if dim == 9 { 1e-6 / 9.0 } else { 0.0 };
            let product = &precision * (closed + DMatrix::identity(dim, dim) * ridge);
            assert!((product - DMatrix::identity(dim, dim)).amax() < 1e-8, "dim {dim}");
        }
    }

    #[test]
    fn energy_is_the_quadratic_form_of_the_precision() {
        let u = factors(9, 5);
        let stats = WeightStatistics::of_factors(u.as_slice(), 9);
        let w = [0.3, -0.1, 0.2, 0.5, -0.4];
        let v = DVector::from_fn(5, |j, _| w[j] - stats.mean[j]);
        let quadratic = (v.transpose() * DMatrix::from_column_slice(5, 5, &stats.precision()) * &v)[0];
        assert!((stats.mahalanobis_squared(&w) - quadratic).abs() < 1e-12 * quadratic);
        let energies: f64 = u.row_iter().map(|r| stats.mahalanobis_squared(r.transpose().as_slice())).sum();
        assert!((energies / 9.0 - 5.0).abs() < 1e-10, "training weights have mean energy dim");
    }

    #[test]
    fn sample_map_is_a_square_root_of_the_covariance() {
        for dim in [5, 9] {
            let stats = WeightStatistics::of_factors(factors(9, dim).as_slice(), 9);
            let mean = DVector::from_column_slice(&stats.mean);
            let root = DMatrix::from_fn(dim, dim, |row, column| {
                let mut e = vec![0.0; dim];
                e[column] = 1.0;
                stats.sample(&e)[row] - mean[row]
            });
            let covariance = DMatrix::from_column_slice(dim, dim, &stats.covariance());
            assert!((&root * root.transpose() - covariance).amax() < 1e-8);
        }
    }

    #[test]
    fn sigma_units_go_both_ways() {
        let stats = WeightStatistics::of_factors(factors(9, 3).as_slice(), 9);
        let sigma = [1.0, -2.0, 0.5];
        let back = stats.standardised(&stats.from_standardised(&sigma));
        assert!(back.iter().zip(&sigma).all(|(a, b)| (a - b).abs() < 1e-14));
        assert_eq!(stats.standardised(&stats.mean), [0.0; 3]);
    }
}
