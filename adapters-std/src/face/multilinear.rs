//! The multilinear face model (eq. 12.1): `c(w2, w3) = mean + M x2 w2 x3 w3`.
//!
//! A face is the mean plus a core tensor contracted with identity weights `w2` and expression weights `w3`:
//! `c[l] = mean[l] + sum_jk core[l, j, k] w2[j] w3[k]`.

use crate::dense::product;
use crate::error::Error;
use crate::face::weight_statistics::WeightStatistics;

/// One mode of the model: how the training set varies in identity, or in expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// Number of training identities (or expressions), `d`.
    pub count: usize,
    /// Number of weights that are kept, at most `d`.
    pub dim: usize,
    /// Factor matrix `U` (`d x dim`, orthonormal columns, column after column); row `i` is the weight of training `i`.
    pub factors: Vec<f64>,
    /// All `d` eigenvalues of the mode covariance, descending, mm^2 summed over the vertices.
    pub eigenvalues: Vec<f64>,
    /// Mean and covariance of the training weights.
    pub weights: WeightStatistics,
}

impl Mode {
    /// Weights of training identity (or expression) `index`.
    ///
    /// # Panics
    /// When `index` is not below `count`.
    pub fn row(&self, index: usize) -> Vec<f64> {
        assert!(index < self.count);
        self.factors.iter().skip(index).step_by(self.count).copied().collect()
    }

    /// Share of the mode's eigenvalue sum that the kept weights hold, 0 to 1.
    pub fn energy_kept(&self) -> f64 {
        let total: f64 = self.eigenvalues.iter().sum();
        if total > 0.0 { self.eigenvalues[..self.dim].iter().sum::<f64>() / total } else { 1.0 }
    }
}

/// A multilinear model with an identity and an expression mode.
#[derive(Debug, Clone, PartialEq)]
pub struct MultilinearModel {
    /// Mean of all training shapes, `3 n_vertices`, mm, xyz after xyz.
    pub mean: Vec<f64>,
    /// Core tensor, mm: the block of `3 n_vertices` coordinates of identity weight `j` and expression weight `k` starts
    /// at `(k identity.dim + j) 3 n_vertices` (identity fastest, as the training shapes).
    pub core: Vec<f64>,
    /// The identity mode (mode 2).
    pub identity: Mode,
    /// The expression mode (mode 3).
    pub expression: Mode,
}

impl MultilinearModel {
    /// Number of vertices.
    pub fn n_vertices(&self) -> usize {
        self.mean.len() / 3
    }

    /// The block of the core of identity weight `j` and expression weight `k`, `3 n_vertices`, mm.
    pub fn core_block(&self, j: usize, k: usize) -> &[f64] {
        let len = self.mean.len();
        &self.core[(k * self.identity.dim + j) * len..][..len]
    }

    /// Weights of a training shape.
    pub fn training_weights(&self, identity: usize, expression: usize) -> (Vec<f64>, Vec<f64>) {
        (self.identity.row(identity), self.expression.row(expression))
    }

    /// The shape of identity weights `w2` and expression weights `w3`, mm.
    ///
    /// Errors: weights of another length than the mode's.
    pub fn shape(&self, w2: &[f64], w3: &[f64]) -> Result<Vec<f64>, Error> {
        self.check_lengths(w2, w3)?;
        let mut shape = self.mean.clone();
        let blocks = self.core.chunks_exact(self.mean.len());
        let weights = w3.iter().flat_map(|&y| w2.iter().map(move |&x| x * y));
        for (block, weight) in blocks.zip(weights) {
            shape.iter_mut().zip(block).for_each(|(c, m)| *c += weight * m);
        }
        Ok(shape)
    }

    /// The shapes of many pairs of weights, one after another, mm; parallel, with bits that do not depend on it.
    pub fn shapes<W: AsRef<[f64]>>(&self, weights: &[(W, W)]) -> Result<Vec<f64>, Error> {
        let rank = self.identity.dim * self.expression.dim;
        let mut coefficients = Vec::with_capacity(rank * weights.len());
        for (w2, w3) in weights {
            let (w2, w3) = (w2.as_ref(), w3.as_ref());
            self.check_lengths(w2, w3)?;
            coefficients.extend(w3.iter().flat_map(|&y| w2.iter().map(move |&x| x * y)));
        }
        let mut shapes = product(&self.core, self.mean.len(), rank, &coefficients);
        for shape in shapes.chunks_exact_mut(self.mean.len()) {
            shape.iter_mut().zip(&self.mean).for_each(|(c, m)| *c += m);
        }
        Ok(shapes)
    }

    /// The model's version of every training shape, in storage order (identity fastest), mm.
    pub fn training_shapes(&self) -> Result<Vec<f64>, Error> {
        let pairs: Vec<_> = (0..self.expression.count)
            .flat_map(|p| (0..self.identity.count).map(move |i| self.training_weights(i, p)))
            .collect();
        self.shapes(&pairs)
    }

    /// Weights drawn from the two Gaussian priors, from standard normal deviates (`identity.dim` and `expression.dim`).
    pub fn sampled_weights(&self, identity: &[f64], expression: &[f64]) -> Result<(Vec<f64>, Vec<f64>), Error> {
        self.check_lengths(identity, expression)?;
        Ok((self.identity.weights.sample(identity), self.expression.weights.sample(expression)))
    }

    fn check_lengths(&self, w2: &[f64], w3: &[f64]) -> Result<(), Error> {
        if w2.len() != self.identity.dim || w3.len() != self.expression.dim {
            return Err(Error::input(format!(
                "{} identity and {} expression weights were given; this model takes {} and {}",
                w2.len(),
                w3.len(),
                self.identity.dim,
                self.expression.dim
            )));
        }
        Ok(())
    }
}
