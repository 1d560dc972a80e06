//! Linear blend skinning, eq. 9.2: `x = sum_j omega_j (R_j v + t_j)`, over the joints in ascending order, from zero.

use super::Holds;
use crate::generator::lanes::{Axes, Lanes};

/// `R v + t` of several vertices: `((r_x x + r_y y) + r_z z) + t`.
#[inline(always)]
pub(crate) fn moved<const N: usize>(motion: &[f32; 12], rest: &Axes<N>) -> Axes<N> {
    let [a, b, c, d, e, f, g, h, i, x, y, z] = *motion;
    let [px, py, pz] = rest;
    let mut out = [[0.0; N]; 3];
    for (out, (row, shift)) in out.iter_mut().zip([([a, b, c], x), ([d, e, f], y), ([g, h, i], z)]) {
        let lanes = out.iter_mut().zip(px).zip(py).zip(pz);
        for (((out, x), y), z) in lanes {
            *out = row[0] * x + row[1] * y + row[2] * z + shift;
        }
    }
    out
}

/// The posed vertices.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub(crate) fn blended<const N: usize, L: Lanes<N>>(
    lanes: L,
    holds: Holds<'_>,
    motions: &[[f32; 12]],
    rest: &Axes<N>,
) -> Axes<N> {
    let mut sum = [[0.0; N]; 3];
    for (joint, weights) in holds.iter() {
        let Some(motion) = motions.get(joint) else { continue };
        let weights = lanes.weights(weights);
        let position = moved(motion, rest);
        for (sum, position) in sum.iter_mut().zip(position) {
            for ((sum, position), weight) in sum.iter_mut().zip(position).zip(weights) {
                *sum += weight * position;
            }
        }
    }
    sum
}

/// `B = sum_j omega_j R_j`, nine numbers for each vertex by rows, over the joints in ascending order, from zero.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub(crate) fn blended_rotations<const N: usize, L: Lanes<N>>(
    lanes: L,
    holds: Holds<'_>,
    motions: &[[f32; 12]],
) -> [[f32; N]; 9] {
    let mut sum = [[0.0; N]; 9];
    for (joint, weights) in holds.iter() {
        let Some(motion) = motions.get(joint) else { continue };
        let weights = lanes.weights(weights);
        for (sum, entry) in sum.iter_mut().zip(motion) {
            for (sum, weight) in sum.iter_mut().zip(weights) {
                *sum += weight * *entry;
            }
        }
    }
    sum
}

/// `B a` of several vertices, each with its own matrix and its own vector: `(b_x x + b_y y) + b_z z`.
#[inline(always)]
pub(crate) fn turned<const N: usize>(rotations: &[[f32; N]; 9], vectors: &Axes<N>) -> Axes<N> {
    let [x, y, z] = vectors;
    let mut out = [[0.0; N]; 3];
    for (out, row) in out.iter_mut().zip(rotations.as_chunks::<3>().0) {
        let [a, b, c] = row;
        let entries = a.iter().zip(b).zip(c);
        let vectors = x.iter().zip(y).zip(z);
        for ((out, ((a, b), c)), ((x, y), z)) in out.iter_mut().zip(entries).zip(vectors) {
            *out = a * x + b * y + c * z;
        }
    }
    out
}

/// The derivative of what a joint adds to vertices, `weighted = omega x_j`, by a turn about an axis through an anchor: `axis x (weighted - omega anchor)`.
#[inline(always)]
pub(crate) fn turn_about<const N: usize>(axis: [f32; 3], arm: &Axes<N>) -> Axes<N> {
    let [a, b, c] = axis;
    let [x, y, z] = arm;
    let mut out = [[0.0; N]; 3];
    let lanes = x.iter().zip(y).zip(z);
    let [out_x, out_y, out_z] = &mut out;
    let outs = out_x.iter_mut().zip(out_y).zip(out_z);
    for (((out_x, out_y), out_z), ((x, y), z)) in outs.zip(lanes) {
        (*out_x, *out_y, *out_z) = (b * z - c * y, c * x - a * z, a * y - b * x);
    }
    out
}

/// `weighted - omega anchor`.
#[inline(always)]
pub(crate) fn arm<const N: usize>(weighted: &Axes<N>, weights: &[f32; N], anchor: [f32; 3]) -> Axes<N> {
    let mut out = *weighted;
    for (out, anchor) in out.iter_mut().zip(anchor) {
        for (out, weight) in out.iter_mut().zip(weights) {
            *out -= weight * anchor;
        }
    }
    out
}
