//! The S-SCAPE generator, eq. 9.1 to 9.3, vertex by vertex: a linear rest shape, corrective terms, and the motions of the joints that hold the vertex.

use super::bilinear::Linearised;
use super::generator::by_lanes;
use super::linear::Linear;
use super::number::Number;
use super::quaternion::{Quaternion, dual_part, product};
use super::skeleton::{Posed, Skeleton, turned};
use super::storage::{Sum, Term};

/// A body.
#[derive(Debug, Clone)]
pub struct Skinned {
    /// `mean + A z`.
    pub rest: Linear,
    /// `C`: nine terms for each joint, or none.
    pub corrective: Vec<Term>,
    /// Joints; without a basis they stay where the mean has them.
    pub skeleton: Skeleton,
    /// `omega_j` of every vertex: per joint and vertex, filled up with zeros.
    pub weights: Vec<Vec<f32>>,
    /// Dual quaternions, not matrices.
    pub dual: bool,
}

fn dot<R: Number>(a: [R; 3], b: [R; 3]) -> R {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

fn cross<R: Number>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn scaled<R: Number>(factor: R, a: [R; 3]) -> [R; 3] {
    a.map(|value| factor * value)
}

fn plus<R: Number>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [0, 1, 2].map(|k| a[k] + b[k])
}

/// Sum of vectors, from the left.
fn sum<R: Number, const N: usize>(vectors: [[R; 3]; N]) -> [R; 3] {
    vectors.into_iter().reduce(plus).expect("a vector")
}

fn vector<R: Number>(q: Quaternion<R>) -> [R; 3] {
    [q[1], q[2], q[3]]
}

/// A joint that holds a vertex, with its weight there.
struct Hold<'p, R> {
    joint: usize,
    posed: &'p Posed<R>,
    /// For dual quaternions with the sign that brings the joint to the side of the strongest.
    weight: R,
}

/// `b = r + eps d` of a vertex.
struct Screw<R> {
    r: Quaternion<R>,
    d: Quaternion<R>,
}

impl<R: Number> Screw<R> {
    fn of(holds: &[Hold<'_, R>]) -> Self {
        let part = |dual: usize, k: usize| {
            holds.iter().fold(R::of(0.0), |sum, hold| sum + hold.weight * hold.posed.dual[dual][k])
        };
        Screw { r: [0, 1, 2, 3].map(|k| part(0, k)), d: [0, 1, 2, 3].map(|k| part(1, k)) }
    }

    /// `1 / |r|^2`; zero for a vertex that nothing holds.
    fn inverse(&self) -> R {
        let norm = self.r[0] * self.r[0] + dot(vector(self.r), vector(self.r));
        if norm > R::of(0.0) { R::of(1.0) / norm } else { R::of(0.0) }
    }

    /// `r v r*`.
    fn turned(&self, v: [R; 3]) -> [R; 3] {
        let (w, u, two) = (self.r[0], vector(self.r), R::of(2.0));
        let square = w * w - dot(u, u);
        sum([scaled(square, v), scaled(two * dot(u, v), u), scaled(two * w, cross(u, v))])
    }

    /// `2 d r*`.
    fn shift(&self, d: Quaternion<R>) -> [R; 3] {
        let (w, u, two) = (self.r[0], vector(self.r), R::of(2.0));
        let e = vector(d);
        sum([scaled(two * w, e), scaled(-two * d[0], u), scaled(two, cross(u, e))])
    }

    fn applied(&self, v: [R; 3]) -> [R; 3] {
        plus(self.turned(v), self.shift(self.d)).map(|value| value * self.inverse())
    }

    /// Change of `x`, where `v` goes, by a change of both parts.
    fn by_blend(&self, v: [R; 3], x: [R; 3], dr: Quaternion<R>, dd: Quaternion<R>) -> [R; 3] {
        let two = R::of(2.0);
        let (w, u, d, e) = (self.r[0], vector(self.r), self.d[0], vector(self.d));
        let (dw, du, de) = (dr[0], vector(dr), vector(dd));
        let square = two * (w * dw - dot(u, du));
        let norm = two * (w * dw + dot(u, du));
        let turn = sum([scaled(square, v), scaled(two * dot(du, v), u), scaled(two * dot(u, v), du)]);
        let side = sum([scaled(two * dw, cross(u, v)), scaled(two * w, cross(du, v)), scaled(two * dw, e)]);
        let shift = sum([scaled(two * w, de), scaled(-two * dd[0], u), scaled(-two * d, du)]);
        let rest = sum([scaled(two, cross(du, e)), scaled(two, cross(u, de)), scaled(-norm, x)]);
        sum([turn, side, shift, rest]).map(|value| value * self.inverse())
    }
}

/// How a vertex moves with its rest position and with the joints.
enum Blend<R> {
    /// `B`, by rows.
    Matrix([[R; 3]; 3]),
    Screw(Screw<R>),
}

impl<R: Number> Blend<R> {
    fn by_rest(&self, change: [R; 3]) -> [R; 3] {
        match self {
            Blend::Matrix(b) => turned(b, change),
            Blend::Screw(screw) => screw.turned(change).map(|value| value * screw.inverse()),
        }
    }

    fn by_shift(&self, hold: &Hold<'_, R>, shift: [R; 3]) -> [R; 3] {
        match self {
            Blend::Matrix(_) => scaled(hold.weight, shift),
            Blend::Screw(screw) => {
                let change = dual_part(hold.posed.dual[0], shift).map(|part| hold.weight * part);
                screw.shift(change).map(|value| value * screw.inverse())
            }
        }
    }
}

impl Skinned {
    /// The joints that hold a vertex of the block of `v`, ascending.
    fn holds<'p, R: Number>(&self, posed: &'p [Posed<R>], v: usize) -> Vec<Hold<'p, R>> {
        let block = v / 16 * 16..v / 16 * 16 + 16;
        let mut holds: Vec<Hold<'p, R>> = (0..posed.len())
            .filter(|&joint| block.clone().any(|v| self.weights[joint][v] != 0.0))
            .map(|joint| Hold { joint, posed: &posed[joint], weight: R::of(self.weights[joint][v].into()) })
            .collect();
        if self.dual {
            // The first of the strongest.
            let mut strongest = 0;
            for k in 1..holds.len() {
                if holds[k].weight > holds[strongest].weight {
                    strongest = k;
                }
            }
            let pivot = holds[strongest].posed.dual[0];
            for hold in &mut holds {
                let q = hold.posed.dual[0];
                let along = ((q[0] * pivot[0] + q[1] * pivot[1]) + q[2] * pivot[2]) + q[3] * pivot[3];
                if along < R::of(0.0) {
                    hold.weight = -hold.weight;
                }
            }
        }
        holds
    }

    /// Where a vertex goes that is at `rest` in the standard posture.
    fn moved<R: Number>(&self, holds: &[Hold<'_, R>], rest: [R; 3]) -> [R; 3] {
        if self.dual {
            return Screw::of(holds).applied(rest);
        }
        let mut position = [R::of(0.0); 3];
        for hold in holds {
            let there = plus(turned(&hold.posed.rotation, rest), hold.posed.translation);
            position = plus(position, scaled(hold.weight, there));
        }
        position
    }

    /// Value and derivatives from the rest position, its components (none where the identity is fixed), and the joints.
    fn of_rest<R: Number>(&self, posed: &[Posed<R>], rest: [R; 3], components: Vec<[R; 3]>, v: usize) -> Linearised<R> {
        let holds = self.holds(posed, v);
        let value = self.moved(&holds, rest);
        let blend = if self.dual {
            Blend::Screw(Screw::of(&holds))
        } else {
            let entry = |i: usize, j: usize| {
                holds.iter().fold(R::of(0.0), |sum, hold| sum + hold.weight * hold.posed.rotation[i][j])
            };
            Blend::Matrix([0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j))))
        };
        let mut derivatives: Vec<[R; 3]> = components.iter().map(|&component| blend.by_rest(component)).collect();
        for hold in &holds {
            for (column, &shift) in derivatives.iter_mut().zip(&hold.posed.shifts) {
                *column = plus(*column, blend.by_shift(hold, shift));
            }
        }
        for (joint, turning) in posed.iter().enumerate() {
            for (k, &axis) in turning.axes.iter().enumerate() {
                let mut column = [R::of(0.0); 3];
                for hold in holds.iter().filter(|hold| self.carries(joint, hold.joint)) {
                    column = plus(column, by_turn(&blend, hold, axis, turning.anchor, rest, value));
                }
                if !self.corrective.is_empty() {
                    let mut change = [R::of(0.0); 3];
                    for (term, &slope) in self.corrective[9 * joint..][..9].iter().zip(&turning.slopes[k]) {
                        change = plus(change, scaled(slope, term.decoded(v)));
                    }
                    column = plus(column, blend.by_rest(change));
                }
                derivatives.push(column);
            }
        }
        Linearised { value, derivatives }
    }

    /// Whether a joint is another or one of those above it.
    fn carries(&self, above: usize, joint: usize) -> bool {
        joint == above || self.skeleton.joints[joint].parent.is_some_and(|parent| self.carries(above, parent))
    }

    fn posed<R: Number>(&self, z: &[R], theta: &[R]) -> Vec<Posed<R>> {
        let positions: Vec<[R; 3]> =
            (0..self.skeleton.joints.len()).map(|joint| self.skeleton.position(joint, z)).collect();
        self.skeleton.posed(&positions, theta)
    }

    /// `f(theta)` of all joints; none without corrective terms.
    fn features<R: Number>(&self, posed: &[Posed<R>]) -> Vec<R> {
        posed.iter().flat_map(|joint| joint.corrections).take(self.corrective.len()).collect()
    }

    /// Position of vertex `v` of the identity `z` in the pose `theta`.
    pub fn value<R: Number>(&self, z: &[R], theta: &[R], v: usize) -> [R; 3] {
        let posed = self.posed(z, theta);
        let rest = self.rest.corrected(z, &self.corrective, &self.features(&posed), v);
        self.moved(&self.holds(&posed, v), rest)
    }

    /// Position and derivatives.
    pub fn linearised<R: Number>(&self, z: &[R], theta: &[R], v: usize) -> Linearised<R> {
        let posed = self.posed(z, theta);
        let rest = self.rest.corrected(z, &self.corrective, &self.features(&posed), v);
        let components = self.rest.components.iter().map(|component| component.decoded(v)).collect();
        self.of_rest(&posed, rest, components, v)
    }

    /// Offset and columns when the pose is fixed: the body of identity zero, and its derivatives by the identity there.
    pub fn with_pose<R: Number>(&self, theta: &[R], v: usize) -> Linearised<R> {
        let dim = self.rest.components.len();
        let mut form = self.linearised(&vec![R::of(0.0); dim], theta, v);
        form.derivatives.truncate(dim);
        form
    }

    /// Derivatives of an energy by the weights from those by the positions, for matrices without corrective terms: forces and torques of the
    /// joints, handed down to the root.
    pub fn gradient_by_wrenches(&self, z: &[f32], theta: &[f32], g: &[[f32; 3]]) -> Vec<f32> {
        let posed = self.posed(z, theta);
        let place = |v: usize| self.rest.corrected(z, &self.corrective, &[], v);
        // Force, then torque, of each joint by itself.
        let mut wrenches: Vec<[f32; 6]> = (0..posed.len())
            .map(|joint| {
                let part = |k: usize| {
                    by_lanes(g.len(), |v| {
                        let holds = self.holds(&posed, v);
                        let Some(hold) = holds.iter().find(|hold| hold.joint == joint) else { return 0.0 };
                        let force = scaled(hold.weight, g[v]);
                        let there = plus(turned(&hold.posed.rotation, place(v)), hold.posed.translation);
                        if k < 3 { force[k] } else { cross(there, force)[k - 3] }
                    })
                };
                [0, 1, 2, 3, 4, 5].map(part)
            })
            .collect();
        let mut gradient: Vec<f32> = (0..z.len())
            .map(|l| {
                by_lanes(g.len(), |v| {
                    let holds = self.holds(&posed, v);
                    let entry = |i: usize, j: usize| {
                        holds.iter().fold(0.0, |sum, hold| sum + hold.weight * hold.posed.rotation[i][j])
                    };
                    let back = [0, 1, 2].map(|j| dot([0, 1, 2].map(|i| entry(i, j)), g[v]));
                    dot(self.rest.components[l].decoded(v), back)
                })
            })
            .collect();
        for (joint, wrench) in posed.iter().zip(&wrenches) {
            for (to, &shift) in gradient.iter_mut().zip(&joint.shifts) {
                *to += dot(shift, [wrench[0], wrench[1], wrench[2]]);
            }
        }
        let mut by_angle: Vec<Vec<f32>> = vec![Vec::new(); posed.len()];
        for joint in (0..posed.len()).rev() {
            let [fx, fy, fz, tx, ty, tz] = wrenches[joint];
            if let Some(parent) = self.skeleton.joints[joint].parent {
                for k in 0..6 {
                    wrenches[parent][k] += wrenches[joint][k];
                }
            }
            let moment = cross(posed[joint].anchor, [fx, fy, fz]);
            let torque = [tx - moment[0], ty - moment[1], tz - moment[2]];
            by_angle[joint] = posed[joint].axes.iter().map(|&axis| dot(axis, torque)).collect();
        }
        gradient.extend(by_angle.into_iter().flatten());
        gradient
    }

    /// `R_j` of every joint, for what is bilinear in them.
    pub fn motions<R: Number>(&self, z: &[R], theta: &[R]) -> Vec<([[R; 3]; 3], [R; 3])> {
        self.posed(z, theta).into_iter().map(|joint| (joint.rotation, joint.translation)).collect()
    }
}

/// What a turn about an axis through an anchor changes at a vertex, by one of the joints that hold it.
fn by_turn<R: Number>(
    blend: &Blend<R>,
    hold: &Hold<'_, R>,
    axis: [R; 3],
    anchor: [R; 3],
    rest: [R; 3],
    value: [R; 3],
) -> [R; 3] {
    match blend {
        Blend::Matrix(_) => {
            let there = plus(turned(&hold.posed.rotation, rest), hold.posed.translation);
            let weighted = scaled(hold.weight, there);
            let arm = [0, 1, 2].map(|k| weighted[k] - hold.weight * anchor[k]);
            cross(axis, arm)
        }
        Blend::Screw(screw) => {
            let half = scaled(R::of(0.5), axis);
            let moment = cross(anchor, half);
            let quaternion = |[x, y, z]: [R; 3]| [R::of(0.0), x, y, z];
            let [r, d] = hold.posed.dual;
            let turn = product(quaternion(half), r);
            let (by_turn, by_moment) = (product(quaternion(half), d), product(quaternion(moment), r));
            let dual = [0, 1, 2, 3].map(|k| by_turn[k] + by_moment[k]);
            let weighted = |q: Quaternion<R>| q.map(|part| hold.weight * part);
            screw.by_blend(rest, value, weighted(turn), weighted(dual))
        }
    }
}

/// A body whose identity is fixed: its rest shape and the places of its joints are kept.
#[derive(Debug, Clone)]
pub struct FixedIdentity<R> {
    body: Skinned,
    rest: Vec<[R; 3]>,
    positions: Vec<[R; 3]>,
}

impl<R: Number> FixedIdentity<R> {
    /// Fixes the identity.
    pub fn new(body: &Skinned, z: &[R]) -> Self {
        let rest = (0..body.rest.mean.len()).map(|v| body.rest.value(z, v)).collect();
        let positions = (0..body.skeleton.joints.len()).map(|joint| body.skeleton.position(joint, z)).collect();
        let skeleton = Skeleton { basis: None, ..body.skeleton.clone() };
        FixedIdentity { body: Skinned { skeleton, ..body.clone() }, rest, positions }
    }

    /// Position and derivatives by the pose weights.
    pub fn linearised(&self, theta: &[R], v: usize) -> Linearised<R> {
        let posed = self.body.skeleton.posed(&self.positions, theta);
        let mut rest = self.rest[v];
        if !self.body.corrective.is_empty() {
            let mut sum = Sum::zero();
            for (term, f) in self.body.corrective.iter().zip(self.body.features(&posed)) {
                sum.add(term, v, f);
            }
            rest = plus(rest, sum.total());
        }
        self.body.of_rest(&posed, rest, Vec::new(), v)
    }
}
