//! Whether what was fitted is a shape of the model's kind, or something else that was bent as near as it would go.

use super::correspondences::Agreement;
use super::start::rms;
use crate::Error;

/// Least share of the model's area that must have a partner in the scan.
const LEAST_COVERAGE: f64 = 0.25;
/// Largest median distance of the partners along the normals, mm.
const MOST_MEDIAN: f64 = 1.2;
/// Largest root mean square residual of the landmarks, mm.
const MOST_LANDMARK_RESIDUAL: f64 = 15.0;
/// Largest robust mean residual of the landmarks where the surfaces agree wholly, mm; where half of the model is `SHARED_MEDIAN` from the scan, none is
/// accepted, and between the two the limit falls linearly. Smooth eggs with landmarks picked on their fronts have surfaces near those of a face, or
/// landmarks near them, and not both (docs/fit.md).
const MOST_ROBUST_RESIDUAL: f64 = 9.6;
/// See [`MOST_ROBUST_RESIDUAL`], mm.
const SHARED_MEDIAN: f64 = 1.7;
/// A residual beyond this counts as this in the robust mean, mm: single landmarks that were marked wrongly do not decide.
const FARTHEST_COUNTED: f64 = 15.0;
/// Largest length of the weights, in what is expected of as many independent standard deviations.
const MOST_WEIGHT: f64 = 2.5;

/// Mean of the residuals of the landmarks, those beyond 15 mm counted as 15; 0 without any.
pub(super) fn robust_mean(residuals: &[f64]) -> f64 {
    residuals.iter().map(|&residual| residual.min(FARTHEST_COUNTED)).sum::<f64>() / residuals.len().max(1) as f64
}

/// Refuses a fit to something else, with the figure that says so.
///
/// `residuals` are those of the landmarks, mm; `lengths` are the squared Mahalanobis distance and the number of the weights of each mode.
///
/// # Errors
/// [`Error::Input`].
pub(super) fn refuse_other_kinds(
    agreement: &Agreement,
    residuals: &[f64],
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
    let landmarks = rms(residuals);
    if !(landmarks <= MOST_LANDMARK_RESIDUAL) {
        return Err(Error::input(format!(
            "the landmarks are {landmarks:.1} mm (root mean square) from those of the fitted model, at most {MOST_LANDMARK_RESIDUAL} are accepted; {kind}"
        )));
    }
    let (mean, limit) = (robust_mean(residuals), MOST_ROBUST_RESIDUAL * (1.0 - agreement.median / SHARED_MEDIAN));
    if !(mean <= limit) {
        return Err(Error::input(format!(
            "the landmarks are {mean:.2} mm (mean) from those of the fitted model, of which half is within {:.2} mm of the scan; at most {limit:.2} are \
             accepted with that, about 2 is usual; {kind}",
            agreement.median
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
        match refuse_other_kinds(&Agreement { coverage, median }, &[landmarks; 13], lengths) {
            Ok(()) => String::new(),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn what_is_no_face_is_refused_with_the_figure() {
        assert_eq!(said(0.25, 1.2, 2.8, [100.0, 25.0]), "");
        for (sentence, part) in [
            (said(0.24, 0.5, 3.0, [9.0, 9.0]), "only 24 % of the fitted model lies on the scan, at least 25 %"),
            (said(0.9, 1.21, 3.0, [9.0, 9.0]), "more than 1.21 mm from the scan, at most 1.2"),
            (said(0.9, 0.5, 15.1, [9.0, 9.0]), "the landmarks are 15.1 mm (root mean square)"),
            (
                said(0.9, 0.85, 4.9, [9.0, 9.0]),
                "the landmarks are 4.90 mm (mean) from those of the fitted model, of which half is within 0.85 mm of the scan; at most 4.80 are",
            ),
            (said(0.9, 0.5, 3.0, [144.0, 9.0]), "identity weights 3.0 times as large"),
            (said(0.9, 0.5, 3.0, [9.0, 64.0]), "expression weights 4.0 times as large"),
        ] {
            assert!(sentence.contains(part) && sentence.contains("is it a scan of the model's kind"), "{sentence}");
        }
    }

    /// Figures of faces (two models, landmarks as given and disturbed by 5 mm) and of eggs (docs/fit.md).
    #[test]
    fn eggs_are_told_from_faces_with_disturbed_landmarks() {
        let refused = |median, landmarks| !said(0.8, median, landmarks, [9.0, 9.0]).is_empty();
        assert!(
            [(0.43, 2.1), (0.66, 2.3), (0.42, 5.5), (0.65, 5.4)].iter().all(|&(median, mark)| !refused(median, mark))
        );
        assert!(
            [(0.85, 5.3), (0.74, 6.0), (0.57, 10.0), (1.11, 5.2)].iter().all(|&(median, mark)| refused(median, mark))
        );
        // Two landmarks of thirteen that were marked wrongly do not make an egg of a face.
        let mut residuals = [2.0; 13];
        residuals[..2].fill(30.0);
        assert!((robust_mean(&residuals) - 4.0).abs() < 1e-9);
        assert_eq!(robust_mean(&[]), 0.0);
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
