//! Specificity: how close random faces of the model are to real ones.
//!
//! Faces are drawn from the Gaussian priors of the two modes; each is compared with the nearest training shape in mean
//! vertex distance. Lower is better, but only together with generalization: a model of the mean alone is very specific.
//!
//! The search for the nearest shape is exact. The vertices are split into small neighbourhoods; the length of a mean
//! difference never exceeds the mean length of the differences, so the distance of the neighbourhoods' centroids bounds the
//! distance of two shapes from below at a fraction of the cost, and most shapes never have to be compared in full.

use crate::dense::{columns, multiply};
use crate::error::Error;
use crate::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use crate::face::multilinear::MultilinearModel;
use crate::face::tensor::ShapeTensor;
use crate::measure::generalization::CurvePoint;
use crate::measure::vertex_error::{MeanError, length, mean_vertex_distance};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Most vertices of a neighbourhood.
const NEIGHBOURHOOD: usize = 16;
/// Faces that are drawn between two calls of the progress function.
const BATCH: usize = 100;
/// Faces that one task makes.
const BLOCK: usize = 25;

/// What to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct SpecificityOptions {
    /// Numbers of identity weights (with all expression weights); those above the number of identities are left out.
    pub identity_dims: Vec<usize>,
    /// Numbers of expression weights (with all identity weights), likewise.
    pub expression_dims: Vec<usize>,
    /// Random faces per size.
    pub samples: usize,
    /// Seed of the random numbers; all sizes use the same ones.
    pub seed: u64,
}

/// The curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Specificity {
    /// Over the size of the identity mode.
    pub identity: Vec<CurvePoint>,
    /// Over the size of the expression mode.
    pub expression: Vec<CurvePoint>,
}

/// Specificity of the models of `tensor`. `progress` is told how many of how many random faces are done, on the calling
/// thread.
///
/// Errors: no samples asked for, and those of [`hosvd`].
pub fn specificity(
    tensor: &ShapeTensor,
    options: &SpecificityOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Specificity, Error> {
    if options.samples == 0 {
        return Err(Error::input("specificity needs random faces, 0 were asked for; ask for 1000"));
    }
    let (d2, d3) = (tensor.n_identities(), tensor.n_expressions());
    let all = HosvdOptions { identity: ModeSize::Dimension(d2), expression: ModeSize::Dimension(d3), hooi: None };
    let model = hosvd(tensor, &all)?.model;
    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    let mut deviates = |n: usize| -> Vec<f64> { (0..n).map(|_| StandardNormal.sample(&mut random)).collect() };
    let samples: Vec<(Vec<f64>, Vec<f64>)> = (0..options.samples).map(|_| (deviates(d2), deviates(d3))).collect();

    let fitting = |dims: &[usize], largest: usize| -> Vec<usize> {
        dims.iter().copied().filter(|dim| (1..=largest).contains(dim)).collect()
    };
    let (identity_dims, expression_dims) = (fitting(&options.identity_dims, d2), fitting(&options.expression_dims, d3));
    let search = NearestShape::new(tensor, &model.mean);
    let total = (identity_dims.len() + expression_dims.len()) * options.samples;
    let mut done = 0;
    progress(0, total);
    let mut point = |dim: usize, d_id: usize, d_pose: usize| -> Result<CurvePoint, Error> {
        let mut distances = Vec::with_capacity(options.samples);
        for batch in samples.chunks(BATCH) {
            let faces = drawn_faces(&model, batch, d_id, d_pose);
            distances.par_extend(faces.par_chunks_exact(tensor.shape_len()).map(|face| search.distance(face)));
            done += batch.len();
            progress(done, total);
        }
        let error = MeanError::of(&distances).ok_or_else(|| Error::Internal("no random faces".into()))?;
        Ok(CurvePoint { dim, error })
    };
    Ok(Specificity {
        identity: identity_dims.iter().map(|&dim| point(dim, dim, d3)).collect::<Result<_, _>>()?,
        expression: expression_dims.iter().map(|&dim| point(dim, d2, dim)).collect::<Result<_, _>>()?,
    })
}

/// Faces with the first `d_id` and `d_pose` weights drawn from their priors, without the others.
fn drawn_faces(model: &MultilinearModel, deviates: &[(Vec<f64>, Vec<f64>)], d_id: usize, d_pose: usize) -> Vec<f64> {
    let (prior2, prior3) = (model.identity.weights.truncated(d_id), model.expression.weights.truncated(d_pose));
    let len = model.mean.len();
    let mut faces = vec![0.0; len * deviates.len()];
    faces.par_chunks_mut(len * BLOCK).zip(deviates.par_chunks(BLOCK)).for_each(|(faces, deviates)| {
        let weights: Vec<(Vec<f64>, Vec<f64>)> =
            deviates.iter().map(|(x, y)| (prior2.sample(&x[..d_id]), prior3.sample(&y[..d_pose]))).collect();
        faces.chunks_exact_mut(len).for_each(|face| face.copy_from_slice(&model.mean));
        for k in 0..d_pose {
            let products: Vec<f64> = weights.iter().flat_map(|(w2, w3)| w2.iter().map(|x| x * w3[k])).collect();
            let blocks = &model.core[k * model.identity.dim * len..][..d_id * len];
            multiply(faces, 1.0, &columns(blocks, len, d_id, len), &columns(&products, d_id, deviates.len(), d_id));
        }
    });
    faces
}

/// Training shapes prepared for searching the nearest.
struct NearestShape<'a> {
    tensor: &'a ShapeTensor,
    /// Vertices, neighbourhood after neighbourhood.
    order: Vec<usize>,
    /// End of each neighbourhood in `order`.
    ends: Vec<usize>,
    /// Sums over the neighbourhoods, shape after shape.
    sums: Vec<f64>,
}

impl<'a> NearestShape<'a> {
    fn new(tensor: &'a ShapeTensor, mean: &[f64]) -> Self {
        let mut order: Vec<usize> = (0..tensor.n_vertices()).collect();
        let mut ends = Vec::new();
        split(&mut order, mean.as_chunks::<3>().0, 0, &mut ends);
        let mut search = NearestShape { tensor, order, ends, sums: Vec::new() };
        let shapes = tensor.data().par_chunks_exact(tensor.shape_len());
        search.sums = shapes.map(|shape| search.neighbourhood_sums(shape)).collect::<Vec<_>>().concat();
        search
    }

    /// Distance of `face` to the nearest training shape, mm.
    fn distance(&self, face: &[f64]) -> f64 {
        let sums = self.neighbourhood_sums(face);
        let n = self.tensor.n_vertices() as f64;
        let bound = |other: &[f64]| -> f64 {
            let pairs = sums.as_chunks::<3>().0.iter().zip(other.as_chunks::<3>().0);
            pairs.map(|(a, b)| length([a[0] - b[0], a[1] - b[1], a[2] - b[2]])).sum::<f64>() / n
        };
        let mut bounds: Vec<(f64, usize)> = self.sums.chunks_exact(sums.len()).map(bound).zip(0..).collect();
        bounds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut nearest = f64::INFINITY;
        for (bound, shape) in bounds {
            // Rounding may lift a bound by a few units in its last places.
            if bound * (1.0 - 1e-12) >= nearest {
                break;
            }
            let len = self.tensor.shape_len();
            nearest = nearest.min(mean_vertex_distance(face, &self.tensor.data()[shape * len..][..len]));
        }
        nearest
    }

    fn neighbourhood_sums(&self, shape: &[f64]) -> Vec<f64> {
        let vertices = shape.as_chunks::<3>().0;
        let mut start = 0;
        let mut sums = Vec::with_capacity(3 * self.ends.len());
        for &end in &self.ends {
            let mut sum = [0.0; 3];
            for &v in &self.order[start..end] {
                (0..3).for_each(|axis| sum[axis] += vertices[v][axis]);
            }
            sums.extend(sum);
            start = end;
        }
        sums
    }
}

/// Orders the vertices so that neighbourhoods are contiguous: halves along the longest axis until they are small.
fn split(order: &mut [usize], positions: &[[f64; 3]], start: usize, ends: &mut Vec<usize>) {
    if order.len() <= NEIGHBOURHOOD {
        ends.push(start + order.len());
        return;
    }
    let extent = |axis: usize| {
        let (low, high) = order.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
            (low.min(positions[v][axis]), high.max(positions[v][axis]))
        });
        high - low
    };
    let axis = (0..3).max_by(|&a, &b| extent(a).total_cmp(&extent(b))).unwrap_or(0);
    order.sort_by(|&a, &b| positions[a][axis].total_cmp(&positions[b][axis]).then(a.cmp(&b)));
    let half = order.len() / 2;
    let (left, right) = order.split_at_mut(half);
    split(left, positions, start, ends);
    split(right, positions, start + half, ends);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tensor(n: usize) -> ShapeTensor {
        let (d2, d3) = (8, 4);
        let wave = |a: usize, b: usize| (((a * a * 37 + a * b * 53 + b * 101 + 11) % 1009) as f64 * 0.77).sin();
        let data = (0..d2 * d3)
            .flat_map(|k| {
                (0..3 * n).map(move |c| 80.0 * wave(c, 1) + 5.0 * wave(k, c % 11) * wave(c, 2) + wave(k + c, 4))
            })
            .collect();
        ShapeTensor::from_shapes(d2, d3, n, data).unwrap()
    }

    fn options() -> SpecificityOptions {
        SpecificityOptions { identity_dims: vec![1, 3, 8, 9], expression_dims: vec![2], samples: 40, seed: 7 }
    }

    #[test]
    fn pruned_search_equals_brute_force() {
        let tensor = tensor(150);
        let model = hosvd(&tensor, &HosvdOptions::default()).unwrap().model;
        let search = NearestShape::new(&tensor, &model.mean);
        for k in 0..20 {
            let face: Vec<f64> = model.mean.iter().enumerate().map(|(c, x)| x + 3.0 * ((c * k) as f64).sin()).collect();
            let shapes = tensor.data().chunks_exact(tensor.shape_len());
            let truth = shapes.map(|shape| mean_vertex_distance(&face, shape)).fold(f64::INFINITY, f64::min);
            assert_eq!(search.distance(&face), truth);
        }
        assert_eq!(search.distance(tensor.shape(3, 2)), 0.0);
    }

    #[test]
    fn neighbourhoods_cover_every_vertex_once() {
        let tensor = tensor(150);
        let search = NearestShape::new(&tensor, tensor.shape(0, 0));
        let mut order = search.order.clone();
        order.sort_unstable();
        assert_eq!(order, (0..150).collect::<Vec<_>>());
        assert_eq!(search.ends.last(), Some(&150));
    }

    #[test]
    fn sizes_that_do_not_exist_are_left_out_and_progress_is_told() {
        let mut last = (0, 0);
        let found = specificity(&tensor(60), &options(), &mut |done, total| last = (done, total)).unwrap();
        assert_eq!(last, (160, 160));
        assert_eq!(found.identity.iter().map(|p| p.dim).collect::<Vec<_>>(), [1, 3, 8]);
        assert_eq!(found.expression[0].error.count, 40);
        let none = SpecificityOptions { samples: 0, ..options() };
        assert!(specificity(&tensor(60), &none, &mut |_, _| {}).unwrap_err().to_string().contains("random faces"));
    }

    #[test]
    fn same_seed_gives_the_same_bits_on_any_number_of_threads() {
        let tensor = tensor(60);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| specificity(&tensor, &options(), &mut |_, _| {}).unwrap())
        };
        let one = run(1);
        assert_eq!(one, run(2));
        assert_eq!(one, run(8));
        let other = specificity(&tensor, &SpecificityOptions { seed: 8, ..options() }, &mut |_, _| {}).unwrap();
        assert_ne!(one, other);
    }
}
