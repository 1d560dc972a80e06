//! A multilinear model of some identities and expressions of a training set, given by inner products alone.
//!
//! Its mean and its core are linear combinations of training shapes, so the Gram matrix `K` of the shapes determines the
//! bases of its modes, `G = M^T M` and `b = M^T a`: everything that a projection needs. Leave-one-out measures learn dozens
//! of such models from one `K`.

use crate::dense::{columns, multiply};
use crate::error::Error;
use crate::face::mode_basis::mode_basis;
use crate::face::mode_gram::{centre_in_place, mode_covariances_of_gram};
use crate::face::projection::ProjectionOptions;
use crate::face::reduced::{ReducedGram, ReducedProblem, ReducedSolution};

/// A model with all its weights.
pub(crate) struct SubsetModel {
    /// Number of each of its shapes in the training set, identity fastest.
    shapes: Vec<usize>,
    n_identities: usize,
    n_expressions: usize,
    u2: Vec<f64>,
    u3: Vec<f64>,
    gram: ReducedGram,
    starts: Vec<Vec<f64>>,
}

/// A shape of the training set in terms of the model: `b` and `|a|^2`.
pub(crate) struct Moments {
    moments: Vec<f64>,
    square: f64,
}

impl SubsetModel {
    /// Learns from the given identities and expressions of a set of `d2 x d3` shapes with the Gram matrix `gram` (about any
    /// point).
    pub(crate) fn new(
        gram: &[f64],
        d2: usize,
        d3: usize,
        identities: &[usize],
        expressions: &[usize],
    ) -> Result<Self, Error> {
        let (n2, n3) = (identities.len(), expressions.len());
        let shapes: Vec<usize> = expressions.iter().flat_map(|p| identities.iter().map(move |i| p * d2 + i)).collect();
        let all = d2 * d3;
        let mut inner: Vec<f64> = shapes.iter().flat_map(|k| shapes.iter().map(move |l| gram[k * all + l])).collect();
        centre_in_place(&mut inner, shapes.len());
        let (c2, c3) = mode_covariances_of_gram(&inner, n2, n3);
        let (u2, u3) = (mode_basis(&c2, n2)?.vectors, mode_basis(&c3, n3)?.vectors);
        // Both indices of K pass to the bases: columns, then (K being symmetric) the columns of the transpose.
        let half = transposed_square(&in_bases(&inner, &u2, &u3), shapes.len());
        let core_gram = in_bases(&half, &u2, &u3);
        let rows: Vec<Vec<f64>> = (0..n3).map(|p| u3.iter().skip(p).step_by(n3).copied().collect()).collect();
        let mean = (0..n3).map(|k| rows.iter().map(|row| row[k]).sum::<f64>() / n3 as f64).collect();
        let starts = std::iter::once(mean).chain(rows).collect();
        let gram = ReducedGram::new(&core_gram, n2, n3);
        Ok(SubsetModel { shapes, n_identities: n2, n_expressions: n3, u2, u3, gram, starts })
    }

    /// What projections of the training shapes number `targets` need.
    pub(crate) fn moments(&self, gram: &[f64], targets: &[usize]) -> Vec<Moments> {
        let all = gram.len().isqrt();
        let n = self.shapes.len() as f64;
        let means: Vec<f64> =
            self.shapes.iter().map(|k| self.shapes.iter().map(|l| gram[k * all + l]).sum::<f64>() / n).collect();
        let mean = means.iter().sum::<f64>() / n;
        targets
            .iter()
            .map(|&x| {
                let row = &gram[x * all..][..all];
                let cross = self.shapes.iter().map(|&k| row[k]).sum::<f64>() / n;
                let inner: Vec<f64> =
                    self.shapes.iter().zip(&means).map(|(&k, of_k)| row[k] - of_k - cross + mean).collect();
                Moments { moments: in_bases(&inner, &self.u2, &self.u3), square: row[x] - 2.0 * cross + mean }
            })
            .collect()
    }

    /// The nearest face with the first `d_id` and `d_pose` weights, also from `before`, a solution with fewer.
    pub(crate) fn projection(
        &self,
        target: &Moments,
        d_id: usize,
        d_pose: usize,
        before: Option<&ReducedSolution>,
        options: &ProjectionOptions,
    ) -> ReducedSolution {
        let n2 = self.n_identities;
        let moments: Vec<f64> =
            target.moments.chunks_exact(n2).take(d_pose).flat_map(|column| &column[..d_id]).copied().collect();
        let problem = ReducedProblem { gram: &self.gram, moments: &moments, square: target.square, d_id, d_pose };
        match before {
            None => problem.solution(&self.starts, options),
            Some(before) => {
                let mut w3 = before.expression.clone();
                w3.resize(d_pose, 0.0);
                problem.solution(&[w3, self.starts[0].clone()], options)
            }
        }
    }

    /// The face of a solution as a linear combination of the `n` training shapes.
    pub(crate) fn coefficients(&self, solution: &ReducedSolution, n: usize) -> Vec<f64> {
        let combined = |u: &[f64], d: usize, w: &[f64]| -> Vec<f64> {
            let mut v = vec![0.0; d];
            for (column, w) in u.chunks_exact(d).zip(w) {
                v.iter_mut().zip(column).for_each(|(v, u)| *v += w * u);
            }
            v
        };
        let v2 = combined(&self.u2, self.n_identities, &solution.identity);
        let v3 = combined(&self.u3, self.n_expressions, &solution.expression);
        let weights: Vec<f64> = v3.iter().flat_map(|y| v2.iter().map(move |x| x * y)).collect();
        // mean + sum_k w_k (c_k - mean) = sum_k (w_k + (1 - sum w) / count) c_k
        let share = (1.0 - weights.iter().sum::<f64>()) / self.shapes.len() as f64;
        let mut coefficients = vec![0.0; n];
        for (&k, w) in self.shapes.iter().zip(&weights) {
            coefficients[k] = w + share;
        }
        coefficients
    }
}

/// `sum_ip U2[i, j] U3[p, k] x_ip` for every column `x` (identity fastest) of `data`, all weights of both modes.
fn in_bases(data: &[f64], u2: &[f64], u3: &[f64]) -> Vec<f64> {
    let (n2, n3) = (u2.len().isqrt(), u3.len().isqrt());
    let n = n2 * n3;
    let mut by_identity = vec![0.0; data.len()];
    let others = data.len() / n2;
    multiply(&mut by_identity, 0.0, &crate::dense::transposed(u2, n2, n2, n2), &columns(data, n2, others, n2));
    let mut out = vec![0.0; data.len()];
    for (out, x) in out.chunks_exact_mut(n).zip(by_identity.chunks_exact(n)) {
        multiply(out, 0.0, &columns(x, n2, n3, n2), &columns(u3, n3, n3, n3));
    }
    out
}

fn transposed_square(matrix: &[f64], n: usize) -> Vec<f64> {
    (0..n).flat_map(|row| matrix.iter().skip(row).step_by(n).copied()).collect()
}
