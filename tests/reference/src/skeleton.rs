//! A skeleton and its forward kinematics (Wuhrer, ch. 9.3), joint by joint.

use super::number::Number;
use super::placement::{Matrix, rotation_matrix};
use super::quaternion::{Quaternion, dual_part, product, rotation_quaternion};

/// One joint.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)]
pub struct Joint {
    pub parent: Option<usize>,
    /// Unit axis of a revolute joint; a ball has none.
    pub axis: Option<[f32; 3]>,
    pub position: [f32; 3],
}

impl Joint {
    /// Angles.
    pub fn dim(&self) -> usize {
        if self.axis.is_some() { 1 } else { 3 }
    }
}

/// Joints, and how their positions follow the identity.
#[derive(Debug, Clone)]
pub struct Skeleton {
    /// Parents before children.
    pub joints: Vec<Joint>,
    /// `P_jl`: per joint and identity weight; none when joints stay, in the file or by the mode.
    pub basis: Option<Vec<Vec<[f32; 3]>>>,
}

/// A joint in a pose.
#[derive(Debug, Clone)]
pub struct Posed<R> {
    /// `x = R v + t`.
    pub rotation: Matrix<R>,
    /// `t`.
    pub translation: [R; 3],
    /// The same motion as a dual quaternion.
    pub dual: [Quaternion<R>; 2],
    /// Entries of its rotation against the parent less the identity, by rows.
    pub corrections: [R; 9],
    /// Where it stands.
    pub anchor: [R; 3],
    /// `a'_k`: about which each of its angles turns what it carries.
    pub axes: Vec<[R; 3]>,
    /// Derivative of the corrections by each of its angles.
    pub slopes: Vec<[R; 9]>,
    /// `D_jl`: derivative of the translation by each identity weight; empty when joints stay.
    pub shifts: Vec<[R; 3]>,
}

/// `A x`, every row from the left.
pub fn turned<R: Number>(a: &Matrix<R>, x: [R; 3]) -> [R; 3] {
    a.map(|row| (row[0] * x[0] + row[1] * x[1]) + row[2] * x[2])
}

/// `A B`.
pub fn matrix_product<R: Number>(a: &Matrix<R>, b: &Matrix<R>) -> Matrix<R> {
    let column = |j: usize| turned(a, [b[0][j], b[1][j], b[2][j]]);
    let [x, y, z] = [column(0), column(1), column(2)];
    [0, 1, 2].map(|i| [x[i], y[i], z[i]])
}

fn plus<R: Number>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [0, 1, 2].map(|k| a[k] + b[k])
}

fn minus<R: Number>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

/// `[a]x`.
fn cross_matrix<R: Number>([x, y, z]: [R; 3]) -> Matrix<R> {
    let o = R::of(0.0);
    [[o, -z, y], [z, o, -x], [-y, x, o]]
}

/// The left Jacobian of the rotation group.
pub fn left_jacobian<R: Number>([x, y, z]: [R; 3]) -> Matrix<R> {
    let (one, half) = (R::of(1.0), R::of(0.5));
    let q = x * x + y * y + z * z;
    let (g, h) = if q < half * R::EPSILON.sqrt().sqrt() {
        (
            half - q * (R::of(1.0 / 24.0) - q * R::of(1.0 / 720.0)),
            R::of(1.0 / 6.0) - q * (R::of(1.0 / 120.0) - q * R::of(1.0 / 5040.0)),
        )
    } else {
        let a = q.sqrt();
        let s = (a * half).sin();
        let f = a.sin() / a;
        ((s + s) * s / q, (one - f) / q)
    };
    let c = one - h * q;
    [
        [c + h * x * x, h * x * y - g * z, h * x * z + g * y],
        [h * x * y + g * z, c + h * y * y, h * y * z - g * x],
        [h * x * z - g * y, h * y * z + g * x, c + h * z * z],
    ]
}

impl Skeleton {
    /// Angles of all joints.
    pub fn pose_dim(&self) -> usize {
        self.joints.iter().map(Joint::dim).sum()
    }

    /// Where a joint stands in the standard posture: `p_j + sum_l z_l P_jl`.
    pub fn position<R: Number>(&self, j: usize, z: &[R]) -> [R; 3] {
        let mut position = self.joints[j].position.map(|value| R::of(value.into()));
        if let Some(basis) = &self.basis {
            for (l, &z) in z.iter().enumerate() {
                for axis in 0..3 {
                    position[axis] = position[axis] + z * R::of(basis[j][l][axis].into());
                }
            }
        }
        position
    }

    /// All joints at the angles `theta`, standing at `positions`.
    pub fn posed<R: Number>(&self, positions: &[[R; 3]], theta: &[R]) -> Vec<Posed<R>> {
        let (o, l) = (R::of(0.0), R::of(1.0));
        let mut posed: Vec<Posed<R>> = Vec::new();
        let mut first = 0;
        for (j, joint) in self.joints.iter().enumerate() {
            let own = &theta[first..first + joint.dim()];
            first += joint.dim();
            let axis = joint.axis.map(|axis| axis.map(|value| R::of(value.into())));
            let vector = match axis {
                Some(axis) => axis.map(|value| own[0] * value),
                None => [own[0], own[1], own[2]],
            };
            let turn = rotation_matrix(vector);
            let parent = joint.parent.map(|parent| &posed[parent]);
            let above = parent.map_or([[l, o, o], [o, l, o], [o, o, l]], |parent| parent.rotation);
            let shift = parent.map_or([o; 3], |parent| parent.translation);
            let p = positions[j];
            let translation = plus(turned(&above, minus(p, turned(&turn, p))), shift);
            let quaternion = rotation_quaternion(vector);
            let quaternion = parent.map_or(quaternion, |parent| product(parent.dual[0], quaternion));
            // What each angle turns about, seen from the parent.
            let local: Vec<[R; 3]> = match axis {
                Some(axis) => vec![axis],
                None => {
                    let jacobian = left_jacobian(vector);
                    [0, 1, 2].map(|k| [jacobian[0][k], jacobian[1][k], jacobian[2][k]]).to_vec()
                }
            };
            let slope = |axis: &[R; 3]| flat(&matrix_product(&cross_matrix(*axis), &turn));
            let mut corrections = flat(&turn);
            for entry in [0, 4, 8] {
                corrections[entry] = corrections[entry] - l;
            }
            let shifts = self.basis.iter().flat_map(|basis| basis[j].iter().enumerate()).map(|(k, slope)| {
                let slope = slope.map(|value| R::of(value.into()));
                let own = turned(&above, minus(slope, turned(&turn, slope)));
                parent.map_or(own, |parent| plus(parent.shifts[k], own))
            });
            let next = Posed {
                rotation: matrix_product(&above, &turn),
                translation,
                dual: [quaternion, dual_part(quaternion, translation)],
                corrections,
                anchor: plus(turned(&above, p), shift),
                axes: local.iter().map(|axis| turned(&above, *axis)).collect(),
                slopes: local.iter().map(slope).collect(),
                shifts: shifts.collect(),
            };
            posed.push(next);
        }
        posed
    }
}

fn flat<R: Number>(m: &Matrix<R>) -> [R; 9] {
    [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|k| m[k / 3][k % 3])
}
