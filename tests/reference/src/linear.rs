//! Equation 9.1 vertex by vertex: `v = mean + sum_l w_l a_l`.

use super::bilinear::Linearised;
use super::number::Number;
use super::storage::{Sum, Term};

/// A linear model.
#[derive(Debug, Clone)]
pub struct Linear {
    /// Number of vertices.
    pub n: usize,
    /// Per vertex, filled up with zeros.
    pub mean: Vec<[f32; 3]>,
    /// `a_l`: per weight.
    pub components: Vec<Term>,
}

impl Linear {
    /// `mean + sum`, the sum over the components and then over the corrective terms.
    pub fn corrected<R: Number>(&self, z: &[R], corrective: &[Term], f: &[R], v: usize) -> [R; 3] {
        let mut sum = Sum::zero();
        for (component, &z) in self.components.iter().zip(z) {
            sum.add(component, v, z);
        }
        for (term, &f) in corrective.iter().zip(f) {
            sum.add(term, v, f);
        }
        let total = sum.total();
        [0, 1, 2].map(|axis| R::of(self.mean[v][axis].into()) + total[axis])
    }

    /// Position of vertex `v` at the weights `z`.
    pub fn value<R: Number>(&self, z: &[R], v: usize) -> [R; 3] {
        self.corrected(z, &[], &[], v)
    }

    /// Position and derivatives.
    pub fn linearised<R: Number>(&self, z: &[R], v: usize) -> Linearised<R> {
        let derivatives = self.components.iter().map(|component| component.decoded(v)).collect();
        Linearised { value: self.value(z, v), derivatives }
    }
}
