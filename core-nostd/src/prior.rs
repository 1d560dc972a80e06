//! Priors on the weights of a mode (Wuhrer, definition 6 and ch. 8, 12): a Gaussian or a box.

use crate::Error;
use crate::format::Gaussian;
use crate::linalg::{at, set};
use crate::workspace::check_len;

/// What is known of a mode's weights before the data are seen.
#[derive(Debug, Clone, Copy)]
pub enum Prior<'a> {
    /// Nothing: the data must determine every weight.
    None,
    /// Gaussian of the training data; its energy `(w - m)^T P (w - m)` is added, times the factor.
    Gaussian(Gaussian<'a>, f32),
    /// Uniform within so many standard deviations of the mean, each weight alone (box prior).
    Box(Gaussian<'a>, f32),
}

impl Prior<'_> {
    /// `Ok` when it fits `dim` weights and its factor is a number above zero.
    ///
    /// Errors: `DimensionMismatch`, `BadOption` (1).
    pub fn check(&self, dim: usize) -> Result<(), Error> {
        match self {
            Prior::None => Ok(()),
            Prior::Gaussian(gaussian, factor) | Prior::Box(gaussian, factor) => {
                check_len(dim, gaussian.mean.len())?;
                check_len(dim, gaussian.scale.len())?;
                check_len(dim.saturating_mul(dim), gaussian.precision.len())?;
                if *factor > 0.0 && factor.is_finite() { Ok(()) } else { Err(Error::BadOption { option: 1 }) }
            }
        }
    }

    /// Writes the bounds of each weight, `mean -+ scale * factor`; infinite where there are none.
    pub fn write_bounds(&self, lower: &mut [f32], upper: &mut [f32]) {
        for (index, (lower, upper)) in lower.iter_mut().zip(upper).enumerate() {
            (*lower, *upper) = (f32::NEG_INFINITY, f32::INFINITY);
            if let Prior::Box(gaussian, factor) = self {
                let mean = gaussian.mean.get(index).unwrap_or(0.0);
                let width = gaussian.scale.get(index).unwrap_or(0.0) * *factor;
                (*lower, *upper) = (mean - width, mean + width);
            }
        }
    }

    /// Adds the energy's derivatives to the normal equations (`stride x stride`, from entry `first` of the variables on) and returns the energy.
    ///
    /// Order of operations: an entry is the factor times that of the precision; row i's image sums `entry_ij (w_j - m_j)` from zero for j ascending and is
    /// added to the gradient; the energy sums `image_i (w_i - m_i)` from zero for i ascending.
    pub fn add_to(&self, weights: &[f32], jtj: &mut [f32], jtr: &mut [f32], stride: usize, first: usize) -> f32 {
        let Prior::Gaussian(gaussian, factor) = self else { return 0.0 };
        let mut energy = 0.0;
        for (i, &weight) in weights.iter().enumerate() {
            let mut image = 0.0;
            for (j, &other) in weights.iter().enumerate() {
                let entry = factor * gaussian.precision.get(i * weights.len() + j).unwrap_or(0.0);
                image += entry * (other - gaussian.mean.get(j).unwrap_or(0.0));
                let at_ij = (first + i) * stride + first + j;
                let sum = at(jtj, at_ij) + entry;
                set(jtj, at_ij, sum);
            }
            let sum = at(jtr, first + i) + image;
            set(jtr, first + i, sum);
            energy += image * (weight - gaussian.mean.get(i).unwrap_or(0.0));
        }
        energy
    }
}
