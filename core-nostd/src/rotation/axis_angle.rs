//! Rotation matrices from rotation vectors (axis times angle, radians).

use crate::Real;

/// A 3 x 3 matrix by rows.
pub type Matrix3<R> = [[R; 3]; 3];

/// The rotation about the axis `v / |v|` by the angle `|v|` (Rodrigues' formula), `v` in radians.
///
/// `R = I + sin(a)/a [v]x + (1 - cos(a))/a^2 [v]x^2`; near zero the factors come from their series, so that the result is smooth there.
///
/// Order of operations: `q = xx + yy + zz`. Where `q` is below half the fourth root of eps, `f = 1 - q (1/6 - q/120)` and
/// `g = 1/2 - q (1/24 - q/720)`, the divisions by numbers being products with their rounded inverses; elsewhere `a = sqrt(q)`, `h = sin(a/2)`,
/// `f = sin(a) / a` and `g = (h + h) h / q`. The diagonal is `1 - (g y y + g z z)` (and cyclic), the entries beside it `g x y -+ f z`, with `g`
/// multiplied first.
///
/// Accuracy: `R R^T = I + (2 c - s^2 - c^2 a^2) [v]x^2` for the computed factors s and c, so an error e of `c a^2` enters at most four times. With
/// `|e| <= 3.5 eps` (two sines, three products, a quotient, the square of the angle) and the roundings of the entries that is at most 20 eps per entry
/// (test `orthonormal`). Panics: never; a non-finite vector gives a non-finite matrix.
pub fn rotation_matrix<R: Real>(v: [R; 3]) -> Matrix3<R> {
    let [x, y, z] = v;
    let square = x * x + y * y + z * z;
    let angle = square.sqrt();
    // The series' next terms, a^6/5040 and a^6/40320, are below eps there.
    let (first, second) = if square < R::EPSILON.sqrt().sqrt() * R::from_f64(0.5) {
        (
            R::ONE - square * (R::from_f64(1.0 / 6.0) - square * R::from_f64(1.0 / 120.0)),
            R::from_f64(0.5) - square * (R::from_f64(1.0 / 24.0) - square * R::from_f64(1.0 / 720.0)),
        )
    } else {
        // 1 - cos a = 2 sin^2(a/2) does not cancel.
        let half = (angle * R::from_f64(0.5)).sin();
        (angle.sin() / angle, (half + half) * half / square)
    };
    let (sx, sy, sz) = (first * x, first * y, first * z);
    let (xx, yy, zz) = (second * x * x, second * y * y, second * z * z);
    let (xy, xz, yz) = (second * x * y, second * x * z, second * y * z);
    [
        [R::ONE - (yy + zz), xy - sz, xz + sy],
        [xy + sz, R::ONE - (xx + zz), yz - sx],
        [xz - sy, yz + sx, R::ONE - (xx + yy)],
    ]
}

/// The left Jacobian of the rotation group at `v`: a small change `d` of the rotation vector turns by `J d` behind the rotation, so that
/// `dR = [J d]x R`.
///
/// `J = I + (1 - cos a)/a^2 [v]x + (a - sin a)/a^3 [v]x^2`.
///
/// Order of operations: `q`, `f` and `g` as in [`rotation_matrix`]; `h = 1/6 - q (1/120 - q/5040)` where the series are used, elsewhere `(1 - f) / q`;
/// with `c = 1 - h q`, the diagonal is `c + h x x`, the entries beside it `h x y -+ g z`, with `h` multiplied first.
/// Accuracy: 4e-7 per entry in `f32` for angles to 10 (test `left_jacobian_matches_differences`). Panics: never.
pub fn left_jacobian<R: Real>(v: [R; 3]) -> Matrix3<R> {
    let [x, y, z] = v;
    let square = x * x + y * y + z * z;
    let (second, third) = if square < R::EPSILON.sqrt().sqrt() * R::from_f64(0.5) {
        (
            R::from_f64(0.5) - square * (R::from_f64(1.0 / 24.0) - square * R::from_f64(1.0 / 720.0)),
            R::from_f64(1.0 / 6.0) - square * (R::from_f64(1.0 / 120.0) - square * R::from_f64(1.0 / 5040.0)),
        )
    } else {
        let angle = square.sqrt();
        let half = (angle * R::from_f64(0.5)).sin();
        ((half + half) * half / square, (R::ONE - angle.sin() / angle) / square)
    };
    let rest = R::ONE - third * square;
    let (sx, sy, sz) = (second * x, second * y, second * z);
    let (xy, xz, yz) = (third * x * y, third * x * z, third * y * z);
    [
        [rest + third * x * x, xy - sz, xz + sy],
        [xy + sz, rest + third * y * y, yz - sx],
        [xz - sy, yz + sx, rest + third * z * z],
    ]
}

/// `a b`.
#[inline]
pub fn product<R: Real>([a, b, c]: &Matrix3<R>, right: &Matrix3<R>) -> Matrix3<R> {
    [transpose_applied(right, *a), transpose_applied(right, *b), transpose_applied(right, *c)]
}

/// `a x`.
#[inline(always)]
pub fn applied<R: Real>([a, b, c]: &Matrix3<R>, [x, y, z]: [R; 3]) -> [R; 3] {
    // Written out: `map` is a call where the compiler does not inline it.
    let row = |[p, q, r]: [R; 3]| p * x + q * y + r * z;
    [row(*a), row(*b), row(*c)]
}

/// `a^T x`.
#[inline(always)]
pub fn transpose_applied<R: Real>([a, b, c]: &Matrix3<R>, [x, y, z]: [R; 3]) -> [R; 3] {
    [a[0] * x + b[0] * y + c[0] * z, a[1] * x + b[1] * y + c[1] * z, a[2] * x + b[2] * y + c[2] * z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn left_jacobian_matches_differences(x in -6.0f64..6.0, y in -6.0f64..6.0, z in -6.0f64..6.0, size in 0.0f64..1.0) {
            let v = [size * x, size * y, size * z];
            let (rotation, jacobian) = (rotation_matrix(v), left_jacobian(v));
            let single = left_jacobian(v.map(|value| value as f32));
            for k in 0..3 {
                let moved = |step: f64| { let mut v = v; v[k] += step; rotation_matrix(v) };
                let (above, below) = (moved(1e-5), moved(-1e-5));
                // dR R^T = [J e_k]x.
                for (row, column, entry, sign) in [(2, 1, 0, 1.0), (0, 2, 1, 1.0), (1, 0, 2, 1.0), (1, 2, 0, -1.0)] {
                    let turn: f64 = (0..3).map(|m| (above[row][m] - below[row][m]) / 2e-5 * rotation[column][m]).sum();
                    prop_assert!((sign * turn - jacobian[entry][k]).abs() < 1e-9, "{turn} {}", jacobian[entry][k]);
                    prop_assert!((f64::from(single[entry][k]) - jacobian[entry][k]).abs() < 4e-7);
                }
            }
        }
    }

    #[test]
    fn quarter_turn_about_z() {
        let turned = applied(&rotation_matrix([0.0, 0.0, core::f64::consts::FRAC_PI_2]), [1.0, 2.0, 3.0]);
        assert!((turned[0] + 2.0).abs() < 1e-15 && (turned[1] - 1.0).abs() < 1e-15 && turned[2] == 3.0);
    }

    #[test]
    fn series_meets_formula() {
        for (angle, tolerance) in [(0.0079f64, 1e-16), (0.0096, 1e-16)] {
            let m = rotation_matrix([angle, 0.0, 0.0]);
            assert!((m[2][1] - angle.sin()).abs() < tolerance && (m[1][1] - angle.cos()).abs() < 2.0 * tolerance);
        }
    }

    proptest! {
        #[test]
        fn orthonormal(x in -9.0f32..9.0, y in -9.0f32..9.0, z in -9.0f32..9.0, shrink in 0i32..12) {
            let factor = 0.5f32.powi(2 * shrink);
            let m = rotation_matrix([x * factor, y * factor, z * factor]);
            // In f64, so that only the matrix is measured, not the product.
            let wide = m.map(|row| row.map(f64::from));
            let transposed = [0, 1, 2].map(|i| wide.map(|row| row[i]));
            for (i, row) in product(&wide, &transposed).iter().enumerate() {
                for (j, &entry) in row.iter().enumerate() {
                    let expected = f64::from(u8::from(i == j));
                    prop_assert!((entry - expected).abs() <= 20.0 * f64::from(f32::EPSILON));
                }
            }
            let image = applied(&m, [x, y, z]);
            prop_assert!((image[0] - x).abs() + (image[1] - y).abs() + (image[2] - z).abs() < 3e-5);
        }
    }
}
