//! The curves of a model's quality over its size: generalization and specificity at sizes that show their course.

use serde_json::{Value, json};

use crate::Error;
use crate::face::projection::ProjectionOptions;
use crate::face::tensor::ShapeTensor;
use crate::measure::generalization::{CurvePoint, Generalization, GeneralizationOptions, generalization};
use crate::measure::specificity::{Specificity, SpecificityOptions, specificity};

/// Both curves of a set of training shapes.
#[derive(Debug, Clone, PartialEq)]
pub struct Curves {
    /// How well shapes that were left out are found again.
    pub general: Generalization,
    /// How near random shapes are to real ones.
    pub specific: Specificity,
}

/// Sizes at which curves are measured: all small ones, then steps, and `count` itself.
pub fn curve_sizes(count: usize) -> Vec<usize> {
    let steps = [1, 2, 3, 4, 5, 7, 10, 15, 20, 30, 40, 50, 70, 100];
    let mut sizes: Vec<usize> = steps.into_iter().filter(|&size| size < count).collect();
    sizes.push(count);
    sizes
}

impl Curves {
    /// Measures both, with `samples` random shapes for each point of specificity. The functions are told how much of either is done.
    ///
    /// # Errors
    /// Those of [`generalization`] and [`specificity`].
    pub fn of(
        shapes: &ShapeTensor,
        samples: usize,
        seed: u64,
        generalizing: &mut dyn FnMut(usize, usize),
        drawing: &mut dyn FnMut(usize, usize),
    ) -> Result<Self, Error> {
        let expression_dims = curve_sizes(shapes.n_expressions());
        let options = GeneralizationOptions {
            // One identity is left out, so one weight fewer can be learned.
            identity_dims: curve_sizes(shapes.n_identities().saturating_sub(1)),
            expression_dims: expression_dims.clone(),
            projection: ProjectionOptions::default(),
        };
        let general = generalization(shapes, &options, generalizing)?;
        let identity_dims = curve_sizes(shapes.n_identities());
        let options = SpecificityOptions { identity_dims, expression_dims, samples, seed };
        Ok(Curves { general, specific: specificity(shapes, &options, drawing)? })
    }

    /// Each curve with its name for programs and for people.
    pub fn named(&self) -> [(&'static str, &'static str, &[CurvePoint]); 5] {
        let (general, specific) = (&self.general, &self.specific);
        [
            ("generalization_identity", "generalization by identity weights, one identity left out", &general.identity),
            (
                "generalization_expression",
                "generalization by expression weights, one identity left out",
                &general.expression,
            ),
            (
                "generalization_unseen_expression",
                "generalization by expression weights, one expression left out",
                &general.unseen_expression,
            ),
            ("specificity_identity", "specificity by identity weights", &specific.identity),
            ("specificity_expression", "specificity by expression weights", &specific.expression),
        ]
    }
}

/// A curve for programs.
pub fn described(curve: &[CurvePoint]) -> Value {
    let point = |point: &CurvePoint| json!({ "dim": point.dim, "mean_mm": point.error.mean, "standard_error_mm": point.error.standard_error });
    curve.iter().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_end_with_the_whole_and_do_not_repeat() {
        assert_eq!(curve_sizes(1), [1]);
        assert_eq!(curve_sizes(5), [1, 2, 3, 4, 5]);
        assert_eq!(curve_sizes(8), [1, 2, 3, 4, 5, 7, 8]);
        assert_eq!(curve_sizes(120).last(), Some(&120));
    }
}
