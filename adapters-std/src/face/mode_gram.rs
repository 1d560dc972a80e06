//! Covariances of the identity and the expression mode, from inner products of shapes (part of the HOSVD, ch. 12).
//!
//! With `a_ip` the shape of identity `i` in expression `p` less the mean of all shapes, `d2` identities and `d3`
//! expressions:
//!
//! `C2[i, i'] = (1/d3) sum_p <a_ip, a_i'p>`, `C3[p, p'] = (1/d2) sum_i <a_ip, a_ip'>`.
//!
//! Both are blocks of one Gram matrix of all shapes. Training needs only those blocks and takes them in one pass over
//! the coordinates ([`mode_covariances`]); leave-one-out measures and HOOI need the whole matrix ([`centred_gram`]).
//! Matrices are square, symmetric and contiguous. Storage order of shapes: see [`ShapeTensor`].

use crate::dense::{columns, gram, multiply, transposed};
use crate::face::tensor::ShapeTensor;
use rayon::prelude::*;

/// Coordinates that are centred and multiplied at a time: a block stays in the cache.
const BLOCK: usize = 128;
/// Coordinates that one task sums; fixed, so that the sums do not depend on the thread count.
const TASK: usize = 8 * BLOCK;

/// `(C2, C3)` in mm^2 summed over the vertices, in one pass, without a copy of the tensor.
///
/// `mean` is the mean of all shapes. Cost: `3 n N (d2 + d3)` multiply-adds.
pub fn mode_covariances(tensor: &ShapeTensor, mean: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (d2, d3, len) = (tensor.n_identities(), tensor.n_expressions(), tensor.shape_len());
    let tasks: Vec<usize> = (0..len).step_by(TASK).collect();
    let partial: Vec<(Vec<f64>, Vec<f64>)> = tasks
        .par_iter()
        .map(|&task| {
            let (mut c2, mut c3) = (vec![0.0; d2 * d2], vec![0.0; d3 * d3]);
            let end = (task + TASK).min(len);
            for start in (task..end).step_by(BLOCK) {
                let width = BLOCK.min(end - start);
                let block = centred_block(tensor, mean, start, width);
                for shapes in block.chunks_exact(width * d2) {
                    multiply(&mut c2, 1.0, &transposed(shapes, width, d2, width), &columns(shapes, width, d2, width));
                }
                let rows = width * d2;
                multiply(&mut c3, 1.0, &transposed(&block, rows, d3, rows), &columns(&block, rows, d3, rows));
            }
            (c2, c3)
        })
        .collect();
    let (mut c2, mut c3) = (vec![0.0; d2 * d2], vec![0.0; d3 * d3]);
    for (part2, part3) in &partial {
        c2.iter_mut().zip(part2).for_each(|(sum, x)| *sum += x);
        c3.iter_mut().zip(part3).for_each(|(sum, x)| *sum += x);
    }
    c2.iter_mut().for_each(|x| *x /= d3 as f64);
    c3.iter_mut().for_each(|x| *x /= d2 as f64);
    (c2, c3)
}

/// Coordinates `start .. start + width` of all shapes less `mean`, shape after shape in storage order.
pub(crate) fn centred_block(tensor: &ShapeTensor, mean: &[f64], start: usize, width: usize) -> Vec<f64> {
    let mut block = Vec::with_capacity(width * tensor.n_shapes());
    let mean = &mean[start..start + width];
    for shape in tensor.data().chunks_exact(tensor.shape_len()) {
        block.extend(shape[start..start + width].iter().zip(mean).map(|(x, m)| x - m));
    }
    block
}

/// Inner products of all pairs of shapes less their mean, `N x N`, mm^2 summed over the vertices.
///
/// Cost: `3 n N^2` multiply-adds.
pub fn centred_gram(tensor: &ShapeTensor) -> Vec<f64> {
    let mut gram = gram(tensor.data(), tensor.shape_len(), tensor.n_shapes());
    centre_in_place(&mut gram, tensor.n_shapes());
    gram
}

/// `K <- H K H` with `H = I - 1 1^T / n`: inner products about the mean from inner products about any point.
pub(crate) fn centre_in_place(gram: &mut [f64], n: usize) {
    let row_means: Vec<f64> = gram.chunks_exact(n).map(|row| row.iter().sum::<f64>() / n as f64).collect();
    let mean = row_means.iter().sum::<f64>() / n as f64;
    for (row, &row_mean) in gram.chunks_exact_mut(n).zip(&row_means) {
        for (x, column_mean) in row.iter_mut().zip(&row_means) {
            *x += mean - row_mean - column_mean;
        }
    }
}

/// `(C2, C3)` from a centred Gram matrix of `d2 d3` shapes in storage order.
pub fn mode_covariances_of_gram(gram: &[f64], d2: usize, d3: usize) -> (Vec<f64>, Vec<f64>) {
    let n = d2 * d3;
    let (mut c2, mut c3) = (vec![0.0; d2 * d2], vec![0.0; d3 * d3]);
    for p in 0..d3 {
        for i in 0..d2 {
            let row = &gram[(p * d2 + i) * n..][..n];
            for (sum, x) in c2[i * d2..][..d2].iter_mut().zip(&row[p * d2..][..d2]) {
                *sum += x / d3 as f64;
            }
            for (sum, x) in c3[p * d3..][..d3].iter_mut().zip(row.iter().skip(i).step_by(d2)) {
                *sum += x / d2 as f64;
            }
        }
    }
    (c2, c3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::register::gpa::mean_of_shapes;

    #[test]
    fn one_pass_equals_the_blocks_of_the_gram_matrix() {
        let (d2, d3, n) = (7, 5, 430);
        let data = (0..d2 * d3 * n * 3).map(|x| 100.0 * (x as f64 * 0.37).sin() + (x % 11) as f64).collect();
        let tensor = ShapeTensor::from_shapes(d2, d3, n, data).unwrap();
        let mean = mean_of_shapes(tensor.data(), tensor.shape_len());
        let (a2, a3) = mode_covariances(&tensor, &mean);
        let (b2, b3) = mode_covariances_of_gram(&centred_gram(&tensor), d2, d3);
        let scale = a2[0].abs();
        assert!(a2.iter().zip(&b2).chain(a3.iter().zip(&b3)).all(|(a, b)| (a - b).abs() < 1e-10 * scale));
    }
}
