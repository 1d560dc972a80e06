//! Gaussian and box priors.

/// Gaussian of a mode over the training data.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Gaussian {
    pub mean: Vec<f32>,
    pub scale: Vec<f32>,
    pub precision: Vec<Vec<f32>>,
}

/// What is known of the weights.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
pub enum Prior<'a> {
    None,
    Gaussian(&'a Gaussian, f32),
    Box(&'a Gaussian, f32),
}

impl Prior<'_> {
    /// Lower and upper bounds.
    pub fn bounds(&self, dim: usize) -> (Vec<f32>, Vec<f32>) {
        match self {
            Prior::Box(gaussian, factor) => {
                let width = |k: usize| gaussian.scale[k] * factor;
                let lower = (0..dim).map(|k| gaussian.mean[k] - width(k)).collect();
                (lower, (0..dim).map(|k| gaussian.mean[k] + width(k)).collect())
            }
            _ => (vec![f32::NEG_INFINITY; dim], vec![f32::INFINITY; dim]),
        }
    }

    /// Adds matrix and gradient to the equations from variable `first` on; returns the energy.
    pub fn add_to(&self, weights: &[f32], jtj: &mut [Vec<f32>], jtr: &mut [f32], first: usize) -> f32 {
        let Prior::Gaussian(Gaussian { mean, precision, .. }, factor) = self else { return 0.0 };
        let mut energy = 0.0;
        for i in 0..weights.len() {
            let mut image = 0.0;
            for j in 0..weights.len() {
                image += (factor * precision[i][j]) * (weights[j] - mean[j]);
                jtj[first + i][first + j] += factor * precision[i][j];
            }
            jtr[first + i] += image;
            energy += image * (weights[i] - mean[i]);
        }
        energy
    }
}
