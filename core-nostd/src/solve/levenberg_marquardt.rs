//! Levenberg-Marquardt minimisation of a sum of squares with bounds on the variables.
//!
//! Source: D. W. Marquardt, An algorithm for least-squares estimation of nonlinear parameters, J. Soc. Ind. Appl. Math. 11, 1963; the bounds are ours.

use crate::linalg::cholesky;
use crate::linalg::{at, set};
use crate::workspace::{Requirement, Workspace, check_len, saturated};
use crate::{Error, Real};

/// A sum of squares `E(x) = sum r_k(x)^2` of which the solver sees only the normal equations.
pub trait LeastSquares<R> {
    /// Number of variables.
    fn dim(&self) -> usize;

    /// Writes `J^T J` (row-major, both triangles) and `J^T r` at `x`, wholly, and returns `E(x)`.
    fn normal_equations(&mut self, x: &[R], jtj: &mut [R], jtr: &mut [R]) -> Result<R, Error>;

    /// Called when the solver moves to `x`, the point of the last [`LeastSquares::normal_equations`]. A problem whose variables are small
    /// motions (rotations) takes them up here and sets them to zero; the energy and its derivatives must stay the same.
    fn accept(&mut self, x: &mut [R]) {
        let _ = x;
    }
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits<R> {
    /// Most evaluations of the normal equations after the first.
    pub max_iterations: u32,
    /// Stop when a step would lower the energy by less than this fraction.
    pub relative_decrease: R,
    /// First damping, relative to the diagonal of `J^T J`.
    pub damping: R,
}

impl<R: Real> Default for Limits<R> {
    fn default() -> Self {
        Limits { max_iterations: 50, relative_decrease: R::EPSILON * R::from_f64(16.0), damping: R::from_f64(1e-3) }
    }
}

/// Why the solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// No step lowers the energy by more than the given fraction: a minimum within the bounds.
    Converged,
    /// The limit of iterations was reached; the result is the best point so far.
    IterationLimit,
    /// Even the smallest step raises the energy: rounding, or derivatives that do not match.
    Stalled,
}

/// Where the solver stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome<R> {
    /// Energy at the result.
    pub energy: R,
    /// Energy at the start.
    pub start_energy: R,
    /// Evaluations of the normal equations after the first.
    pub iterations: u32,
    /// Why it stopped.
    pub status: Status,
}

/// Scratch of [`minimised_in_place`] for `dim` variables.
pub const fn minimised_req(dim: usize) -> Requirement {
    let square = dim.saturating_mul(dim);
    Requirement::of(square.saturating_mul(3)).and(Requirement::of(dim.saturating_mul(5)))
}

/// Moves `x` to a minimum of the problem's energy within `lower <= x <= upper` (empty slices: no bounds).
///
/// Each iteration holds the variables that stand at a bound and would leave it and solves `(J^T J + lambda D) d = -J^T r` for the others by
/// Cholesky, with `D` the largest diagonal seen so far. Variables that the step carries beyond a bound are held there and the rest is solved
/// again, at most 8 times; then the step is clipped. It is accepted when the energy falls. The damping follows the ratio of the real to the
/// predicted decrease (H. B. Nielsen, Damping parameter in Marquardt's method, 1999).
///
/// | argument | shape | note |
/// |---|---|---|
/// | `x` | `dim` | start, clipped to the bounds; result |
/// | `lower`, `upper` | `dim` or empty | |
/// | `workspace` | [`minimised_req`] | |
///
/// Order of operations: each diagonal entry of `D` is the larger of the old one and that of `J^T J`, or 1 where that is not above 0. The right-hand
/// side of a free variable is `-(J^T r)_i`, minus `(J^T J)_ij d_j` for the held j ascending; a held variable is a row of the identity. The
/// predicted decrease is taken after clipping, with `d = x_new - x`: from zero, minus `d_i (g_i + g_i + sum_j A_ij d_j)` for i ascending. A step that
/// is not predicted to lower the energy by the fraction `relative_decrease` ends the search as converged, without counting, unless it was
/// clipped at its last solution or could not be solved: then, as after a step that does not lower the energy, `lambda *= growth` and
/// `growth *= 2`, to 1e16, where the search has stalled. After an accepted step `lambda *= max(1/3, 1 - (2 ratio - 1)^3)`, at least eps, `growth = 2`, and
/// the search has converged when the decrease was at most that fraction. A variable equal to a bound takes the bound's bits.
///
/// Cost: one evaluation of the normal equations and `dim^3 / 6` multiplications an iteration (for each solution of a bounded one).
/// Determinism: all sums in index order. Errors: `DimensionMismatch`, `WorkspaceTooSmall`, `BadOption` (3) for limits that are no numbers, a damping that is not above zero; `BadOption` (0) when a lower bound exceeds its upper
/// one or is NaN, `NotFinite` when the energy at the start is not finite, and whatever the problem returns at the start; `x` is then the clipped start.
/// Panics: never.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub fn minimised_in_place<R: Real>(
    problem: &mut impl LeastSquares<R>,
    x: &mut [R],
    lower: &[R],
    upper: &[R],
    limits: &Limits<R>,
    workspace: &mut [R],
) -> Result<Outcome<R>, Error> {
    let n = problem.dim();
    check_len(n, x.len())?;
    for bound in [lower, upper] {
        if !bound.is_empty() {
            check_len(n, bound.len())?;
        }
    }
    minimised_req(n).check(workspace.len())?;
    let decrease_fits = limits.relative_decrease >= R::ZERO && limits.relative_decrease.is_finite();
    if !(decrease_fits && limits.damping > R::ZERO && limits.damping.is_finite()) {
        return Err(Error::BadOption { option: 3 });
    }
    if lower.iter().zip(upper).any(|(l, u)| !(l <= u)) {
        return Err(Error::BadOption { option: 0 });
    }
    let mut pieces = Workspace::new(workspace);
    let mut jtj = pieces.take(n * n)?;
    let mut trial_jtj = pieces.take(n * n)?;
    let damped = pieces.take(n * n)?;
    let mut jtr = pieces.take(n)?;
    let mut trial_jtr = pieces.take(n)?;
    let trial = pieces.take(n)?;
    let scale = pieces.take(n)?;
    let held = pieces.take(n)?;

    clip(x, lower, upper);
    let start_energy = problem.normal_equations(x, jtj, jtr)?;
    if !start_energy.is_finite() {
        return Err(Error::NotFinite { index: 0 });
    }
    problem.accept(x);
    scale.fill(R::ZERO);
    let mut energy = start_energy;
    let mut lambda = limits.damping;
    let mut growth = R::from_f64(2.0);
    let mut status = Status::IterationLimit;
    let mut iterations = 0;
    while iterations < limits.max_iterations {
        for i in 0..n {
            // Marquardt's scaling never shrinks, and a variable without influence gets a unit one.
            let diagonal = at(jtj, i * n + i);
            let kept = at(scale, i).max(diagonal);
            set(scale, i, if kept > R::ZERO { kept } else { R::ONE });
        }
        let system = System { jtj, jtr, x, lower, upper, scale, lambda };
        let step = system.step(damped, held, trial).ok();
        iterations += 1;
        // The energy may be negative, when a prior's matrix is not definite: a failed step must not pass for one that predicts zero.
        let lowers = |(predicted, _): &(R, bool)| *predicted > limits.relative_decrease * energy;
        let Some((predicted, _)) = step.filter(lowers) else {
            // A clipped or failed step says nothing of the minimum: a shorter one is tried.
            if step.is_some_and(|(_, clipped)| !clipped) {
                status = Status::Converged;
                iterations -= 1;
                break;
            }
            if !raise(&mut lambda, &mut growth) {
                status = Status::Stalled;
                break;
            }
            continue;
        };
        let trial_energy = problem.normal_equations(trial, trial_jtj, trial_jtr);
        let trial_energy = trial_energy.ok().filter(|energy| energy.is_finite()).unwrap_or(R::MAX);
        let decrease = energy - trial_energy;
        if decrease > R::ZERO {
            x.copy_from_slice_checked(trial);
            problem.accept(x);
            core::mem::swap(&mut jtj, &mut trial_jtj);
            core::mem::swap(&mut jtr, &mut trial_jtr);
            let ratio = decrease / predicted;
            let bend = R::from_f64(2.0) * ratio - R::ONE;
            lambda *= R::from_f64(1.0 / 3.0).max(R::ONE - bend * bend * bend);
            // Below this the damping has no effect in the arithmetic.
            lambda = lambda.max(R::EPSILON);
            growth = R::from_f64(2.0);
            let small = decrease <= limits.relative_decrease * energy;
            energy = trial_energy;
            if small {
                status = Status::Converged;
                break;
            }
        } else if !raise(&mut lambda, &mut growth) {
            status = Status::Stalled;
            break;
        }
    }
    Ok(Outcome { energy, start_energy, iterations, status })
}

/// Raises the damping; false when it cannot be raised further.
fn raise<R: Real>(lambda: &mut R, growth: &mut R) -> bool {
    *lambda *= *growth;
    *growth *= R::from_f64(2.0);
    *lambda < R::from_f64(1e16)
}

/// Solutions of a step whose variables run into bounds.
const MAX_PASSES: usize = 8;

/// The quadratic model at the current point.
struct System<'a, R> {
    jtj: &'a [R],
    jtr: &'a [R],
    x: &'a [R],
    lower: &'a [R],
    upper: &'a [R],
    scale: &'a [R],
    lambda: R,
}

impl<R: Real> System<'_, R> {
    /// Writes the trial point and returns the predicted decrease `-(2 g.d + d.A d)` of its step, and whether the step was clipped at the end.
    ///
    /// `held` tells which variables are held: their step, or the largest number for a free one.
    fn step(&self, damped: &mut [R], held: &mut [R], trial: &mut [R]) -> Result<(R, bool), Error> {
        let n = self.x.len();
        for i in 0..n {
            let (value, gradient) = (at(self.x, i), at(self.jtr, i));
            let stays_low = self.lower.get(i).is_some_and(|&l| value <= l) && gradient > R::ZERO;
            let stays_high = self.upper.get(i).is_some_and(|&u| value >= u) && gradient < R::ZERO;
            set(held, i, if stays_low || stays_high { R::ZERO } else { R::MAX });
        }
        let mut clipped = false;
        for _ in 0..MAX_PASSES {
            self.solve(damped, held, trial)?;
            clipped = false;
            for i in 0..n {
                let to = at(self.x, i) + at(trial, i);
                let bound = match (self.lower.get(i), self.upper.get(i)) {
                    (Some(&l), _) if to < l => l,
                    (_, Some(&u)) if to > u => u,
                    _ => continue,
                };
                if at(held, i) == R::MAX {
                    set(held, i, bound - at(self.x, i));
                    clipped = true;
                }
            }
            if !clipped {
                break;
            }
        }
        for (value, &x) in trial.iter_mut().zip(self.x) {
            *value += x;
        }
        clip(trial, self.lower, self.upper);
        let mut predicted = R::ZERO;
        for i in 0..n {
            let d_i = at(trial, i) - at(self.x, i);
            let mut image = R::ZERO;
            for j in 0..n {
                image += at(self.jtj, i * n + j) * (at(trial, j) - at(self.x, j));
            }
            predicted -= d_i * (at(self.jtr, i) + at(self.jtr, i) + image);
        }
        if predicted.is_finite() { Ok((predicted, clipped)) } else { Err(Error::NotFinite { index: saturated(n) }) }
    }

    /// Solves for the free variables' step, given the step of the held ones.
    fn solve(&self, damped: &mut [R], held: &[R], step: &mut [R]) -> Result<(), Error> {
        let n = self.x.len();
        let is_free = |i: usize| at(held, i) == R::MAX;
        for i in 0..n {
            let mut rhs = -at(self.jtr, i);
            for j in 0..n {
                let entry = at(self.jtj, i * n + j);
                if !is_free(j) {
                    rhs -= entry * at(held, j);
                }
                let kept = if i == j {
                    if is_free(i) { entry + self.lambda * at(self.scale, i) } else { R::ONE }
                } else if is_free(i) && is_free(j) {
                    entry
                } else {
                    R::ZERO
                };
                set(damped, i * n + j, kept);
            }
            set(step, i, if is_free(i) { rhs } else { at(held, i) });
        }
        cholesky::factor_in_place(damped, n)?;
        cholesky::solve_in_place(damped, step)
    }
}

fn clip<R: Real>(x: &mut [R], lower: &[R], upper: &[R]) {
    for (i, value) in x.iter_mut().enumerate() {
        if let Some(&bound) = lower.get(i) {
            *value = value.max(bound);
        }
        if let Some(&bound) = upper.get(i) {
            *value = value.min(bound);
        }
    }
}

/// `copy_from_slice` without its panic path; the lengths are equal by construction.
trait CopyChecked<R> {
    fn copy_from_slice_checked(&mut self, from: &[R]);
}

impl<R: Copy> CopyChecked<R> for [R] {
    fn copy_from_slice_checked(&mut self, from: &[R]) {
        for (to, &from) in self.iter_mut().zip(from) {
            *to = from;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rosenbrock's valley: r = (10 (y - x^2), 1 - x), minimum 0 at (1, 1).
    struct Valley;

    impl LeastSquares<f64> for Valley {
        fn dim(&self) -> usize {
            2
        }
        fn normal_equations(&mut self, x: &[f64], jtj: &mut [f64], jtr: &mut [f64]) -> Result<f64, Error> {
            let (r0, r1) = (10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]);
            let rows = [[-20.0 * x[0], 10.0], [-1.0, 0.0]];
            for i in 0..2 {
                jtr[i] = rows[0][i] * r0 + rows[1][i] * r1;
                for j in 0..2 {
                    jtj[i * 2 + j] = rows[0][i] * rows[0][j] + rows[1][i] * rows[1][j];
                }
            }
            Ok(r0 * r0 + r1 * r1)
        }
    }

    #[test]
    fn valley_free() {
        let mut x = [-1.2, 1.0];
        let outcome = minimised_in_place(&mut Valley, &mut x, &[], &[], &Limits::default(), &mut [0.0; 64]).unwrap();
        assert_eq!(outcome.status, Status::Converged);
        assert!(outcome.energy < 1e-20 && (x[0] - 1.0).abs() < 1e-9 && (x[1] - 1.0).abs() < 1e-9, "{outcome:?} {x:?}");
    }

    #[test]
    fn valley_bounded() {
        // With x <= 0.5 the minimum is at (0.5, 0.25), energy 0.25.
        let mut x = [-1.2, 1.0];
        let (low, high) = ([-2.0, -2.0], [0.5, 2.0]);
        let outcome = minimised_in_place(&mut Valley, &mut x, &low, &high, &Limits::default(), &mut [0.0; 64]).unwrap();
        assert_eq!(outcome.status, Status::Converged);
        assert!((x[0] - 0.5).abs() < 1e-12 && (x[1] - 0.25).abs() < 1e-7 && (outcome.energy - 0.25).abs() < 1e-12);
    }

    /// E = x^T A x + 2 (x_0 + x_1) - 1 with an indefinite A, as a prior's matrix may be: negative at the start.
    struct Saddle {
        evaluations: u32,
    }

    impl LeastSquares<f64> for Saddle {
        fn dim(&self) -> usize {
            2
        }
        fn normal_equations(&mut self, x: &[f64], jtj: &mut [f64], jtr: &mut [f64]) -> Result<f64, Error> {
            self.evaluations += 1;
            let image = [2.0 * x[0] - 3.0 * x[1], 2.0 * x[1] - 3.0 * x[0]];
            jtj.copy_from_slice(&[2.0, -3.0, -3.0, 2.0]);
            jtr.copy_from_slice(&[image[0] + 1.0, image[1] + 1.0]);
            Ok(x[0] * image[0] + x[1] * image[1] + 2.0 * (x[0] + x[1]) - 1.0)
        }
    }

    /// Found by the fuzz target `bilinear`: beside a negative energy a failed step passed for a good one, and what the failed
    /// factorisation had left became the result.
    #[test]
    fn a_step_that_cannot_be_solved_is_not_taken() {
        let mut x = [0.0, 0.0];
        let mut saddle = Saddle { evaluations: 0 };
        let limits = Limits { max_iterations: 1, ..Limits::default() };
        let outcome = minimised_in_place(&mut saddle, &mut x, &[], &[], &limits, &mut [0.0; 64]).unwrap();
        assert_eq!((outcome.energy, outcome.status, saddle.evaluations), (-1.0, Status::IterationLimit, 1));
        assert_eq!(x, [0.0, 0.0]);
    }

    #[test]
    fn refusals() {
        for limits in [
            Limits { relative_decrease: f64::NAN, ..Limits::default() },
            Limits { damping: -1.0, ..Limits::default() },
            Limits { damping: f64::INFINITY, ..Limits::default() },
        ] {
            let refused = minimised_in_place(&mut Valley, &mut [0.0; 2], &[], &[], &limits, &mut [0.0; 64]);
            assert_eq!(refused, Err(Error::BadOption { option: 3 }));
        }
        let mut x = [0.0, 0.0];
        let mut run = |low: &[f64], high: &[f64], w: usize| {
            minimised_in_place(&mut Valley, &mut x, low, high, &Limits::default(), &mut [0.0; 64][..w]).map(|_| ())
        };
        assert_eq!(run(&[1.0, 0.0], &[0.0, 0.0], 64), Err(Error::BadOption { option: 0 }));
        assert_eq!(run(&[f64::NAN, 0.0], &[0.0, 0.0], 64), Err(Error::BadOption { option: 0 }));
        assert_eq!(run(&[0.0], &[], 64), Err(Error::DimensionMismatch { expected: 2, found: 1 }));
        assert_eq!(run(&[], &[], 3), Err(Error::WorkspaceTooSmall { needed: 22, given: 3 }));
        let start = minimised_in_place(&mut Valley, &mut [f64::NAN, 0.0], &[], &[], &Limits::default(), &mut [0.0; 64]);
        assert_eq!(start, Err(Error::NotFinite { index: 0 }));
    }

    proptest! {
        /// Never leaves the bounds and never ends above its start.
        #[test]
        fn stays_inside(x in -2.0f64..2.0, y in -2.0f64..2.0, a in -2.0f64..2.0, b in 0.0f64..2.0, c in -2.0f64..2.0, d in 0.0f64..2.0) {
            let (low, high) = ([a, c], [a + b, c + d]);
            let mut point = [x, y];
            let outcome = minimised_in_place(&mut Valley, &mut point, &low, &high, &Limits::default(), &mut [0.0; 64]).unwrap();
            prop_assert!(outcome.energy <= outcome.start_energy);
            prop_assert!(point[0] >= a && point[0] <= a + b && point[1] >= c && point[1] <= c + d);
        }
    }
}
