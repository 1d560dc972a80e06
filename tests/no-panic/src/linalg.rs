//! `linalg` of the kernel, in both precisions.

use crate::memory::{Input, Output, status};
use habitus_core::linalg::polar::{Nearest, polar};
use habitus_core::linalg::svd3::svd3;
use habitus_core::linalg::{cholesky, least_squares, qr, symmetric_eigen};

macro_rules! checks {
    ($real:ty, $cholesky:ident, $eigen:ident, $qr:ident, $least_squares:ident, $svd:ident) => {
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

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $qr(
            a: Output<$real>,
            n_rows: usize,
            n_columns: usize,
            tau: Output<$real>,
            order: Output<u32>,
            b: Output<$real>,
        ) -> i32 {
            // SAFETY: the caller's promise.
            let (a, tau, order, b) = unsafe { (a.slice(), tau.slice(), order.slice(), b.slice()) };
            status(qr::factor_in_place(a, n_rows, n_columns, tau, order))
                .wrapping_add(status(qr::transpose_applied_in_place(a, tau, b)))
                .wrapping_add(status(qr::applied_in_place(a, tau, b)))
                .wrapping_add(status(qr::back_substituted_in_place(a, n_columns, b)))
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $least_squares(
            [a, b, x, workspace]: [Output<$real>; 4],
            order: Output<u32>,
            tolerance: $real,
        ) -> i32 {
            // SAFETY: the caller's promise.
            let (a, b, x, workspace) = unsafe { (a.slice(), b.slice(), x.slice(), workspace.slice()) };
            // SAFETY: the caller's promise.
            let order = unsafe { order.slice() };
            if let Err(error) = least_squares::least_squares_req(x.len()).check(workspace.len()) {
                return error.code() as i32;
            }
            match least_squares::least_squares_in_place(a, b, x, order, tolerance, workspace) {
                Ok(found) => found.rank as i32 + found.residual as i32,
                Err(error) => error.code() as i32,
            }
        }

        #[unsafe(no_mangle)]
        extern "C" fn $svd(a: [[$real; 3]; 3], tolerance: $real, out: &mut [[[$real; 3]; 3]; 4]) -> i32 {
            let [u, v, rotation, stretch] = out;
            let (Ok(found), Ok(factors)) = (svd3(&a), polar(&a)) else { return status(svd3(&a)) };
            (*u, *v) = (found.u, found.v);
            (*rotation, *stretch) = (factors.rotation, factors.stretch);
            let [x, y, z] = found.singular;
            found.rank(tolerance) as i32 + i32::from(factors.nearest == Nearest::Open) + (x + y + z) as i32
        }
    };
}

checks!(f32, check_cholesky_f32, check_symmetric_eigen_f32, check_qr_f32, check_least_squares_f32, check_svd3_f32);
checks!(f64, check_cholesky_f64, check_symmetric_eigen_f64, check_qr_f64, check_least_squares_f64, check_svd3_f64);

/// Solving without factoring first: any numbers as the factor.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_cholesky_solve(l: Input<f32>, b: Output<f32>) -> i32 {
    // SAFETY: the caller's promise.
    let (l, b) = unsafe { (l.slice(), b.slice()) };
    status(cholesky::solve_in_place(l, b))
}
