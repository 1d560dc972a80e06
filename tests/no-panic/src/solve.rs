//! `solve` of the kernel, in both precisions: Procrustes, and Levenberg-Marquardt and L-BFGS-B on any problem.

use crate::memory::{Input, Output, status};
use habitus_core::Error;
use habitus_core::solve::lbfgsb::{self, Objective};
use habitus_core::solve::levenberg_marquardt::{LeastSquares, Limits, minimised_in_place, minimised_req};
use habitus_core::solve::procrustes::Moments;

/// A problem whose derivatives are whatever the caller's function writes.
struct Foreign<R> {
    dim: usize,
    derivatives: extern "C" fn(*const R, *mut R, *mut R) -> R,
}

impl<R> LeastSquares<R> for Foreign<R> {
    fn dim(&self) -> usize {
        self.dim
    }

    fn normal_equations(&mut self, x: &[R], jtj: &mut [R], jtr: &mut [R]) -> Result<R, Error> {
        Ok((self.derivatives)(x.as_ptr(), jtj.as_mut_ptr(), jtr.as_mut_ptr()))
    }
}

impl<R> Objective<R> for Foreign<R> {
    fn dim(&self) -> usize {
        self.dim
    }

    fn value_and_gradient(&mut self, x: &[R], gradient: &mut [R]) -> Result<R, Error> {
        Ok((self.derivatives)(x.as_ptr(), gradient.as_mut_ptr(), core::ptr::null_mut()))
    }
}

macro_rules! checks {
    ($real:ty, $procrustes:ident, $minimise:ident, $lbfgsb:ident) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $procrustes(
            pairs: Input<[[$real; 3]; 2]>,
            points: [Input<[$real; 3]>; 2],
            with_scale: bool,
        ) -> i32 {
            let mut moments = Moments::<$real>::new();
            // SAFETY: the caller's promise.
            for &[source, target] in unsafe { pairs.slice() } {
                moments.add(source, target, 1.0);
            }
            // SAFETY: the caller's promise.
            let [sources, targets] = unsafe { points.map(|points| points.slice()) };
            if let Err(error) = moments.add_all(sources, targets) {
                return error.code() as i32;
            }
            match moments.similarity(with_scale) {
                Ok(similarity) => similarity.applied([1.0; 3])[0] as i32,
                Err(error) => error.code() as i32,
            }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $minimise(
            dim: usize,
            derivatives: extern "C" fn(*const $real, *mut $real, *mut $real) -> $real,
            x: Output<$real>,
            bounds: [Input<$real>; 2],
            max_iterations: u32,
            workspace: Output<$real>,
        ) -> i32 {
            let [lower, upper] = bounds;
            // SAFETY: the caller's promise.
            let (x, lower, upper) = unsafe { (x.slice(), lower.slice(), upper.slice()) };
            // SAFETY: the caller's promise.
            let workspace = unsafe { workspace.slice() };
            if minimised_req(dim).check(workspace.len()).is_err() {
                return -1;
            }
            let limits = Limits { max_iterations, ..Limits::default() };
            status(minimised_in_place(&mut Foreign { dim, derivatives }, x, lower, upper, &limits, workspace))
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $lbfgsb(
            dim: usize,
            derivatives: extern "C" fn(*const $real, *mut $real, *mut $real) -> $real,
            x: Output<$real>,
            bounds: [Input<$real>; 2],
            counts: [u32; 3],
            workspace: Output<$real>,
        ) -> i32 {
            let [lower, upper] = bounds;
            // SAFETY: the caller's promise.
            let (x, lower, upper) = unsafe { (x.slice(), lower.slice(), upper.slice()) };
            // SAFETY: the caller's promise.
            let workspace = unsafe { workspace.slice() };
            let [max_iterations, max_evaluations, history] = counts;
            if lbfgsb::minimised_req(dim, history as usize).check(workspace.len()).is_err() {
                return -1;
            }
            let limits = lbfgsb::Limits { max_iterations, max_evaluations, history, ..lbfgsb::Limits::default() };
            let objective = &mut Foreign { dim, derivatives };
            match lbfgsb::minimised_in_place(objective, x, lower, upper, &limits, workspace) {
                Ok(outcome) => outcome.evaluations as i32 + outcome.gradient as i32 + outcome.status as i32,
                Err(error) => error.code() as i32,
            }
        }
    };
}

checks!(f32, check_procrustes_f32, check_minimise_f32, check_lbfgsb_f32);
checks!(f64, check_procrustes_f64, check_minimise_f64, check_lbfgsb_f64);
