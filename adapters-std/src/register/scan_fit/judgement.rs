//! Whether what was fitted is a shape of the model's kind, or something else that was bent as near as it would go.

use super::correspondences::Agreement;
use crate::Error;

/// Least share of the model's area that must have a partner in the scan.
const LEAST_COVERAGE: f64 = 0.25;
/// Largest median distance of the partners along the normals, mm.
const MOST_MEDIAN: f64 = 1.2;
/// Largest root mean square residual of the landmarks, mm.
const MOST_LANDMARK_RESIDUAL: f64 = 15.0;
/// Largest length of the weights, in what is expected of as many independent standard deviations.
const MOST_WEIGHT: f64 = 2.5;

/// Refuses a fit to something else, with the figure that says so.
///
/// `lengths` are the squared Mahalanobis distance and the number of the weights of each mode.
///
/// # Errors
/// [`Error::Input`].
pub(super) fn refuse_other_kinds(
    agreement: &Agreement,
    landmarks: f64,
    lengths: [(&str, f64, usize); 2],
) -> Result<(), Error> {
    let kind = "is it a scan of the model's kind, with landmarks of its own?";
    if !(agreement.coverage >= LEAST_COVERAGE) {
        return Err(Error::input(format!(
            "only {:.0} % of the fitted model lies on the scan, at least {:.0} % must; {kind}",
            100.0 * agreement.coverage,
            100.0 * LEAST_COVERAGE
        )));
    }
    if !(agreement.median <= MOST_MEDIAN) {
        return Err(Error::input(format!(
            "half of the fitted model is more than {:.2} mm from the scan, at most {MOST_MEDIAN} are accepted; {kind}",
            agreement.median
        )));
    }
    if !(landmarks <= MOST_LANDMARK_RESIDUAL) {
        return Err(Error::input(format!(
            "the landmarks are {landmarks:.1} mm (root mean square) from those of the fitted model, at most {MOST_LANDMARK_RESIDUAL} are accepted; {kind}"
        )));
    }
    for (name, energy, dim) in lengths {
        let length = (energy / dim.max(1) as f64).sqrt();
        if !(length <= MOST_WEIGHT) {
            return Err(Error::input(format!(
                "the scan asks for {name} weights {length:.1} times as large as those of the training data, at most {MOST_WEIGHT} are accepted; {kind}"
            )));
        }
    }
    Ok(())
}
