//! Dual-quaternion skinning: `b = sum_j s_j omega_j q_j`, `x = (r v r* + 2 d r*) / |r|^2` with `b = r + eps d`.
//!
//! Source: Kavan, Collins, Zara, O'Sullivan, Geometric skinning with approximate dual quaternion blending, 2008. The sign `s_j` brings `q_j` onto the side of
//! the quaternion of the vertex' strongest joint (the first of equals), because `q` and `-q` are the same motion.

use super::Holds;
use crate::generator::lanes::{Axes, Lanes};

/// Eight numbers of several vertices: rotation `[w, x, y, z]`, then the dual part.
pub(crate) type Dual<const N: usize> = [[f32; N]; 8];

/// The rotation of the strongest joint of each vertex.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
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
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
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
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
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

/// One number of several vertices.
type Numbers<const N: usize> = [f32; N];

/// The blends of several vertices, ready to move points.
pub(crate) struct Screws<const N: usize> {
    w: Numbers<N>,
    u: Axes<N>,
    d: Numbers<N>,
    e: Axes<N>,
    square: Numbers<N>,
    inverse: Numbers<N>,
}

impl<const N: usize> Screws<N> {
    /// A vertex that nothing holds (padding) is moved to the origin.
    #[inline(always)]
    pub(crate) fn of(blend: &Dual<N>) -> Self {
        let [w, x, y, z, d, a, b, c] = *blend;
        let u = [x, y, z];
        let imaginary = dot(&u, &u);
        let norm = each::<N>(|l| at(&w, l) * at(&w, l) + at(&imaginary, l));
        let inverse = each::<N>(|l| if at(&norm, l) > 0.0 { 1.0 / at(&norm, l) } else { 0.0 });
        Screws { w, u, d, e: [a, b, c], square: each::<N>(|l| at(&w, l) * at(&w, l) - at(&imaginary, l)), inverse }
    }

    /// `r v r*`, not divided: `((w^2 - u.u) v + 2 (u.v) u) + 2 w (u x v)`.
    #[inline(always)]
    fn turned(&self, v: &Axes<N>) -> Axes<N> {
        let along = twice(&dot(&self.u, v));
        combine([(&self.square, v), (&along, &self.u), (&twice(&self.w), &cross(&self.u, v))])
    }

    /// `2 d r*`, not divided: `((2 w) e + (-2 d) u) + 2 (u x e)`.
    #[inline(always)]
    fn shift(&self, d: &Numbers<N>, e: &Axes<N>) -> Axes<N> {
        let back = each::<N>(|l| -2.0 * at(d, l));
        combine([(&twice(&self.w), e), (&back, &self.u), (&[2.0; N], &cross(&self.u, e))])
    }

    #[inline(always)]
    fn divided(&self, [x, y, z]: Axes<N>) -> Axes<N> {
        let axis = |axis: &Numbers<N>| each::<N>(|l| at(axis, l) * at(&self.inverse, l));
        [axis(&x), axis(&y), axis(&z)]
    }

    /// Where points go: the sum of both, times `1 / |r|^2`, where `|r|^2 = w^2 + u.u`.
    #[inline(always)]
    pub(crate) fn applied(&self, v: &Axes<N>) -> Axes<N> {
        self.divided(sum(&self.turned(v), &self.shift(&self.d, &self.e)))
    }

    /// Derivative of the positions by a change of the points: `r dv r*`, times `1 / |r|^2`.
    #[inline(always)]
    pub(crate) fn by_point(&self, change: &Axes<N>) -> Axes<N> {
        self.divided(self.turned(change))
    }

    /// Derivative of the positions by a change of the dual parts, one dual part weighted for each vertex: `2 d r*` of the change, times `1 / |r|^2`.
    #[inline(always)]
    pub(crate) fn by_dual(&self, dual: [f32; 4], weights: &Numbers<N>) -> Axes<N> {
        let [d, e @ ..] = weighted(dual, weights);
        self.divided(self.shift(&d, &e))
    }

    /// Derivative of the positions `x` of points `v` by a change `(dw, du)` of the rotation and `(dd, de)` of the dual part, weighted for each vertex.
    ///
    /// With `q = 2 (w dw - u.du)` and `n = 2 (w dw + u.du)` it is the sum, from the left, of
    /// `(q v + (2 du.v) u) + (2 u.v) du`, `((2 dw) (u x v) + (2 w) (du x v)) + (2 dw) e`, `((2 w) de + (-2 dd) u) + (-2 d) du` and
    /// `(2 (du x e) + 2 (u x de)) + (-n) x`, times `1 / |r|^2`.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(crate) fn by_blend(
        &self,
        [v, x]: [&Axes<N>; 2],
        (turn, dual): ([f32; 4], [f32; 4]),
        weights: &Numbers<N>,
    ) -> Axes<N> {
        let [dw, du @ ..] = weighted(turn, weights);
        let [dd, de @ ..] = weighted(dual, weights);
        let (real, imaginary) = (each::<N>(|l| at(&self.w, l) * at(&dw, l)), dot(&self.u, &du));
        let square = each::<N>(|l| 2.0 * (at(&real, l) - at(&imaginary, l)));
        let norm = each::<N>(|l| -2.0 * (at(&real, l) + at(&imaginary, l)));
        let (along, change) = (twice(&dot(&self.u, v)), twice(&dot(&du, v)));
        let (twice_w, twice_dw) = (twice(&self.w), twice(&dw));
        let turned = combine([(&square, v), (&change, &self.u), (&along, &du)]);
        let sides = combine([(&twice_dw, &cross(&self.u, v)), (&twice_w, &cross(&du, v)), (&twice_dw, &self.e)]);
        let (back, back_d) = (each::<N>(|l| -2.0 * at(&dd, l)), each::<N>(|l| -2.0 * at(&self.d, l)));
        let duals = combine([(&twice_w, &de), (&back, &self.u), (&back_d, &du)]);
        let rest = combine([(&[2.0; N], &cross(&du, &self.e)), (&[2.0; N], &cross(&self.u, &de)), (&norm, x)]);
        self.divided(sum(&sum(&sum(&turned, &sides), &duals), &rest))
    }
}

/// Where the blends take points. Without vectors one lane goes after the other, which is less code and less traffic than side by side; the bits are
/// the same.
#[inline(always)]
pub(crate) fn moved<const N: usize>(blend: &Dual<N>, points: &Axes<N>) -> Axes<N> {
    if !cfg!(target_arch = "arm") {
        return Screws::of(blend).applied(points);
    }
    let mut out = [[0.0; N]; 3];
    for lane in 0..N {
        let screw = Screws::<1>::of(&blend.each_ref().map(|part| [at(part, lane)]));
        let moved = screw.applied(&points.each_ref().map(|axis| [at(axis, lane)]));
        for (out, [value]) in out.iter_mut().zip(moved) {
            if let Some(to) = out.get_mut(lane) {
                *to = value;
            }
        }
    }
    out
}

/// A lane, without a check that could fail where this is not inlined.
#[inline(always)]
fn at<const N: usize>(numbers: &Numbers<N>, lane: usize) -> f32 {
    numbers.get(lane).copied().unwrap_or(0.0)
}

/// One number for each lane.
#[inline(always)]
fn each<const N: usize>(number: impl Fn(usize) -> f32) -> Numbers<N> {
    // Not by `array::from_fn`: that is not inlined into this many calls, and what is not inlined has narrow vectors.
    let mut numbers = [0.0; N];
    for (lane, to) in numbers.iter_mut().enumerate() {
        *to = number(lane);
    }
    numbers
}

/// A quaternion times the weight of each lane.
#[inline(always)]
fn weighted<const N: usize>([w, x, y, z]: [f32; 4], weights: &Numbers<N>) -> [Numbers<N>; 4] {
    let part = |part: f32| each::<N>(|l| at(weights, l) * part);
    [part(w), part(x), part(y), part(z)]
}

#[inline(always)]
fn twice<const N: usize>(numbers: &Numbers<N>) -> Numbers<N> {
    each::<N>(|l| 2.0 * at(numbers, l))
}

#[inline(always)]
fn sum<const N: usize>([a, b, c]: &Axes<N>, [x, y, z]: &Axes<N>) -> Axes<N> {
    [each::<N>(|l| at(a, l) + at(x, l)), each::<N>(|l| at(b, l) + at(y, l)), each::<N>(|l| at(c, l) + at(z, l))]
}

/// Sum of three scaled vectors, from the left.
#[inline(always)]
fn combine<const N: usize>([(a, p), (b, q), (c, r)]: [(&Numbers<N>, &Axes<N>); 3]) -> Axes<N> {
    // By name: where a closure over an index is not inlined, its bounds are checked.
    let ([px, py, pz], [qx, qy, qz], [rx, ry, rz]) = (p, q, r);
    let axis = |p: &Numbers<N>, q: &Numbers<N>, r: &Numbers<N>| {
        each::<N>(|l| at(a, l) * at(p, l) + at(b, l) * at(q, l) + at(c, l) * at(r, l))
    };
    [axis(px, qx, rx), axis(py, qy, ry), axis(pz, qz, rz)]
}

#[inline(always)]
fn dot<const N: usize>([a, b, c]: &Axes<N>, [x, y, z]: &Axes<N>) -> Numbers<N> {
    each::<N>(|l| at(a, l) * at(x, l) + at(b, l) * at(y, l) + at(c, l) * at(z, l))
}

#[inline(always)]
fn cross<const N: usize>([a, b, c]: &Axes<N>, [x, y, z]: &Axes<N>) -> Axes<N> {
    [
        each::<N>(|l| at(b, l) * at(z, l) - at(c, l) * at(y, l)),
        each::<N>(|l| at(c, l) * at(x, l) - at(a, l) * at(z, l)),
        each::<N>(|l| at(a, l) * at(y, l) - at(b, l) * at(x, l)),
    ]
}

/// `a x b` of one vector.
#[inline(always)]
fn cross_one([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

/// The change of a joint's motion by a turn about an axis through an anchor: `1/2 ((0, a) + eps (0, -a x p)) q`.
#[inline(always)]
pub(crate) fn turned_by(axis: [f32; 3], anchor: [f32; 3], motion: &[f32; 8]) -> ([f32; 4], [f32; 4]) {
    use crate::rotation::quaternion::quaternion_product;
    let half = axis.map(|value| 0.5 * value);
    let [x, y, z] = cross_one(anchor, half);
    let rotation = [motion[0], motion[1], motion[2], motion[3]];
    let dual = [motion[4], motion[5], motion[6], motion[7]];
    let turn = [0.0, half[0], half[1], half[2]];
    let by_turn = quaternion_product(turn, dual);
    let by_shift = quaternion_product([0.0, x, y, z], rotation);
    let ([a, b, c, d], [e, f, g, h]) = (by_turn, by_shift);
    (quaternion_product(turn, rotation), [a + e, b + f, c + g, d + h])
}
