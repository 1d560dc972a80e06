//! Unit quaternions and dual quaternions, `[w, x, y, z]`.

use super::number::Number;

/// Real part, then the imaginary parts.
pub type Quaternion<R> = [R; 4];

/// The rotation by a rotation vector.
pub fn rotation_quaternion<R: Number>([x, y, z]: [R; 3]) -> Quaternion<R> {
    let q = x * x + y * y + z * z;
    let (one, half) = (R::of(1.0), R::of(0.5));
    let threshold = half * R::EPSILON.sqrt().sqrt();
    let (real, factor) = if q < threshold {
        let real = one - q * (R::of(1.0 / 8.0) - q * R::of(1.0 / 384.0));
        (real, half - q * (R::of(1.0 / 48.0) - q * R::of(1.0 / 3840.0)))
    } else {
        let a = q.sqrt();
        ((a * half).cos(), (a * half).sin() / a)
    };
    let all = [real, factor * x, factor * y, factor * z];
    if real < R::of(0.0) { all.map(|part| -part) } else { all }
}

/// Hamilton's product.
pub fn product<R: Number>(a: Quaternion<R>, b: Quaternion<R>) -> Quaternion<R> {
    let imaginary = |i: usize, j: usize, k: usize| ((a[0] * b[i] + a[i] * b[0]) + a[j] * b[k]) - a[k] * b[j];
    [
        ((a[0] * b[0] - a[1] * b[1]) - a[2] * b[2]) - a[3] * b[3],
        imaginary(1, 2, 3),
        imaginary(2, 3, 1),
        imaginary(3, 1, 2),
    ]
}

/// `1/2 (0, t) r`.
pub fn dual_part<R: Number>(r: Quaternion<R>, t: [R; 3]) -> Quaternion<R> {
    product([R::of(0.0), t[0], t[1], t[2]], r).map(|part| R::of(0.5) * part)
}
