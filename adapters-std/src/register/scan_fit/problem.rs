//! One round of a fit as a sum of squares: the kernel's normal equations of the samples, and the priors.

use habitus_core::fit::{Frame, Sample, normal_equations_req};
use habitus_core::generator::{Generator, Weights};
use habitus_core::linalg::cholesky::{factor_in_place, solve_in_place};
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::{LeastSquares, Limits, minimised_in_place, minimised_req};
use rayon::prelude::*;

use super::held::Held;
use super::state::{Priors, State};
use crate::Error;
use crate::evaluate::normal_equations;

/// Samples of which one task sums the normal equations; fixed, so that the sums do not depend on the number of threads.
const CHUNK: usize = 1024;

/// Damping relative to the diagonal.
const DAMPING: f64 = 1e-6;

/// Energy `sum_k weight_k r_k^2 + factor (identity prior + pose prior)` over the free weights and the motions.
struct Problem<'a> {
    held: &'a Held,
    samples: &'a [Sample],
    priors: &'a Priors,
    /// Precision of the displacement's amplitudes.
    smooth: &'a [f64],
    prior_factors: [f64; 2],
    frame: Frame,
    state: State,
    trial: State,
}

/// Sums of one chunk.
struct Sums {
    jtj: Vec<f32>,
    jtr: Vec<f32>,
    energy: f32,
}

impl Problem<'_> {
    fn sums(&self, chunk: &[Sample], n: usize) -> Result<Sums, habitus_core::Error> {
        let mut sums = Sums { jtj: vec![0.0; n * n], jtr: vec![0.0; n], energy: 0.0 };
        let mut workspace = vec![0.0; normal_equations_req(self.held.dim(), self.frame).numbers()];
        let pose: Vec<f32> = self.trial.pose.iter().chain(&self.trial.amplitudes).copied().collect();
        let weights = Weights { identity: &self.trial.identity[..self.held.identity_dim()], pose: &pose };
        let placement = &self.trial.placement;
        let (jtj, jtr) = (&mut sums.jtj[..], &mut sums.jtr[..]);
        sums.energy = normal_equations(self.held, weights, chunk, placement, self.frame, jtj, jtr, &mut workspace)?;
        Ok(sums)
    }

    /// Adds the prior of one group, of which the first `dim` weights are free, at variable `first`.
    fn add_prior(&self, identity: bool, dim: usize, first: usize, jtj: &mut [f64], jtr: &mut [f64]) -> f64 {
        let (prior, weights, factor) = if identity {
            (&self.priors.identity, &self.trial.identity, self.prior_factors[0])
        } else {
            (&self.priors.pose, &self.trial.pose, self.prior_factors[1])
        };
        let (all, stride) = (prior.mean.len(), jtr.len());
        for (i, gradient) in prior.gradient(weights).into_iter().take(dim).enumerate() {
            jtr[first + i] += factor * gradient;
            for j in 0..dim {
                jtj[(first + i) * stride + first + j] += factor * prior.precision[i * all + j];
            }
        }
        factor * prior.energy(weights)
    }
}

impl Problem<'_> {
    /// Adds the prior of the displacement, whose amplitudes begin at variable `first`.
    fn add_smoothness(&self, first: usize, jtj: &mut [f64], jtr: &mut [f64]) -> f64 {
        let (amplitudes, stride) = (&self.trial.amplitudes, jtr.len());
        let mut energy = 0.0;
        for (i, row) in self.smooth.chunks_exact(amplitudes.len().max(1)).enumerate() {
            let gradient: f64 = row.iter().zip(amplitudes).map(|(p, &a)| p * f64::from(a)).sum();
            jtr[first + i] += gradient;
            energy += gradient * f64::from(amplitudes[i]);
            let entries = &mut jtj[(first + i) * stride + first..][..row.len()];
            entries.iter_mut().zip(row).for_each(|(to, p)| *to += p);
        }
        energy
    }
}

impl Problem<'_> {
    /// The free weights, and no motion.
    fn variables(&self) -> Vec<f64> {
        let state = &self.state;
        let weights = state.identity[..self.held.identity_dim()].iter().chain(&state.pose).chain(&state.amplitudes);
        weights.map(|&x| f64::from(x)).chain(std::iter::repeat_n(0.0, self.frame.dim())).collect()
    }

    /// Makes `x` the trial state.
    fn try_at(&mut self, x: &[f64]) {
        let (identity_dim, pose_dim) = (self.held.identity_dim(), self.held.pose_dim());
        self.trial.clone_from(&self.state);
        for (to, &from) in self.trial.identity[..identity_dim].iter_mut().zip(x) {
            *to = from as f32;
        }
        let pose = self.trial.pose.iter_mut().chain(&mut self.trial.amplitudes);
        for (to, &from) in pose.zip(&x[identity_dim..identity_dim + pose_dim]) {
            *to = from as f32;
        }
        if let [a, b, c, u, v, w, rest @ ..] = &x[identity_dim + pose_dim..] {
            let single = |x: &f64| *x as f32;
            let log_scale = rest.first().map_or(0.0, single);
            self.trial.placement = self.state.placement.moved([a, b, c].map(single), [u, v, w].map(single), log_scale);
        }
    }
}

impl LeastSquares<f64> for Problem<'_> {
    fn dim(&self) -> usize {
        self.held.dim() + self.frame.dim()
    }

    fn normal_equations(&mut self, x: &[f64], jtj: &mut [f64], jtr: &mut [f64]) -> Result<f64, habitus_core::Error> {
        self.try_at(x);
        let identity_dim = self.held.identity_dim();
        let n = x.len();
        let chunks: Vec<_> = self.samples.par_chunks(CHUNK).map(|chunk| self.sums(chunk, n)).collect();
        jtj.fill(0.0);
        jtr.fill(0.0);
        let mut energy = 0.0;
        for sums in chunks {
            let sums = sums?;
            jtj.iter_mut().zip(&sums.jtj).for_each(|(to, &from)| *to += f64::from(from));
            jtr.iter_mut().zip(&sums.jtr).for_each(|(to, &from)| *to += f64::from(from));
            energy += f64::from(sums.energy);
        }
        energy += self.add_prior(true, identity_dim, 0, jtj, jtr);
        let own_pose = self.trial.pose.len();
        energy += self.add_prior(false, own_pose, identity_dim, jtj, jtr);
        energy += self.add_smoothness(identity_dim + own_pose, jtj, jtr);
        Ok(energy)
    }

    fn accept(&mut self, x: &mut [f64]) {
        self.state.clone_from(&self.trial);
        for motion in x.iter_mut().skip(self.held.dim()) {
            *motion = 0.0;
        }
    }
}

/// What is believed before anything is measured.
#[derive(Clone, Copy)]
pub(super) struct Belief<'a> {
    pub of_weights: &'a Priors,
    /// What the priors of identity and pose are multiplied with.
    pub factors: [f64; 2],
    /// Of the amplitudes of the smooth displacement; empty without one.
    pub smooth: &'a [f64],
}

/// The state that minimises the energy of `samples` on the linear model `held`, from `state`.
pub(super) fn improved(
    held: &Held,
    samples: &[Sample],
    Belief { of_weights: priors, factors: prior_factors, smooth }: Belief<'_>,
    frame: Frame,
    state: &State,
    max_iterations: u32,
) -> Result<State, Error> {
    let mut problem =
        Problem { held, samples, priors, smooth, prior_factors, frame, state: state.clone(), trial: state.clone() };
    let mut x = problem.variables();
    let mut workspace = vec![0.0; minimised_req(x.len()).numbers()];
    let limits = Limits { max_iterations, relative_decrease: 1e-4, damping: DAMPING };
    minimised_in_place(&mut problem, &mut x, &[], &[], &limits, &mut workspace)
        .map_err(|error| Error::Kernel { what: "the fit cannot be improved".into(), error })?;
    Ok(problem.state)
}

/// The state after one Gauss-Newton step on the energy of `samples` on the linear model `held`, from `state`. Between two steps pairs and
/// weights change anyway, so the energy at its end is not looked at.
pub(super) fn stepped(
    held: &Held,
    samples: &[Sample],
    Belief { of_weights: priors, factors: prior_factors, smooth }: Belief<'_>,
    frame: Frame,
    state: &State,
) -> Result<State, Error> {
    let mut problem =
        Problem { held, samples, priors, smooth, prior_factors, frame, state: state.clone(), trial: state.clone() };
    let mut x = problem.variables();
    let n = x.len();
    let (mut jtj, mut jtr) = (vec![0.0; n * n], vec![0.0; n]);
    let named = |error| Error::Kernel { what: "the fit cannot be improved".into(), error };
    problem.normal_equations(&x, &mut jtj, &mut jtr).map_err(named)?;
    for diagonal in jtj.iter_mut().step_by(n + 1) {
        *diagonal = if *diagonal > 0.0 { *diagonal * (1.0 + DAMPING) } else { 1.0 };
    }
    factor_in_place(&mut jtj, n).map_err(named)?;
    solve_in_place(&jtj, &mut jtr).map_err(named)?;
    x.iter_mut().zip(&jtr).for_each(|(x, step)| *x -= step);
    problem.try_at(&x);
    Ok(problem.trial)
}

/// The kernel's similarity as one of the adapters, in double precision.
pub(super) fn widened(placement: &Similarity<f32>) -> Similarity<f64> {
    Similarity {
        scale: f64::from(placement.scale),
        rotation: placement.rotation.map(|row| row.map(f64::from)),
        translation: placement.translation.map(f64::from),
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{face, held, mean_state, model};
    use super::*;
    use habitus_core::fit::SurfacePoint;

    fn samples(target: &[[f64; 3]]) -> Vec<Sample> {
        let normal = |v: usize| (v.is_multiple_of(2)).then_some([0.0, 0.6, 0.8]);
        let sample = |v: usize| Sample {
            point: SurfacePoint::vertex(v as u32),
            target: target[v].map(|x| x as f32),
            normal: normal(v),
            weight: 0.05,
        };
        (0..target.len()).step_by(5).map(sample).collect()
    }

    /// The gradient of samples, priors and displacement is that of the energy, by finite differences.
    #[test]
    fn gradient_is_that_of_the_energy() {
        let priors = Priors::of(&model()).expect("priors");
        let mut state = mean_state();
        let n = model().header().n_vertices as usize;
        let bent = super::super::displacement::Displacement {
            heights: vec![vec![1.0; n], (0..n).map(|v| v as f32 / n as f32).collect()],
            components: Vec::new(),
            precision: vec![5.0, 1.0, 1.0, 4.0],
        };
        state.amplitudes = vec![0.4, -0.3];
        let held = held(&state).displaced(&bent, &state.amplitudes, &super::super::samples::faces());
        let samples = samples(&face(&[1.0, -0.5], &[0.5]).positions);
        let mut problem = Problem {
            held: &held,
            samples: &samples,
            priors: &priors,
            smooth: &bent.precision,
            prior_factors: [3.0, 2.0],
            frame: Frame::Rigid,
            state: state.clone(),
            trial: state.clone(),
        };
        let free = state.identity.iter().chain(&state.pose).chain(&state.amplitudes).map(|&x| f64::from(x) + 0.1);
        let x: Vec<f64> = free.chain([0.0; 6]).collect();
        let dim = problem.dim();
        assert_eq!(dim, x.len());
        let (mut jtj, mut jtr) = (vec![0.0; dim * dim], vec![0.0; dim]);
        problem.normal_equations(&x, &mut jtj, &mut jtr).expect("sums");
        let mut energy = |k: usize, step: f64| {
            let mut moved = x.clone();
            moved[k] += step;
            problem.normal_equations(&moved, &mut vec![0.0; dim * dim], &mut vec![0.0; dim]).expect("sums")
        };
        for k in 0..dim {
            let step = if (9..12).contains(&k) { 1e-3 } else { 0.1 };
            let slope = (energy(k, step) - energy(k, -step)) / (4.0 * step);
            assert!((slope - jtr[k]).abs() < 0.02 * (1.0 + jtr[k].abs().max(slope.abs())), "{k}: {slope} {}", jtr[k]);
            assert!(jtj[k * dim + k] > 0.0);
        }
    }

    /// One improvement of a face of the model lowers its distance; without samples the priors draw to the mean.
    #[test]
    fn improvement_fits_and_the_priors_hold() {
        let priors = Priors::of(&model()).expect("priors");
        let belief = Belief { of_weights: &priors, factors: [1.0; 2], smooth: &[] };
        let truth = face(&[1.0, -0.5], &[0.5]).positions;
        let start = mean_state();
        let better = improved(&held(&start), &samples(&truth), belief, Frame::Rigid, &start, 5).expect("a state");
        let distance =
            |state: &State| super::super::samples::mean_distance(&super::super::samples::placed(state), &truth);
        assert!(distance(&better) < 0.4 * distance(&start), "{} {}", distance(&better), distance(&start));
        let mut away = start.clone();
        away.identity[0] += 1.0;
        let back = improved(&held(&away), &[], belief, Frame::Rigid, &away, 5).expect("a state");
        assert!((back.identity[0] - start.identity[0]).abs() < 1e-3, "{:?}", back.identity);
    }
}
