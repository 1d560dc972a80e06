//! The first fundamental form of a triangle, and the Jacobian of a map that carries one triangle to another.

use super::jacobian::Matrix2;
use crate::{Error, Real};

/// Products of the two edges u, v that leave the first corner: a 2 x 2 metric, with its area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metric<R> {
    /// `u.u`.
    pub uu: R,
    /// `u.v`.
    pub uv: R,
    /// `v.v`.
    pub vv: R,
    /// Twice the area: the root of the determinant, without its cancellation.
    pub double_area: R,
}

impl<R: Real> Metric<R> {
    /// Of three corners: `u = q - p`, `v = r - p`, sums in the order x, y, z; twice the area is the length of `u x v`. Panics: never.
    pub fn of_corners([p, q, r]: [[R; 3]; 3]) -> Self {
        let edge = |to: [R; 3]| [to[0] - p[0], to[1] - p[1], to[2] - p[2]];
        let dot = |[a, b, c]: [R; 3], [x, y, z]: [R; 3]| a * x + b * y + c * z;
        let (u, v) = (edge(q), edge(r));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        Metric { uu: dot(u, u), uv: dot(u, v), vv: dot(v, v), double_area: dot(normal, normal).sqrt() }
    }

    /// Of the lengths of u, of v, and of the edge between their ends, by polarisation: `u.v = (u u + v v - c c) / 2`.
    ///
    /// Twice the area is Kahan's, with the lengths sorted as `a >= b >= c`: `sqrt((a + (b + c)) (c - (a - b)) (c + (a - b)) (a + (b - c))) / 2`; zero for lengths that
    /// break the triangle inequality. Source: W. Kahan, Miscalculating area and angles of a needle-like triangle, 2014. Panics: never.
    pub fn of_lengths(u: R, v: R, between: R) -> Self {
        let (large, small) = (u.max(v), u.min(v));
        let (a, rest) = (large.max(between), large.min(between));
        let (b, c) = (rest.max(small), rest.min(small));
        let square = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
        let half = R::from_f64(0.5);
        Metric {
            uu: u * u,
            uv: (u * u + v * v - between * between) * half,
            vv: v * v,
            double_area: if square > R::ZERO { square.sqrt() * half } else { R::ZERO },
        }
    }

    /// Area of the triangle.
    pub fn area(&self) -> R {
        self.double_area * R::from_f64(0.5)
    }

    /// The edges u and v laid into the plane, counter-clockwise: `u = (l, 0)`, `v = (u.v / l, double_area / l)` with `l = sqrt(u.u)`.
    ///
    /// Errors: `Degenerate` when twice the area is not above `eps (u.u + v.v)`. Panics: never.
    pub fn edges(&self) -> Result<[[R; 2]; 2], Error> {
        if !(self.double_area > R::EPSILON * (self.uu + self.vv)) {
            return Err(Error::Degenerate);
        }
        let length = self.uu.sqrt();
        Ok([[length, R::ZERO], [self.uv / length, self.double_area / length]])
    }

    /// Jacobian of the linear map to another triangle, in the frames of [`Metric::edges`]: [`jacobian`] of both. It never folds: whether the map
    /// does cannot be told from lengths.
    ///
    /// Errors: `Degenerate` as for [`Metric::edges`], of either. Panics: never.
    pub fn jacobian_to(&self, image: &Metric<R>) -> Result<Matrix2<R>, Error> {
        jacobian(self.edges()?, image.edges()?)
    }
}

/// Jacobian `[u' v'] [u v]^-1` of the linear map that carries the edges u, v of a triangle to u', v', all in tangent coordinates (logarithms at the
/// first corners).
///
/// Order of operations: `det = u_x v_y - u_y v_x`; row by row `(u' v_y - v' u_y) / det` and `(v' u_x - u' v_x) / det`.
/// Errors: `Degenerate` when the magnitude of det is not above `eps (|u|^2 + |v|^2)`. Panics: never.
pub fn jacobian<R: Real>([u, v]: [[R; 2]; 2], [to_u, to_v]: [[R; 2]; 2]) -> Result<Matrix2<R>, Error> {
    let determinant = u[0] * v[1] - u[1] * v[0];
    let size = u[0] * u[0] + u[1] * u[1] + (v[0] * v[0] + v[1] * v[1]);
    if !(determinant.abs() > R::EPSILON * size) {
        return Err(Error::Degenerate);
    }
    let row = |u_to: R, v_to: R| [(u_to * v[1] - v_to * u[1]) / determinant, (v_to * u[0] - u_to * v[0]) / determinant];
    Ok([row(to_u[0], to_v[0]), row(to_u[1], to_v[1])])
}
