//! Bounds on the variables of a solver: two slices, each empty where there are none.

use crate::workspace::check_len;
use crate::{Error, Real};

/// `lower <= x <= upper`, entry by entry.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds<'a, R> {
    pub(super) lower: &'a [R],
    pub(super) upper: &'a [R],
}

impl<R: Real> Bounds<'_, R> {
    /// `Ok` when they fit `n` variables and leave room for each.
    ///
    /// Errors: `DimensionMismatch`; `BadOption` (0) when a lower bound exceeds its upper one or is NaN.
    pub(super) fn check(&self, n: usize) -> Result<(), Error> {
        for bound in [self.lower, self.upper] {
            if !bound.is_empty() {
                check_len(n, bound.len())?;
            }
        }
        let wrong = |bound: &[R]| bound.iter().any(|value| value.partial_cmp(value).is_none());
        if wrong(self.lower) || wrong(self.upper) || self.lower.iter().zip(self.upper).any(|(l, u)| !(l <= u)) {
            return Err(Error::BadOption { option: 0 });
        }
        Ok(())
    }

    /// Both bounds of a variable; infinite where there is none.
    #[inline(always)]
    pub(super) fn of(&self, i: usize) -> (R, R) {
        let infinity = R::ONE / R::ZERO;
        (self.lower.get(i).copied().unwrap_or(-infinity), self.upper.get(i).copied().unwrap_or(infinity))
    }

    /// The nearest allowed value of a variable; the lower bound for NaN, if there is one.
    #[inline(always)]
    pub(super) fn clipped(&self, i: usize, value: R) -> R {
        let (low, high) = self.of(i);
        value.max(low).min(high)
    }
}
