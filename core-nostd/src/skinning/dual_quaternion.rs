//! Dual-quaternion skinning: `b = sum_j s_j omega_j q_j`, `x = (r v r* + 2 d r*) / |r|^2` with `b = r + eps d`.
//!
//! Source: Kavan, Collins, Zara, O'Sullivan, Geometric skinning with approximate dual quaternion blending, 2008. The sign `s_j` brings `q_j` onto the side of
//! the quaternion of the vertex' strongest joint (the first of equals), because `q` and `-q` are the same motion.

use super::Holds;
use crate::generator::lanes::{Axes, Lanes};

/// Eight numbers of several vertices: rotation `[w, x, y, z]`, then the dual part.
pub(crate) type Dual<const N: usize> = [[f32; N]; 8];

/// The rotation of the strongest joint of each vertex.
#[inline(always)]
fn pivots<const N: usize, L: Lanes<N>>(lanes: L, holds: Holds<'_>, motions: &[[f32; 8]]) -> [[f32; N]; 4] {
    let mut strongest = [-1.0f32; N];
    let mut pivot = [[0.0; N]; 4];
    for (joint, weights) in holds.iter() {
        let Some(motion) = motions.get(joint) else { continue };
        let weights = lanes.weights(weights);
        for (part, value) in pivot.iter_mut().zip(motion) {
            for ((part, weight), strongest) in part.iter_mut().zip(weights).zip(strongest) {
                *part = if weight > strongest { *value } else { *part };
            }
        }
        for (strongest, weight) in strongest.iter_mut().zip(weights) {
            *strongest = if weight > *strongest { weight } else { *strongest };
        }
    }
    pivot
}

/// Calls `visit` with each joint and its signed weights; signs as said above, the scalar product summed w, x, y, z.
#[inline(always)]
pub(crate) fn signed_weights<const N: usize, L: Lanes<N>>(
    lanes: L,
    holds: Holds<'_>,
    motions: &[[f32; 8]],
    mut visit: impl FnMut(usize, &[f32; 8], [f32; N]),
) {
    let pivot = pivots(lanes, holds, motions);
    let [pw, px, py, pz] = &pivot;
    for (joint, weights) in holds.iter() {
        let Some(motion) = motions.get(joint) else { continue };
        let mut weights = lanes.weights(weights);
        let [w, x, y, z] = [motion[0], motion[1], motion[2], motion[3]];
        let pivots = pw.iter().zip(px).zip(py).zip(pz);
        for (weight, (((pw, px), py), pz)) in weights.iter_mut().zip(pivots) {
            let along = w * pw + x * px + y * py + z * pz;
            *weight = if along < 0.0 { -*weight } else { *weight };
        }
        visit(joint, motion, weights);
    }
}

/// The blended dual quaternion of each vertex, summed over the joints in ascending order, from zero.
#[inline(always)]
pub(crate) fn blended<const N: usize, L: Lanes<N>>(lanes: L, holds: Holds<'_>, motions: &[[f32; 8]]) -> Dual<N> {
    let mut sum = [[0.0; N]; 8];
    signed_weights(lanes, holds, motions, |_, motion, weights| {
        for (sum, value) in sum.iter_mut().zip(motion) {
            for (sum, weight) in sum.iter_mut().zip(weights) {
                *sum += weight * *value;
            }
        }
    });
    sum
}

/// One vertex of a blend, ready to move points.
#[derive(Clone, Copy)]
pub(crate) struct Screw {
    w: f32,
    u: [f32; 3],
    d: f32,
    e: [f32; 3],
    square: f32,
    inverse: f32,
}

impl Screw {
    /// Lane `lane` of a blend. A vertex that nothing holds (padding) is left where `0 v` is.
    #[inline(always)]
    pub(crate) fn of<const N: usize>(blend: &Dual<N>, lane: usize) -> Self {
        let part = |k: usize| blend.get(k).and_then(|part: &[f32; N]| part.get(lane)).copied().unwrap_or(0.0);
        let (w, u) = (part(0), [part(1), part(2), part(3)]);
        let imaginary = dot(u, u);
        let norm = w * w + imaginary;
        let inverse = if norm > 0.0 { 1.0 / norm } else { 0.0 };
        Screw { w, u, d: part(4), e: [part(5), part(6), part(7)], square: w * w - imaginary, inverse }
    }

    /// `r v r*`, not divided: `((w^2 - u.u) v + 2 (u.v) u) + 2 w (u x v)`.
    #[inline(always)]
    fn turned(&self, v: [f32; 3]) -> [f32; 3] {
        let along = 2.0 * dot(self.u, v);
        let double = 2.0 * self.w;
        let side = cross(self.u, v);
        combine([(self.square, v), (along, self.u), (double, side)])
    }

    /// `2 d r*`, not divided: `((2 w) e + (-2 d) u) + 2 (u x e)`.
    #[inline(always)]
    fn shift(&self, d: f32, e: [f32; 3]) -> [f32; 3] {
        combine([(2.0 * self.w, e), (-2.0 * d, self.u), (2.0, cross(self.u, e))])
    }

    /// Where a point goes: the sum of both, times `1 / |r|^2`, where `|r|^2 = w^2 + u.u`.
    #[inline(always)]
    pub(crate) fn applied(&self, v: [f32; 3]) -> [f32; 3] {
        plus(self.turned(v), self.shift(self.d, self.e)).map(|value| value * self.inverse)
    }

    /// Derivative of the position by a change of the point: `r dv r*`, times `1 / |r|^2`.
    #[inline(always)]
    pub(crate) fn by_point(&self, dv: [f32; 3]) -> [f32; 3] {
        self.turned(dv).map(|value| value * self.inverse)
    }

    /// Derivative of the position by a change of the dual part: `2 d r*` of the change, times `1 / |r|^2`.
    #[inline(always)]
    pub(crate) fn by_dual(&self, [d, e @ ..]: [f32; 4]) -> [f32; 3] {
        self.shift(d, e).map(|value| value * self.inverse)
    }

    /// Derivative of the position `x` of a point `v` by a change `(dw, du)` of the rotation and `(dd, de)` of the dual part.
    ///
    /// With `q = 2 (w dw - u.du)` and `n = 2 (w dw + u.du)` it is the sum, from the left, of
    /// `(q v + (2 du.v) u) + (2 u.v) du`, `((2 dw) (u x v) + (2 w) (du x v)) + (2 dw) e`, `((2 w) de + (-2 dd) u) + (-2 d) du` and
    /// `(2 (du x e) + 2 (u x de)) + (-n) x`, times `1 / |r|^2`.
    #[inline(always)]
    pub(crate) fn by_blend(&self, v: [f32; 3], x: [f32; 3], r: [f32; 4], d: [f32; 4]) -> [f32; 3] {
        let ([dw, du @ ..], [dd, de @ ..]) = (r, d);
        let square = 2.0 * (self.w * dw - dot(self.u, du));
        let norm = 2.0 * (self.w * dw + dot(self.u, du));
        let (along, change) = (2.0 * dot(self.u, v), 2.0 * dot(du, v));
        let turned = combine([(square, v), (change, self.u), (along, du)]);
        let sides = combine([(2.0 * dw, cross(self.u, v)), (2.0 * self.w, cross(du, v)), (2.0 * dw, self.e)]);
        let dual = combine([(2.0 * self.w, de), (-2.0 * dd, self.u), (-2.0 * self.d, du)]);
        let rest = combine([(2.0, cross(du, self.e)), (2.0, cross(self.u, de)), (-norm, x)]);
        plus(plus(plus(turned, sides), dual), rest).map(|value| value * self.inverse)
    }
}

/// Sum of three scaled vectors, from the left.
#[inline(always)]
fn combine([(a, p), (b, q), (c, r)]: [(f32, [f32; 3]); 3]) -> [f32; 3] {
    plus(plus(p.map(|value| a * value), q.map(|value| b * value)), r.map(|value| c * value))
}

// Written out: the optimiser for size keeps the check of an index.
#[inline(always)]
fn plus([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    [a + x, b + y, c + z]
}

#[inline(always)]
fn dot([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> f32 {
    a * x + b * y + c * z
}

#[inline(always)]
pub(crate) fn cross([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

/// Lane `lane` of several vertices.
#[inline(always)]
pub(crate) fn lane_of<const N: usize>(axes: &Axes<N>, lane: usize) -> [f32; 3] {
    let [x, y, z] = axes;
    [x, y, z].map(|axis| axis.get(lane).copied().unwrap_or(0.0))
}

/// The change of a joint's motion by a turn about an axis through an anchor: `1/2 ((0, a) + eps (0, -a x p)) q`.
///
/// With `h = a / 2`: the rotation changes by the product `(0, h) r`, the dual part by `(0, h) d + (0, p x h) r`.
#[inline(always)]
pub(crate) fn turned_by(axis: [f32; 3], anchor: [f32; 3], motion: &[f32; 8]) -> ([f32; 4], [f32; 4]) {
    use crate::rotation::quaternion::quaternion_product;
    let half = axis.map(|value| 0.5 * value);
    let [x, y, z] = cross(anchor, half);
    let rotation = [motion[0], motion[1], motion[2], motion[3]];
    let dual = [motion[4], motion[5], motion[6], motion[7]];
    let turn = [0.0, half[0], half[1], half[2]];
    let by_turn = quaternion_product(turn, dual);
    let by_shift = quaternion_product([0.0, x, y, z], rotation);
    let ([a, b, c, d], [p, q, r, s]) = (by_turn, by_shift);
    (quaternion_product(turn, rotation), [a + p, b + q, c + r, d + s])
}
