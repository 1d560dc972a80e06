//! The unknowns of a fit, and their Gaussian priors in double precision.

use habitus_core::format::{Gaussian, Mode, Model};
use habitus_core::rotation::similarity::Similarity;

use crate::Error;

/// Weights and placement (model to centred scan, mm).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct State {
    pub identity: Vec<f32>,
    pub pose: Vec<f32>,
    /// Amplitudes of the displacement, mm; none while there is no displacement.
    pub amplitudes: Vec<f32>,
    pub placement: Similarity<f32>,
}

/// Gaussian priors of all weights, identity first (Wuhrer ch. 12; covariance of the training weights).
pub(super) struct Priors {
    pub identity: Prior,
    pub pose: Prior,
}

/// Mean and precision of one group of weights.
pub(super) struct Prior {
    pub mean: Vec<f64>,
    /// `d x d`.
    pub precision: Vec<f64>,
}

impl Priors {
    /// Those of the model.
    pub(super) fn of(model: &Model<'_>) -> Result<Self, Error> {
        let of_mode = |mode| {
            model.gaussian(mode).map(|gaussian| Prior::of(&gaussian)).ok_or_else(|| {
                Error::input(
                    "the model does not say how its weights are distributed, so it cannot be fitted to a scan; train it with this program",
                )
            })
        };
        Ok(Priors { identity: of_mode(Mode::Identity)?, pose: of_mode(Mode::Pose)? })
    }

    /// The mean weights.
    pub(super) fn mean_state(&self) -> State {
        let single = |values: &[f64]| values.iter().map(|&value| value as f32).collect();
        State {
            identity: single(&self.identity.mean),
            pose: single(&self.pose.mean),
            amplitudes: Vec::new(),
            placement: Similarity::IDENTITY,
        }
    }
}

impl Prior {
    fn of(gaussian: &Gaussian<'_>) -> Self {
        Prior {
            mean: gaussian.mean.iter().map(f64::from).collect(),
            precision: gaussian.precision.iter().map(f64::from).collect(),
        }
    }

    /// Squared Mahalanobis distance of weights.
    pub(super) fn energy(&self, weights: &[f32]) -> f64 {
        self.gradient(weights).iter().zip(weights).zip(&self.mean).map(|((g, &w), m)| g * (f64::from(w) - m)).sum()
    }

    /// `P (w - m)`.
    pub(super) fn gradient(&self, weights: &[f32]) -> Vec<f64> {
        let offsets: Vec<f64> =
            weights.iter().zip(&self.mean).map(|(&weight, mean)| f64::from(weight) - mean).collect();
        let rows = self.precision.chunks_exact(self.mean.len().max(1));
        rows.map(|row| row.iter().zip(&offsets).map(|(p, offset)| p * offset).sum()).collect()
    }
}
