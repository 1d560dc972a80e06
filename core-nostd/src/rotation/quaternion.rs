//! Unit quaternions and dual quaternions, `[w, x, y, z]`.

use crate::Real;

/// A quaternion: real part, then the imaginary parts.
pub type Quaternion<R> = [R; 4];

/// The rotation by the rotation vector `v` (radians), with a real part that is not negative.
///
/// Order of operations: `q = xx + yy + zz`. Where `q` is below half the fourth root of eps, the factor of `v` is `1/2 - q (1/48 - q/3840)` and the real part
/// `1 - q (1/8 - q/384)`, the divisions by numbers being products with their rounded inverses; elsewhere `sin(a/2) / a` and `cos(a/2)` with `a = sqrt(q)`. All
/// four are negated when the real part is below zero.
/// Panics: never.
pub fn rotation_quaternion<R: Real>(v: [R; 3]) -> Quaternion<R> {
    let [x, y, z] = v;
    let square = x * x + y * y + z * z;
    let (real, factor) = if square < R::EPSILON.sqrt().sqrt() * R::from_f64(0.5) {
        (
            R::ONE - square * (R::from_f64(1.0 / 8.0) - square * R::from_f64(1.0 / 384.0)),
            R::from_f64(0.5) - square * (R::from_f64(1.0 / 48.0) - square * R::from_f64(1.0 / 3840.0)),
        )
    } else {
        let angle = square.sqrt();
        let half = angle * R::from_f64(0.5);
        (half.cos(), half.sin() / angle)
    };
    let all = [real, factor * x, factor * y, factor * z];
    if real < R::ZERO { all.map(|value| -value) } else { all }
}

/// Hamilton's product `a b`: `b` is applied first.
///
/// Order of operations: each part sums from the left, the product with the real part of `a` first:
/// `((aw bx + ax bw) + ay bz) - az by` and cyclic, `((aw bw - ax bx) - ay by) - az bz`.
#[inline(always)]
pub fn quaternion_product<R: Real>([aw, ax, ay, az]: Quaternion<R>, [bw, bx, by, bz]: Quaternion<R>) -> Quaternion<R> {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by + ay * bw + az * bx - ax * bz,
        aw * bz + az * bw + ax * by - ay * bx,
    ]
}

/// The dual part `1/2 (0, t) r` of the motion that rotates by `r`, then moves by `t`: [`quaternion_product`] with a real part of zero, each part halved.
#[inline(always)]
pub fn dual_part<R: Real>(r: Quaternion<R>, t: [R; 3]) -> Quaternion<R> {
    let half = R::from_f64(0.5);
    quaternion_product([R::ZERO, t[0], t[1], t[2]], r).map(|value| half * value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::axis_angle::{applied, rotation_matrix};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn turns_as_the_matrix_does(v in proptest::array::uniform3(-5.0f64..5.0), u in proptest::array::uniform3(-1.0f64..1.0), p in proptest::array::uniform3(-9.0f64..9.0), small in 0.0f64..1.0) {
            let v = v.map(|value| small * value);
            let (q, o) = (rotation_quaternion(v), rotation_quaternion(u));
            prop_assert!(q[0] >= 0.0);
            let both = quaternion_product(q, o);
            let conjugate = [both[0], -both[1], -both[2], -both[3]];
            let turned = quaternion_product(quaternion_product(both, [0.0, p[0], p[1], p[2]]), conjugate);
            let expected = applied(&rotation_matrix(v), applied(&rotation_matrix(u), p));
            for axis in 0..3 {
                prop_assert!((turned[axis + 1] - expected[axis]).abs() < 1e-12);
            }
        }
    }
}
