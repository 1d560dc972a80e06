//! Small dense linear algebra on the caller's slices: row-major, without panics and with bounded work.

pub mod cholesky;
pub mod least_squares;
pub mod polar;
pub mod qr;
pub mod svd3;
pub mod symmetric_eigen;

#[cfg(test)]
mod tests;

use crate::Real;

/// Entry `i`, or zero outside: lengths are checked at the top of each function, this only spares the compiler a panic path.
#[inline(always)]
pub(crate) fn at<R: Real>(slice: &[R], i: usize) -> R {
    slice.get(i).copied().unwrap_or(R::ZERO)
}

#[inline(always)]
pub(crate) fn set<R: Real>(slice: &mut [R], i: usize, value: R) {
    if let Some(entry) = slice.get_mut(i) {
        *entry = value;
    }
}
