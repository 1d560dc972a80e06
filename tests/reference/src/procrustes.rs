//! Horn's closed form of the placement of corresponding points.

use super::Refusal;
use super::eigen::eigenpairs;
use super::number::{Number, larger};
use super::placement::Placement;

const DEGENERATE: Refusal = [403, 0, 0];

/// Sums over pairs of points, relative to the first.
struct Sums<R> {
    total: R,
    sum_p: [R; 3],
    sum_q: [R; 3],
    cross: [[R; 3]; 3],
    spread: [[R; 3]; 3],
}

impl<R: Number> Sums<R> {
    fn zero() -> Self {
        let zero = R::of(0.0);
        Sums { total: zero, sum_p: [zero; 3], sum_q: [zero; 3], cross: [[zero; 3]; 3], spread: [[zero; 3]; 3] }
    }

    fn add(&mut self, p: [R; 3], q: [R; 3], weight: R) {
        self.total = self.total + weight;
        for i in 0..3 {
            self.sum_p[i] = self.sum_p[i] + weight * p[i];
            self.sum_q[i] = self.sum_q[i] + weight * q[i];
            for j in 0..3 {
                self.cross[i][j] = self.cross[i][j] + (weight * p[i]) * q[j];
                self.spread[i][j] = self.spread[i][j] + (weight * p[i.min(j)]) * p[i.max(j)];
            }
        }
    }

    fn plus(&mut self, other: &Sums<R>) {
        self.total = self.total + other.total;
        for i in 0..3 {
            self.sum_p[i] = self.sum_p[i] + other.sum_p[i];
            self.sum_q[i] = self.sum_q[i] + other.sum_q[i];
            for j in 0..3 {
                self.cross[i][j] = self.cross[i][j] + other.cross[i][j];
                self.spread[i][j] = self.spread[i][j] + other.spread[i][j];
            }
        }
    }
}

/// The transform of `sources` that minimises the weighted squared distance to `targets`.
pub fn placement<R: Number>(
    sources: &[[R; 3]],
    targets: &[[R; 3]],
    weights: &[R],
    with_scale: bool,
) -> Result<Placement<R>, Refusal> {
    let mut sums = Sums::zero();
    for ((&source, &target), &weight) in sources.iter().zip(targets).zip(weights) {
        sums.add(less(source, sources[0]), less(target, targets[0]), weight);
    }
    best(sums, sources, targets, with_scale)
}

/// The same for weights of 1, pairs summed by their places in groups of sixteen, then over the places.
pub fn aligned<R: Number>(sources: &[[R; 3]], targets: &[[R; 3]], with_scale: bool) -> Result<Placement<R>, Refusal> {
    let mut sums = Sums::zero();
    for lane in 0..16 {
        let mut of_lane = Sums::zero();
        for k in (lane..sources.len()).step_by(16) {
            of_lane.add(less(sources[k], sources[0]), less(targets[k], targets[0]), R::of(1.0));
        }
        sums.plus(&of_lane);
    }
    best(sums, sources, targets, with_scale)
}

fn less<R: Number>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn best<R: Number>(
    sums: Sums<R>,
    sources: &[[R; 3]],
    targets: &[[R; 3]],
    with_scale: bool,
) -> Result<Placement<R>, Refusal> {
    let zero = R::of(0.0);
    let Sums { total, sum_p, sum_q, cross, spread } = sums;
    if sources.is_empty() {
        return Err(DEGENERATE);
    }
    let (p0, q0) = (sources[0], targets[0]);
    if !(total > zero) {
        return Err(DEGENERATE);
    }
    let mean_p = sum_p.map(|sum| sum / total);
    let mean_q = sum_q.map(|sum| sum / total);
    let h: Vec<Vec<R>> = (0..3).map(|i| (0..3).map(|j| cross[i][j] - sum_p[i] * mean_q[j]).collect()).collect();
    let scatter: Vec<Vec<R>> =
        (0..3).map(|i| (0..3).map(|j| spread[i][j] - sum_p[i.min(j)] * mean_p[i.max(j)]).collect()).collect();
    let (values, _) = eigenpairs(&scatter)?;
    let ratio = larger(R::of(1e-12), R::EPSILON * R::of(8.0));
    if !(values[0][0] > zero && values[1][1] > ratio * values[0][0]) {
        return Err(DEGENERATE);
    }

    // Horn's symmetric matrix; x, y, z are axes 0, 1, 2.
    let (xx, yy, zz) = (h[0][0], h[1][1], h[2][2]);
    let differences = [h[1][2] - h[2][1], h[2][0] - h[0][2], h[0][1] - h[1][0]];
    let (xy, zx, yz) = (h[0][1] + h[1][0], h[2][0] + h[0][2], h[1][2] + h[2][1]);
    let matrix = vec![
        vec![xx + yy + zz, differences[0], differences[1], differences[2]],
        vec![differences[0], xx - yy - zz, xy, zx],
        vec![differences[1], xy, -xx + yy - zz, yz],
        vec![differences[2], zx, yz, -xx - yy + zz],
    ];
    let (values, vectors) = eigenpairs(&matrix)?;
    // Two best quaternions: any turn between them does as well.
    let apart = larger(R::of(1e-12), R::EPSILON * R::of(16.0));
    if !(values[0][0] - values[1][1] > apart * values[0][0]) {
        return Err(DEGENERATE);
    }
    let rotation = matrix_of_quaternion(&vectors[0]);
    let mut scale = R::of(1.0);
    if with_scale {
        let mut along = zero;
        for i in 0..3 {
            for j in 0..3 {
                along = along + rotation[j][i] * h[i][j];
            }
        }
        scale = along / (scatter[0][0] + scatter[1][1] + scatter[2][2]);
    }
    if !(scale > zero) {
        return Err(DEGENERATE);
    }
    let turned = Placement { scale, rotation, translation: [zero; 3] };
    let from = turned.applied([0, 1, 2].map(|k| p0[k] + mean_p[k]));
    let found = Placement { translation: [0, 1, 2].map(|k| q0[k] + mean_q[k] - from[k]), ..turned };
    if found.numbers().iter().all(|value| value.is_finite()) { Ok(found) } else { Err([103, 0, 0]) }
}

fn matrix_of_quaternion<R: Number>(q: &[R]) -> [[R; 3]; 3] {
    let (one, two) = (R::of(1.0), R::of(2.0));
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    [
        [one - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y)],
        [two * (x * y + w * z), one - two * (x * x + z * z), two * (y * z - w * x)],
        [two * (x * z - w * y), two * (y * z + w * x), one - two * (x * x + y * y)],
    ]
}
