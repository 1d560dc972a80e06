//! The Jacobian of a map that is known at scattered samples, by weighted least squares in the tangent planes.

use super::jacobian::Matrix2;
use crate::Real;

/// Samples that a fit needs at least.
const LEAST_SAMPLES: u32 = 4;
/// Condition of the samples' second moments at which the fit is refused.
const MOST_CONDITION: f64 = 25.0;

/// Why samples give no Jacobian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unfit {
    /// Fewer than four samples.
    TooFew,
    /// Samples near a line, or of no weight: the condition of `sum w b b^T` is 25 or more.
    IllConditioned,
}

/// Sums over the neighbours of one sample; feed it with [`TangentFit::add`], then ask for the Jacobian.
///
/// `J = (sum w a b^T) (sum w b b^T)^-1` minimises `sum w |a - J b|^2`, with b the logarithm of a neighbour and a that of its image.
#[derive(Debug, Clone, Copy, Default)]
pub struct TangentFit<R> {
    count: u32,
    cross: Matrix2<R>,
    // Second moments of b: xx, xy, yy.
    spread: [R; 3],
}

/// The weight `exp(-|b|^2 / (2 (1.5 h)^2))` of a neighbour at b, where samples lie h apart.
///
/// Order of operations: `r = 1.5 h`, then `exp(-((b_x b_x + b_y b_y) / (2 r r)))`. Panics: never.
pub fn weight<R: Real>([x, y]: [R; 2], spacing: R) -> R {
    let reach = R::from_f64(1.5) * spacing;
    (-((x * x + y * y) / (R::from_f64(2.0) * reach * reach))).exp()
}

impl<R: Real> TangentFit<R> {
    /// No samples yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds the neighbour at `b` with its image at `a`, and a weight of at least zero: `w b` first, then its products with a and b.
    pub fn add(&mut self, [b_x, b_y]: [R; 2], [a_x, a_y]: [R; 2], weight: R) {
        let (x, y) = (weight * b_x, weight * b_y);
        let [[xx, xy], [yx, yy]] = &mut self.cross;
        *xx += x * a_x;
        *xy += y * a_x;
        *yx += x * a_y;
        *yy += y * a_y;
        let [xx, xy, yy] = &mut self.spread;
        *xx += x * b_x;
        *xy += x * b_y;
        *yy += y * b_y;
        self.count = self.count.saturating_add(1);
    }

    /// The Jacobian in the frames of both tangent planes.
    ///
    /// Order of operations, for the moments xx, xy, yy: `det = xx yy - xy xy`; the larger eigenvalue is `(xx + yy + sqrt((xx - yy)^2 + 4 (xy xy))) / 2`, the condition its square over det; a row (p, q) of
    /// the cross moments gives `(p yy - q xy) / det`, `(q xx - p xy) / det`.
    /// Errors: [`Unfit`]. Panics: never.
    pub fn jacobian(&self) -> Result<Matrix2<R>, Unfit> {
        if self.count < LEAST_SAMPLES {
            return Err(Unfit::TooFew);
        }
        let [xx, xy, yy] = self.spread;
        let determinant = xx * yy - xy * xy;
        let apart = ((xx - yy) * (xx - yy) + R::from_f64(4.0) * (xy * xy)).sqrt();
        let large = (xx + yy + apart) * R::from_f64(0.5);
        if !(large * large < R::from_f64(MOST_CONDITION) * determinant) {
            return Err(Unfit::IllConditioned);
        }
        Ok(self.cross.map(|[p, q]| [(p * yy - q * xy) / determinant, (q * xx - p * xy) / determinant]))
    }
}
