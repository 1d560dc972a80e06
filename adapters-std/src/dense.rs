//! Strided views of dense column-major data, and products over them whose bits do not depend on the thread count.
//!
//! Threads never share a sum: each owns a block of the result, and a block's sum runs over its terms in one fixed
//! order. Block sizes are constants, so the same numbers come out of one thread and of many.

use nalgebra::{Dyn, MatrixView, MatrixViewMut};
use rayon::prelude::*;

/// A read-only matrix with unit stride along its columns, or along its rows when it is a transpose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Strided<'a> {
    data: &'a [f64],
    rows: usize,
    columns: usize,
    row_stride: usize,
    column_stride: usize,
}

impl<'a> Strided<'a> {
    fn view(&self) -> MatrixView<'a, f64, Dyn, Dyn, Dyn, Dyn> {
        let (rows, columns) = (Dyn(self.rows), Dyn(self.columns));
        let (down, across) = (Dyn(self.row_stride), Dyn(self.column_stride));
        MatrixView::from_slice_with_strides_generic(self.data, rows, columns, down, across)
    }
}

/// Up to this size of any side, [`multiply`] uses its own loops.
///
/// nalgebra hands larger products to matrixmultiply; its own loops for small ones read views of a non-unit row stride
/// out of bounds (its checks of unsafe preconditions say so), so they must not be reached.
const SMALL: usize = 5;
/// Side of the square blocks of a Gram matrix that one task computes.
const GRAM_BLOCK: usize = 64;
/// Columns of a product that one task computes.
const PRODUCT_COLUMNS: usize = 16;

/// `rows x columns`, column-major, consecutive columns `stride` apart; row 0 is `data[0]`.
pub(crate) fn columns(data: &[f64], rows: usize, columns: usize, stride: usize) -> Strided<'_> {
    Strided { data, rows, columns, row_stride: 1, column_stride: stride }
}

/// The transpose of [`columns`] with the same arguments: `columns x rows`.
pub(crate) fn transposed(data: &[f64], rows: usize, columns: usize, stride: usize) -> Strided<'_> {
    Strided { data, rows: columns, columns: rows, row_stride: stride, column_stride: 1 }
}

/// `out <- a b + beta out` with `out` contiguous and column-major, and `b` from [`columns`]; one thread.
pub(crate) fn multiply(out: &mut [f64], beta: f64, a: &Strided<'_>, b: &Strided<'_>) {
    assert!(a.columns == b.rows && b.row_stride == 1 && out.len() == a.rows * b.columns);
    if a.rows.min(a.columns).min(b.columns) > SMALL {
        MatrixViewMut::from_slice_generic(out, Dyn(a.rows), Dyn(b.columns)).gemm(1.0, &a.view(), &b.view(), beta);
        return;
    }
    for (j, out) in out.chunks_exact_mut(a.rows).enumerate() {
        let b = &b.data[j * b.column_stride..][..b.rows];
        out.iter_mut().for_each(|x| *x = if beta == 0.0 { 0.0 } else { beta * *x });
        if a.row_stride == 1 {
            for (k, b) in b.iter().enumerate() {
                let column = &a.data[k * a.column_stride..][..a.rows];
                out.iter_mut().zip(column).for_each(|(x, a)| *x += a * b);
            }
        } else {
            for (i, x) in out.iter_mut().enumerate() {
                *x += dot(&a.data[i * a.row_stride..][..a.columns], b);
            }
        }
    }
}

/// Sum of products in a fixed order: eight partial sums, which vectorise, then their sum.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7])) + rest
}

/// `A B`, column-major, for column-major contiguous `a` (`rows x inner`) and `b` (`inner x n`); parallel over columns.
pub(crate) fn product(a: &[f64], rows: usize, inner: usize, b: &[f64]) -> Vec<f64> {
    let n = b.len() / inner;
    let mut out = vec![0.0; rows * n];
    let (blocks_out, blocks_b) = (out.par_chunks_mut(rows * PRODUCT_COLUMNS), b.par_chunks(inner * PRODUCT_COLUMNS));
    blocks_out.zip(blocks_b).for_each(|(out, b)| {
        let width = b.len() / inner;
        multiply(out, 0.0, &columns(a, rows, inner, rows), &columns(b, inner, width, inner));
    });
    out
}

/// `A^T A` (`n x n`, both triangles) of the column-major contiguous `a` (`rows x n`).
///
/// Cost: `n^2 rows` multiply-adds; no second copy of `a`.
pub(crate) fn gram(a: &[f64], rows: usize, n: usize) -> Vec<f64> {
    let n_blocks = n.div_ceil(GRAM_BLOCK);
    let pairs: Vec<(usize, usize)> = (0..n_blocks).flat_map(|j| (0..=j).map(move |i| (i, j))).collect();
    let extent = |block: usize| (block * GRAM_BLOCK, ((block + 1) * GRAM_BLOCK).min(n));
    let blocks: Vec<Vec<f64>> = pairs
        .par_iter()
        .map(|&(i, j)| {
            let ((i0, i1), (j0, j1)) = (extent(i), extent(j));
            let mut block = vec![0.0; (i1 - i0) * (j1 - j0)];
            let left = transposed(&a[i0 * rows..i1 * rows], rows, i1 - i0, rows);
            multiply(&mut block, 0.0, &left, &columns(&a[j0 * rows..j1 * rows], rows, j1 - j0, rows));
            block
        })
        .collect();
    let mut gram = vec![0.0; n * n];
    for (&(i, j), block) in pairs.iter().zip(&blocks) {
        let ((i0, i1), (j0, j1)) = (extent(i), extent(j));
        for column in j0..j1 {
            for row in i0..i1.min(column + 1) {
                let value = block[(column - j0) * (i1 - i0) + row - i0];
                gram[column * n + row] = value;
                gram[row * n + column] = value;
            }
        }
    }
    gram
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gram_equals_sums_of_products() {
        let (rows, n) = (37, 131);
        let a: Vec<f64> = (0..rows * n).map(|i| ((i * 7919) % 101) as f64 - 50.0).collect();
        let gram = gram(&a, rows, n);
        for i in 0..n {
            for j in 0..n {
                let exact: f64 = (0..rows).map(|r| a[i * rows + r] * a[j * rows + r]).sum();
                assert_eq!(gram[i * n + j], exact, "integers of this size are exact, ({i}, {j})");
            }
        }
    }

    #[test]
    fn small_and_large_products_are_both_right() {
        let data: Vec<f64> = (0..600).map(|i| ((i * 29) % 23) as f64 - 11.0).collect();
        for (rows, inner, n) in [(1, 1, 1), (3, 20, 4), (20, 3, 9), (9, 20, 5), (9, 10, 11)] {
            let b = columns(&data[7..], inner, n, inner + 2);
            for a in [columns(&data, rows, inner, rows + 1), transposed(&data, inner, rows, inner + 1)] {
                let mut out = vec![2.0; rows * n];
                multiply(&mut out, 3.0, &a, &b);
                for (at, &x) in out.iter().enumerate() {
                    let (i, j) = (at % rows, at / rows);
                    let exact: f64 = (0..inner)
                        .map(|k| a.data[i * a.row_stride + k * a.column_stride] * b.data[j * b.column_stride + k])
                        .sum();
                    assert_eq!(x, exact + 6.0, "{rows} x {inner} x {n}");
                }
            }
        }
    }

    #[test]
    fn product_equals_sums_of_products() {
        let (rows, inner, n) = (19, 23, 41);
        let a: Vec<f64> = (0..rows * inner).map(|i| ((i * 31) % 17) as f64).collect();
        let b: Vec<f64> = (0..inner * n).map(|i| ((i * 13) % 11) as f64).collect();
        let c = product(&a, rows, inner, &b);
        for column in 0..n {
            for row in 0..rows {
                let exact: f64 = (0..inner).map(|k| a[k * rows + row] * b[column * inner + k]).sum();
                assert_eq!(c[column * rows + row], exact);
            }
        }
    }
}
