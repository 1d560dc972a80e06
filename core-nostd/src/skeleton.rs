//! The skeleton of a body model as data, and its forward kinematics (Wuhrer, ch. 9.3).
//!
//! A joint turns about one axis (a revolute degree of freedom, one angle) or about all (a ball, a rotation vector); three revolute joints at one
//! anchor are a chain of three angles. Parents come before children. Where a joint stands depends on who it is: its position is a fixed
//! linear map of the rest shape, `p_j(z) = p_j + P_j z`.

use crate::format::{Floats, Indices};
use crate::rotation::axis_angle::{Matrix3, applied, left_jacobian, product, rotation_matrix};
use crate::rotation::quaternion::{dual_part, quaternion_product, rotation_quaternion};

/// Whether joints follow the identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointMode {
    /// Joints stand where the rest shape of the identity has them: the default where the model knows how.
    Regressed,
    /// Joints stand where the mean shape has them; then the model is bilinear (eq. 8.2) in identity and bone transforms.
    Mean,
}

/// A skeleton over the sections of a model file; copying it copies views.
#[derive(Debug, Clone, Copy)]
pub struct Skeleton<'a> {
    parents: Indices<'a>,
    axes: Floats<'a>,
    positions: Floats<'a>,
    basis: Floats<'a>,
    identity_dim: usize,
    pose_dim: usize,
    /// Where the joints stand, for an identity that is fixed.
    placed: Option<&'a [[f32; 3]]>,
}

/// One joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// The joint that carries it.
    pub parent: Option<usize>,
    /// Axis of a revolute joint in the standard posture, of unit length; `None` for a ball.
    pub axis: Option<[f32; 3]>,
    /// Position in the mean shape, millimetres.
    pub position: [f32; 3],
}

impl Joint {
    /// Angles of the joint.
    pub const fn dim(&self) -> usize {
        if self.axis.is_some() { 1 } else { 3 }
    }

    /// The rotation vector of the joint at these angles.
    #[inline]
    fn rotation_vector(&self, angles: &[f32]) -> [f32; 3] {
        let angle = |k: usize| angles.get(k).copied().unwrap_or(0.0);
        match self.axis {
            Some(axis) => axis.map(|value| angle(0) * value),
            None => [angle(0), angle(1), angle(2)],
        }
    }
}

/// A rigid motion `x = R v + t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motion {
    pub rotation: Matrix3<f32>,
    pub translation: [f32; 3],
}

impl Motion {
    const IDENTITY: Self =
        Motion { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// Nine numbers of the rotation by rows, then the translation.
    #[inline(always)]
    pub(crate) fn load(numbers: &[f32; 12]) -> Self {
        let [a, b, c, d, e, f, g, h, i, x, y, z] = *numbers;
        Motion { rotation: [[a, b, c], [d, e, f], [g, h, i]], translation: [x, y, z] }
    }

    fn store(&self, numbers: &mut [f32; 12]) {
        let [[a, b, c], [d, e, f], [g, h, i]] = self.rotation;
        let [x, y, z] = self.translation;
        *numbers = [a, b, c, d, e, f, g, h, i, x, y, z];
    }
}

/// What forward kinematics writes; slices may be empty where a use does not need them.
pub(crate) struct Posed<'s> {
    /// Motion of each joint from the standard posture.
    pub motions: &'s mut [[f32; 12]],
    /// The motions as dual quaternions: rotation, then dual part; of joint and parent the rotation is the nearer of the two.
    pub duals: &'s mut [[f32; 8]],
    /// Rotation of each joint against its parent, less the identity, by rows: what corrects the rest shape.
    pub corrections: &'s mut [[f32; 9]],
    /// The first angle of each joint; an `f32` holds them exactly.
    pub first_angles: &'s mut [f32],
    /// Where each joint stands.
    pub anchors: &'s mut [[f32; 3]],
    /// About which axis each angle turns what its joint carries; of a ball not of unit length.
    pub axes: &'s mut [[f32; 3]],
    /// Derivative of `corrections` of the angle's joint by each angle.
    pub correction_slopes: &'s mut [[f32; 9]],
    /// Derivative of each joint's translation by each identity weight, `n_joints x identity_dim`.
    pub shifts: &'s mut [[f32; 3]],
}

impl<'a> Skeleton<'a> {
    pub(crate) fn new(
        parents: Indices<'a>,
        axes: Floats<'a>,
        positions: Floats<'a>,
        basis: Floats<'a>,
        identity_dim: usize,
        pose_dim: usize,
    ) -> Self {
        Skeleton { parents, axes, positions, basis, identity_dim, pose_dim, placed: None }
    }

    /// The skeleton of one identity.
    pub(crate) fn with_positions<'w>(&self, positions: &'w [[f32; 3]]) -> Skeleton<'w>
    where
        'a: 'w,
    {
        Skeleton { placed: Some(positions), basis: Floats::default(), identity_dim: 0, ..*self }
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.parents.len()
    }

    /// Number of angles of all joints.
    pub fn pose_dim(&self) -> usize {
        self.pose_dim
    }

    /// The file knows how the joints follow the identity.
    pub fn is_regressed(&self) -> bool {
        !self.basis.is_empty()
    }

    /// One joint.
    #[inline]
    pub fn joint(&self, index: usize) -> Option<Joint> {
        let three = |view: &Floats<'a>, from: usize| Some([view.get(from)?, view.get(from + 1)?, view.get(from + 2)?]);
        let axis = three(&self.axes, index.checked_mul(3)?)?;
        Some(Joint {
            parent: self.parent(index),
            axis: (axis != [0.0; 3]).then_some(axis),
            position: match self.placed {
                Some(placed) => *placed.get(index)?,
                None => three(&self.positions, 3 * index)?,
            },
        })
    }

    /// The parent of a joint.
    #[inline(always)]
    pub(crate) fn parent(&self, joint: usize) -> Option<usize> {
        match self.parents.get(joint)? {
            u32::MAX => None,
            parent => Some(parent as usize),
        }
    }

    /// The first angle of each joint and their number, in order of the joints.
    pub fn angles(&self) -> impl Iterator<Item = core::ops::Range<usize>> + use<'a> {
        let skeleton = *self;
        let mut first = 0;
        (0..self.n_joints()).map(move |index| {
            let from = first;
            first += skeleton.joint(index).map_or(0, |joint| joint.dim());
            from..first
        })
    }

    /// Where a joint stands in the standard posture of an identity.
    pub(crate) fn placed(&self, index: usize, identity: &[f32], mode: JointMode) -> Option<[f32; 3]> {
        Some(self.position(index, &self.joint(index)?, identity, mode))
    }

    /// Derivative of a joint's position by identity weight `l`.
    #[inline(always)]
    fn slope(&self, joint: usize, l: usize) -> [f32; 3] {
        let from = (joint * self.identity_dim + l) * 3;
        let along = |axis: usize| self.basis.get(from + axis).unwrap_or(0.0);
        [along(0), along(1), along(2)]
    }

    /// `p_j + sum_l z_l P_jl`, l ascending, from the position in the mean.
    fn position(&self, index: usize, joint: &Joint, identity: &[f32], mode: JointMode) -> [f32; 3] {
        let mut position = joint.position;
        if mode == JointMode::Regressed && self.is_regressed() {
            for (l, &weight) in identity.iter().enumerate() {
                for (value, slope) in position.iter_mut().zip(self.slope(index, l)) {
                    *value += weight * slope;
                }
            }
        }
        position
    }

    /// Poses the joints: `R_j = R_par R(theta_j)`, `t_j = R_par (p_j - R(theta_j) p_j) + t_par`.
    ///
    /// The rotation vector of a revolute joint is its angle times each part of its axis. Scalar products sum x, y, z in this order, also with the zeros of a
    /// matrix. A root's parent is the identity, with which its matrix and its points are multiplied too. A quaternion is the parent's times the joint's own
    /// (a root's: its own), whose real part is not negative, with the dual part of the motion's translation. The anchor is `R_par p_j + t_par`; the axis of a
    /// revolute joint `R_par a`, those of a ball the columns of `R_par J` with the left Jacobian J, each column multiplied by `R_par`. Corrections are the
    /// entries of `R(theta_j)`, 1 taken from those of the diagonal; their derivative by an angle is the product `[a_k]x R(theta_j)`, with `a_k` the axis or
    /// column before `R_par`. Shifts are `D_j = D_par + R_par (P_j - R(theta_j) P_j)`, of a root the second part alone.
    pub(crate) fn pose(
        &self,
        identity: &[f32],
        angles: &[f32],
        mode: JointMode,
        derivatives: bool,
        out: &mut Posed<'_>,
    ) {
        let mut first = 0;
        for index in 0..self.n_joints() {
            let Some(joint) = self.joint(index) else { continue };
            let own = angles.get(first..first + joint.dim()).unwrap_or_default();
            let vector = joint.rotation_vector(own);
            let turn = rotation_matrix(vector);
            let parent = match joint.parent.and_then(|parent| out.motions.get(parent)) {
                Some(numbers) => Motion::load(numbers),
                None => Motion::IDENTITY,
            };
            let position = self.position(index, &joint, identity, mode);
            let moved = minus(position, applied(&turn, position));
            let motion = Motion {
                rotation: product(&parent.rotation, &turn),
                translation: plus(applied(&parent.rotation, moved), parent.translation),
            };
            if let Some(numbers) = out.motions.get_mut(index) {
                motion.store(numbers);
            }
            write_dual(index, &joint, vector, motion.translation, out.duals);
            if let Some(features) = out.corrections.get_mut(index) {
                *features = less_identity(&turn);
            }
            // Said once more, for programs that want no derivatives and link no code for them.
            if derivatives
                && let (Some(anchor), Some(angle)) = (out.anchors.get_mut(index), out.first_angles.get_mut(index))
            {
                *angle = first as f32;
                *anchor = plus(applied(&parent.rotation, position), parent.translation);
                self.turn_axes(first, &joint, vector, &parent.rotation, &turn, out);
                self.shift(index, &joint, &parent.rotation, &turn, mode, out);
            }
            first += joint.dim();
        }
    }

    /// Axes of a joint's angles, and how they change the corrections: `[J e_k]x R`.
    fn turn_axes(
        &self,
        first: usize,
        joint: &Joint,
        vector: [f32; 3],
        parent: &Matrix3<f32>,
        turn: &Matrix3<f32>,
        out: &mut Posed<'_>,
    ) {
        let columns = match joint.axis {
            Some(axis) => [axis; 3],
            None => {
                let [a, b, c] = left_jacobian(vector);
                [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]]
            }
        };
        for (k, column) in columns.into_iter().take(joint.dim()).enumerate() {
            if let Some(axis) = out.axes.get_mut(first + k) {
                *axis = applied(parent, column);
            }
            if let Some(slopes) = out.correction_slopes.get_mut(first + k) {
                let [x, y, z] = column;
                let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
                let [[a, b, c], [d, e, f], [g, h, i]] = product(&cross, turn);
                *slopes = [a, b, c, d, e, f, g, h, i];
            }
        }
    }

    fn shift(
        &self,
        index: usize,
        joint: &Joint,
        parent: &Matrix3<f32>,
        turn: &Matrix3<f32>,
        mode: JointMode,
        out: &mut Posed<'_>,
    ) {
        if mode == JointMode::Mean || !self.is_regressed() {
            return;
        }
        for l in 0..self.identity_dim {
            let slope = self.slope(index, l);
            let moved = applied(parent, minus(slope, applied(turn, slope)));
            let above = joint.parent.and_then(|parent| out.shifts.get(parent * self.identity_dim + l).copied());
            if let Some(shift) = out.shifts.get_mut(index * self.identity_dim + l) {
                *shift = above.map_or(moved, |above| plus(above, moved));
            }
        }
    }
}

/// The motion of a joint as a dual quaternion.
fn write_dual(index: usize, joint: &Joint, vector: [f32; 3], translation: [f32; 3], duals: &mut [[f32; 8]]) {
    if duals.is_empty() {
        return;
    }
    let own = rotation_quaternion(vector);
    let parent = joint.parent.and_then(|parent| duals.get(parent));
    let rotation = parent.map_or(own, |[w, x, y, z, ..]| quaternion_product([*w, *x, *y, *z], own));
    if let Some(dual) = duals.get_mut(index) {
        let [w, x, y, z] = rotation;
        let [d, a, b, c] = dual_part(rotation, translation);
        *dual = [w, x, y, z, d, a, b, c];
    }
}

/// Rotation less the identity, by rows.
fn less_identity(&[[a, b, c], [d, e, f], [g, h, i]]: &Matrix3<f32>) -> [f32; 9] {
    [a - 1.0, b, c, d, e - 1.0, f, g, h, i - 1.0]
}

#[inline(always)]
fn plus([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    [a + x, b + y, c + z]
}

#[inline(always)]
fn minus([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    [a - x, b - y, c - z]
}
