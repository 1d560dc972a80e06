//! Parameters of a shape whose correspondence is known: the weights whose face is nearest in least squares.
//!
//! Minimises `|a - M x2 w2 x3 w3|^2` for `a` the shape less the model's mean. With one set of weights fixed the other is a
//! small linear least-squares problem, so the two are solved in turn. All that is needed of the big core is its Gram
//! matrix (`reduced`, once per model) and one product with `a` (once per shape).

use crate::dense::{columns, multiply, transposed};
use crate::error::Error;
use crate::face::multilinear::MultilinearModel;
use crate::face::reduced::{ReducedGram, ReducedProblem};
use rayon::prelude::*;

/// Shapes that one task projects.
const BLOCK: usize = 8;

/// When to stop, and how many starts to follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProjectionOptions {
    /// Most sweeps (one solve for each set of weights, or one Newton step) from one start.
    pub sweeps: usize,
    /// Relative decrease of the energy in one sweep below which the iteration counts as converged.
    pub tolerance: f64,
    /// Sweeps that every start makes before the starts are compared.
    pub screening_sweeps: usize,
    /// The starts of lowest energy that are followed to the end.
    pub kept_starts: usize,
}

impl Default for ProjectionOptions {
    fn default() -> Self {
        ProjectionOptions { sweeps: 100, tolerance: 1e-7, screening_sweeps: 3, kept_starts: 3 }
    }
}

/// The nearest face found.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    /// Identity weights.
    pub identity: Vec<f64>,
    /// Expression weights, scaled to the root mean square length of the training weights (`w2 -> g w2, w3 -> w3 / g`
    /// changes nothing, so a length has to be chosen).
    pub expression: Vec<f64>,
    /// Sum of squared coordinate differences, mm^2.
    pub energy: f64,
    /// Sweeps made from the winning start.
    pub sweeps: usize,
    /// The winning start: 0 for the mean weights, `p + 1` for the weights of training expression `p`.
    pub start: usize,
    /// Whether the tolerance was reached before the limit of sweeps.
    pub converged: bool,
}

/// A model prepared for projecting shapes.
#[derive(Debug, Clone)]
pub struct Projector<'a> {
    model: &'a MultilinearModel,
    gram: ReducedGram,
    starts: Vec<Vec<f64>>,
}

impl<'a> Projector<'a> {
    /// Prepares a model. Cost: `3 n (d_id d_pose)^2` multiply-adds.
    pub fn new(model: &'a MultilinearModel) -> Self {
        let (d_id, d_pose) = (model.identity.dim, model.expression.dim);
        let gram = crate::dense::gram(&model.core, model.mean.len(), d_id * d_pose);
        let rows = (0..model.expression.count).map(|p| model.expression.row(p));
        let starts = std::iter::once(model.expression.weights.mean.clone()).chain(rows).collect();
        Projector { model, gram: ReducedGram::new(&gram, d_id, d_pose), starts }
    }

    /// Projects shapes (one after another, mm, in the model's frame); parallel, with bits that do not depend on it.
    ///
    /// Errors: a length that is not a whole number of shapes, a coordinate that is not finite.
    pub fn project(&self, shapes: &[f64], options: &ProjectionOptions) -> Result<Vec<Projection>, Error> {
        let len = self.model.mean.len();
        if !shapes.len().is_multiple_of(len) {
            return Err(Error::input(format!(
                "{} coordinates are no whole number of shapes of {} vertices; give shapes in the model's topology",
                shapes.len(),
                len / 3
            )));
        }
        if let Some(at) = shapes.iter().position(|x| !x.is_finite()) {
            return Err(Error::input(format!(
                "shape {} holds {} at vertex {} (counted from 0); fill it in first",
                at / len,
                shapes[at],
                at % len / 3
            )));
        }
        let blocks: Vec<Vec<Projection>> =
            shapes.par_chunks(len * BLOCK).map(|shapes| self.project_block(shapes, options)).collect();
        Ok(blocks.into_iter().flatten().collect())
    }

    fn project_block(&self, shapes: &[f64], options: &ProjectionOptions) -> Vec<Projection> {
        let model = self.model;
        let (len, d_id, d_pose) = (model.mean.len(), model.identity.dim, model.expression.dim);
        let rank = d_id * d_pose;
        let n = shapes.len() / len;
        let mut centred = shapes.to_vec();
        for shape in centred.chunks_exact_mut(len) {
            shape.iter_mut().zip(&model.mean).for_each(|(x, m)| *x -= m);
        }
        let mut moments = vec![0.0; rank * n];
        multiply(&mut moments, 0.0, &transposed(&model.core, len, rank, len), &columns(&centred, len, n, len));
        let problems = centred.chunks_exact(len).zip(moments.chunks_exact(rank));
        problems
            .map(|(shape, moments)| {
                let square = shape.iter().map(|x| x * x).sum();
                let problem = ReducedProblem { gram: &self.gram, moments, square, d_id, d_pose };
                let found = problem.solution(&self.starts, options);
                let (identity, expression) = self.in_gauge(found.identity, found.expression);
                Projection {
                    identity,
                    expression,
                    energy: found.energy,
                    sweeps: found.sweeps,
                    start: found.start,
                    converged: found.converged,
                }
            })
            .collect()
    }

    /// The equivalent weights whose expression part has the training weights' length, with the sign nearer to the means.
    fn in_gauge(&self, mut w2: Vec<f64>, mut w3: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
        let (mode2, mode3) = (&self.model.identity, &self.model.expression);
        let length = w3.iter().map(|x| x * x).sum::<f64>().sqrt();
        // Orthonormal columns: the squared lengths of the rows sum to the number of columns.
        let target = (mode3.dim as f64 / mode3.count as f64).sqrt();
        let towards = |w: &[f64], mean: &[f64]| w.iter().zip(mean).map(|(w, m)| w * m).sum::<f64>();
        let g = target / length;
        let nearness = mode2.count as f64 * towards(&w2, &mode2.weights.mean) / g
            + mode3.count as f64 * towards(&w3, &mode3.weights.mean) * g;
        let g = if nearness < 0.0 { -g } else { g };
        w2.iter_mut().for_each(|w| *w /= g);
        w3.iter_mut().for_each(|w| *w *= g);
        (w2, w3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::hosvd::{HosvdOptions, ModeSize, hosvd};
    use crate::face::tensor::ShapeTensor;

    fn bilinear_tensor() -> ShapeTensor {
        let (d2, d3, n) = (9, 5, 40);
        let wave = |a: usize, b: usize| (((a * a * 37 + a * b * 53 + b * 101 + 11) % 1009) as f64 * 0.77).sin();
        let mut data = Vec::new();
        for p in 0..d3 {
            for i in 0..d2 {
                for c in 0..3 * n {
                    let (x, y) = (wave(i, c % 7), wave(p + 50, c % 5));
                    data.push(60.0 * wave(c, 3) + 4.0 * x * wave(c, 90) + 3.0 * y * wave(c, 91) + x * y * wave(c, 92));
                }
            }
        }
        ShapeTensor::from_shapes(d2, d3, n, data).unwrap()
    }

    fn model(tensor: &ShapeTensor, d_id: usize, d_pose: usize) -> MultilinearModel {
        let options =
            HosvdOptions { identity: ModeSize::Dimension(d_id), expression: ModeSize::Dimension(d_pose), hooi: None };
        hosvd(tensor, &options).unwrap().model
    }

    #[test]
    fn training_shapes_are_found_again() {
        let tensor = bilinear_tensor();
        let model = model(&tensor, 9, 5);
        let found = Projector::new(&model).project(tensor.data(), &ProjectionOptions::default()).unwrap();
        assert_eq!(found.len(), 45);
        for (k, projection) in found.iter().enumerate() {
            let shape = model.shape(&projection.identity, &projection.expression).unwrap();
            let truth = tensor.shape(k % 9, k / 9);
            let worst = shape.iter().zip(truth).fold(0.0f64, |worst, (a, b)| worst.max((a - b).abs()));
            assert!(worst < 1e-4, "shape {k}: {worst} mm, start {}", projection.start);
        }
    }

    #[test]
    fn energy_is_the_squared_distance_and_no_small_change_lowers_it() {
        let tensor = bilinear_tensor();
        let model = model(&tensor, 4, 3);
        let shape: Vec<f64> = tensor.shape(2, 1).iter().enumerate().map(|(c, x)| x + (c as f64).sin()).collect();
        let options = ProjectionOptions { tolerance: 1e-13, sweeps: 1000, ..ProjectionOptions::default() };
        let found = &Projector::new(&model).project(&shape, &options).unwrap()[0];
        assert!(found.converged);
        let energy = |w2: &[f64], w3: &[f64]| -> f64 {
            model.shape(w2, w3).unwrap().iter().zip(&shape).map(|(a, b)| (a - b) * (a - b)).sum()
        };
        let least = energy(&found.identity, &found.expression);
        assert!((least - found.energy).abs() < 1e-9 * least, "{least} {}", found.energy);
        for j in 0..7 {
            for step in [-1e-3, 1e-3] {
                let (mut w2, mut w3) = (found.identity.clone(), found.expression.clone());
                if j < 4 {
                    w2[j] += step;
                } else {
                    w3[j - 4] += step;
                }
                assert!(energy(&w2, &w3) > least, "weight {j}");
            }
        }
    }

    #[test]
    fn expression_weights_have_the_training_length() {
        let tensor = bilinear_tensor();
        let model = model(&tensor, 6, 4);
        let found = Projector::new(&model).project(tensor.shape(3, 2), &ProjectionOptions::default()).unwrap();
        let square: f64 = found[0].expression.iter().map(|x| x * x).sum();
        assert!((square - 4.0 / 5.0).abs() < 1e-12);
    }

    #[test]
    fn bits_do_not_depend_on_the_thread_count() {
        let tensor = bilinear_tensor();
        let model = model(&tensor, 6, 4);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Projector::new(&model).project(tensor.data(), &ProjectionOptions::default()).unwrap())
        };
        let one = run(1);
        assert_eq!(one, run(2));
        assert_eq!(one, run(8));
    }

    #[test]
    fn unfit_shapes_are_sentences() {
        let tensor = bilinear_tensor();
        let model = model(&tensor, 2, 2);
        let projector = Projector::new(&model);
        let said = projector.project(&[0.0; 7], &ProjectionOptions::default()).unwrap_err().to_string();
        assert!(said.contains("7 coordinates"), "{said}");
        let mut shapes = tensor.data()[..240].to_vec();
        shapes[120 + 31] = f64::INFINITY;
        let said = projector.project(&shapes, &ProjectionOptions::default()).unwrap_err().to_string();
        assert!(said.contains("shape 1 holds inf at vertex 10"), "{said}");
    }
}
