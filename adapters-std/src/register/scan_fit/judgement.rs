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

#[cfg(test)]
mod tests {
    use super::*;

    fn said(coverage: f64, median: f64, landmarks: f64, energies: [f64; 2]) -> String {
        let lengths = [("identity", energies[0], 16), ("expression", energies[1], 4)];
        match refuse_other_kinds(&Agreement { coverage, median }, landmarks, lengths) {
            Ok(()) => String::new(),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn what_is_no_face_is_refused_with_the_figure() {
        assert_eq!(said(0.25, 1.2, 15.0, [100.0, 25.0]), "");
        for (sentence, part) in [
            (said(0.24, 0.5, 3.0, [9.0, 9.0]), "only 24 % of the fitted model lies on the scan, at least 25 %"),
            (said(0.9, 1.21, 3.0, [9.0, 9.0]), "more than 1.21 mm from the scan, at most 1.2"),
            (said(0.9, 0.5, 15.1, [9.0, 9.0]), "the landmarks are 15.1 mm (root mean square)"),
            (said(0.9, 0.5, 3.0, [144.0, 9.0]), "identity weights 3.0 times as large"),
            (said(0.9, 0.5, 3.0, [9.0, 64.0]), "expression weights 4.0 times as large"),
        ] {
            assert!(sentence.contains(part) && sentence.contains("is it a scan of the model's kind"), "{sentence}");
        }
    }

    #[test]
    fn figures_that_are_no_numbers_are_refused() {
        for nan in 0..4 {
            let at = |k: usize, x: f64| if k == nan { f64::NAN } else { x };
            assert!(said(at(0, 0.9), at(1, 0.5), at(2, 3.0), [at(3, 9.0), 9.0]).contains("scan"), "{nan}");
        }
        assert!(!said(0.9, f64::INFINITY, 3.0, [9.0, 9.0]).is_empty());
    }
}
