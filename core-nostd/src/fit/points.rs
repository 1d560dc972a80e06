//! Fitting a generator to points whose correspondences the caller supplies.

use super::normal_equations::{Frame, check_sample, normal_equations, normal_equations_req};
use super::samples::{Sample, Samples};
use crate::Error;
use crate::Real;
use crate::generator::{At, Generator, Weights};
use crate::prior::Prior;
use crate::rotation::similarity::Similarity;
use crate::solve::levenberg_marquardt::{LeastSquares, Limits, Status, minimised_in_place, minimised_req};
use crate::solve::procrustes::Moments;
use crate::workspace::{Requirement, Workspace, check_len};

/// How to fit.
#[derive(Debug, Clone, Copy)]
pub struct FitOptions<'a> {
    /// Which motions of the placement are sought beside the weights.
    pub frame: Frame,
    /// Find the first placement from the samples (Procrustes); otherwise start from the one given.
    pub place: bool,
    /// Prior of the identity weights.
    pub identity_prior: Prior<'a>,
    /// Prior of the pose weights.
    pub pose_prior: Prior<'a>,
    /// Standard deviation of the targets per axis, millimetres: what makes distances and priors comparable. Above 0.
    pub noise: f32,
    /// When to stop.
    pub limits: Limits<f32>,
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitReport {
    /// Root of the weighted mean squared distance of the samples, millimetres.
    pub rms: f32,
    /// Energy at the result: squared distances over the noise, and the priors.
    pub energy: f32,
    /// Energy after placing, before the first step.
    pub start_energy: f32,
    /// Iterations.
    pub iterations: u32,
    /// Why the solver stopped.
    pub status: Status,
}

/// Scratch of [`fit_points`], to which [`Generator::state_req`] with derivatives is added (nothing for sums of terms).
pub const fn fit_points_req(identity_dim: usize, pose_dim: usize, frame: Frame) -> Requirement {
    let weights = identity_dim.saturating_add(pose_dim);
    let all = weights.saturating_add(frame.dim());
    normal_equations_req(weights, frame).and(minimised_req(all)).and(Requirement::of(all.saturating_mul(3)))
}

/// Finds weights and placement that minimise `sum_k weight_k |s R x_k(w) + t - target_k|^2 / noise^2 + priors` (Wuhrer ch. 12; maximum a posteriori
/// for targets with independent noise).
///
/// Weights and motions are solved for together by Levenberg-Marquardt with bounds; the placement takes up the motions of every accepted step.
///
/// | argument | shape | note |
/// |---|---|---|
/// | `samples` | at least one with a weight | with `place`: at least three points that are not on a line |
/// | `identity`, `pose` | `identity_dim`, `pose_dim` | start and result; untouched on error |
/// | `placement` | model to scan | start (unless `place`) and result; untouched on error |
/// | `workspace` | [`fit_points_req`] and the generator's state | |
///
/// Order of operations: the sums of the normal equations are multiplied by `1 / (noise * noise)`, rounded once; then the priors are added, identity
/// first. The energy is `(distances * precision + identity prior) + pose prior`, the root mean square `sqrt(distances / sum of weights)`. Placing
/// feeds [`Moments`] with the samples of a weight above zero, in their order.
///
/// Errors: `DimensionMismatch`, `NotFinite`, `IndexOutOfRange`, `WorkspaceTooSmall`, `BadSample`, `BadOption` (1 prior, 2 noise, 3 limits), `Empty`, `Degenerate`.
/// Panics: never.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub fn fit_points<G: Generator + ?Sized, S: Samples + ?Sized>(
    generator: &G,
    samples: &S,
    options: &FitOptions<'_>,
    identity: &mut [f32],
    pose: &mut [f32],
    placement: &mut Similarity<f32>,
    workspace: &mut [f32],
) -> Result<FitReport, Error> {
    let (identity_dim, pose_dim) = (generator.identity_dim(), generator.pose_dim());
    let start = Weights { identity, pose };
    start.check(identity_dim, pose_dim)?;
    options.identity_prior.check(identity_dim)?;
    options.pose_prior.check(pose_dim)?;
    if !(options.noise > 0.0 && options.noise.is_finite()) {
        return Err(Error::BadOption { option: 2 });
    }
    let state_req = generator.state_req(true);
    fit_points_req(identity_dim, pose_dim, options.frame).and(state_req).check(workspace.len())?;
    let (total_weight, moments) = gathered(generator, generator.begin(start, true, workspace)?, samples)?;
    if !(total_weight > 0.0) {
        return Err(Error::Empty);
    }
    let first = if options.place {
        moments.similarity(options.frame == Frame::Similarity)?
    } else if placement.is_finite() {
        *placement
    } else {
        return Err(Error::NotFinite { index: 0 });
    };

    #[cfg(feature = "log")]
    log::debug!("fit: {} samples, {identity_dim} + {pose_dim} weights", samples.len());
    let weights_dim = identity_dim + pose_dim;
    let all = weights_dim + options.frame.dim();
    let mut pieces = Workspace::new(workspace);
    let x = pieces.take(all)?;
    let lower = pieces.take(all)?;
    let upper = pieces.take(all)?;
    let scratch = pieces.take(normal_equations_req(weights_dim, options.frame).and(state_req).numbers())?;
    x.fill(0.0);
    for (to, &from) in x.iter_mut().zip(identity.iter().chain(pose.iter())) {
        *to = from;
    }
    write_bounds(options, identity_dim, weights_dim, lower, upper);
    let mut problem = Problem {
        generator,
        samples,
        options,
        placement: first,
        trial_placement: first,
        scratch,
        distances: 0.0,
        trial_distances: 0.0,
    };
    let outcome = minimised_in_place(&mut problem, x, lower, upper, &options.limits, pieces.rest())?;
    *placement = problem.placement;
    for (to, &from) in identity.iter_mut().chain(pose.iter_mut()).zip(x.iter()) {
        *to = from;
    }
    #[cfg(feature = "log")]
    log::debug!("fit: {:?} after {} iterations, energy {}", outcome.status, outcome.iterations, outcome.energy);
    Ok(FitReport {
        rms: Real::sqrt(problem.distances / total_weight),
        energy: outcome.energy,
        start_energy: outcome.start_energy,
        iterations: outcome.iterations,
        status: outcome.status,
    })
}

/// Sum of the samples' weights, and the moments of their points on the generator at its start and of their targets.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
fn gathered<G: Generator + ?Sized, S: Samples + ?Sized>(
    generator: &G,
    at: At<'_>,
    samples: &S,
) -> Result<(f32, Moments<f32>), Error> {
    let mut total = 0.0;
    let mut moments = Moments::new();
    for index in 0..samples.len() {
        let Some(sample) = samples.get(index) else { continue };
        check_sample(&sample, index, generator.vertex_count())?;
        if sample.weight > 0.0 {
            total += sample.weight;
            moments.add(position(generator, at, &sample), sample.target, sample.weight);
        }
    }
    Ok((total, moments))
}

/// Where a sample's point lies on the generator.
#[inline(always)]
fn position<G: Generator + ?Sized>(generator: &G, at: At<'_>, sample: &Sample) -> [f32; 3] {
    let mut sum = [0.0; 3];
    for (&vertex, &part) in sample.point.vertices.iter().zip(&sample.point.barycentric) {
        if part != 0.0 {
            let value = generator.vertex_unchecked(at, vertex as usize).unwrap_or_default();
            for (sum, value) in sum.iter_mut().zip(value) {
                *sum += part * value;
            }
        }
    }
    sum
}

/// Bounds of the priors; the motions are free.
fn write_bounds(
    options: &FitOptions<'_>,
    identity_dim: usize,
    weights_dim: usize,
    lower: &mut [f32],
    upper: &mut [f32],
) {
    lower.fill(f32::NEG_INFINITY);
    upper.fill(f32::INFINITY);
    let (low, low_rest) = lower.split_at_mut_checked(identity_dim).unwrap_or_default();
    let (high, high_rest) = upper.split_at_mut_checked(identity_dim).unwrap_or_default();
    options.identity_prior.write_bounds(low, high);
    let pose_dim = weights_dim - identity_dim.min(weights_dim);
    let low = low_rest.get_mut(..pose_dim).unwrap_or_default();
    let high = high_rest.get_mut(..pose_dim).unwrap_or_default();
    options.pose_prior.write_bounds(low, high);
}

/// The fit as a sum of squares: variables are the weights, then the motions from the placement.
struct Problem<'a, 'w, G: ?Sized, S: ?Sized> {
    generator: &'a G,
    samples: &'a S,
    options: &'a FitOptions<'a>,
    placement: Similarity<f32>,
    trial_placement: Similarity<f32>,
    scratch: &'w mut [f32],
    /// Weighted squared distances at the accepted point and at the last one, mm^2.
    distances: f32,
    trial_distances: f32,
}

impl<G: Generator + ?Sized, S: Samples + ?Sized> LeastSquares<f32> for Problem<'_, '_, G, S> {
    fn dim(&self) -> usize {
        self.generator.dim() + self.options.frame.dim()
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn normal_equations(&mut self, x: &[f32], jtj: &mut [f32], jtr: &mut [f32]) -> Result<f32, Error> {
        let identity_dim = self.generator.identity_dim();
        let (identity, rest) = x.split_at_checked(identity_dim).unwrap_or_default();
        let (pose, motion) = rest.split_at_checked(self.generator.pose_dim()).unwrap_or_default();
        check_len(self.options.frame.dim(), motion.len())?;
        let step = |k: usize| motion.get(k).copied().unwrap_or(0.0);
        self.trial_placement = if motion.is_empty() {
            self.placement
        } else {
            self.placement.moved([step(0), step(1), step(2)], [step(3), step(4), step(5)], step(6))
        };
        if !self.trial_placement.is_finite() {
            return Err(Error::NotFinite { index: 0 });
        }
        let weights = Weights { identity, pose };
        let frame = self.options.frame;
        let placement = &self.trial_placement;
        let distances =
            normal_equations(self.generator, weights, self.samples, placement, frame, jtj, jtr, self.scratch)?;
        self.trial_distances = distances;
        let precision = 1.0 / (self.options.noise * self.options.noise);
        for entry in jtj.iter_mut().chain(jtr.iter_mut()) {
            *entry *= precision;
        }
        let stride = x.len();
        let identity_energy = self.options.identity_prior.add_to(identity, jtj, jtr, stride, 0);
        let pose_energy = self.options.pose_prior.add_to(pose, jtj, jtr, stride, identity_dim);
        Ok(distances * precision + identity_energy + pose_energy)
    }

    fn accept(&mut self, x: &mut [f32]) {
        self.placement = self.trial_placement;
        self.distances = self.trial_distances;
        for motion in x.iter_mut().skip(self.generator.dim()) {
            *motion = 0.0;
        }
    }
}
