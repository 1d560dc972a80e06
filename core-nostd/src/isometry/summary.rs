//! Sums over many deviations, one by one: weighted mean, largest, fraction within a tolerance.

use super::pairs::Deviation;
use crate::Real;

/// Figures of a stream of values; weights are areas where the values stand for pieces of a surface.
///
/// Sums are compensated (Kahan's summation, in the order of the calls), so that a mean over millions of values in `f32` keeps its digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary<R> {
    tolerance: R,
    values: Sum<R>,
    weight: Sum<R>,
    within: Sum<R>,
    violated: Sum<R>,
    largest: Option<(R, u32)>,
    calls: u32,
    skipped: u32,
}

impl<R: Real> Summary<R> {
    /// Nothing yet; values up to `tolerance` count as within.
    pub fn new(tolerance: R) -> Self {
        Summary {
            tolerance,
            values: Sum::default(),
            weight: Sum::default(),
            within: Sum::default(),
            violated: Sum::default(),
            largest: None,
            calls: 0,
            skipped: 0,
        }
    }

    /// Takes up a deviation with a weight of at least zero. A value that is not finite counts as violated.
    pub fn add(&mut self, deviation: Deviation<R>, weight: R) {
        match deviation {
            Deviation::Skipped => self.skipped = self.skipped.saturating_add(1),
            Deviation::Value(value) if value.is_finite() => {
                self.values.add(weight * value);
                self.weight.add(weight);
                if value <= self.tolerance {
                    self.within.add(weight);
                }
                if self.largest.is_none_or(|(largest, _)| value > largest) {
                    self.largest = Some((value, self.calls));
                }
            }
            Deviation::Value(_) | Deviation::Violated => self.violated.add(weight),
        }
        self.calls = self.calls.saturating_add(1);
    }

    /// Weighted mean of the finite values; `None` without any weight.
    pub fn mean(&self) -> Option<R> {
        (self.weight.total > R::ZERO).then(|| self.values.total / self.weight.total)
    }

    /// The largest finite value and the number of its call, from 0; the first of equals.
    pub fn largest(&self) -> Option<(R, u32)> {
        self.largest
    }

    /// Weight of the values within the tolerance over the weight of all but the skipped ones; `None` without any weight.
    pub fn fraction_within(&self) -> Option<R> {
        self.fraction(self.within.total)
    }

    /// Weight of what was violated over the weight of all but the skipped ones; `None` without any weight.
    pub fn fraction_violated(&self) -> Option<R> {
        self.fraction(self.violated.total)
    }

    fn fraction(&self, part: R) -> Option<R> {
        let all = self.weight.total + self.violated.total;
        (all > R::ZERO).then(|| part / all)
    }

    /// Calls in all, and those among them that were skipped.
    pub fn counts(&self) -> [u32; 2] {
        [self.calls, self.skipped]
    }
}

/// A compensated sum: `y = x - lost`, `t = total + y`, `lost = (t - total) - y`, `total = t`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Sum<R> {
    total: R,
    lost: R,
}

impl<R: Real> Sum<R> {
    fn add(&mut self, value: R) {
        let term = value - self.lost;
        let total = self.total + term;
        self.lost = (total - self.total) - term;
        self.total = total;
    }
}
