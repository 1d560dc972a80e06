//! Rotations and similarity transforms.

use super::number::Number;

/// A 3 x 3 matrix by rows.
pub type Matrix<R> = [[R; 3]; 3];

/// Rodrigues' formula.
pub fn rotation_matrix<R: Number>([x, y, z]: [R; 3]) -> Matrix<R> {
    let (one, half) = (R::of(1.0), R::of(0.5));
    let square = x * x + y * y + z * z;
    let threshold = R::EPSILON.sqrt().sqrt() * half;
    let (f, g) = if square < threshold {
        let f = one - square * (R::of(1.0 / 6.0) - square * R::of(1.0 / 120.0));
        let g = half - square * (R::of(1.0 / 24.0) - square * R::of(1.0 / 720.0));
        (f, g)
    } else {
        let angle = square.sqrt();
        let h = (angle * half).sin();
        (angle.sin() / angle, (h + h) * h / square)
    };
    let mut m = [[one; 3]; 3];
    m[0][0] = one - (g * y * y + g * z * z);
    m[1][1] = one - (g * x * x + g * z * z);
    m[2][2] = one - (g * x * x + g * y * y);
    m[0][1] = g * x * y - f * z;
    m[1][0] = g * x * y + f * z;
    m[0][2] = g * x * z + f * y;
    m[2][0] = g * x * z - f * y;
    m[1][2] = g * y * z - f * x;
    m[2][1] = g * y * z + f * x;
    m
}

fn dot<R: Number>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn column<R: Number>(m: &Matrix<R>, k: usize) -> [R; 3] {
    [m[0][k], m[1][k], m[2][k]]
}

/// `x -> s R x + t`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub struct Placement<R> {
    pub scale: R,
    pub rotation: Matrix<R>,
    pub translation: [R; 3],
}

impl<R: Number> Placement<R> {
    /// Nothing moves.
    pub fn identity() -> Self {
        let (o, l) = (R::of(0.0), R::of(1.0));
        Placement { scale: l, rotation: [[l, o, o], [o, l, o], [o, o, l]], translation: [o; 3] }
    }

    /// Scale, rotation by rows, translation.
    pub fn numbers(&self) -> Vec<R> {
        let rotation = self.rotation.iter().flatten().copied();
        [self.scale].into_iter().chain(rotation).chain(self.translation).collect()
    }

    /// `s R x + t`.
    pub fn applied(&self, x: [R; 3]) -> [R; 3] {
        [0, 1, 2].map(|k| self.scale * dot(self.rotation[k], x) + self.translation[k])
    }

    /// `R^T (x - t) / s`.
    pub fn inverse_applied(&self, x: [R; 3]) -> [R; 3] {
        let shifted = [0, 1, 2].map(|k| x[k] - self.translation[k]);
        self.inverse_rotated(shifted).map(|value| value / self.scale)
    }

    /// `R^T d`.
    pub fn inverse_rotated(&self, d: [R; 3]) -> [R; 3] {
        [0, 1, 2].map(|k| dot(column(&self.rotation, k), d))
    }

    /// The transform after a motion of the model in its own frame.
    pub fn moved(&self, rotation: [R; 3], translation: [R; 3], log_scale: R) -> Self {
        let turn = rotation_matrix(rotation);
        let turned = [0, 1, 2].map(|i| [0, 1, 2].map(|j| dot(self.rotation[i], column(&turn, j))));
        let shift = [0, 1, 2].map(|i| dot(self.rotation[i], translation));
        Placement {
            scale: self.scale * log_scale.exp(),
            rotation: orthonormal(turned),
            translation: [0, 1, 2].map(|k| self.translation[k] + self.scale * shift[k]),
        }
    }
}

/// Gram-Schmidt over the first two rows; the third is their cross product.
fn orthonormal<R: Number>(m: Matrix<R>) -> Matrix<R> {
    let unit = |v: [R; 3]| {
        let length = dot(v, v).sqrt();
        v.map(|value| value / length)
    };
    let a = unit(m[0]);
    let along = dot(a, m[1]);
    let b = unit([0, 1, 2].map(|k| m[1][k] - along * a[k]));
    [a, b, [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]]
}
