//! What a multilinear model misses of faces it was not learned from: the principal components of its residuals in cross-validation.
//!
//! The training identities are dealt to groups; each group's faces are projected on the model of all others (as for generalization, Davies
//! et al. 2008, 9.2), and what remains is a sample of what the model will miss of the next face: the truncated weights, and the shapes that no
//! training face has. Its covariance is kept as principal components, so that a fit to a scan can tell what no weights express from what they
//! do ([`crate::register::scan_fit`]).

use rayon::prelude::*;

use crate::dense::{columns, multiply, product, transposed};
use crate::error::Error;
use crate::face::mode_basis::mode_basis;
use crate::face::mode_gram::centred_gram;
use crate::face::projection::ProjectionOptions;
use crate::face::subset_model::SubsetModel;
use crate::face::tensor::ShapeTensor;

/// Components that a model file holds unless it is asked for others: 98 % of the variance for faces.
pub const N_COMPONENTS: usize = 80;

/// Groups of identities at most.
const GROUPS: usize = 12;
/// Shapes at most that take part; of more, identities are left out evenly.
const MOST_SHAPES: usize = 3000;
/// Residuals at most whose components are sought; of more, residuals are left out evenly.
const MOST_RESIDUALS: usize = 800;
/// A component with a smaller share of the variance is rounding.
const ROUNDING: f64 = 1e-9;

/// Principal components of the residuals of unseen faces.
#[derive(Debug, Clone, PartialEq)]
pub struct Remainder {
    /// Components, one after another, the strongest first: displacements of all vertices (xyz) by one standard deviation, mm.
    pub components: Vec<f64>,
    /// Root mean square residual of a vertex, mm.
    pub rms: f64,
    /// The same of what the components do not hold, mm.
    pub rms_left: f64,
}

/// The `n_components` strongest components for a model of `tensor` with `d_id` and `d_pose` weights; fewer where the data have fewer, none of one
/// identity.
pub fn remainder(tensor: &ShapeTensor, [d_id, d_pose]: [usize; 2], n_components: usize) -> Result<Remainder, Error> {
    let (all, d3) = (tensor.n_identities(), tensor.n_expressions());
    let step = all.div_ceil((MOST_SHAPES / d3).max(2));
    if step > 1 {
        let identities: Vec<usize> = (0..all).step_by(step).collect();
        let shapes = (0..d3).flat_map(|p| identities.iter().flat_map(move |&i| tensor.shape(i, p).iter().copied()));
        let fewer = ShapeTensor::from_shapes(identities.len(), d3, tensor.n_vertices(), shapes.collect())?;
        return remainder(&fewer, [d_id, d_pose], n_components);
    }
    if all < 2 || tensor.n_shapes() < 3 || n_components == 0 {
        return Ok(Remainder { components: Vec::new(), rms: 0.0, rms_left: 0.0 });
    }
    let gram = centred_gram(tensor);
    let n_groups = GROUPS.min(all);
    let groups: Vec<Result<Vec<f64>, Error>> = (0..n_groups)
        .into_par_iter()
        .map(|group| residuals(&gram, [all, d3], [d_id, d_pose], [group, n_groups]))
        .collect();
    let mut combinations = Vec::new();
    for group in groups {
        combinations.extend(group?);
    }
    components(tensor, &gram, &combinations, n_components)
}

/// The residuals of the identities `group`, `group + n_groups`, ..., as combinations of all shapes.
fn residuals(
    gram: &[f64],
    [d2, d3]: [usize; 2],
    [d_id, d_pose]: [usize; 2],
    [group, n_groups]: [usize; 2],
) -> Result<Vec<f64>, Error> {
    let (left_out, others): (Vec<usize>, Vec<usize>) = (0..d2).partition(|identity| identity % n_groups == group);
    let expressions: Vec<usize> = (0..d3).collect();
    let model = SubsetModel::new(gram, d2, d3, &others, &expressions)?;
    let (d_id, d_pose) = (d_id.min(others.len()), d_pose.min(d3));
    let shapes: Vec<usize> = expressions.iter().flat_map(|p| left_out.iter().map(move |i| p * d2 + i)).collect();
    let mut combinations = Vec::with_capacity(d2 * d3 * shapes.len());
    for (moments, &shape) in model.moments(gram, &shapes).iter().zip(&shapes) {
        let nearest = model.projection(moments, d_id, d_pose, None, &ProjectionOptions::default());
        let start = combinations.len();
        combinations.extend(model.coefficients(&nearest, d2 * d3).iter().map(|x| -x));
        combinations[start + shape] += 1.0;
    }
    Ok(combinations)
}

/// The principal components of residuals that are combinations of the shapes of `tensor`.
fn components(
    tensor: &ShapeTensor,
    gram: &[f64],
    combinations: &[f64],
    n_components: usize,
) -> Result<Remainder, Error> {
    let n = tensor.n_shapes();
    let step = (combinations.len() / n).div_ceil(MOST_RESIDUALS);
    let sample: Vec<f64> = combinations.chunks_exact(n).step_by(step).flatten().copied().collect();
    let count = sample.len() / n;
    let mut inner = vec![0.0; count * count];
    let with_gram = product(gram, n, n, &sample);
    multiply(&mut inner, 0.0, &transposed(&sample, n, count, n), &columns(&with_gram, n, count, n));
    inner.iter_mut().for_each(|x| *x /= count as f64);
    let basis = mode_basis(&inner, count)?;
    let total: f64 = basis.values.iter().sum();
    let kept = basis.values.iter().take(n_components).take_while(|value| **value > ROUNDING * total).count();
    // With the residuals as the columns of E, component k is E v_k / sqrt(count), of length sqrt(value_k).
    let mut of_shapes = product(&sample, n, count, &basis.vectors[..kept * count]);
    of_shapes.iter_mut().for_each(|x| *x /= (count as f64).sqrt());
    let components = product(tensor.data(), tensor.shape_len(), n, &of_shapes);
    let rms = |sum: f64| (sum.max(0.0) / tensor.n_vertices() as f64).sqrt();
    let held: f64 = basis.values[..kept].iter().sum();
    // A total that is rounding of the shapes themselves is none.
    let shapes: f64 = gram.iter().step_by(n + 1).sum::<f64>() / n as f64;
    if total <= ROUNDING * shapes {
        return Ok(Remainder { components: Vec::new(), rms: 0.0, rms_left: 0.0 });
    }
    Ok(Remainder { components, rms: rms(total), rms_left: rms(total - held) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::hosvd::{HosvdOptions, ModeSize, hosvd};
    use crate::face::projection::Projector;

    /// Shapes with `rank` identity directions of falling strength, beside an expression direction.
    fn tensor(d2: usize, d3: usize, n: usize, rank: usize) -> ShapeTensor {
        let wave = |a: usize, b: usize| (((a * a * 37 + a * b * 53 + b * 101 + 11) % 1009) as f64 * 0.77).sin();
        let mut data = Vec::new();
        for p in 0..d3 {
            for i in 0..d2 {
                for c in 0..3 * n {
                    let own: f64 = (0..rank).map(|r| 4.0 / (1 + r) as f64 * wave(i, 7 + r) * wave(c, 90 + r)).sum();
                    data.push(60.0 * wave(c, 3) + own + 3.0 * wave(p + 50, 5) * wave(c, 70));
                }
            }
        }
        ShapeTensor::from_shapes(d2, d3, n, data).expect("a tensor")
    }

    /// With as many groups as identities: the second moments of the residuals of models that are learned anew.
    #[test]
    fn components_are_those_of_the_residuals_of_unseen_faces() {
        let (d2, d3, n, d_id) = (9, 3, 30, 3);
        let tensor = tensor(d2, d3, n, 6);
        let found = remainder(&tensor, [d_id, d3], 100).expect("components");
        let mut expected = Vec::new();
        for left in 0..d2 {
            let others = (0..d3).flat_map(|p| (0..d2).filter(move |&i| i != left).map(move |i| (i, p)));
            let data = others.flat_map(|(i, p)| tensor.shape(i, p).to_vec()).collect();
            let others = ShapeTensor::from_shapes(d2 - 1, d3, n, data).expect("a tensor");
            let size = |dim| ModeSize::Dimension(dim);
            let sizes = HosvdOptions { identity: size(d_id), expression: size(d3), hooi: None };
            let model = hosvd(&others, &sizes).expect("a model").model;
            let projector = Projector::new(&model);
            for p in 0..d3 {
                let shape = tensor.shape(left, p);
                let weights = &projector.project(shape, &ProjectionOptions::default()).expect("weights")[0];
                let nearest = model.shape(&weights.identity, &weights.expression).expect("a shape");
                expected.push(shape.iter().zip(nearest).map(|(a, b)| a - b).collect::<Vec<f64>>());
            }
        }
        let rms = |sum: f64| (sum / n as f64).sqrt();
        let squares: f64 = expected.iter().flatten().map(|x| x * x).sum::<f64>() / expected.len() as f64;
        assert!((found.rms - rms(squares)).abs() < 1e-3 * rms(squares), "{} {}", found.rms, rms(squares));
        // The variance along any direction, here along the residuals themselves.
        let len = tensor.shape_len();
        for direction in expected.iter().step_by(5) {
            let along = |a: &[f64]| a.iter().zip(direction).map(|(x, y)| x * y).sum::<f64>().powi(2);
            let of_found: f64 = found.components.chunks_exact(len).map(along).sum();
            let of_sample = expected.iter().map(|e| along(e)).sum::<f64>() / expected.len() as f64;
            assert!((of_found - of_sample).abs() < 5e-3 * of_sample, "{of_found} {of_sample}");
        }
        assert!(found.rms_left < 1e-4 * found.rms);
    }

    #[test]
    fn fewer_components_hold_less_and_come_first() {
        let tensor = tensor(9, 3, 30, 6);
        let all = remainder(&tensor, [3, 3], 100).expect("components");
        let two = remainder(&tensor, [3, 3], 2).expect("components");
        assert_eq!(two.components.len(), 2 * 90);
        assert!(two.components.iter().zip(&all.components).all(|(a, b)| (a - b).abs() < 1e-9));
        assert!(two.rms_left > 0.0 && two.rms_left < two.rms && two.rms == all.rms);
    }

    /// Data of low rank leave nothing, one identity tells nothing: no components, no error.
    #[test]
    fn what_misses_nothing_has_no_components() {
        for (tensor, size) in
            [(tensor(9, 1, 30, 2), [3, 1]), (tensor(1, 3, 30, 1), [1, 3]), (tensor(2, 1, 30, 1), [1, 1])]
        {
            let found = remainder(&tensor, size, 10).expect("a result");
            assert!(
                found.components.is_empty() && found.rms == 0.0,
                "{} components, {}",
                found.components.len() / 90,
                found.rms
            );
        }
        assert!(remainder(&tensor(9, 3, 30, 6), [3, 3], 0).expect("a result").components.is_empty());
    }

    #[test]
    fn more_shapes_than_are_needed_are_thinned() {
        let found = remainder(&tensor(1100, 3, 4, 6), [2, 3], 5).expect("components");
        assert_eq!(found.components.len(), 5 * 12);
    }

    #[test]
    fn bits_do_not_depend_on_the_thread_count() {
        let tensor = tensor(14, 4, 200, 8);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| remainder(&tensor, [4, 4], 20).expect("components"))
        };
        assert_eq!(run(1), run(3));
    }
}
