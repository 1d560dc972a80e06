//! Measures of one Jacobian of a map between tangent planes (eq. 3.4), and the conversion of tolerances.

use crate::Real;

/// A 2 x 2 matrix by rows.
pub type Matrix2<R> = [[R; 2]; 2];

/// Green's strain `(J^T J - I) / 2` as xx, xy, yy.
///
/// Order of operations: `xx = (a a + c c - 1) / 2`, `xy = (a b + c d) / 2`, `yy = (b b + d d - 1) / 2` for the rows (a, b), (c, d). Panics: never.
pub fn green_strain<R: Real>(&[[a, b], [c, d]]: &Matrix2<R>) -> [R; 3] {
    [a * a + c * c - R::ONE, a * b + c * d, b * b + d * d - R::ONE].map(|value| value * R::from_f64(0.5))
}

/// Eq. 3.4: `|J^T J - I|^2` in the Frobenius norm, four times that of [`green_strain`].
///
/// `4 (xx xx + 2 (xy xy) + yy yy)`, from the left. A scale s gives `2 (s^2 - 1)^2`. Panics: never.
pub fn local<R: Real>(jacobian: &Matrix2<R>) -> R {
    let [xx, xy, yy] = green_strain(jacobian);
    R::from_f64(4.0) * (xx * xx + R::from_f64(2.0) * (xy * xy) + yy * yy)
}

/// What a map does to lengths, areas, angles and sides at one point, from the singular values of its Jacobian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distortion<R> {
    /// Largest factor of a length, `s_1`.
    pub longest: R,
    /// Smallest factor of a length, `s_2`; negative when the determinant is.
    pub shortest: R,
}

impl<R: Real> Distortion<R> {
    /// Of a Jacobian with the rows (a, b), (c, d): `Q = sqrt((a+d)^2 + (c-b)^2)`, `P = sqrt((a-d)^2 + (c+b)^2)`, `longest = (Q + P) / 2`, `shortest = (Q - P) / 2`.
    ///
    /// Accuracy: 4 eps of `longest` (test `singular_values_as_by_another_library`). Panics: never.
    pub fn of(&[[a, b], [c, d]]: &Matrix2<R>) -> Self {
        let root = |x: R, y: R| (x * x + y * y).sqrt() * R::from_f64(0.5);
        let (q, p) = (root(a + d, c - b), root(a - d, c + b));
        Distortion { longest: q + p, shortest: q - p }
    }

    /// `max(s_1, 1 / s_2) - 1`: 0 for an isometry, infinite where a direction vanishes.
    pub fn stretch(&self) -> R {
        self.longest.max(R::ONE / self.shortest.abs()) - R::ONE
    }

    /// Factor of areas, `s_1 s_2`.
    pub fn area(&self) -> R {
        self.longest * self.shortest.abs()
    }

    /// Distortion of angles, `s_1 / s_2`: 1 for a conformal map, infinite where a direction vanishes; NaN where both do.
    pub fn angle(&self) -> R {
        self.longest / self.shortest.abs()
    }

    /// Whether the map turns the surface over here: the sign of the determinant is not the one of a map that reverses orientation (`reverses`) or not.
    pub fn folds(&self, reverses: bool) -> bool {
        if reverses { self.shortest > R::ZERO } else { self.shortest < R::ZERO }
    }
}

/// The tolerance for eq. 3.4 that belongs to a relative one `nu` of lengths (eq. 3.2): `8 nu nu`, the first term of `2 ((1 + nu)^2 - 1)^2`.
pub fn local_of_relative<R: Real>(nu: R) -> R {
    R::from_f64(8.0) * nu * nu
}

/// The inverse of [`local_of_relative`]: `sqrt(nu / 8)`.
pub fn relative_of_local<R: Real>(nu: R) -> R {
    (nu / R::from_f64(8.0)).sqrt()
}
