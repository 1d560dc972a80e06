//! Similarity transforms `x -> s R x + t`: where a model stands in the frame of a scan.

use super::axis_angle::{Matrix3, applied, product, rotation_matrix, transpose_applied};
use crate::Real;

/// A similarity transform: scale, rotation, translation (millimetres), acting on column vectors as `x -> s R x + t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity<R> {
    /// Factor of lengths, above zero.
    pub scale: R,
    /// Rotation matrix by rows.
    pub rotation: Matrix3<R>,
    /// Translation.
    pub translation: [R; 3],
}

impl<R: Real> Similarity<R> {
    /// The transform that moves nothing.
    pub const IDENTITY: Self = Similarity {
        scale: R::ONE,
        rotation: [[R::ONE, R::ZERO, R::ZERO], [R::ZERO, R::ONE, R::ZERO], [R::ZERO, R::ZERO, R::ONE]],
        translation: [R::ZERO; 3],
    };

    /// Where a point of the model lies in the scan: rotated (sums in the order x, y, z), scaled, then translated.
    #[inline(always)]
    pub fn applied(&self, point: [R; 3]) -> [R; 3] {
        let [x, y, z] = applied(&self.rotation, point);
        let [a, b, c] = self.translation;
        [self.scale * x + a, self.scale * y + b, self.scale * z + c]
    }

    /// Where a point of the scan lies in the frame of the model: translated back, rotated back, then divided by the scale.
    #[inline(always)]
    pub fn inverse_applied(&self, [x, y, z]: [R; 3]) -> [R; 3] {
        let [a, b, c] = self.translation;
        transpose_applied(&self.rotation, [x - a, y - b, z - c]).map(|value| value / self.scale)
    }

    /// A direction of the scan in the frame of the model: rotated back, not scaled.
    #[inline(always)]
    pub fn inverse_rotated(&self, direction: [R; 3]) -> [R; 3] {
        transpose_applied(&self.rotation, direction)
    }

    /// This transform after a small motion of the model in its own frame: `self o (x -> exp(log_scale) exp([rotation]x) x + translation)`.
    ///
    /// The rotation is made orthonormal again, so that a long sequence of steps does not drift: the first row is divided by its length, the
    /// second loses its part along the first and is divided by its length, the third is their cross product. The translation becomes
    /// `t + s (R translation)`, with the scale before the step.
    pub fn moved(&self, rotation: [R; 3], translation: [R; 3], log_scale: R) -> Self {
        let turned = applied(&self.rotation, translation);
        let [a, b, c] = self.translation;
        Similarity {
            scale: self.scale * log_scale.exp(),
            rotation: orthonormal(product(&self.rotation, &rotation_matrix(rotation))),
            translation: [a + self.scale * turned[0], b + self.scale * turned[1], c + self.scale * turned[2]],
        }
    }

    /// All numbers finite and the scale above zero.
    pub fn is_finite(&self) -> bool {
        let sum = self.rotation.iter().flatten().chain(&self.translation).all(|value| value.is_finite());
        sum && self.scale.is_finite() && self.scale > R::ZERO
    }
}

/// One Gram-Schmidt pass over the rows; the third is the product of the others.
fn orthonormal<R: Real>([a, b, _]: Matrix3<R>) -> Matrix3<R> {
    let dot = |u: [R; 3], v: [R; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let unit = |v: [R; 3]| {
        let length = dot(v, v).sqrt();
        v.map(|value| value / length)
    };
    let a = unit(a);
    let along = dot(a, b);
    let b = unit([b[0] - along * a[0], b[1] - along * a[1], b[2] - along * a[2]]);
    [a, b, [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_is_composing() {
        let place =
            Similarity { scale: 2.0, rotation: rotation_matrix([0.3, -0.2, 0.5]), translation: [1.0, 2.0, 3.0] };
        let point = [0.7, -1.1, 0.4];
        let turned = applied(&rotation_matrix([0.1, 0.2, -0.1]), point).map(|x| 0.1f64.exp() * x);
        let expected = place.applied([turned[0] + 4.0, turned[1] + 5.0, turned[2] + 6.0]);
        let found = place.moved([0.1, 0.2, -0.1], [4.0, 5.0, 6.0], 0.1).applied(point);
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn inverse_undoes() {
        let place =
            Similarity { scale: 0.5, rotation: rotation_matrix([1.0, 2.0, -0.5]), translation: [10.0, -20.0, 30.0] };
        let back = place.inverse_applied(place.applied([3.0, 1.0, 4.0]));
        assert!((back[0] - 3.0f64).abs() + (back[1] - 1.0).abs() + (back[2] - 4.0).abs() < 1e-13);
    }

    #[test]
    fn many_steps_stay_orthonormal() {
        let mut place = Similarity::<f32>::IDENTITY;
        for _ in 0..10_000 {
            place = place.moved([0.01, -0.02, 0.03], [0.0; 3], 0.0);
        }
        for (i, row) in place.rotation.iter().enumerate() {
            for (j, other) in place.rotation.iter().enumerate() {
                let dot = row[0] * other[0] + row[1] * other[1] + row[2] * other[2];
                assert!((dot - if i == j { 1.0 } else { 0.0 }).abs() < 1e-6);
            }
        }
    }
}
