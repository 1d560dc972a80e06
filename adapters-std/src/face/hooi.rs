//! Higher-order orthogonal iteration: refines truncated factors so that the model explains more of the training set.
//!
//! In turn, the factors of one mode become the leading eigenvectors of its covariance after projection onto the other
//! mode's factors. The residual never increases. The HOSVD is usually close enough (ch. 12), so this is optional.

use crate::error::Error;
use crate::face::mode_basis::mode_basis;
use crate::face::mode_gram::centred_gram;
use crate::face::tensor::ShapeTensor;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HooiOptions {
    /// Most sweeps over both modes.
    pub sweeps: usize,
    /// Relative growth of the explained energy below which a sweep is the last.
    pub tolerance: f64,
}

impl Default for HooiOptions {
    fn default() -> Self {
        HooiOptions { sweeps: 10, tolerance: 1e-10 }
    }
}

/// Refines `u2` (`d2 x d_id`) and `u3` (`d3 x d_pose`), column after column; sizes stay.
///
/// Needs the Gram matrix of all shapes: `3 n N^2` multiply-adds and `N^2` numbers.
pub fn refined_factors(
    tensor: &ShapeTensor,
    mut u2: Vec<f64>,
    mut u3: Vec<f64>,
    options: &HooiOptions,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let (d2, d3) = (tensor.n_identities(), tensor.n_expressions());
    let gram = centred_gram(tensor);
    let mut explained = 0.0;
    for _ in 0..options.sweeps {
        let basis2 = mode_basis(&projected_covariance(&gram, &u3, d2, d3, 1, d2), d2)?;
        u2 = basis2.vectors[..u2.len()].to_vec();
        let basis3 = mode_basis(&projected_covariance(&gram, &u2, d3, d2, d2, 1), d3)?;
        u3 = basis3.vectors[..u3.len()].to_vec();
        let now: f64 = basis3.values[..u3.len() / d3].iter().sum();
        if now - explained <= options.tolerance * now {
            break;
        }
        explained = now;
    }
    Ok((u2, u3))
}

/// `C[a, a'] = sum_bb' (U U^T)[b, b'] K[(a, b), (a', b')]`: the covariance of one mode (`d` items) after projection of the
/// other (`other` items) onto `factors`; the shape of `(a, b)` is number `a stride + b other_stride`.
fn projected_covariance(
    gram: &[f64],
    factors: &[f64],
    d: usize,
    other: usize,
    stride: usize,
    other_stride: usize,
) -> Vec<f64> {
    let n = d * other;
    let mut projector = vec![0.0; other * other];
    for column in factors.chunks_exact(other) {
        for b in 0..other {
            for c in 0..other {
                projector[b * other + c] += column[b] * column[c];
            }
        }
    }
    let mut covariance = vec![0.0; d * d];
    for a in 0..d {
        for a2 in 0..=a {
            let mut sum = 0.0;
            for b in 0..other {
                let row = &gram[(a * stride + b * other_stride) * n..][..n];
                for c in 0..other {
                    sum += projector[b * other + c] * row[a2 * stride + c * other_stride];
                }
            }
            covariance[a * d + a2] = sum;
            covariance[a2 * d + a] = sum;
        }
    }
    covariance
}
