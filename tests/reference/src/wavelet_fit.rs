//! The fit of a wavelet model, level by level and one coefficient at a time (Wuhrer, ch. 15).

use super::Refusal;
use super::cholesky::{factor, solution};
use super::multiscale::{Multiscale, Spread};
use super::normal_equations::{Frame, Sample};
use super::number::larger;
use super::placement::Placement;
use super::procrustes;
use super::wavelet::{Node, lines_of};

/// How to fit; `None` holds the weights of a mode.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Options<'a> {
    pub frame: Frame,
    pub spreads: [Option<&'a Spread>; 2],
    pub kappa: f32,
    pub omega: f32,
    pub levels: std::ops::Range<usize>,
    pub passes: u32,
}

/// Where a fit ended.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Fit {
    pub identity: Vec<f32>,
    pub pose: Vec<f32>,
    pub placement: Placement<f32>,
    pub rms: f32,
    pub start_rms: f32,
    pub passes: u32,
    pub reached: u32,
}

type Vector = [f32; 3];

fn dot(a: Vector, b: Vector) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn plus(a: Vector, factor: f32, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] + factor * b[k])
}

/// A sample that counts, with where its node lies and what is missing to its target, both in the frame of the model.
struct Point<'a> {
    sample: &'a Sample,
    node: [usize; 2],
    position: Vector,
    residual: Vector,
}

/// Fits from the given weights and placement.
pub fn fit(
    model: &Multiscale,
    samples: &[Option<Sample>],
    options: &Options<'_>,
    identity: &[f32],
    pose: &[f32],
    placement: &Placement<f32>,
) -> Result<Fit, Refusal> {
    let grid = model.vertex_grid();
    let used = samples.iter().flatten().filter(|sample| sample.weight > 0.0);
    let points: Vec<Point<'_>> = used
        .map(|sample| {
            let corner = (0..3).find(|&k| sample.barycentric[k] == 1.0).expect("a sample at a vertex");
            let node = model.node(sample.corners[corner] as usize);
            Point { sample, node, position: [0.0; 3], residual: [0.0; 3] }
        })
        .collect();
    // By cells of the finest fitted level, within a cell the last first.
    let side = grid.step(options.levels.end - 1);
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|&k| (points[k].node[1] / side, points[k].node[0] / side, std::cmp::Reverse(k)));
    let weights = [identity.to_vec(), pose.to_vec()];
    let mut fit = Fitting { model, options, points, order, weights, placement: *placement };

    let nodes = grid.nodes();
    for (q, node) in nodes.iter().enumerate() {
        let value = fit.value(q);
        for (k, influence) in fit.influences(node) {
            fit.points[k].position = plus(fit.points[k].position, influence, value);
        }
    }
    if options.frame != Frame::Fixed {
        fit.placement = fit.placed()?;
    }
    let start_rms = fit.residuals();
    let (mut passes, mut reached) = (0, 0);
    for level in options.levels.clone() {
        for _ in 0..options.passes {
            for (q, node) in nodes.iter().enumerate().filter(|(_, node)| node.level == level) {
                reached += u32::from(fit.improve(q, node));
            }
            passes += 1;
            if options.frame != Frame::Fixed
                && let Ok(placement) = fit.placed()
            {
                fit.placement = placement;
            }
            fit.residuals();
        }
    }
    let rms = fit.residuals();
    let [identity, pose] = fit.weights;
    Ok(Fit { identity, pose, placement: fit.placement, rms, start_rms, passes, reached })
}

struct Fitting<'a> {
    model: &'a Multiscale,
    options: &'a Options<'a>,
    points: Vec<Point<'a>>,
    order: Vec<usize>,
    weights: [Vec<f32>; 2],
    placement: Placement<f32>,
}

impl Fitting<'_> {
    /// The points that a coefficient moves, in the order in which they are summed, and how far.
    fn influences(&self, node: &Node) -> Vec<(usize, f32)> {
        let [x, y] = lines_of::<f32>(&self.model.vertex_grid(), self.model.wavelet, node);
        let all = self.order.iter().map(|&k| (k, x[self.points[k].node[0]] * y[self.points[k].node[1]]));
        all.filter(|&(_, influence)| influence != 0.0).collect()
    }

    /// Own weights of a coefficient.
    fn own(&self, q: usize) -> [Vec<f32>; 2] {
        let dims = self.model.local_dims();
        [0, 1].map(|mode| self.weights[mode][q * dims[mode]..(q + 1) * dims[mode]].to_vec())
    }

    fn value(&self, q: usize) -> Vector {
        if q >= self.model.weighted() {
            return self.model.mean_of(q);
        }
        let [x, y] = self.own(q);
        self.model.local(q, &x, &y)
    }

    fn placed(&self) -> Result<Placement<f32>, Refusal> {
        let sources: Vec<Vector> = self.points.iter().map(|point| point.position).collect();
        let targets: Vec<Vector> = self.points.iter().map(|point| point.sample.target).collect();
        let weights: Vec<f32> = self.points.iter().map(|point| point.sample.weight).collect();
        procrustes::placement(&sources, &targets, &weights, self.options.frame == Frame::Similarity)
    }

    /// Writes the residuals; the root mean square in millimetres of the scan.
    fn residuals(&mut self) -> f32 {
        let (mut sum, mut total) = (0.0f32, 0.0f32);
        for point in &mut self.points {
            let target = self.placement.inverse_applied(point.sample.target);
            point.residual = [0, 1, 2].map(|k| target[k] - point.position[k]);
            let square = match point.sample.normal {
                Some(normal) => {
                    let along = dot(self.placement.inverse_rotated(normal), point.residual);
                    along * along
                }
                None => dot(point.residual, point.residual),
            };
            sum += point.sample.weight * square;
            total += point.sample.weight;
        }
        self.placement.scale * libm::sqrtf(sum / total)
    }

    /// Improves a coefficient; whether any point sees it.
    fn improve(&mut self, q: usize, node: &Node) -> bool {
        let influences = self.influences(node);
        let scale = self.placement.scale * self.placement.scale;
        let (mut matrix, mut gradient) = ([[0.0f32; 3]; 3], [0.0f32; 3]);
        for &(k, influence) in &influences {
            let point = &self.points[k];
            let factor = scale * point.sample.weight * influence;
            let square = factor * influence;
            match point.sample.normal.map(|normal| self.placement.inverse_rotated(normal)) {
                None => {
                    gradient = plus(gradient, factor, point.residual);
                    for axis in 0..3 {
                        matrix[axis][axis] += square;
                    }
                }
                Some(n) => {
                    gradient = plus(gradient, factor * dot(n, point.residual), n);
                    for i in 0..3 {
                        for j in 0..3 {
                            matrix[i][j] += square * (n[i.min(j)] * n[i.max(j)]);
                        }
                    }
                }
            }
        }
        if !(matrix[0][0] + matrix[1][1] + matrix[2][2] >= 1e-12) {
            return false;
        }
        let own = self.own(q);
        let modes = [0, 1].map(|mode| Mode::new(self.options, mode, q, &own[mode]));
        let mut local = Local { model: self.model, q, matrix, gradient, omega: self.options.omega, modes };
        if let Some(change) = local.improved().filter(|change| change.iter().all(|value| value.is_finite())) {
            for (all, mode) in self.weights.iter_mut().zip(&local.modes) {
                let from = q * mode.weights.len();
                all[from..from + mode.weights.len()].copy_from_slice(&mode.weights);
            }
            for (k, influence) in influences {
                self.points[k].position = plus(self.points[k].position, influence, change);
                self.points[k].residual =
                    [0, 1, 2].map(|axis| self.points[k].residual[axis] - influence * change[axis]);
            }
        }
        true
    }
}

/// The weights of one mode of a coefficient, what draws them and the box.
#[derive(Clone)]
struct Mode {
    free: bool,
    weights: Vec<f32>,
    mean: Vec<f32>,
    precision: Vec<f32>,
    lower: Vec<f32>,
    upper: Vec<f32>,
}

impl Mode {
    fn new(options: &Options<'_>, mode: usize, q: usize, weights: &[f32]) -> Self {
        let held = weights.to_vec();
        let Some(spread) = options.spreads[mode] else {
            let precision = vec![0.0; held.len()];
            let (mean, lower, upper) = (held.clone(), held.clone(), held.clone());
            return Mode { free: false, weights: held, mean, precision, lower, upper };
        };
        let range = q * held.len()..(q + 1) * held.len();
        let (mean, scale) = (&spread.mean[range.clone()], &spread.scale[range]);
        // The box grows to hold the weights as they are.
        let bound = |sign: f32| -> Vec<f32> {
            let ends = held.iter().zip(mean).zip(scale);
            ends.map(|((&weight, &mean), &scale)| {
                let end = mean + sign * (options.kappa * scale);
                if sign * end > sign * weight { end } else { weight }
            })
            .collect()
        };
        let (lower, upper) = (bound(-1.0), bound(1.0));
        let precision = scale.iter().map(|scale| 1.0 / (scale * scale)).collect();
        Mode { free: true, weights: held, mean: mean.to_vec(), precision, lower, upper }
    }

    fn pull(&self) -> f32 {
        let mut sum = 0.0;
        for k in 0..self.weights.len() {
            let off = self.weights[k] - self.mean[k];
            sum += off * off * self.precision[k];
        }
        sum
    }
}

/// The problem of a coefficient: `d^T A d - 2 g^T d` of its change d, and the pull of its weights to their means.
struct Local<'a> {
    model: &'a Multiscale,
    q: usize,
    matrix: [Vector; 3],
    gradient: Vector,
    omega: f32,
    modes: [Mode; 2],
}

impl Local<'_> {
    fn value(&self) -> Vector {
        self.model.local(self.q, &self.modes[0].weights, &self.modes[1].weights)
    }

    fn image(&self, v: Vector) -> Vector {
        self.matrix.map(|row| dot(row, v))
    }

    fn pulls(&self) -> f32 {
        self.omega * (self.modes[0].pull() + self.modes[1].pull())
    }

    /// The better of four alternations from the weights and four more from their means, if it is better than the weights were.
    fn improved(&mut self) -> Option<Vector> {
        let start = self.value();
        let (mut least, mut best) = (self.pulls(), None);
        for from_means in [false, true] {
            for mode in self.modes.iter_mut().filter(|mode| from_means && mode.free) {
                for k in 0..mode.weights.len() {
                    mode.weights[k] = mode.mean[k].clamp(mode.lower[k], mode.upper[k]);
                }
            }
            for _ in 0..4 {
                self.minimise(0, start);
                self.minimise(1, start);
            }
            let change = plus(self.value(), -1.0, start);
            let energy = dot(change, self.image(change)) - 2.0 * dot(self.gradient, change) + self.pulls();
            if energy < least {
                least = energy;
                best = Some((change, self.modes.clone()));
            }
        }
        let (change, modes) = best?;
        self.modes = modes;
        Some(change)
    }

    /// The best weights of one mode in its box: Newton steps of the weights that may move, as far as the box goes.
    fn minimise(&mut self, of: usize, start: Vector) {
        if !self.modes[of].free {
            return;
        }
        let mut change = plus(self.value(), -1.0, start);
        let dim = self.modes[of].weights.len();
        let other = &self.modes[1 - of].weights;
        let slopes: Vec<Vector> = (0..dim)
            .map(|k| {
                if of == 0 {
                    self.model.identity_slope(self.q, other, k)
                } else {
                    self.model.pose_slope(self.q, other, k)
                }
            })
            .collect();
        // Weights that a bound has stopped: they stay until a whole step was made.
        let mut stopped = vec![false; dim];
        for _ in 0..3 * dim + 3 {
            let mode = &self.modes[of];
            let image = self.image(change);
            let force = [0, 1, 2].map(|axis| self.gradient[axis] - image[axis]);
            let down: Vec<f32> = (0..dim)
                .map(|k| dot(slopes[k], force) - self.omega * (mode.weights[k] - mode.mean[k]) * mode.precision[k])
                .collect();
            let moves: Vec<bool> = (0..dim)
                .map(|k| {
                    let leaves_below = down[k] < 0.0 && mode.weights[k] <= mode.lower[k];
                    let leaves_above = down[k] > 0.0 && mode.weights[k] >= mode.upper[k];
                    !stopped[k] && !leaves_below && !leaves_above
                })
                .collect();
            let entry = |k: usize, l: usize| {
                let own = if k == l { self.omega * mode.precision[k] } else { 0.0 };
                dot(self.image(slopes[k]), slopes[l]) + own
            };
            let largest = (0..dim).fold(0.0, |largest, k| larger(largest, entry(k, k)));
            if !moves.contains(&true) || !(largest > 0.0) {
                return;
            }
            let system: Vec<Vec<f32>> = (0..dim)
                .map(|k| {
                    let row = (0..dim).map(|l| {
                        let entry = if moves[k] && moves[l] { entry(k, l) } else { 0.0 };
                        if k == l { entry + 1e-5 * largest } else { entry }
                    });
                    row.collect()
                })
                .collect();
            let Ok(root) = factor(&system) else { return };
            let right: Vec<f32> = (0..dim).map(|k| if moves[k] { down[k] } else { 0.0 }).collect();
            let step = solution(&root, &right);
            let (mut length, mut stops) = (1.0f32, None);
            for k in 0..dim {
                let bound = if step[k] < 0.0 { mode.lower[k] } else { mode.upper[k] };
                let room = bound - mode.weights[k];
                if step[k] != 0.0 && room / step[k] < length {
                    length = larger(room / step[k], 0.0);
                    stops = Some((k, bound));
                }
            }
            let weights = &mut self.modes[of].weights;
            let mut longest = 0.0f32;
            for k in 0..dim {
                let part = length * step[k];
                weights[k] += part;
                change = plus(change, part, slopes[k]);
                longest = larger(longest, part.abs());
            }
            if let Some((k, bound)) = stops {
                change = plus(change, bound - weights[k], slopes[k]);
                weights[k] = bound;
                stopped[k] = true;
            } else if stopped.contains(&true) {
                stopped.fill(false);
            } else if longest <= 1e-6 {
                return;
            }
        }
    }
}
