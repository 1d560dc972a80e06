//! Singular value decomposition of 3 x 3 matrices by one-sided Jacobi rotations.

use crate::rotation::axis_angle::Matrix3;
use crate::{Error, Real};

/// Sweeps after which the iteration gives up; it takes at most 6 in the tests.
const MAX_SWEEPS: u32 = 16;

/// `A = U diag(singular) V^T`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Svd3<R> {
    /// Orthogonal, its columns are the left singular vectors; a reflection when the determinant of A is negative, else a rotation.
    pub u: Matrix3<R>,
    /// Singular values in descending order, at least zero.
    pub singular: [R; 3],
    /// Rotation, its columns are the right singular vectors.
    pub v: Matrix3<R>,
}

impl<R: Real> Svd3<R> {
    /// Number of singular values above `tolerance` times the first one; 0 for a matrix of zeros.
    pub fn rank(&self, tolerance: R) -> u32 {
        let [first, ..] = self.singular;
        self.singular.iter().fold(0, |rank, &value| rank + u32::from(value > tolerance * first))
    }
}

/// The singular value decomposition of `a` (rows).
///
/// Source: M. R. Hestenes, Inversion of matrices by biorthogonalization, 1958, with the exchanges of P. P. M. de Rijk, 1989. The matrix is
/// divided by `s`, the [`Real::binade`] of its entry of largest magnitude, so that nothing overflows or underflows on the way. Each sweep
/// visits the columns (0,1), (0,2), (1,2). With `alpha = |b_p|^2`, `beta = |b_q|^2`, `gamma = b_p . b_q` (x, y, z ascending): where `alpha < beta` the columns
/// become `(b_q, -b_p)`, likewise those of V, which starts as the identity. A pair is skipped when `beta <= eps^4` or
/// `|gamma| <= 4 eps (sqrt(alpha) sqrt(beta))`; otherwise `zeta = (beta - alpha) / (2 gamma)`, `t = 1 / (|zeta| + sqrt(zeta^2 + 1))` with the sign of zeta (beyond
/// 1e15: `1 / (2 zeta)`), `c = 1 / sqrt(t^2 + 1)`, `s = t c`, and the columns become `c b_p - s b_q` and `s b_p + c b_q`. After a sweep that
/// neither rotated nor exchanged, the singular values are `s sqrt(|b_k|^2)` and the left vectors `b_k / sqrt(|b_k|^2)`. A column with `|b_k|^2 <= eps^4` counts as
/// zero; its left vector completes the others to a rotation: of three, the columns of the identity; of two, the cross product of the first with the axis
/// of its component of least magnitude (the first of equals), divided by its length; the third is the cross product of the others.
///
/// Cost: about 60 multiplications and two square roots a rotation, three rotations a sweep, 3 to 6 sweeps; no workspace.
/// Accuracy: `|A - U S V^T| <= 16 eps |A|`, `U` and `V` orthogonal to 16 eps (Frobenius norms, test `random_matrices`; 7 and 10 in 200 000 matrices); singular values that are small
/// because columns are small keep their relative accuracy, down to `eps^2` of the largest entry.
/// Errors: `NotFinite` with the entry of `a` that is not finite (row by row), or 9 when a singular value exceeds the largest number; `NotConverged`.
/// Panics: never.
pub fn svd3<R: Real>(a: &Matrix3<R>) -> Result<Svd3<R>, Error> {
    if let Some(index) = a.iter().flatten().position(|entry| !entry.is_finite()) {
        return Err(Error::NotFinite { index: crate::workspace::saturated(index) });
    }
    let largest = a.iter().flatten().fold(R::ZERO, |largest, entry| entry.abs().max(largest));
    let scale = if largest > R::ZERO { largest.binade() } else { R::ONE };
    let mut columns = transposed(&a.map(|row| row.map(|entry| entry / scale)));
    let mut right = identity();
    let mut sweeps = 0;
    loop {
        let [b0, b1, b2] = &mut columns;
        let [v0, v1, v2] = &mut right;
        let first = rotated([b0, b1], [v0, v1]);
        let second = rotated([b0, b2], [v0, v2]);
        let third = rotated([b1, b2], [v1, v2]);
        if !(first || second || third) {
            break;
        }
        sweeps += 1;
        if sweeps == MAX_SWEEPS {
            return Err(Error::NotConverged { iterations: MAX_SWEEPS });
        }
    }
    let [b0, b1, b2] = columns;
    let [(s0, u0), (s1, u1), (s2, u2)] = [unit(b0), unit(b1), unit(b2)];
    let singular = [s0 * scale, s1 * scale, s2 * scale];
    if !singular.iter().all(|value| value.is_finite()) {
        return Err(Error::NotFinite { index: 9 });
    }
    let left = if s0 == R::ZERO {
        identity()
    } else {
        let u1 = if s1 == R::ZERO { perpendicular(u0) } else { u1 };
        [u0, u1, if s2 == R::ZERO { cross(u0, u1) } else { u2 }]
    };
    Ok(Svd3 { u: transposed(&left), singular, v: transposed(&right) })
}

/// Orders two columns by length and makes them orthogonal; false when they were.
fn rotated<R: Real>([bp, bq]: [&mut [R; 3]; 2], [vp, vq]: [&mut [R; 3]; 2]) -> bool {
    let (mut alpha, mut beta) = (dot(bp, bp), dot(bq, bq));
    let exchanged = alpha < beta;
    if exchanged {
        core::mem::swap(&mut alpha, &mut beta);
        for (p, q) in [(&mut *bp, &mut *bq), (&mut *vp, &mut *vq)] {
            (*p, *q) = (*q, p.map(|x| -x));
        }
    }
    let gamma = dot(bp, bq);
    if beta <= negligible() || gamma.abs() <= R::from_f64(4.0) * R::EPSILON * (alpha.sqrt() * beta.sqrt()) {
        return exchanged;
    }
    let two = R::from_f64(2.0);
    let zeta = (beta - alpha) / (two * gamma);
    let t = if zeta.abs() > R::from_f64(1e15) {
        R::ONE / (two * zeta)
    } else {
        let root = R::ONE / (zeta.abs() + (zeta * zeta + R::ONE).sqrt());
        if zeta < R::ZERO { -root } else { root }
    };
    let c = R::ONE / (t * t + R::ONE).sqrt();
    let s = t * c;
    for (p, q) in [(bp, bq), (vp, vq)] {
        for (p, q) in p.iter_mut().zip(q) {
            (*p, *q) = (c * *p - s * *q, s * *p + c * *q);
        }
    }
    true
}

/// `eps^4`: the square of a length that counts as zero.
fn negligible<R: Real>() -> R {
    R::EPSILON * R::EPSILON * (R::EPSILON * R::EPSILON)
}

/// Length and direction of a column; zeros when it counts as zero.
fn unit<R: Real>(column: [R; 3]) -> (R, [R; 3]) {
    let square = dot(&column, &column);
    if square <= negligible() {
        return (R::ZERO, [R::ZERO; 3]);
    }
    let length = square.sqrt();
    (length, column.map(|x| x / length))
}

/// A unit vector at a right angle to one.
fn perpendicular<R: Real>(u: [R; 3]) -> [R; 3] {
    let [x, y, z] = u.map(R::abs);
    let axis = if x <= y && x <= z {
        [R::ONE, R::ZERO, R::ZERO]
    } else if y <= z {
        [R::ZERO, R::ONE, R::ZERO]
    } else {
        [R::ZERO, R::ZERO, R::ONE]
    };
    unit(cross(u, axis)).1
}

pub(super) fn dot<R: Real>([a, b, c]: &[R; 3], [x, y, z]: &[R; 3]) -> R {
    *a * *x + *b * *y + *c * *z
}

pub(crate) fn cross<R: Real>([a, b, c]: [R; 3], [x, y, z]: [R; 3]) -> [R; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

pub(super) fn transposed<R: Real>([a, b, c]: &Matrix3<R>) -> Matrix3<R> {
    [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]]
}

pub(super) fn identity<R: Real>() -> Matrix3<R> {
    let (zero, one) = (R::ZERO, R::ONE);
    [[one, zero, zero], [zero, one, zero], [zero, zero, one]]
}
