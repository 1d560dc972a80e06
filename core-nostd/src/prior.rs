//! Priors on the weights of a mode (Wuhrer, definition 6 and ch. 8, 9, 12): a Gaussian or a box.

use crate::Error;
use crate::format::{Floats, Gaussian, Spread};
use crate::linalg::{at, set};
use crate::workspace::check_len;

/// What is known of a mode's weights before the data are seen.
#[derive(Debug, Clone, Copy)]
pub enum Prior<'a> {
    /// Nothing: the data must determine every weight.
    None,
    /// Gaussian of the training data; its energy `(w - m)^T P (w - m)` is added, times the factor.
    Gaussian(Gaussian<'a>, f32),
    /// Uniform within so many standard deviations of the mean, each weight alone (box prior). Means of more weights are left over: those of a wavelet
    /// model's finer levels.
    Box(Spread<'a>, f32),
    /// Uniform between a lower and an upper bound of each weight: the limits of a body's angles (ch. 9), see
    /// [`Model::pose_bounds`](crate::format::Model::pose_bounds).
    Bounds(Floats<'a>, Floats<'a>),
}

impl Prior<'_> {
    /// `Ok` when it fits `dim` weights and its factor is a number above zero, or no lower bound exceeds the upper one.
    ///
    /// Errors: `DimensionMismatch`, `BadOption` (1).
    pub fn check(&self, dim: usize) -> Result<(), Error> {
        match self {
            Prior::None => Ok(()),
            Prior::Bounds(lower, upper) => {
                check_len(dim, lower.len())?;
                check_len(dim, upper.len())?;
                // Also false for NaN.
                let ordered = lower.iter().zip(upper.iter()).all(|(lower, upper)| lower <= upper);
                if ordered { Ok(()) } else { Err(Error::BadOption { option: 1 }) }
            }
            Prior::Gaussian(gaussian, factor) => {
                check_len(dim, gaussian.mean.len())?;
                check_len(dim, gaussian.scale.len())?;
                check_len(dim.saturating_mul(dim), gaussian.precision.len())?;
                check_factor(*factor)
            }
            Prior::Box(Spread { mean, scale }, factor) => {
                check_len(dim, dim.min(mean.len()))?;
                check_len(dim, dim.min(scale.len()))?;
                check_factor(*factor)
            }
        }
    }

    /// Writes the bounds of each weight, `mean -+ scale * factor` or those that are given; infinite where there are none.
    ///
    /// Shapes: `lower` and `upper` have one entry for each weight, in the weights' units; those behind the shorter of them are untouched.
    /// Errors: none; [`Prior::check`] refuses priors of another size before. Panics: never.
    pub fn write_bounds(&self, lower: &mut [f32], upper: &mut [f32]) {
        for (index, (lower, upper)) in lower.iter_mut().zip(upper).enumerate() {
            (*lower, *upper) = match self {
                Prior::Box(spread, factor) => {
                    let mean = spread.mean.get(index).unwrap_or(0.0);
                    let width = spread.scale.get(index).unwrap_or(0.0) * *factor;
                    (mean - width, mean + width)
                }
                Prior::Bounds(low, high) => {
                    (low.get(index).unwrap_or(f32::NEG_INFINITY), high.get(index).unwrap_or(f32::INFINITY))
                }
                Prior::None | Prior::Gaussian(..) => (f32::NEG_INFINITY, f32::INFINITY),
            };
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
                let entry =
                    factor * gaussian.precision.get(i.saturating_mul(weights.len()).saturating_add(j)).unwrap_or(0.0);
                image += entry * (other - gaussian.mean.get(j).unwrap_or(0.0));
                let at_ij = first.saturating_add(i).saturating_mul(stride).saturating_add(first).saturating_add(j);
                let sum = at(jtj, at_ij) + entry;
                set(jtj, at_ij, sum);
            }
            let at_i = first.saturating_add(i);
            let sum = at(jtr, at_i) + image;
            set(jtr, at_i, sum);
            energy += image * (weight - gaussian.mean.get(i).unwrap_or(0.0));
        }
        energy
    }
}

fn check_factor(factor: f32) -> Result<(), Error> {
    if factor > 0.0 && factor.is_finite() { Ok(()) } else { Err(Error::BadOption { option: 1 }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::bytes_of;

    #[test]
    fn bounds_are_those_that_are_given_and_add_no_energy() {
        let [lower, upper] = [bytes_of(&[-1.0, 0.0]), bytes_of(&[2.0, 0.0])];
        let prior = Prior::Bounds(Floats::new(&lower), Floats::new(&upper));
        assert_eq!(prior.check(2), Ok(()));
        let (mut low, mut high) = ([7.0; 2], [7.0; 2]);
        prior.write_bounds(&mut low, &mut high);
        assert_eq!((low, high), ([-1.0, 0.0], [2.0, 0.0]));
        let (mut jtj, mut jtr) = ([1.0; 4], [1.0; 2]);
        assert_eq!(prior.add_to(&[5.0, 5.0], &mut jtj, &mut jtr, 2, 0), 0.0);
        assert_eq!((jtj, jtr), ([1.0; 4], [1.0; 2]));
    }

    #[test]
    fn a_box_takes_a_prefix_of_the_means_and_refuses_fewer() {
        let [mean, scale] = [bytes_of(&[1.0, -2.0, 9.0]), bytes_of(&[0.5, 1.0, 9.0])];
        let prior = Prior::Box(Spread { mean: Floats::new(&mean), scale: Floats::new(&scale) }, 2.0);
        assert_eq!((prior.check(3), prior.check(2)), (Ok(()), Ok(())));
        assert_eq!(prior.check(4), Err(Error::DimensionMismatch { expected: 4, found: 3 }));
        let (mut low, mut high) = ([7.0; 2], [7.0; 2]);
        prior.write_bounds(&mut low, &mut high);
        assert_eq!((low, high), ([0.0, -4.0], [2.0, 0.0]));
        let short = Spread { mean: Floats::new(&mean), scale: Floats::new(&scale).part(0, 1).unwrap() };
        assert_eq!(Prior::Box(short, 2.0).check(2), Err(Error::DimensionMismatch { expected: 2, found: 1 }));
    }

    #[test]
    fn bounds_of_another_number_or_order_are_refused() {
        let [lower, upper, nan] = [bytes_of(&[-1.0, 0.0]), bytes_of(&[2.0, 0.0]), bytes_of(&[f32::NAN, 0.0])];
        let [lower, upper, nan] = [&lower, &upper, &nan].map(|bytes| Floats::new(bytes));
        let mismatch = |expected, found| Err(Error::DimensionMismatch { expected, found });
        assert_eq!(Prior::Bounds(lower, upper).check(3), mismatch(3, 2));
        assert_eq!(Prior::Bounds(lower, upper.part(0, 1).unwrap()).check(2), mismatch(2, 1));
        assert_eq!(Prior::Bounds(upper, lower).check(2), Err(Error::BadOption { option: 1 }));
        assert_eq!(Prior::Bounds(nan, upper).check(2), Err(Error::BadOption { option: 1 }));
        assert_eq!(Prior::Bounds(lower, lower).check(2), Ok(()));
    }
}
