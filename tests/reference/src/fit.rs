//! Weights and placement from points.

use super::Refusal;
use super::generator::Generator;
use super::levenberg_marquardt::{Bounds, Equations, Limits, Problem, minimum};
use super::normal_equations::{Frame, Sample, equations, linearised};
use super::placement::Placement;
use super::prior::Prior;
use super::procrustes;

/// How to fit.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
pub struct Options<'a> {
    pub frame: Frame,
    pub place: bool,
    pub identity_prior: Prior<'a>,
    pub pose_prior: Prior<'a>,
    pub noise: f32,
    pub limits: Limits<f32>,
}

/// Where a fit ended.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Fit {
    pub identity: Vec<f32>,
    pub pose: Vec<f32>,
    pub placement: Placement<f32>,
    pub rms: f32,
    pub energy: f32,
    pub start_energy: f32,
    pub iterations: u32,
    pub status: u32,
}

/// Fits from the given weights and placement.
pub fn fit(
    model: &dyn Generator,
    samples: &[Option<Sample>],
    options: &Options<'_>,
    identity: &[f32],
    pose: &[f32],
    placement: &Placement<f32>,
) -> Result<Fit, Refusal> {
    let used: Vec<&Sample> = samples.iter().flatten().filter(|sample| sample.weight > 0.0).collect();
    let mut total_weight = 0.0f32;
    for sample in &used {
        total_weight += sample.weight;
    }
    if !(total_weight > 0.0) {
        return Err([105, 0, 0]);
    }
    let mut start = *placement;
    if options.place {
        let sources: Vec<[f32; 3]> = used.iter().map(|sample| linearised(model, identity, pose, sample).0).collect();
        let targets: Vec<[f32; 3]> = used.iter().map(|sample| sample.target).collect();
        let weights: Vec<f32> = used.iter().map(|sample| sample.weight).collect();
        start = procrustes::placement(&sources, &targets, &weights, options.frame == Frame::Similarity)?;
    }
    let free = options.frame.dim();
    let (mut lower, mut upper) = options.identity_prior.bounds(identity.len());
    let (pose_lower, pose_upper) = options.pose_prior.bounds(pose.len());
    lower.extend(pose_lower);
    upper.extend(pose_upper);
    lower.extend(vec![f32::NEG_INFINITY; free]);
    upper.extend(vec![f32::INFINITY; free]);
    let x: Vec<f32> = identity.iter().chain(pose).copied().chain(vec![0.0; free]).collect();
    let mut problem = Fitting {
        model,
        samples,
        options,
        identity_dim: identity.len(),
        weights_dim: identity.len() + pose.len(),
        placement: start,
        trial: start,
        distances: 0.0,
        trial_distances: 0.0,
    };
    let found = minimum(&mut problem, &x, Some(&Bounds { lower, upper }), &options.limits)?;
    Ok(Fit {
        identity: found.x[..identity.len()].to_vec(),
        pose: found.x[identity.len()..identity.len() + pose.len()].to_vec(),
        placement: problem.placement,
        rms: libm::sqrtf(problem.distances / total_weight),
        energy: found.energy,
        start_energy: found.start_energy,
        iterations: found.iterations,
        status: found.status,
    })
}

/// Variables are identity weights, pose weights, motions from the accepted placement.
struct Fitting<'a> {
    model: &'a dyn Generator,
    samples: &'a [Option<Sample>],
    options: &'a Options<'a>,
    identity_dim: usize,
    weights_dim: usize,
    placement: Placement<f32>,
    trial: Placement<f32>,
    distances: f32,
    trial_distances: f32,
}

impl Problem<f32> for Fitting<'_> {
    fn equations(&mut self, x: &[f32]) -> Option<Equations<f32>> {
        let (identity, rest) = x.split_at(self.identity_dim);
        let (pose, m) = rest.split_at(self.weights_dim - self.identity_dim);
        self.trial = match m.len() {
            0 => self.placement,
            6 => self.placement.moved([m[0], m[1], m[2]], [m[3], m[4], m[5]], 0.0),
            _ => self.placement.moved([m[0], m[1], m[2]], [m[3], m[4], m[5]], m[6]),
        };
        if !self.trial.numbers().iter().all(|value| value.is_finite()) || !(self.trial.scale > 0.0) {
            return None;
        }
        let Options { frame, noise, identity_prior, pose_prior, .. } = *self.options;
        if identity.iter().chain(pose).any(|weight| !(weight.abs() <= 1e9)) {
            return None;
        }
        let (distances, mut jtj, mut jtr) = equations(self.model, identity, pose, self.samples, &self.trial, frame);
        if ![distances].iter().chain(&jtr).chain(jtj.iter().flatten()).all(|sum| sum.is_finite()) {
            return None;
        }
        self.trial_distances = distances;
        let precision = 1.0 / (noise * noise);
        for entry in jtj.iter_mut().flatten().chain(&mut jtr) {
            *entry *= precision;
        }
        let identity_energy = identity_prior.add_to(identity, &mut jtj, &mut jtr, 0);
        let pose_energy = pose_prior.add_to(pose, &mut jtj, &mut jtr, self.identity_dim);
        Some((distances * precision + identity_energy + pose_energy, jtj, jtr))
    }

    fn accept(&mut self, x: &mut [f32]) {
        self.placement = self.trial;
        self.distances = self.trial_distances;
        x[self.weights_dim..].fill(0.0);
    }
}
