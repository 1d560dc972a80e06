//! Measures of a pair of distances (eqs 3.1 to 3.3): between two samples of the first surface, and between their images.

use crate::Real;

/// What one pair says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Deviation<R> {
    /// To be compared with the tolerance.
    Value(R),
    /// Beyond any tolerance: exactly one distance is infinite (no path on one side), or one is no distance (NaN, negative).
    Violated,
    /// Says nothing: both distances are infinite, or the first is shorter than the discretisation can tell (and the other is finite).
    Skipped,
}

/// Eq. 3.1, and eq. 3.3 with distances within the region: `|d_1 - d_2|`, in the unit of the distances. Panics: never.
pub fn absolute<R: Real>(d1: R, d2: R) -> Deviation<R> {
    compared(d1, d2, |smaller, larger| larger - smaller)
}

/// Eq. 3.2, and eq. 3.3 with distances within the region: the ratio of the distances, guarded where they are short.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relative<R> {
    /// Added to both distances, at least zero; the distance of samples is usual.
    pub floor: R,
    /// Pairs whose first distance is below this are skipped; three times the distance of samples is usual.
    pub shortest: R,
}

impl<R: Real> Relative<R> {
    /// The usual guard for samples that lie `spacing` apart: a floor of once, a shortest distance of three times that.
    pub fn with_spacing(spacing: R) -> Self {
        Relative { floor: spacing, shortest: R::from_f64(3.0) * spacing }
    }

    /// `(max + floor) / (min + floor) - 1`, computed as `(max - min) / (min + floor)`; two zeros without a floor are skipped. Panics: never.
    pub fn deviation(&self, d1: R, d2: R) -> Deviation<R> {
        let found = compared(d1, d2, |smaller, larger| (larger - smaller) / (smaller + self.floor));
        match found {
            Deviation::Value(_) if d1 < self.shortest || d1 + d2 + self.floor == R::ZERO => Deviation::Skipped,
            // Against a zero without a floor.
            Deviation::Value(value) if !value.is_finite() => Deviation::Violated,
            found => found,
        }
    }
}

fn compared<R: Real>(d1: R, d2: R, deviation: impl Fn(R, R) -> R) -> Deviation<R> {
    if !(d1 >= R::ZERO && d2 >= R::ZERO) {
        return Deviation::Violated;
    }
    match (d1.is_finite(), d2.is_finite()) {
        (true, true) => Deviation::Value(deviation(d1.min(d2), d1.max(d2))),
        (false, false) => Deviation::Skipped,
        _ => Deviation::Violated,
    }
}
