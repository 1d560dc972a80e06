//! `linalg` of the kernel, in both precisions.

use crate::memory::{Input, Output, status};
use habitus_core::linalg::{cholesky, symmetric_eigen};

macro_rules! checks {
    ($real:ty, $cholesky:ident, $eigen:ident) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $cholesky(a: Output<$real>, b: Output<$real>, n: usize) -> i32 {
            // SAFETY: the caller's promise.
            let (a, b) = unsafe { (a.slice(), b.slice()) };
            status(cholesky::factor_in_place(a, n)).wrapping_add(status(cholesky::solve_in_place(a, b)))
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $eigen(a: Output<$real>, vectors: Output<$real>, n: usize) -> i32 {
            // SAFETY: the caller's promise.
            let (a, vectors) = unsafe { (a.slice(), vectors.slice()) };
            status(symmetric_eigen::diagonalise_in_place(a, vectors, n))
        }
    };
}

checks!(f32, check_cholesky_f32, check_symmetric_eigen_f32);
checks!(f64, check_cholesky_f64, check_symmetric_eigen_f64);

/// Solving without factoring first: any numbers as the factor.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_cholesky_solve(l: Input<f32>, b: Output<f32>) -> i32 {
    // SAFETY: the caller's promise.
    let (l, b) = unsafe { (l.slice(), b.slice()) };
    status(cholesky::solve_in_place(l, b))
}
