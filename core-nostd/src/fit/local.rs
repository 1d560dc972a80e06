//! The weights of one coefficient of a wavelet model: a problem of a few unknowns in a box.
//!
//! With the sums over the samples collapsed, the energy of a change `d = s(x, y) - s_0` of the coefficient is `d^T A d - 2 g^T d`, with a symmetric
//! 3 x 3 matrix `A` and a 3-vector `g`, whatever the number of samples. It is quadratic in either mode alone.

use crate::generator::wavelet::local::bilinear;
use crate::linalg::cholesky;
use crate::linalg::{at, set};
use crate::workspace::{Requirement, Workspace};
use crate::{Error, Real};

/// Alternations between the modes, from each start.
const SWEEPS: usize = 4;

/// The energy of a change of one coefficient.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadratic {
    /// `A`: xx, xy, xz, yy, yz, zz.
    pub(super) matrix: [f32; 6],
    pub(super) gradient: [f32; 3],
}

impl Quadratic {
    /// Adds a sample that moves by `influence` times the change: residual `r`, squared weight, and the normal along which alone it counts.
    #[inline(always)]
    pub(super) fn add(&mut self, weight: f32, influence: f32, r: [f32; 3], normal: Option<[f32; 3]>) {
        let factor = weight * influence;
        let square = factor * influence;
        match normal {
            None => {
                for (sum, r) in self.gradient.iter_mut().zip(r) {
                    *sum += factor * r;
                }
                let [xx, _, _, yy, _, zz] = &mut self.matrix;
                for sum in [xx, yy, zz] {
                    *sum += square;
                }
            }
            Some([a, b, c]) => {
                let along = factor * (a * r[0] + b * r[1] + c * r[2]);
                for (sum, n) in self.gradient.iter_mut().zip([a, b, c]) {
                    *sum += along * n;
                }
                for (sum, product) in self.matrix.iter_mut().zip([a * a, a * b, a * c, b * b, b * c, c * c]) {
                    *sum += square * product;
                }
            }
        }
    }

    pub(super) fn trace(&self) -> f32 {
        let [xx, _, _, yy, _, zz] = self.matrix;
        xx + yy + zz
    }

    fn image(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let [xx, xy, xz, yy, yz, zz] = self.matrix;
        [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]
    }

    fn energy(&self, change: [f32; 3]) -> f32 {
        dot(change, self.image(change)) - 2.0 * dot(self.gradient, change)
    }
}

fn dot([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> f32 {
    a * x + b * y + c * z
}

fn plus([a, b, c]: [f32; 3], factor: f32, [x, y, z]: [f32; 3]) -> [f32; 3] {
    [a + factor * x, b + factor * y, c + factor * z]
}

/// One mode of one coefficient: its weights, where they are drawn to and how far they may go.
pub(super) struct Variables<'w> {
    pub(super) weights: &'w mut [f32],
    /// Mean and inverse variance of each weight.
    pub(super) mean: &'w mut [f32],
    pub(super) precision: &'w mut [f32],
    pub(super) lower: &'w mut [f32],
    pub(super) upper: &'w mut [f32],
    best: &'w mut [f32],
    /// The weights are sought.
    pub(super) free: bool,
}

impl<'w> Variables<'w> {
    fn take(dim: usize, workspace: &mut Workspace<'w, f32>) -> Result<Self, Error> {
        Ok(Variables {
            weights: workspace.take(dim)?,
            mean: workspace.take(dim)?,
            precision: workspace.take(dim)?,
            lower: workspace.take(dim)?,
            upper: workspace.take(dim)?,
            best: workspace.take(dim)?,
            free: false,
        })
    }

    /// Energy of the pull to the mean, before its factor.
    fn pull(&self) -> f32 {
        let terms = self.weights.iter().zip(self.mean.iter()).zip(self.precision.iter());
        terms.fold(0.0, |sum, ((weight, mean), precision)| sum + (weight - mean) * (weight - mean) * precision)
    }

    fn keep(&mut self) {
        for (best, weight) in self.best.iter_mut().zip(self.weights.iter()) {
            *best = *weight;
        }
    }
}

/// Memory in which the problems of the coefficients are solved, one after the other.
pub(super) struct Local<'w> {
    pub(super) identity: Variables<'w>,
    pub(super) pose: Variables<'w>,
    /// Terms `m_ij`, j fastest.
    pub(super) core: &'w mut [[f32; 3]],
    slopes: &'w mut [[f32; 3]],
    matrix: &'w mut [f32],
    step: &'w mut [f32],
    /// For each weight: 0 when it may move, -1 when its bound holds it for this step, 1 when it stays until a whole step was made.
    stuck: &'w mut [f32],
}

/// Memory of [`Local::take`].
pub(super) const fn local_req(identity_dim: usize, pose_dim: usize) -> Requirement {
    let most = if identity_dim > pose_dim { identity_dim } else { pose_dim };
    let core = identity_dim.saturating_mul(pose_dim).saturating_mul(3);
    Requirement::of(6 * (identity_dim + pose_dim))
        .and(Requirement::of(core))
        .and(Requirement::of(5 * most))
        .and(Requirement::of(most.saturating_mul(most)))
}

impl<'w> Local<'w> {
    pub(super) fn take(
        identity_dim: usize,
        pose_dim: usize,
        workspace: &mut Workspace<'w, f32>,
    ) -> Result<Self, Error> {
        let most = identity_dim.max(pose_dim);
        Ok(Local {
            identity: Variables::take(identity_dim, workspace)?,
            pose: Variables::take(pose_dim, workspace)?,
            core: workspace.take(3 * identity_dim * pose_dim)?.as_chunks_mut().0,
            slopes: workspace.take(3 * most)?.as_chunks_mut().0,
            matrix: workspace.take(most * most)?,
            step: workspace.take(most)?,
            stuck: workspace.take(most)?,
        })
    }

    /// The coefficient at the weights.
    pub(super) fn value(&self, mean: [f32; 3]) -> [f32; 3] {
        bilinear(mean, self.core, self.identity.weights, self.pose.weights)
    }

    /// Improves the weights and returns the change of the coefficient; `None`, and the weights as they were, when they are as good as can be found.
    ///
    /// Two starts, the weights as they are and their means, each with [`SWEEPS`] alternations; the better of them is taken if it is better than the
    /// weights were.
    pub(super) fn improved(&mut self, mean: [f32; 3], quadratic: &Quadratic, omega: f32) -> Option<[f32; 3]> {
        let start = self.value(mean);
        let mut best_energy = omega * (self.identity.pull() + self.pose.pull());
        let mut best = None;
        self.identity.keep();
        self.pose.keep();
        for from_means in [false, true] {
            if from_means {
                for mode in [&mut self.identity, &mut self.pose] {
                    if mode.free {
                        for (((weight, mean), lower), upper) in
                            mode.weights.iter_mut().zip(mode.mean.iter()).zip(mode.lower.iter()).zip(mode.upper.iter())
                        {
                            *weight = Real::min(Real::max(*mean, *lower), *upper);
                        }
                    }
                }
            }
            let change = |value: [f32; 3]| plus(value, -1.0, start);
            for _ in 0..SWEEPS {
                for mode in [Half::Identity, Half::Pose] {
                    let value = change(self.value(mean));
                    self.minimise(mode, value, quadratic, omega);
                }
            }
            let change = change(self.value(mean));
            let energy = quadratic.energy(change) + omega * (self.identity.pull() + self.pose.pull());
            if energy < best_energy {
                best_energy = energy;
                best = Some(change);
                self.identity.keep();
                self.pose.keep();
            }
        }
        for mode in [&mut self.identity, &mut self.pose] {
            for (weight, best) in mode.weights.iter_mut().zip(mode.best.iter()) {
                *weight = *best;
            }
        }
        best
    }

    /// The best weights of one mode in its box, the other being held, from a change of the coefficient by `change`.
    ///
    /// An active set method: a Newton step of the weights that may move, as far as the box goes; a weight that stops it stays until a whole step was made. Each step
    /// lowers the energy.
    fn minimise(&mut self, half: Half, mut change: [f32; 3], quadratic: &Quadratic, omega: f32) {
        let poses = self.pose.weights.len();
        let (mode, other, strides) = match half {
            Half::Identity => (&mut self.identity, &self.pose, [poses, 1]),
            Half::Pose => (&mut self.pose, &self.identity, [1, poses]),
        };
        if !mode.free {
            return;
        }
        let dim = mode.weights.len();
        for (k, slope) in self.slopes.iter_mut().take(dim).enumerate() {
            *slope = [0.0; 3];
            for (l, &weight) in other.weights.iter().enumerate() {
                let term = self.core.get(k * strides[0] + l * strides[1]).copied().unwrap_or_default();
                *slope = plus(*slope, weight, term);
            }
        }
        let slopes = self.slopes.get(..dim).unwrap_or_default();
        let stuck = &mut *self.stuck;
        stuck.fill(0.0);
        for _ in 0..3 * dim + 3 {
            let [x, y, z] = quadratic.image(change);
            let [a, b, c] = quadratic.gradient;
            let force = [a - x, b - y, c - z];
            let mut count = 0usize;
            for (k, slope) in slopes.iter().enumerate() {
                let weight = at(mode.weights, k);
                let down = dot(*slope, force) - omega * (weight - at(mode.mean, k)) * at(mode.precision, k);
                let outside =
                    (down < 0.0 && weight <= at(mode.lower, k)) || (down > 0.0 && weight >= at(mode.upper, k));
                let moves = !outside && at(stuck, k) == 0.0;
                set(self.step, k, if moves { down } else { 0.0 });
                count += usize::from(moves);
                if !moves && at(stuck, k) == 0.0 {
                    set(stuck, k, -1.0);
                }
            }
            if count == 0 {
                break;
            }
            let matrix = self.matrix.get_mut(..dim * dim).unwrap_or_default();
            let step = self.step.get_mut(..dim).unwrap_or_default();
            let own = |k: usize| omega * at(mode.precision, k);
            if !factored(matrix, slopes, stuck, quadratic, own) || cholesky::solve_in_place(matrix, step).is_err() {
                break;
            }
            let (mut length, mut stops) = (1.0, None);
            for (k, &step) in step.iter().enumerate() {
                let bound = if step < 0.0 { at(mode.lower, k) } else { at(mode.upper, k) };
                let room = bound - at(mode.weights, k);
                if step != 0.0 && room / step < length {
                    length = Real::max(room / step, 0.0);
                    stops = Some((k, bound));
                }
            }
            let mut largest_step = 0.0;
            for (k, (&step, slope)) in step.iter().zip(slopes).enumerate() {
                let step = length * step;
                set(mode.weights, k, at(mode.weights, k) + step);
                change = plus(change, step, *slope);
                largest_step = Real::max(largest_step, Real::abs(step));
            }
            // Those that only their bound has held are asked again.
            let mut any_stuck = false;
            for k in 0..dim {
                if at(stuck, k) < 0.0 {
                    set(stuck, k, 0.0);
                }
                any_stuck |= at(stuck, k) > 0.0;
            }
            match stops {
                Some((k, bound)) => {
                    let weight = at(mode.weights, k);
                    change = plus(change, bound - weight, slopes.get(k).copied().unwrap_or_default());
                    set(mode.weights, k, bound);
                    set(stuck, k, 1.0);
                }
                None if any_stuck => stuck.fill(0.0),
                None if largest_step <= 1e-6 => break,
                None => {}
            }
        }
    }
}

/// The factor of the system of the weights that may move; others have a row of their own.
///
/// More weights than three, or directions that no sample sees, leave the system singular; a little weight on the diagonal keeps the step short there,
/// and more where the entries are what rounding has left of larger numbers.
fn factored(
    matrix: &mut [f32],
    slopes: &[[f32; 3]],
    stuck: &[f32],
    quadratic: &Quadratic,
    own: impl Fn(usize) -> f32,
) -> bool {
    let dim = slopes.len();
    for damping in [1e-5, 1e-4, 1e-3, 1e-2, 0.1] {
        let mut largest = 0.0;
        for (k, slope) in slopes.iter().enumerate() {
            let image = quadratic.image(*slope);
            for (l, other) in slopes.iter().enumerate() {
                let entry = dot(image, *other) + if k == l { own(k) } else { 0.0 };
                largest = if k == l { Real::max(largest, entry) } else { largest };
                let apart = at(stuck, k) != 0.0 || at(stuck, l) != 0.0;
                set(matrix, k * dim + l, if apart { 0.0 } else { entry });
            }
        }
        if !(largest > 0.0) {
            return false;
        }
        for k in 0..dim {
            let entry = at(matrix, k * dim + k) + damping * largest;
            set(matrix, k * dim + k, entry);
        }
        if cholesky::factor_in_place(matrix, dim).is_ok() {
            return true;
        }
    }
    false
}

#[derive(Clone, Copy)]
enum Half {
    Identity,
    Pose,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Stream;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// The least energy by coordinate descent in f64, of the identity weights alone.
    fn least(local: &Local<'_>, mean: [f32; 3], quadratic: &Quadratic, omega: f64, steps: usize) -> f64 {
        let d = local.identity.weights.len();
        let e = local.pose.weights.len();
        let slopes: Vec<[f64; 3]> = (0..d)
            .map(|i| {
                std::array::from_fn(|axis| {
                    (0..e).map(|j| f64::from(local.pose.weights[j]) * f64::from(local.core[i * e + j][axis])).sum()
                })
            })
            .collect();
        let [xx, xy, xz, yy, yz, zz] = quadratic.matrix.map(f64::from);
        let matrix = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let image = |v: [f64; 3]| matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let start: Vec<f64> = local.identity.weights.iter().map(|&w| f64::from(w)).collect();
        let mut w = start.clone();
        let change = |w: &[f64]| -> [f64; 3] {
            std::array::from_fn(|axis| (0..d).map(|i| (w[i] - start[i]) * slopes[i][axis]).sum())
        };
        let of = |values: &[f32], k: usize| f64::from(values[k]);
        for step in 0..steps {
            let k = step % d;
            let u = image(change(&w));
            let gradient = dot(slopes[k], [0, 1, 2].map(|axis| u[axis] - f64::from(quadratic.gradient[axis])))
                + omega * (w[k] - of(local.identity.mean, k)) * of(local.identity.precision, k);
            let curvature = dot(slopes[k], image(slopes[k])) + omega * of(local.identity.precision, k);
            if curvature > 0.0 {
                w[k] = (w[k] - gradient / curvature).clamp(of(local.identity.lower, k), of(local.identity.upper, k));
            }
        }
        let c = change(&w);
        let pull: f64 =
            (0..d).map(|k| (w[k] - of(local.identity.mean, k)).powi(2) * of(local.identity.precision, k)).sum();
        let _ = mean;
        dot(c, image(c)) - 2.0 * dot(quadratic.gradient.map(f64::from), c) + omega * pull
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::cases()))]

        #[test]
        fn one_mode_reaches_the_least_energy_in_its_box(
            seed in 1u32..10_000, d in 1usize..6, e in 1usize..4, samples in 1usize..6, half in 0.1f32..3.0, pulled: bool, normals: bool,
        ) {
            let mut stream = Stream::new(seed);
            let mut memory = vec![f32::NAN; local_req(d, e).numbers()];
            let mut local = Local::take(d, e, &mut Workspace::new(&mut memory)).unwrap();
            for mode in [&mut local.identity, &mut local.pose] {
                for k in 0..mode.weights.len() {
                    mode.mean[k] = stream.next();
                    mode.weights[k] = mode.mean[k] + half * stream.next();
                    mode.precision[k] = 2.0;
                    (mode.lower[k], mode.upper[k]) = (mode.mean[k] - half, mode.mean[k] + half);
                }
            }
            local.identity.free = true;
            local.pose.free = false;
            for term in local.core.iter_mut() {
                *term = [stream.next(), stream.next(), stream.next()];
            }
            let mean = [100.0, 50.0, -20.0];
            let mut quadratic = Quadratic::default();
            for _ in 0..samples {
                let r = [stream.next(), stream.next(), stream.next()];
                quadratic.add(1.0, stream.next(), r, normals.then_some([0.6, 0.0, 0.8]));
            }
            let omega = if pulled { 0.1 } else { 0.0 };
            let reference = least(&local, mean, &quadratic, f64::from(omega), 4000 * d);
            let before = omega * (local.identity.pull() + local.pose.pull());
            let pose_pull = omega * local.pose.pull();
            let change = local.improved(mean, &quadratic, omega).unwrap_or_default();
            let energy = quadratic.energy(change) + omega * (local.identity.pull() + local.pose.pull());
            prop_assert!(energy <= before + 1e-4, "{} {}", energy, before);
            // What a direction that hardly a sample sees is worth, and rounding of a coefficient of 100 mm.
            prop_assert!(f64::from(energy - pose_pull) <= reference + 1e-3, "{} {}", energy - pose_pull, reference);
            for k in 0..d {
                let weight = local.identity.weights[k];
                prop_assert!(local.identity.lower[k] <= weight && weight <= local.identity.upper[k]);
            }
        }
    }
}
