//! Generalization: how well the model explains faces that it has not learned from.
//!
//! Each identity (or expression) is left out in turn, a model is learned from the others, and the shapes left out are
//! projected on it with their correspondence known. The error is the mean vertex distance. Lower is better.
//!
//! Nothing here but the last step sees coordinates: a model learned from a subset is a set of linear combinations of its
//! shapes, so its mode covariances, the Gram matrix of its core, and the products with the shapes left out all follow from
//! the inner products of the training shapes, computed once.

use crate::error::Error;
use crate::face::mode_gram::centred_gram;
use crate::face::projection::ProjectionOptions;
use crate::face::reduced::ReducedSolution;
use crate::face::subset_model::SubsetModel;
use crate::face::tensor::ShapeTensor;
use crate::measure::vertex_error::{MeanError, mean_lengths_of_combinations};
use rayon::prelude::*;

/// Fewest expressions for which leaving one out makes sense.
const EXPRESSIONS_TO_LEAVE_ONE_OUT: usize = 5;
/// Left-out items between two calls of the progress function.
const BATCH: usize = 4;

/// Which sizes to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneralizationOptions {
    /// Numbers of identity weights (with all expression weights); those above the number of identities learned are left out.
    pub identity_dims: Vec<usize>,
    /// Numbers of expression weights (with all identity weights), likewise.
    pub expression_dims: Vec<usize>,
    /// How to project.
    pub projection: ProjectionOptions,
}

/// Error at one size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Number of weights of the mode.
    pub dim: usize,
    /// Mean vertex distance over all shapes, mm.
    pub error: MeanError,
}

/// The curves; an empty one could not be measured with these training data.
#[derive(Debug, Clone, PartialEq)]
pub struct Generalization {
    /// One identity left out, over the size of the identity mode.
    pub identity: Vec<CurvePoint>,
    /// One identity left out, over the size of the expression mode.
    pub expression: Vec<CurvePoint>,
    /// One expression left out, over the size of the expression mode; measured from five expressions on.
    pub unseen_expression: Vec<CurvePoint>,
}

/// Leave-one-out curves. `progress` is told how many of how many models are done, on the calling thread.
///
/// Starts of each projection: the mean weights and those of every training expression at the smallest size, then also the
/// solution of the size before, so that the energy cannot grow with the size.
///
/// Errors: fewer than two identities.
pub fn generalization(
    tensor: &ShapeTensor,
    options: &GeneralizationOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Generalization, Error> {
    let (d2, d3) = (tensor.n_identities(), tensor.n_expressions());
    if d2 < 2 || tensor.n_shapes() < 3 {
        return Err(Error::input(format!(
            "generalization leaves one identity out, but the training data hold {d2}; give at least two, and three shapes"
        )));
    }
    let identity_dims = usable(&options.identity_dims, d2 - 1);
    let expression_dims = usable(&options.expression_dims, d3);
    let unseen_dims =
        if d3 >= EXPRESSIONS_TO_LEAVE_ONE_OUT { usable(&options.expression_dims, d3 - 1) } else { Vec::new() };

    let gram = centred_gram(tensor);
    let mut jobs: Vec<LeftOut> = (0..d2).map(LeftOut::Identity).collect();
    if !unseen_dims.is_empty() {
        jobs.extend((0..d3).map(LeftOut::Expression));
    }
    let mut results = Vec::with_capacity(jobs.len());
    progress(0, jobs.len());
    for batch in jobs.chunks(BATCH) {
        let done: Vec<Result<Vec<Vec<f64>>, Error>> = batch
            .par_iter()
            .map(|&job| {
                let sizes: Vec<(usize, usize)> = match job {
                    LeftOut::Identity(_) => {
                        let along_identity = identity_dims.iter().map(|&dim| (dim, d3));
                        along_identity.chain(expression_dims.iter().map(|&dim| (d2 - 1, dim))).collect()
                    }
                    LeftOut::Expression(_) => unseen_dims.iter().map(|&dim| (d2, dim)).collect(),
                };
                errors_left_out(tensor, &gram, job, &sizes, &options.projection)
            })
            .collect();
        for errors in done {
            results.push(errors?);
        }
        progress(results.len(), jobs.len());
    }
    let (identities, expressions) = results.split_at(d2);
    Ok(Generalization {
        identity: curve(identities, &identity_dims, 0),
        expression: curve(identities, &expression_dims, identity_dims.len()),
        unseen_expression: curve(expressions, &unseen_dims, 0),
    })
}

#[derive(Debug, Clone, Copy)]
enum LeftOut {
    Identity(usize),
    Expression(usize),
}

/// Errors in mm of the shapes of `job` projected on the model of all others, for each of `sizes`.
fn errors_left_out(
    tensor: &ShapeTensor,
    gram: &[f64],
    job: LeftOut,
    sizes: &[(usize, usize)],
    options: &ProjectionOptions,
) -> Result<Vec<Vec<f64>>, Error> {
    let (d2, d3, n) = (tensor.n_identities(), tensor.n_expressions(), tensor.n_shapes());
    let (mut identities, mut expressions): (Vec<usize>, Vec<usize>) = ((0..d2).collect(), (0..d3).collect());
    let left_out: Vec<usize> = match job {
        LeftOut::Identity(i) => {
            identities.remove(i);
            (0..d3).map(|p| p * d2 + i).collect()
        }
        LeftOut::Expression(p) => {
            expressions.remove(p);
            (0..d2).map(|i| p * d2 + i).collect()
        }
    };
    let model = SubsetModel::new(gram, d2, d3, &identities, &expressions)?;
    let problems = model.moments(gram, &left_out);
    let mut warm: Vec<Option<ReducedSolution>> = vec![None; left_out.len()];
    let mut coefficients = Vec::with_capacity(n * left_out.len() * sizes.len());
    for (at, &(d_id, d_pose)) in sizes.iter().enumerate() {
        // A curve over another mode begins anew.
        let continues = at > 0 && sizes[at - 1].0 <= d_id && sizes[at - 1].1 <= d_pose;
        for (x, &shape) in left_out.iter().enumerate() {
            let before = warm[x].take().filter(|_| continues);
            let found = model.projection(&problems[x], d_id, d_pose, before.as_ref(), options);
            let mut column = model.coefficients(&found, n);
            column[shape] -= 1.0;
            coefficients.extend(column);
            warm[x] = Some(found);
        }
    }
    let errors = mean_lengths_of_combinations(tensor.data(), tensor.shape_len(), &coefficients);
    Ok(errors.chunks_exact(left_out.len()).map(<[f64]>::to_vec).collect())
}

/// The distinct sizes from 1 to `largest`, ascending.
fn usable(dims: &[usize], largest: usize) -> Vec<usize> {
    let mut dims: Vec<usize> = dims.iter().copied().filter(|dim| (1..=largest).contains(dim)).collect();
    dims.sort_unstable();
    dims.dedup();
    dims
}

/// Summary of `results[left out][first + size]` over everything left out.
fn curve(results: &[Vec<Vec<f64>>], dims: &[usize], first: usize) -> Vec<CurvePoint> {
    let at_size =
        |size: usize| -> Vec<f64> { results.iter().flat_map(|result| result[first + size].clone()).collect() };
    let points = dims.iter().enumerate();
    points.filter_map(|(size, &dim)| MeanError::of(&at_size(size)).map(|error| CurvePoint { dim, error })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::hosvd::{HosvdOptions, ModeSize, hosvd};
    use crate::face::projection::Projector;
    use crate::measure::vertex_error::mean_vertex_distance;

    fn tensor(d2: usize, d3: usize, n: usize) -> ShapeTensor {
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

    fn options(identity: &[usize], expression: &[usize]) -> GeneralizationOptions {
        let projection = ProjectionOptions { tolerance: 1e-11, sweeps: 500, ..ProjectionOptions::default() };
        GeneralizationOptions { identity_dims: identity.to_vec(), expression_dims: expression.to_vec(), projection }
    }

    #[test]
    fn shortcut_through_inner_products_equals_models_that_are_learned_anew() {
        let (d2, d3, n) = (7, 5, 25);
        let tensor = tensor(d2, d3, n);
        let found = generalization(&tensor, &options(&[4], &[]), &mut |_, _| {}).unwrap();
        let mut errors = Vec::new();
        for left in 0..d2 {
            let data: Vec<f64> = (0..d3)
                .flat_map(|p| (0..d2).filter(move |&i| i != left).map(move |i| (i, p)))
                .flat_map(|(i, p)| tensor.shape(i, p).to_vec())
                .collect();
            let others = ShapeTensor::from_shapes(d2 - 1, d3, n, data).unwrap();
            let sizes =
                HosvdOptions { identity: ModeSize::Dimension(4), expression: ModeSize::Dimension(d3), hooi: None };
            let model = hosvd(&others, &sizes).unwrap().model;
            let projector = Projector::new(&model);
            for p in 0..d3 {
                let shape = tensor.shape(left, p);
                let weights = &projector.project(shape, &options(&[], &[]).projection).unwrap()[0];
                let nearest = model.shape(&weights.identity, &weights.expression).unwrap();
                errors.push(mean_vertex_distance(&nearest, shape));
            }
        }
        let truth = MeanError::of(&errors).unwrap();
        let point = found.identity[0];
        assert_eq!((point.dim, point.error.count), (4, d2 * d3));
        assert!((point.error.mean - truth.mean).abs() < 1e-4 * truth.mean, "{point:?} {truth:?}");
        assert!((point.error.standard_error - truth.standard_error).abs() < 1e-3 * truth.mean);
    }

    #[test]
    fn curves_do_not_rise_and_progress_is_told() {
        let mut told = Vec::new();
        let all = [1, 2, 3, 4, 5, 6, 7, 8];
        let found =
            generalization(&tensor(7, 5, 25), &options(&all, &all), &mut |done, total| told.push((done, total)))
                .unwrap();
        assert_eq!(told.first(), Some(&(0, 12)));
        assert_eq!(told.last(), Some(&(12, 12)));
        let dims = |curve: &[CurvePoint]| curve.iter().map(|point| point.dim).collect::<Vec<_>>();
        assert_eq!(dims(&found.identity), [1, 2, 3, 4, 5, 6]);
        assert_eq!(dims(&found.expression), [1, 2, 3, 4, 5]);
        assert_eq!(dims(&found.unseen_expression), [1, 2, 3, 4]);
        for curve in [&found.identity, &found.expression, &found.unseen_expression] {
            assert!(curve.windows(2).all(|w| w[1].error.mean <= w[0].error.mean * 1.005), "{curve:?}");
        }
    }

    #[test]
    fn bits_do_not_depend_on_the_thread_count() {
        let tensor = tensor(7, 5, 300);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| generalization(&tensor, &options(&[2, 5], &[3]), &mut |_, _| {}).unwrap())
        };
        let one = run(1);
        assert_eq!(one, run(2));
        assert_eq!(one, run(8));
    }

    #[test]
    fn one_identity_is_a_sentence_and_few_expressions_leave_a_curve_out() {
        let said = generalization(&tensor(1, 5, 9), &options(&[1], &[1]), &mut |_, _| {}).unwrap_err().to_string();
        assert!(said.contains("leaves one identity out, but the training data hold 1"), "{said}");
        let found = generalization(&tensor(4, 1, 9), &options(&[1, 2], &[1]), &mut |_, _| {}).unwrap();
        assert!(found.unseen_expression.is_empty() && found.expression.len() == 1 && found.identity.len() == 2);
    }
}
