//! The line search: a bracket of step lengths of which one fulfils the weak Wolfe conditions.

use super::step::Place;
use crate::Real;
use crate::linalg::{at, set};

/// Share of the slope by which the value must fall (Armijo), and that which may be left of the slope (Wolfe).
const FALL: f64 = 1e-4;
const SLOPE_LEFT: f64 = 0.9;

/// A bracket along one way.
pub(super) struct Search<R> {
    /// The next trial.
    pub(super) t: R,
    /// Slope of the function along the way at its start.
    pub(super) slope: R,
    start: R,
    largest: R,
    low: [R; 3],
    high: Option<R>,
}

impl<R: Real> Place<'_, R> {
    /// The way from here to the aim. The largest allowed step is the first that puts a variable at its bound, at least 1.
    pub(super) fn search(&self, point: &[R], value: R, first: bool) -> Search<R> {
        let (mut square, mut largest) = (R::ZERO, R::MAX);
        for (i, (&x, &to)) in self.x.iter().zip(point).enumerate() {
            let way = to - x;
            square += way * way;
            let (low, high) = self.bounds.of(i);
            let room = if way > R::ZERO { high - x } else { low - x };
            if way != R::ZERO {
                largest = largest.min(room / way);
            }
        }
        let slope = self.slope(point, self.gradient);
        let t = if first { R::ONE.min(R::ONE / square.sqrt()) } else { R::ONE };
        Search { t, slope, start: value, largest: largest.max(R::ONE), low: [R::ZERO, value, slope], high: None }
    }

    /// Slope of a gradient along the way to the aim.
    pub(super) fn slope(&self, point: &[R], gradient: &[R]) -> R {
        let ways = self.x.iter().zip(point).map(|(&x, &to)| to - x);
        ways.zip(gradient).fold(R::ZERO, |sum, (way, &g)| sum + g * way)
    }

    /// Writes the point at `t` of the way: the aim itself at 1, else `x + t (aim - x)`, clipped.
    pub(super) fn write_trial(&self, point: &[R], t: R, trial: &mut [R]) {
        for (i, (&x, &to)) in self.x.iter().zip(point).enumerate() {
            set(trial, i, if t == R::ONE { to } else { self.bounds.clipped(i, x + t * (to - x)) });
        }
    }

    /// Largest magnitude of `P(x - g) - x`.
    pub(super) fn projected_gradient(&self) -> R {
        self.x
            .iter()
            .enumerate()
            .fold(R::ZERO, |largest, (i, &x)| largest.max((self.bounds.clipped(i, x - at(self.gradient, i)) - x).abs()))
    }
}

impl<R: Real> Search<R> {
    /// Whether the trial with this value and slope is taken; sets the next one if not. With `any_slope` the value alone decides.
    pub(super) fn takes(&mut self, value: R, slope: R, any_slope: bool) -> bool {
        if !(value <= self.start + R::from_f64(FALL) * self.t * self.slope) {
            self.shorten(value);
            return false;
        }
        if any_slope || slope >= R::from_f64(SLOPE_LEFT) * self.slope || self.t >= self.largest {
            return true;
        }
        self.low = [self.t, value, slope];
        match self.high {
            // The value at the end of the bracket is not known any more: halve it.
            Some(high) => self.t = (self.t + high) * R::from_f64(0.5),
            None => self.t = (self.t * R::from_f64(4.0)).min(self.largest),
        }
        false
    }

    /// Makes the trial the end of the bracket: `value` is too large there.
    pub(super) fn shorten(&mut self, value: R) {
        let [low, at_low, slope] = self.low;
        let width = self.t - low;
        self.high = Some(self.t);
        let bend = value - at_low - slope * width;
        let share = -(slope * width) / (bend + bend);
        self.t = low + width * share.max(R::from_f64(0.1)).min(R::from_f64(0.9));
    }
}
