//! The small mask as a linear model: the vertices of [`small_model`](crate::small_model), seven components.

use crate::small_model::{N_VERTICES, coefficient, landmarks};
use habitus::io::model::{Coefficients, LinearForm, ModePrior, ModelSource, hab};

const DIM: usize = 7;

/// The bytes of the model file.
///
/// # Panics
/// When the library refuses to write it.
pub fn bytes() -> Vec<u8> {
    let shape = |term: usize| (0..3 * N_VERTICES).map(move |k| f64::from(coefficient(term, k % 3, k / 3)));
    let mean: Vec<f64> = shape(0).collect();
    let components: Vec<f64> = (1..=DIM).flat_map(shape).collect();
    let mut source = ModelSource::new(Coefficients::Linear(LinearForm { mean: &mean, components: &components }));
    source.landmarks = landmarks();
    let unit = (0..DIM * DIM).map(|k| f64::from(u8::from(k % (DIM + 1) == 0))).collect();
    source.identity_prior = ModePrior { mean: vec![0.0; DIM], scale: vec![1.0; DIM], precision: unit };
    source.provenance = "procedural mask, no scan".into();
    hab::bytes(&source).expect("a small model can be written")
}
