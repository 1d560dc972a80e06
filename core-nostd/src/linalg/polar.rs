//! Polar factors of 3 x 3 matrices: the nearest rotation, and the stretch that is left.

use super::svd3::{Svd3, cross, svd3, transposed};
use crate::rotation::axis_angle::{Matrix3, product};
use crate::{Error, Real};

/// Whether [`polar`] found the only nearest rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nearest {
    /// The only one, of a matrix that does not reflect.
    Rotation,
    /// The only one, of a matrix that reflects: the stretch has a negative eigenvalue.
    OfReflection,
    /// One of several: the matrix is zero or of rank 1, or reflects and its two smallest singular values are equal, to rounding.
    Open,
}

/// `A = R S` with a rotation R and a symmetric S.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polar<R> {
    /// The rotation nearest to A in the Frobenius norm.
    pub rotation: Matrix3<R>,
    /// `R^T A`, symmetric to the last bit; positive semidefinite unless A reflects.
    pub stretch: Matrix3<R>,
    /// Whether the rotation is determined by A.
    pub nearest: Nearest,
}

/// The nearest rotation to `a` (rows) and the symmetric stretch that is left.
///
/// With `A = U S V^T` and d the sign of the determinant of U: `R = U diag(1, 1, d) V^T`, `stretch = V diag(s_0, s_1, d s_2) V^T`. It is open when
/// `s_1 + d s_2 <= 16 eps s_0`: within rounding another rotation is as near. Sums over k ascending; the entries of the stretch are
/// `v_ik v_jk` times the singular value, for j >= i, and mirrored.
///
/// Source: N. J. Higham, Computing the polar decomposition, 1986; the sign is that of S. Umeyama, 1991.
/// Cost: [`svd3`] and 60 multiplications. Accuracy: `|A - R S| <= 16 eps |A|`, R orthogonal to 16 eps (test `random_matrices`; 12 in 200 000 matrices).
/// Errors: those of [`svd3`]. Panics: never.
pub fn polar<R: Real>(a: &Matrix3<R>) -> Result<Polar<R>, Error> {
    let Svd3 { u, singular: [s0, s1, s2], v } = svd3(a)?;
    let [u0, u1, u2] = transposed(&u);
    let [x, y, z] = cross(u0, u1);
    let reflects = x * u2[0] + y * u2[1] + z * u2[2] < R::ZERO;
    let (u2, s2) = if reflects { (u2.map(|x| -x), -s2) } else { (u2, s2) };
    let right = transposed(&v);
    let rotation = product(&transposed(&[u0, u1, u2]), &right);
    let entry = |[x0, x1, x2]: [R; 3], [y0, y1, y2]: [R; 3]| x0 * y0 * s0 + x1 * y1 * s1 + x2 * y2 * s2;
    let [a, b, c] = v;
    let (ab, ac, bc) = (entry(a, b), entry(a, c), entry(b, c));
    let stretch = [[entry(a, a), ab, ac], [ab, entry(b, b), bc], [ac, bc, entry(c, c)]];
    let nearest = if !(s1 + s2 > R::from_f64(16.0) * R::EPSILON * s0) {
        Nearest::Open
    } else if reflects {
        Nearest::OfReflection
    } else {
        Nearest::Rotation
    };
    Ok(Polar { rotation, stretch, nearest })
}
