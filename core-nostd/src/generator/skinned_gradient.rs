//! Reverse mode of a body whose motions are blended as matrices: forces and torques on the joints, carried down to the root.
//!
//! `F_j = sum_i omega_ij g_i`, `T_j = sum_i x_ij x (omega_ij g_i)`; for an angle of joint a with axis `a'` and anchor `p'`, over the joints j that a moves,
//! `a' . sum_j (T_j - p' x F_j)`; for identity weight l `sum_i A_il . B_i^T g_i + sum_j D_jl . F_j`.

use super::gradient::{Lane, add_products, checked, deinterleaved, total};
use super::lanes::{Axes, Whole};
use super::rest::Rest;
use super::skinned::Skinned;
use super::{At, LANES, NUMBERS};
use crate::Error;
use crate::skinning::linear_blend::{blended_rotations, moved};
use crate::workspace::{Requirement, Workspace};

/// Lane sums of a force and of a torque.
type Wrench = [Lane; 6];

impl<R: Rest> Skinned<'_, R> {
    pub(super) fn wrench_req(&self) -> Requirement {
        let lanes = 6 * self.skeleton.n_joints() + self.rest.identity_dim();
        Requirement::of(lanes.saturating_mul(LANES))
    }

    /// The gradient, for matrices without corrective terms.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(super) fn by_wrenches(
        &self,
        at: At<'_>,
        vertex_gradients: &[f32],
        gradient: &mut [f32],
        workspace: &mut [f32],
    ) -> Result<(), Error> {
        checked(self, at, vertex_gradients, gradient, workspace, self.wrench_req())?;
        let state = self.state(at);
        let dim = self.rest.identity_dim();
        let mut pieces = Workspace::new(workspace);
        let lanes = pieces.take(6 * LANES * self.skeleton.n_joints())?.as_chunks_mut::<LANES>().0;
        let wrenches: &mut [Wrench] = lanes.as_chunks_mut().0;
        let sums = pieces.take(dim.saturating_mul(LANES))?.as_chunks_mut::<LANES>().0;
        wrenches.fill([[0.0; LANES]; 6]);
        sums.fill([0.0; LANES]);
        for (block, numbers) in vertex_gradients.chunks(NUMBERS).enumerate() {
            let of_block = deinterleaved(numbers);
            let Some(holds) = self.influences.block(block + self.first_block) else { break };
            let Some(rest) = self.rest.shape(Whole, block, at.weights.identity, state.corrections) else { break };
            for (joint, weights) in holds.iter() {
                let (Some(motion), Some(wrench)) = (state.motions.get(joint), wrenches.get_mut(joint)) else {
                    continue;
                };
                let weights = super::lanes::Lanes::weights(Whole, weights);
                let force = of_block.map(|axis| weighted(&weights, axis));
                add_wrench(wrench, &moved(motion, &rest), &force);
            }
            if dim > 0 {
                let back = turned_back(&blended_rotations(Whole, holds, state.motions), &of_block);
                self.rest.components(Whole, block, |column, component| {
                    if let Some(sum) = sums.get_mut(column) {
                        add_products(sum, &component, &back);
                    }
                });
            }
        }
        self.collected(&state, wrenches, sums, gradient);
        Ok(())
    }

    /// From lane sums to the gradient; the wrenches are summed from the leaves to the root.
    fn collected(
        &self,
        state: &super::skinned::State<'_>,
        wrenches: &mut [Wrench],
        sums: &[Lane],
        gradient: &mut [f32],
    ) {
        let dim = self.rest.identity_dim();
        let (by_identity, by_pose) = gradient.split_at_mut_checked(dim).unwrap_or_default();
        for (to, sum) in by_identity.iter_mut().zip(sums) {
            *to = total(sum);
        }
        // The total of a wrench goes into its first lane.
        for wrench in wrenches.iter_mut() {
            for lanes in wrench.iter_mut() {
                lanes[0] = total(lanes);
            }
        }
        for (joint, wrench) in wrenches.iter().enumerate() {
            for (l, to) in by_identity.iter_mut().enumerate() {
                if let Some([x, y, z]) = state.shifts.get(joint * dim + l) {
                    *to += x * wrench[0][0] + y * wrench[1][0] + z * wrench[2][0];
                }
            }
        }
        for joint in (0..wrenches.len()).rev() {
            let Some(wrench) = wrenches.get(joint).map(|wrench| wrench.map(|lanes| lanes[0])) else { continue };
            let [fx, fy, fz, tx, ty, tz] = wrench;
            if let Some(parent) = self.skeleton.parent(joint).and_then(|parent| wrenches.get_mut(parent)) {
                for (lanes, value) in parent.iter_mut().zip(wrench) {
                    lanes[0] += value;
                }
            }
            let [px, py, pz] = state.anchors.get(joint).copied().unwrap_or_default();
            let torque = [tx - (py * fz - pz * fy), ty - (pz * fx - px * fz), tz - (px * fy - py * fx)];
            let first = |joint: usize| state.first_angles.get(joint).map_or(state.axes.len(), |&first| first as usize);
            for angle in first(joint)..first(joint + 1) {
                if let (Some(to), Some([a, b, c])) = (by_pose.get_mut(angle), state.axes.get(angle)) {
                    *to = a * torque[0] + b * torque[1] + c * torque[2];
                }
            }
        }
    }
}

/// `omega f` of each lane.
#[inline(always)]
fn weighted(weights: &Lane, mut force: Lane) -> Lane {
    for (force, weight) in force.iter_mut().zip(weights) {
        *force *= weight;
    }
    force
}

/// Adds a force at points: `F += f`, `T += x x f`.
#[inline(always)]
fn add_wrench(wrench: &mut Wrench, [x, y, z]: &Axes<LANES>, [fx, fy, fz]: &Axes<LANES>) {
    let [sx, sy, sz, tx, ty, tz] = wrench;
    for (sum, force) in [(sx, fx), (sy, fy), (sz, fz)] {
        for (sum, force) in sum.iter_mut().zip(force) {
            *sum += force;
        }
    }
    for (torque, (a, fb), (b, fa)) in [(tx, (y, fz), (z, fy)), (ty, (z, fx), (x, fz)), (tz, (x, fy), (y, fx))] {
        let lanes = a.iter().zip(fb).zip(b.iter().zip(fa));
        for (torque, ((a, fb), (b, fa))) in torque.iter_mut().zip(lanes) {
            *torque += a * fb - b * fa;
        }
    }
}

/// `B^T g`.
#[inline(always)]
fn turned_back([a, b, c, d, e, f, g, h, i]: &[Lane; 9], [x, y, z]: &Axes<LANES>) -> Axes<LANES> {
    let row = |a: &Lane, d: &Lane, g: &Lane| {
        let mut out = [0.0; LANES];
        let lanes = a.iter().zip(x).zip(d.iter().zip(y)).zip(g.iter().zip(z));
        for (out, (((a, x), (d, y)), (g, z))) in out.iter_mut().zip(lanes) {
            *out = a * x + d * y + g * z;
        }
        out
    };
    [row(a, d, g), row(b, e, h), row(c, f, i)]
}

/// The way that the gradient of a body takes.
impl<R: Rest> Skinned<'_, R> {
    pub(super) fn has_wrenches(&self) -> bool {
        self.blend == super::skinned::Blend::Linear && self.rest.corrections() == 0
    }
}

#[cfg(test)]
mod tests {
    use crate::format::Model;
    use crate::generator::{Generator, Weights};
    use crate::quantise::F32;
    use crate::testing::{Body, Stream, header, model_file};
    use proptest::prelude::*;
    use std::vec::Vec;

    /// `J^T g` by the columns of `linearise_at`, in f64.
    fn expected(generator: &impl Generator, at: crate::generator::At<'_>, g: &[f32]) -> Vec<f64> {
        let (blocks, dim) = (generator.block_count(), generator.dim());
        let (mut values, mut jacobian) = (vec![0.0; 48 * blocks], vec![0.0; 48 * blocks * dim]);
        generator.linearise_at(at, 0..blocks, &mut values, &mut jacobian).unwrap();
        let entry = |k: usize, v: usize, axis: usize| jacobian[((v / 16 * dim + k) * 3 + axis) * 16 + v % 16];
        let one = |k: usize| (0..g.len()).map(|c| f64::from(entry(k, c / 3, c % 3)) * f64::from(g[c])).sum();
        (0..dim).map(one).collect()
    }

    fn check(generator: &impl Generator, weights: Weights<'_>, seed: u32) -> Result<(), TestCaseError> {
        let mut state = vec![f32::NAN; generator.state_req(true).numbers()];
        let at = generator.begin(weights, true, &mut state).unwrap();
        let g = Stream::new(seed).take(3 * generator.vertex_count());
        let mut workspace = vec![f32::NAN; generator.gradient_req().numbers()];
        let mut gradient = vec![f32::NAN; generator.dim()];
        generator.gradient_at(at, &g, &mut gradient, &mut workspace).unwrap();
        for (found, expected) in gradient.iter().zip(expected(generator, at, &g)) {
            // Torques are differences of products of positions of some 1000 mm with forces of 1.
            prop_assert!((f64::from(*found) - expected).abs() < 0.02, "{} {}", found, expected);
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::cases().min(8000)))]

        #[test]
        fn gradients_are_the_transposed_jacobian(seed in 1u32..100000, corrections: bool, dual: bool) {
            let mut spec = Body::new(37, 3);
            (spec.corrections, spec.dual) = (corrections, dual);
            let file = spec.file(seed);
            let body = Model::open(&file).unwrap().skinned::<F32<'_>>().unwrap();
            let mut stream = Stream::new(seed + 1);
            let (identity, pose) = (stream.take(3), stream.take(9));
            check(&body, Weights { identity: &identity, pose: &pose }, seed)?;
            let blocks = 1..3;
            let mut memory = vec![0.0; body.with_identity_req(&blocks).numbers()];
            let fixed = body.with_identity(&identity, blocks, &mut memory).unwrap();
            check(&fixed, Weights { identity: &[], pose: &pose }, seed)?;
            let face = model_file(&header(21, 3, 2, true), seed);
            check(&Model::open(&face).unwrap().bilinear().unwrap(), Weights { identity: &identity, pose: &pose[..2] }, seed)?;
        }
    }
}
