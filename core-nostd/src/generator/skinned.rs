//! The S-SCAPE generator, eq. 9.1 to 9.3: a linear rest shape, a skeleton that stands in it, and skinning.

use super::lanes::{Axes, Columns, Lanes, One, Whole};
use super::rest::Rest;
use super::{At, Block, Generator, LANES, NUMBERS, Weights, gradient};
use crate::Error;
use crate::skeleton::{JointMode, Posed, Skeleton};
pub use crate::skinning::Blend;
use crate::skinning::dual_quaternion::{self, Screws, signed_weights};
use crate::skinning::linear_blend::{self, arm, moved, turn_about, turned};
use crate::skinning::{Holds, Influences};
use crate::workspace::Requirement;

/// Corrective terms of each joint: the entries of its rotation against its parent, less the identity, by rows.
pub const CORRECTIONS: usize = 9;

/// A body over a model file; copying it copies views.
///
/// `x_i(z, theta)` is the blend of the joints' motions applied to the rest shape `v_i(z) = mean_i + A_i z + C_i f(theta)`, where `f` are the
/// entries of the joints' rotations less the identity (models without corrective terms have no `C`). The pose weights are the joints' angles in the order of
/// the joints: one for a revolute joint, a rotation vector for a ball, radians.
///
/// Derivatives, for [`Blend::Linear`] and angle k of joint a with axis `a'_k` and anchor `p'_a`: `sum_j a'_k x (omega_j x_j - omega_j p'_a)` over the joints j
/// that hold the vertex and are moved by a, plus `B C f'`; by weight l: `B A_l + sum_j omega_j D_jl`. For dual quaternions the same by the chain rule.
///
/// Order of summation: that of [`Linear`](super::linear::Linear) for the rest shape (components, then corrections), of the skinning kernels over the joints in ascending order; a column of an
/// angle sums, from zero, over the holding joints that its own joint carries in ascending order, then adds the corrections.
///
/// With matrices a holding joint j adds `a'_k x (omega_j x_j - omega_j p'_a)`, where `x_j = R_j v + t_j` is multiplied by its weight first; a weight l has
/// `B A_l`, to which `omega_j D_jl` are added over j. With dual quaternions a holding joint changes the blend by its signed weight times the change of its
/// motion by the turn, or times the dual part `1/2 (0, D_jl) r_j`, and each such change gives one term of the column. The corrections of an angle are the sum,
/// from zero, of its joint's nine decoded terms times their slopes, turned as a component is. All holding joints of a vertex are those of its block, also with
/// a weight of zero.
#[derive(Debug, Clone, Copy)]
pub struct Skinned<'a, R> {
    pub(super) rest: R,
    pub(super) skeleton: Skeleton<'a>,
    pub(super) influences: Influences<'a>,
    /// Block of the file at which the rest shape begins.
    pub(super) first_block: usize,
    pub(super) blend: Blend,
    pub(super) joints: JointMode,
}

/// The state, carved.
pub(super) struct State<'s> {
    pub(super) motions: &'s [[f32; 12]],
    pub(super) duals: &'s [[f32; 8]],
    pub(super) corrections: &'s [f32],
    pub(super) first_angles: &'s [f32],
    pub(super) anchors: &'s [[f32; 3]],
    pub(super) axes: &'s [[f32; 3]],
    pub(super) correction_slopes: &'s [[f32; CORRECTIONS]],
    pub(super) shifts: &'s [[f32; 3]],
}

impl<'a, R: Rest> Skinned<'a, R> {
    pub(crate) fn new(rest: R, skeleton: Skeleton<'a>, influences: Influences<'a>, blend: Blend) -> Self {
        let joints = if skeleton.is_regressed() { JointMode::Regressed } else { JointMode::Mean };
        Skinned { rest, skeleton, influences, first_block: 0, blend, joints }
    }

    /// The same body with motions blended in another way than its file says.
    pub const fn with_blend(mut self, blend: Blend) -> Self {
        self.blend = blend;
        self
    }

    /// The same body with joints that follow the identity (where the file knows how), or stay.
    pub const fn with_joints(mut self, joints: JointMode) -> Self {
        self.joints = joints;
        self
    }

    /// How motions are blended.
    pub const fn blend(&self) -> Blend {
        self.blend
    }

    /// Whether joints follow the identity.
    pub const fn joints(&self) -> JointMode {
        self.joints
    }

    /// The rest shape: the body in the standard posture.
    pub const fn rest(&self) -> &R {
        &self.rest
    }

    /// The skeleton.
    pub const fn skeleton(&self) -> &Skeleton<'a> {
        &self.skeleton
    }

    /// Who holds what.
    pub const fn influences(&self) -> &Influences<'a> {
        &self.influences
    }

    /// Where the joints stand, in the pose that `at` was begun with, millimetres; `None` for a joint that is not there.
    pub fn joint_position(&self, at: At<'_>, joint: usize) -> Option<[f32; 3]> {
        // A joint turns about itself: its own motion leaves it where its parent's takes it.
        let place = self.skeleton.placed(joint, at.weights.identity, self.joints)?;
        let state = self.state(at);
        Some(moved(state.motions.get(joint)?, &place.map(|value| [value])).map(|[value]| value))
    }

    /// Numbers of each part of the state, in its order.
    fn sizes(&self, derivatives: bool) -> [usize; 8] {
        let (joints, angles) = (self.skeleton.n_joints(), self.skeleton.pose_dim());
        let when = |wanted: bool, numbers: usize| if wanted { numbers } else { 0 };
        let corrected = self.rest.corrections() != 0;
        let follows = self.joints == JointMode::Regressed && self.skeleton.is_regressed();
        [
            12 * joints,
            when(self.blend == Blend::DualQuaternion, 8 * joints),
            when(corrected, CORRECTIONS * joints),
            when(derivatives, joints),
            when(derivatives, 3 * joints),
            when(derivatives, 3 * angles),
            when(derivatives && corrected, CORRECTIONS * angles),
            when(derivatives && follows, 3 * joints * self.rest.identity_dim()),
        ]
    }

    #[inline(always)]
    pub(super) fn state<'s>(&self, at: At<'s>) -> State<'s> {
        let mut rest = at.state;
        let mut parts = self.sizes(at.derivatives).map(|numbers| {
            let (part, behind) = rest.split_at_checked(numbers).unwrap_or_default();
            rest = behind;
            part
        });
        let mut next = 0;
        let mut take = || {
            let part = parts.get_mut(next).map(core::mem::take).unwrap_or_default();
            next += 1;
            part
        };
        State {
            motions: take().as_chunks().0,
            duals: take().as_chunks().0,
            corrections: take(),
            first_angles: take(),
            anchors: take().as_chunks().0,
            axes: take().as_chunks().0,
            correction_slopes: take().as_chunks().0,
            shifts: take().as_chunks().0,
        }
    }

    /// The vertices of the rest shape `rest`, posed.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn posed<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        holds: Holds<'a>,
        state: &State<'_>,
        rest: &Axes<N>,
    ) -> Axes<N> {
        match self.blend {
            Blend::Linear => linear_blend::blended(lanes, holds, state.motions, rest),
            Blend::DualQuaternion => dual_quaternion::moved(&dual_quaternion::blended(lanes, holds, state.duals), rest),
        }
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn value<const N: usize, L: Lanes<N>>(&self, lanes: L, at: At<'_>, block: usize) -> Option<Axes<N>> {
        let state = self.state(at);
        let rest = self.rest.shape(lanes, block, at.weights.identity, state.corrections)?;
        Some(self.posed(lanes, self.influences.block(block + self.first_block)?, &state, &rest))
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearised<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        at: At<'_>,
        block: usize,
        columns: &mut (impl Columns<N> + ?Sized),
    ) -> Option<Axes<N>> {
        let state = self.state(at);
        let holds = self.influences.block(block + self.first_block)?;
        let rest = self.rest.shape(lanes, block, at.weights.identity, state.corrections)?;
        let value = self.posed(lanes, holds, &state, &rest);
        let dim = self.rest.identity_dim();
        for column in dim..dim + self.skeleton.pose_dim() {
            columns.set(column, [[0.0; N]; 3]);
        }
        let blend = match self.blend {
            Blend::Linear => {
                self.turn_linear(lanes, holds, &state, &rest, columns);
                Blended::Rotations(linear_blend::blended_rotations(lanes, holds, state.motions))
            }
            Blend::DualQuaternion => {
                let screws = Screws::of(&dual_quaternion::blended(lanes, holds, state.duals));
                self.turn_dual(lanes, holds, &state, &screws, [&rest, &value], columns);
                Blended::Duals(screws)
            }
        };
        self.rest.components(lanes, block, |column, component| columns.set(column, blend.by_rest(&component)));
        self.shift(lanes, holds, &state, &blend, columns);
        self.rest.correct(lanes, block, self.skeleton.angles(), state.correction_slopes, |angle, change| {
            add(columns, dim + angle, blend.by_rest(&change));
        });
        Some(value)
    }

    /// Adds the turns of the joints, for blended matrices.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn turn_linear<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        holds: Holds<'a>,
        state: &State<'_>,
        rest: &Axes<N>,
        columns: &mut (impl Columns<N> + ?Sized),
    ) {
        for (joint, weights) in holds.iter() {
            let Some(motion) = state.motions.get(joint) else { continue };
            let weights = lanes.weights(weights);
            let mut weighted = moved(motion, rest);
            for axis in &mut weighted {
                for (value, weight) in axis.iter_mut().zip(weights) {
                    *value *= weight;
                }
            }
            self.ancestors(joint, state, |anchor, axes, first| {
                let arm = arm(&weighted, &weights, anchor);
                for (k, axis) in axes.iter().enumerate() {
                    add(columns, first + k, turn_about(*axis, &arm));
                }
            });
        }
    }

    /// Adds the turns of the joints, for blended dual quaternions; `shapes` are the rest shape and the posed one.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn turn_dual<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        holds: Holds<'a>,
        state: &State<'_>,
        screws: &Screws<N>,
        shapes: [&Axes<N>; 2],
        columns: &mut (impl Columns<N> + ?Sized),
    ) {
        signed_weights(lanes, holds, state.duals, |joint, motion, weights| {
            self.ancestors(joint, state, |anchor, axes, first| {
                for (k, axis) in axes.iter().enumerate() {
                    let change = dual_quaternion::turned_by(*axis, anchor, motion);
                    let change = screws.by_blend(shapes, change, &weights);
                    add(columns, first + k, change);
                }
            });
        });
    }

    /// Calls `visit` with anchor, axes and first column of a joint and of all that carry it.
    #[inline(always)]
    fn ancestors(&self, joint: usize, state: &State<'_>, mut visit: impl FnMut([f32; 3], &[[f32; 3]], usize)) {
        let mut next = Some(joint);
        while let Some(joint) = next {
            let parent = self.skeleton.parent(joint);
            let first = |joint: usize| state.first_angles.get(joint).map_or(state.axes.len(), |&first| first as usize);
            let angles = first(joint)..first(joint + 1);
            if let (Some(anchor), Some(axes)) = (state.anchors.get(joint), state.axes.get(angles.clone())) {
                visit(*anchor, axes, self.rest.identity_dim() + angles.start);
            }
            // Parents come before children, so this ends.
            next = parent.filter(|&parent| parent < joint);
        }
    }

    /// Adds what the joints do when they follow the identity.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn shift<const N: usize, L: Lanes<N>>(
        &self,
        lanes: L,
        holds: Holds<'a>,
        state: &State<'_>,
        blend: &Blended<N>,
        columns: &mut (impl Columns<N> + ?Sized),
    ) {
        let dim = self.rest.identity_dim();
        if state.shifts.is_empty() {
            return;
        }
        let mut one = |joint: usize, motion: Option<&[f32; 8]>, weights: &[f32; N]| {
            let shifts = state.shifts.get(joint * dim..(joint + 1) * dim).unwrap_or_default();
            for (column, shift) in shifts.iter().enumerate() {
                add(columns, column, blend.by_shift(*shift, motion, weights));
            }
        };
        match blend {
            Blended::Rotations(_) => {
                for (joint, weights) in holds.iter() {
                    one(joint, None, &lanes.weights(weights));
                }
            }
            Blended::Duals(_) => signed_weights(lanes, holds, state.duals, |joint, motion, weights| {
                one(joint, Some(motion), &weights);
            }),
        }
    }
}

/// The blend of each vertex.
enum Blended<const N: usize> {
    Rotations([[f32; N]; 9]),
    Duals(Screws<N>),
}

impl<const N: usize> Blended<N> {
    /// Change of the position by a change of the rest shape.
    #[inline(always)]
    fn by_rest(&self, change: &Axes<N>) -> Axes<N> {
        match self {
            Blended::Rotations(rotations) => turned(rotations, change),
            Blended::Duals(screws) => screws.by_point(change),
        }
    }

    /// Change of the position by a shift of one joint.
    #[inline(always)]
    fn by_shift(&self, shift: [f32; 3], motion: Option<&[f32; 8]>, weights: &[f32; N]) -> Axes<N> {
        let mut out = [[0.0; N]; 3];
        match (self, motion) {
            (Blended::Duals(screws), Some(motion)) => {
                let dual = crate::rotation::quaternion::dual_part([motion[0], motion[1], motion[2], motion[3]], shift);
                out = screws.by_dual(dual, weights);
            }
            _ => {
                for (out, shift) in out.iter_mut().zip(shift) {
                    for (out, weight) in out.iter_mut().zip(weights) {
                        *out = weight * shift;
                    }
                }
            }
        }
        out
    }
}

#[inline(always)]
fn add<const N: usize>(columns: &mut (impl Columns<N> + ?Sized), column: usize, value: Axes<N>) {
    let mut sum = columns.get(column);
    for (sum, value) in sum.iter_mut().zip(value) {
        for (sum, value) in sum.iter_mut().zip(value) {
            *sum += value;
        }
    }
    columns.set(column, sum);
}

impl<R: Rest> Generator for Skinned<'_, R> {
    fn vertex_count(&self) -> usize {
        self.rest.vertex_count()
    }

    fn identity_dim(&self) -> usize {
        self.rest.identity_dim()
    }

    fn pose_dim(&self) -> usize {
        self.skeleton.pose_dim()
    }

    fn state_req(&self, derivatives: bool) -> Requirement {
        Requirement::of(self.sizes(derivatives).iter().sum())
    }

    fn write_state(&self, weights: Weights<'_>, derivatives: bool, state: &mut [f32]) {
        let mut rest = state;
        let mut parts = self.sizes(derivatives).map(|numbers| {
            let (part, behind) = core::mem::take(&mut rest).split_at_mut_checked(numbers).unwrap_or_default();
            rest = behind;
            part
        });
        let mut next = 0;
        let mut take = || {
            let part = parts.get_mut(next).map(core::mem::take).unwrap_or_default();
            next += 1;
            part
        };
        let mut posed = Posed {
            motions: take().as_chunks_mut().0,
            duals: take().as_chunks_mut().0,
            corrections: take().as_chunks_mut().0,
            first_angles: take(),
            anchors: take().as_chunks_mut().0,
            axes: take().as_chunks_mut().0,
            correction_slopes: take().as_chunks_mut().0,
            shifts: take().as_chunks_mut().0,
        };
        self.skeleton.pose(weights.identity, weights.pose, self.joints, derivatives, &mut posed);
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block> {
        Some(Block { axes: self.value(Whole, at, block)? })
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block> {
        Some(Block { axes: self.linearised(Whole, at, block, jacobian)? })
    }

    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]> {
        Some(self.value(One(vertex % LANES), at, vertex / LANES)?.map(|[value]| value))
    }

    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        Some(self.linearised(One(vertex % LANES), at, vertex / LANES, jacobian)?.map(|[value]| value))
    }

    fn gradient_req(&self) -> Requirement {
        if self.has_wrenches() { self.wrench_req() } else { gradient::by_jacobian_req(self.dim()) }
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn gradient_at(
        &self,
        at: At<'_>,
        vertex_gradients: &[f32],
        gradient: &mut [f32],
        workspace: &mut [f32],
    ) -> Result<(), Error> {
        if self.has_wrenches() {
            return self.by_wrenches(at, vertex_gradients, gradient, workspace);
        }
        gradient::by_jacobian(self, at, vertex_gradients, gradient, workspace)
    }
}
