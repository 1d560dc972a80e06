//! Learns a multilinear model by higher-order singular value decomposition (ch. 12), through small Gram matrices.
//!
//! The mode covariances ([`mode_gram`](crate::face::mode_gram)) are diagonalised, each basis is cut to its strongest
//! vectors, and the core is the centred tensor contracted with both: `m_jk = sum_ip U2[i, j] U3[p, k] a_ip`.
//! The big tensor is never unfolded nor copied.

use crate::dense::{columns, multiply};
use crate::error::Error;
use crate::face::hooi::{HooiOptions, refined_factors};
use crate::face::mode_basis::{ModeBasis, mode_basis};
use crate::face::mode_gram::{centred_block, mode_covariances};
use crate::face::multilinear::{Mode, MultilinearModel};
use crate::face::tensor::ShapeTensor;
use crate::face::weight_statistics::WeightStatistics;
use crate::register::gpa::mean_of_shapes;
use rayon::prelude::*;

/// Coordinates that one task contracts.
const BLOCK: usize = 128;
/// Tasks whose results wait to be written to the core: bounds the memory beside it.
const BATCH: usize = 32;

/// How many weights of a mode are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ModeSize {
    /// This many.
    Dimension(usize),
    /// The fewest that hold this share of the mode's eigenvalue sum, but at most `cap`.
    Energy {
        /// Share, above 0 and at most 1.
        share: f64,
        /// Largest number.
        cap: usize,
    },
}

/// What to learn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HosvdOptions {
    /// Size of the identity mode.
    pub identity: ModeSize,
    /// Size of the expression mode.
    pub expression: ModeSize,
    /// Refinement of the truncated factors by HOOI, off by default.
    pub hooi: Option<HooiOptions>,
}

impl Default for HosvdOptions {
    fn default() -> Self {
        HosvdOptions {
            identity: ModeSize::Energy { share: 0.98, cap: 100 },
            expression: ModeSize::Energy { share: 0.98, cap: 10 },
            hooi: None,
        }
    }
}

/// Something about the training data that limits the model; its `Display` is a sentence for the user.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TrainingWarning {
    /// All shapes are of one identity.
    OneIdentity,
    /// All shapes are of one expression.
    OneExpression,
}

impl std::fmt::Display for TrainingWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            TrainingWarning::OneIdentity => {
                "the training data hold one identity, so the model can change expressions only; \
                 add shapes of further people to learn an identity mode"
            }
            TrainingWarning::OneExpression => {
                "the training data hold one expression, so the model can change identities only; \
                 add further expressions of the same people to learn an expression mode"
            }
        })
    }
}

/// A learned model and what its user should know.
#[derive(Debug, Clone, PartialEq)]
pub struct Trained {
    /// The model.
    pub model: MultilinearModel,
    /// What limits it.
    pub warnings: Vec<TrainingWarning>,
}

/// Learns a model from shapes that are aligned already.
///
/// Cost: `3 n N (d2 + d3 + d_id) + 3 n d_id d3 d_pose` multiply-adds; memory beside the tensor: the core and a few MB.
///
/// Errors: a dimension of 0 or above the number of identities (expressions), an energy share outside `(0, 1]`, shapes
/// that are all equal.
pub fn hosvd(tensor: &ShapeTensor, options: &HosvdOptions) -> Result<Trained, Error> {
    let mean = mean_of_shapes(tensor.data(), tensor.shape_len());
    let (c2, c3) = mode_covariances(tensor, &mean);
    let (d2, d3) = (tensor.n_identities(), tensor.n_expressions());
    let (basis2, basis3) = (mode_basis(&c2, d2)?, mode_basis(&c3, d3)?);
    let square: f64 = mean.iter().map(|x| x * x).sum();
    if basis2.values.iter().sum::<f64>() <= 1e-24 * square {
        return Err(Error::input(format!(
            "all {} training shapes are equal, so there is no variation to learn; give different shapes",
            tensor.n_shapes()
        )));
    }
    let d_id = kept(options.identity, &basis2, "identity", "identities")?;
    let d_pose = kept(options.expression, &basis3, "expression", "expressions")?;
    let (mut u2, mut u3) = (basis2.vectors[..d2 * d_id].to_vec(), basis3.vectors[..d3 * d_pose].to_vec());
    if let Some(hooi) = &options.hooi {
        (u2, u3) = refined_factors(tensor, u2, u3, hooi)?;
    }
    let core = core(tensor, &mean, &u2, &u3);
    let mode = |count, factors: Vec<f64>, eigenvalues| {
        let weights = WeightStatistics::of_factors(&factors, count);
        Mode { count, dim: weights.dim(), factors, eigenvalues, weights }
    };
    let model =
        MultilinearModel { mean, core, identity: mode(d2, u2, basis2.values), expression: mode(d3, u3, basis3.values) };
    let mut warnings = Vec::new();
    if d2 == 1 {
        warnings.push(TrainingWarning::OneIdentity);
    }
    if d3 == 1 {
        warnings.push(TrainingWarning::OneExpression);
    }
    Ok(Trained { model, warnings })
}

/// The number of weights that `size` keeps of a mode.
fn kept(size: ModeSize, basis: &ModeBasis, mode: &str, items: &str) -> Result<usize, Error> {
    let count = basis.values.len();
    match size {
        ModeSize::Dimension(0) => {
            Err(Error::input(format!("the {mode} mode needs at least 1 weight, 0 were asked for")))
        }
        ModeSize::Dimension(dim) if dim > count => Err(Error::input(format!(
            "{dim} {mode} weights were asked for, but the training data hold {count} {items}; ask for at most {count}"
        ))),
        ModeSize::Dimension(dim) => Ok(dim),
        ModeSize::Energy { share, cap } if share > 0.0 && share <= 1.0 && cap > 0 => {
            let total: f64 = basis.values.iter().sum();
            let mut sum = 0.0;
            let reached = basis.values.iter().position(|value| {
                sum += value;
                sum >= share * total
            });
            Ok(reached.map_or(count, |last| last + 1).min(cap))
        }
        ModeSize::Energy { share, cap } => Err(Error::input(format!(
            "an energy share of {share} with at most {cap} weights was asked for in the {mode} mode; the share must lie \
             above 0 and at most at 1, and the cap must be at least 1"
        ))),
    }
}

/// The core tensor in the layout of [`MultilinearModel::core`].
fn core(tensor: &ShapeTensor, mean: &[f64], u2: &[f64], u3: &[f64]) -> Vec<f64> {
    let (d2, d3, len) = (tensor.n_identities(), tensor.n_expressions(), tensor.shape_len());
    let (d_id, d_pose) = (u2.len() / d2, u3.len() / d3);
    let mut core = vec![0.0; len * d_id * d_pose];
    let starts: Vec<usize> = (0..len).step_by(BLOCK).collect();
    for batch in starts.chunks(BATCH) {
        let blocks: Vec<Vec<f64>> = batch
            .par_iter()
            .map(|&start| {
                let width = BLOCK.min(len - start);
                let centred = centred_block(tensor, mean, start, width);
                let mut by_identity = vec![0.0; width * d_id * d3];
                for (out, shapes) in by_identity.chunks_exact_mut(width * d_id).zip(centred.chunks_exact(width * d2)) {
                    multiply(out, 0.0, &columns(shapes, width, d2, width), &columns(u2, d2, d_id, d2));
                }
                let mut block = vec![0.0; width * d_id * d_pose];
                let rows = width * d_id;
                multiply(&mut block, 0.0, &columns(&by_identity, rows, d3, rows), &columns(u3, d3, d_pose, d3));
                block
            })
            .collect();
        core.par_chunks_exact_mut(len).enumerate().for_each(|(column, out)| {
            for (&start, block) in batch.iter().zip(&blocks) {
                let width = BLOCK.min(len - start);
                out[start..start + width].copy_from_slice(&block[column * width..][..width]);
            }
        });
    }
    core
}

#[cfg(test)]
#[path = "hosvd_tests.rs"]
mod tests;
