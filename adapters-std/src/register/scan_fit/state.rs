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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energy_is_the_squared_mahalanobis_distance() {
        let prior = Prior { mean: vec![1.0, -1.0], precision: vec![2.0, 0.5, 0.5, 1.0] };
        // Steps (1, 2): 2 + 2 * 0.5 * 2 + 4.
        assert_eq!(prior.energy(&[2.0, 1.0]), 8.0);
        assert_eq!(prior.gradient(&[2.0, 1.0]), [3.0, 2.5]);
        assert_eq!((prior.energy(&[1.0, -1.0]), prior.gradient(&[1.0, -1.0])), (0.0, vec![0.0; 2]));
    }

    #[test]
    fn the_mean_state_has_the_mean_weights_and_no_motion() {
        let priors = Priors::of(&super::super::samples::model()).expect("priors");
        let state = priors.mean_state();
        assert_eq!((state.identity.len(), state.pose.len(), state.amplitudes.len()), (4, 3, 0));
        assert!(priors.identity.energy(&state.identity) < 1e-9 && priors.pose.energy(&state.pose) < 1e-9);
        assert_eq!(state.placement, Similarity::IDENTITY);
    }
}
