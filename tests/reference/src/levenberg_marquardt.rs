//! Levenberg-Marquardt with bounds, on matrices of rows.

use super::Refusal;
use super::cholesky;
use super::number::{Number, larger};

/// Energy, `J^T J`, `J^T r`.
pub type Equations<R> = (R, Vec<Vec<R>>, Vec<R>);

/// A sum of squares.
pub trait Problem<R> {
    /// The equations at `x`; `None` where they cannot be evaluated.
    fn equations(&mut self, x: &[R]) -> Option<Equations<R>>;
    /// The point of the last call has been accepted; it may be expressed anew.
    fn accept(&mut self, _x: &mut [R]) {}
}

/// When to stop.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
pub struct Limits<R> {
    pub max_iterations: u32,
    pub relative_decrease: R,
    pub damping: R,
}

/// Where it stopped; `status` is 0 converged, 1 limit of iterations, 2 stalled.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Minimum<R> {
    pub x: Vec<R>,
    pub energy: R,
    pub start_energy: R,
    pub iterations: u32,
    pub status: u32,
}

/// Bounds of the variables.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Bounds<R> {
    pub lower: Vec<R>,
    pub upper: Vec<R>,
}

impl<R: Number> Bounds<R> {
    fn clipped(&self, x: &[R]) -> Vec<R> {
        let mut x = x.to_vec();
        for (i, value) in x.iter_mut().enumerate() {
            // A value equal to a bound takes the bound's bits, which matters for the two zeros.
            if !(*value > self.lower[i]) {
                *value = self.lower[i];
            }
            if !(*value < self.upper[i]) {
                *value = self.upper[i];
            }
        }
        x
    }
}

/// A minimum within the bounds (if any) from `start` on.
pub fn minimum<R: Number>(
    problem: &mut impl Problem<R>,
    start: &[R],
    bounds: Option<&Bounds<R>>,
    limits: &Limits<R>,
) -> Result<Minimum<R>, Refusal> {
    let (zero, one, two) = (R::of(0.0), R::of(1.0), R::of(2.0));
    let n = start.len();
    let (decrease, damping) = (limits.relative_decrease, limits.damping);
    if !(decrease >= zero && decrease.is_finite() && damping > zero && damping.is_finite()) {
        return Err([104, 3, 0]);
    }
    let mut x = bounds.map_or(start.to_vec(), |bounds| bounds.clipped(start));
    let Some((start_energy, mut jtj, mut jtr)) = problem.equations(&x) else { return Err([103, 0, 0]) };
    if !start_energy.is_finite() {
        return Err([103, 0, 0]);
    }
    problem.accept(&mut x);
    let mut energy = start_energy;
    let mut scale = vec![zero; n];
    let (mut lambda, mut growth) = (limits.damping, two);
    let mut iterations = 0;
    let mut status = 1;
    while iterations < limits.max_iterations {
        for i in 0..n {
            let kept = larger(scale[i], jtj[i][i]);
            scale[i] = if kept > zero { kept } else { one };
        }
        let damping: Vec<R> = scale.iter().map(|&scale| lambda * scale).collect();
        let step = trial(&jtj, &jtr, &x, &damping, bounds);
        iterations += 1;
        let mut lowered = false;
        match step {
            Some(Trial { predicted, ref point, .. }) if predicted > limits.relative_decrease * energy => {
                if let Some((trial_energy, trial_jtj, trial_jtr)) =
                    problem.equations(point).filter(|(energy, ..)| energy.is_finite())
                {
                    let decrease = energy - trial_energy;
                    if decrease > zero {
                        x = point.clone();
                        problem.accept(&mut x);
                        (jtj, jtr) = (trial_jtj, trial_jtr);
                        let bend = two * (decrease / predicted) - one;
                        lambda = lambda * larger(R::of(1.0 / 3.0), one - bend * bend * bend);
                        lambda = larger(lambda, R::EPSILON);
                        growth = two;
                        let small = decrease <= limits.relative_decrease * energy;
                        energy = trial_energy;
                        lowered = true;
                        if small {
                            status = 0;
                            break;
                        }
                    }
                }
            }
            Some(Trial { clipped: false, .. }) => {
                status = 0;
                iterations -= 1;
                break;
            }
            _ => {}
        }
        if !lowered {
            lambda = lambda * growth;
            growth = growth * two;
            if !(lambda < R::of(1e16)) {
                status = 2;
                break;
            }
        }
    }
    Ok(Minimum { x, energy, start_energy, iterations, status })
}

struct Trial<R> {
    point: Vec<R>,
    predicted: R,
    clipped: bool,
}

/// The step's end point, the predicted decrease, and whether it was still being clipped at the last solution.
fn trial<R: Number>(jtj: &[Vec<R>], jtr: &[R], x: &[R], damping: &[R], bounds: Option<&Bounds<R>>) -> Option<Trial<R>> {
    let (zero, n) = (R::of(0.0), x.len());
    // For each held variable its step.
    let mut held: Vec<Option<R>> = vec![None; n];
    if let Some(Bounds { lower, upper }) = bounds {
        for i in 0..n {
            if (x[i] <= lower[i] && jtr[i] > zero) || (x[i] >= upper[i] && jtr[i] < zero) {
                held[i] = Some(zero);
            }
        }
    }
    let mut step = vec![zero; n];
    let mut clipped = false;
    for _pass in 0..8 {
        step = solved(jtj, jtr, damping, &held)?;
        clipped = false;
        if let Some(Bounds { lower, upper }) = bounds {
            for i in 0..n {
                let to = x[i] + step[i];
                if held[i].is_none() && (to < lower[i] || to > upper[i]) {
                    held[i] = Some(if to < lower[i] { lower[i] - x[i] } else { upper[i] - x[i] });
                    clipped = true;
                }
            }
        }
        if !clipped {
            break;
        }
    }
    let mut point: Vec<R> = step.iter().zip(x).map(|(&step, &x)| step + x).collect();
    if let Some(bounds) = bounds {
        point = bounds.clipped(&point);
    }
    let d: Vec<R> = point.iter().zip(x).map(|(&to, &from)| to - from).collect();
    let mut predicted = zero;
    for i in 0..n {
        let mut image = zero;
        for j in 0..n {
            image = image + jtj[i][j] * d[j];
        }
        predicted = predicted - d[i] * (jtr[i] + jtr[i] + image);
    }
    predicted.is_finite().then_some(Trial { point, predicted, clipped })
}

/// The damped Gauss-Newton step of the free variables, given the steps of the held ones.
fn solved<R: Number>(jtj: &[Vec<R>], jtr: &[R], damping: &[R], held: &[Option<R>]) -> Option<Vec<R>> {
    let n = jtr.len();
    let mut matrix = vec![vec![R::of(0.0); n]; n];
    let mut rhs = vec![R::of(0.0); n];
    for i in 0..n {
        if let Some(step) = held[i] {
            matrix[i][i] = R::of(1.0);
            rhs[i] = step;
            continue;
        }
        rhs[i] = -jtr[i];
        for j in 0..n {
            match held[j] {
                Some(step) => rhs[i] = rhs[i] - jtj[i][j] * step,
                None if i == j => matrix[i][i] = jtj[i][i] + damping[i],
                None => matrix[i][j] = jtj[i][j],
            }
        }
    }
    let factor = cholesky::factor(&matrix).ok()?;
    Some(cholesky::solution(&factor, &rhs))
}
