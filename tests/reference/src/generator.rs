//! What the fits and the vectors ask of a model of any kind.

use super::bilinear::{Bilinear, Linearised, value_of_prepared};
use super::linear::Linear;
use super::skinned::{FixedIdentity, Skinned};
use super::stored_bilinear::StoredBilinear;

/// A model: positions and derivatives of its vertices.
pub trait Generator: std::fmt::Debug {
    /// Number of vertices.
    fn n(&self) -> usize;
    /// Vertices that have numbers: those that fill up the last block too, where they are not simply zero.
    fn lanes(&self) -> usize;
    /// Number of identity weights and of pose weights.
    fn dims(&self) -> (usize, usize);
    /// Position and derivatives.
    fn linearised(&self, x: &[f32], y: &[f32], v: usize) -> Linearised;
    /// Position.
    fn value(&self, x: &[f32], y: &[f32], v: usize) -> [f32; 3];
    /// Position and derivatives by the pose weights of the form with the identity fixed.
    fn identity_fixed(&self, x: &[f32], y: &[f32], v: usize) -> Linearised;
    /// Position and derivatives by the identity weights of the form with the pose fixed.
    fn pose_fixed(&self, x: &[f32], y: &[f32], v: usize) -> Linearised;

    /// Derivatives of an energy by the weights from those by the positions, `g`.
    fn gradient(&self, x: &[f32], y: &[f32], g: &[[f32; 3]]) -> Vec<f32> {
        by_jacobian(x.len() + y.len(), g, |v| self.linearised(x, y, v))
    }
}

/// `(x x' + y y') + z z'`.
pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

/// `J^T g`.
fn by_jacobian(dim: usize, g: &[[f32; 3]], slope: impl Fn(usize) -> Linearised) -> Vec<f32> {
    let slopes: Vec<Linearised> = (0..g.len()).map(slope).collect();
    (0..dim).map(|k| by_lanes(g.len(), |v| dot(slopes[v].derivatives[k], g[v]))).collect()
}

/// What vertices add, summed by their places in the blocks, then over the places.
pub fn by_lanes(n: usize, of: impl Fn(usize) -> f32) -> f32 {
    let mut lanes = [0.0; 16];
    for v in 0..n {
        lanes[v % 16] += of(v);
    }
    lanes.iter().fold(0.0, |sum, lane| sum + lane)
}

/// An offset and columns at the free weights.
fn of_columns(form: Linearised, weights: &[f32]) -> Linearised {
    Linearised { value: value_of_prepared(&form, weights), ..form }
}

impl Generator for Bilinear {
    fn n(&self) -> usize {
        self.offset.len()
    }

    fn lanes(&self) -> usize {
        self.offset.len()
    }

    fn dims(&self) -> (usize, usize) {
        Bilinear::dims(self)
    }

    fn linearised(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        Bilinear::linearised(self, x, y, v)
    }

    fn value(&self, x: &[f32], y: &[f32], v: usize) -> [f32; 3] {
        Bilinear::value(self, x, y, v)
    }

    fn identity_fixed(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        of_columns(self.with_identity(x, v), y)
    }

    fn pose_fixed(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        of_columns(self.with_pose(y, v), x)
    }
}

impl Generator for StoredBilinear {
    fn n(&self) -> usize {
        self.counts().0
    }

    fn lanes(&self) -> usize {
        self.counts().1
    }

    fn dims(&self) -> (usize, usize) {
        (self.head().identity_dim, self.head().pose_dim)
    }

    fn linearised(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        StoredBilinear::linearised(self, x, y, v)
    }

    fn value(&self, x: &[f32], y: &[f32], v: usize) -> [f32; 3] {
        StoredBilinear::linearised(self, x, y, v).value
    }

    fn identity_fixed(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        of_columns(self.with_identity(x, v), y)
    }

    fn pose_fixed(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        of_columns(self.with_pose(y, v), x)
    }
}

impl Generator for Linear {
    fn n(&self) -> usize {
        self.n
    }

    fn lanes(&self) -> usize {
        self.mean.len()
    }

    fn dims(&self) -> (usize, usize) {
        (self.components.len(), 0)
    }

    fn linearised(&self, x: &[f32], _: &[f32], v: usize) -> Linearised {
        Linear::linearised(self, x, v)
    }

    fn value(&self, x: &[f32], _: &[f32], v: usize) -> [f32; 3] {
        Linear::value(self, x, v)
    }

    fn identity_fixed(&self, _: &[f32], _: &[f32], _: usize) -> Linearised {
        panic!("a linear model has one group of weights");
    }

    fn pose_fixed(&self, _: &[f32], _: &[f32], _: usize) -> Linearised {
        panic!("a linear model has one group of weights");
    }
}

impl Generator for Skinned {
    fn n(&self) -> usize {
        self.rest.n
    }

    fn lanes(&self) -> usize {
        self.rest.mean.len()
    }

    fn dims(&self) -> (usize, usize) {
        (self.rest.components.len(), self.skeleton.pose_dim())
    }

    fn linearised(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        Skinned::linearised(self, x, y, v)
    }

    fn value(&self, x: &[f32], y: &[f32], v: usize) -> [f32; 3] {
        Skinned::value(self, x, y, v)
    }

    fn identity_fixed(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        FixedIdentity::new(self, x).linearised(y, v)
    }

    fn pose_fixed(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        of_columns(self.with_pose(y, v), x)
    }

    fn gradient(&self, x: &[f32], y: &[f32], g: &[[f32; 3]]) -> Vec<f32> {
        if self.dual || !self.corrective.is_empty() {
            return by_jacobian(x.len() + y.len(), g, |v| self.linearised(x, y, v));
        }
        self.gradient_by_wrenches(x, y, g)
    }
}
