//! L-BFGS-B: minimisation of a smooth function of many variables with bounds, from values and gradients.

mod compact;
mod search;
mod step;
#[cfg(test)]
mod tests;

use super::bounds::Bounds;
use crate::workspace::{Requirement, Workspace, check_len, saturated};
use crate::{Error, Real};
use compact::Compact;
use step::{Place, Small, copy};

/// A function `f(x)` with its gradient.
pub trait Objective<R> {
    /// Number of variables.
    fn dim(&self) -> usize;

    /// Writes the gradient at `x`, wholly, and returns `f(x)`. At a trial point an error, or a number that is not finite, only shortens the step.
    fn value_and_gradient(&mut self, x: &[R], gradient: &mut [R]) -> Result<R, Error>;
}

/// When to stop, and how much to remember.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits<R> {
    /// Most steps.
    pub max_iterations: u32,
    /// Most evaluations after the first.
    pub max_evaluations: u32,
    /// Stop when a step lowers the value, or promises to, by no more than this fraction of its magnitude.
    pub relative_decrease: R,
    /// Stop when no entry of the projected gradient exceeds this; in units of the gradient.
    pub gradient: R,
    /// Pairs of steps and changes of the gradient that are kept, above zero; 3 to 10 are usual.
    pub history: u32,
}

impl<R: Real> Default for Limits<R> {
    fn default() -> Self {
        Limits {
            max_iterations: 200,
            max_evaluations: 400,
            relative_decrease: R::EPSILON * R::from_f64(16.0),
            gradient: R::ZERO,
            history: 5,
        }
    }
}

/// Why the solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The projected gradient is at most the given one: a stationary point within the bounds.
    Stationary,
    /// The last step lowered the value by no more than the given fraction, or the next one promises no more.
    Converged,
    /// The limit of iterations was reached; the result is the best point so far.
    IterationLimit,
    /// The limit of evaluations was reached; the result is the best point so far.
    EvaluationLimit,
    /// No step along the gradient lowers the value: rounding (as beside a minimum of value zero), or a gradient that does not match.
    Stalled,
}

/// Where the solver stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome<R> {
    /// Value at the result.
    pub value: R,
    /// Value at the start.
    pub start_value: R,
    /// Largest entry of the projected gradient `|P(x - g) - x|` at the result.
    pub gradient: R,
    /// Steps that were made.
    pub iterations: u32,
    /// Evaluations after the first.
    pub evaluations: u32,
    /// Why it stopped.
    pub status: Status,
}

/// Scratch of [`minimised_in_place`] for `dim` variables and `history` pairs.
pub const fn minimised_req(dim: usize, history: usize) -> Requirement {
    let pairs = Requirement::of(history.saturating_mul(2).saturating_add(5).saturating_mul(dim));
    pairs.and(Requirement::of(history.saturating_mul(4).saturating_mul(history.saturating_add(2))))
}

/// Trial points of one step.
const MAX_TRIALS: u32 = 20;
/// Those after which any trial is taken whose value is low enough, whatever its slope.
const STRICT_TRIALS: u32 = 10;

/// Moves `x` to a minimum of the function within `lower <= x <= upper` (empty slices: no bounds; infinite entries: none for that variable).
///
/// Source: R. H. Byrd, P. Lu, J. Nocedal, C. Zhu, A limited memory algorithm for bound constrained optimization, 1995: the quadratic model of the
/// last `history` pairs, its generalised Cauchy point (algorithm CP), its minimum over the variables that are free there (direct primal
/// method) and the way back into the bounds. Different from it: both middle matrices are factors of one quasi-definite matrix
/// (`compact.rs`), computed anew in each step; breakpoints are found by search instead of a heap; the line search is by bracketing (below).
///
/// | argument | shape | note |
/// |---|---|---|
/// | `x` | `dim` | start, clipped to the bounds; result |
/// | `lower`, `upper` | `dim` or empty | |
/// | `workspace` | [`minimised_req`] | |
///
/// Along the way d from x to the aim the first trial is `t = 1`, without pairs `min(1, 1 / |d|)`. A trial that does not lower the value by `1e-4 t` times the
/// slope becomes the end `high` of the bracket; one where more than 0.9 of the slope is left and t is below the largest allowed step becomes
/// its start `low`, but not after ten trials; any other is taken. The next trial is the minimum of the parabola through value and slope at `low` and value at `high`, between
/// 0.1 and 0.9 of the bracket, or its middle when `low` has just moved; without `high` it is `4 t`, at most the largest allowed step. After 20 trials, or when the way does not go down, the pairs are forgotten and the step begins
/// anew; without pairs the search ends as converged when the slope promises no more than the fraction `relative_decrease`, else as stalled. A variable that
/// the aim puts at a bound takes the bound's bits when `t = 1`.
///
/// Cost: an iteration has one evaluation, seldom more, and about `(8 h^2 + 30 h) n + 12 h^3` operations for h pairs, `n + 16 h^2` more for every variable
/// that the way to the Cauchy point runs into its bound.
/// Beside another program (SciPy 1.17's port of the authors' code, 5 pairs, gradient to 1e-8) it takes 53 evaluations for 49, 127 for 108, 348 for 356 in the chained valley of 2, 10, 50 variables
/// from (-1.2, 1, ...), 37 for 31 with an active bound (test `figures`).
/// Determinism: all sums from zero, in index order; the order of operations stands beside the parts (`compact.rs`, `step.rs`, `search.rs`). Never ends above its start.
/// Errors: `DimensionMismatch`, `WorkspaceTooSmall`, `BadOption` (3) for limits that are negative or no numbers and for a history of zero; `BadOption` (0) when a lower bound exceeds its
/// upper one or is NaN; at the clipped start `NotFinite` with the variable or the gradient's entry that is not finite, or `dim` for the value, and whatever the function returns. Panics: never.
#[inline]
pub fn minimised_in_place<R: Real>(
    objective: &mut impl Objective<R>,
    x: &mut [R],
    lower: &[R],
    upper: &[R],
    limits: &Limits<R>,
    workspace: &mut [R],
) -> Result<Outcome<R>, Error> {
    let n = objective.dim();
    check_len(n, x.len())?;
    let bounds = Bounds { lower, upper };
    bounds.check(n)?;
    let history = limits.history as usize;
    minimised_req(n, history).check(workspace.len())?;
    let fits = |value: R| value >= R::ZERO && value.is_finite();
    if !(fits(limits.relative_decrease) && fits(limits.gradient) && history > 0) {
        return Err(Error::BadOption { option: 3 });
    }
    let mut pieces = Workspace::new(workspace);
    let (steps, changes) = (pieces.take(history * n)?, pieces.take(history * n)?);
    let mut matrix = Compact::new(steps, changes, pieces.take(4 * history * history)?, n, history);
    let (p, c) = (pieces.take(2 * history)?, pieces.take(2 * history)?);
    let mut small = Small { p, c, w: pieces.take(2 * history)?, v: pieces.take(2 * history)? };
    let (mut gradient, mut trial_gradient) = (pieces.take(n)?, pieces.take(n)?);
    let (trial, point, free) = (pieces.take(n)?, pieces.take(n)?, pieces.take(n)?);

    for (i, value) in x.iter_mut().enumerate() {
        *value = bounds.clipped(i, *value);
    }
    all_finite(x)?;
    let start_value = objective.value_and_gradient(x, gradient)?;
    all_finite(gradient)?;
    if !start_value.is_finite() {
        return Err(Error::NotFinite { index: saturated(n) });
    }
    let mut outcome = Outcome {
        value: start_value,
        start_value,
        gradient: R::ZERO,
        iterations: 0,
        evaluations: 0,
        status: Status::IterationLimit,
    };
    loop {
        let place = Place { x, gradient, bounds };
        outcome.gradient = place.projected_gradient();
        if outcome.gradient <= limits.gradient {
            outcome.status = Status::Stationary;
            break;
        }
        if outcome.iterations >= limits.max_iterations {
            break;
        }
        let least = limits.relative_decrease * outcome.value.abs();
        let aimed = place.aim(&mut matrix, &mut small, point, free, trial_gradient);
        let mut search = place.search(point, outcome.value, matrix.count == 0);
        if aimed.is_ok() && matrix.count > 0 && search.slope < R::ZERO && -search.slope <= least {
            outcome.status = Status::Converged;
            break;
        }
        let mut found = None;
        if aimed.is_ok() && search.slope < R::ZERO {
            for trials in 0..MAX_TRIALS {
                if outcome.evaluations >= limits.max_evaluations {
                    break;
                }
                outcome.evaluations += 1;
                place.write_trial(point, search.t, trial);
                let value = objective.value_and_gradient(trial, trial_gradient).ok();
                let value = value.filter(|value| value.is_finite() && all_finite(trial_gradient).is_ok());
                found = value
                    .filter(|&value| search.takes(value, place.slope(point, trial_gradient), trials >= STRICT_TRIALS));
                if found.is_some() {
                    break;
                }
                if value.is_none() {
                    search.shorten(R::MAX);
                }
            }
            if found.is_none() && outcome.evaluations >= limits.max_evaluations {
                outcome.status = Status::EvaluationLimit;
                break;
            }
        }
        let Some(value) = found else {
            if matrix.count == 0 {
                outcome.status =
                    if search.slope < R::ZERO && -search.slope <= least { Status::Converged } else { Status::Stalled };
                break;
            }
            matrix.clear();
            continue;
        };
        matrix.take_up(x, trial, gradient, trial_gradient);
        copy(x, trial);
        core::mem::swap(&mut gradient, &mut trial_gradient);
        outcome.iterations += 1;
        let decrease = outcome.value - value;
        outcome.value = value;
        if decrease <= limits.relative_decrease * (value + decrease).abs().max(value.abs()) {
            outcome.gradient = Place { x, gradient, bounds }.projected_gradient();
            outcome.status = Status::Converged;
            break;
        }
    }
    Ok(outcome)
}

/// `Ok` when every number is finite.
fn all_finite<R: Real>(values: &[R]) -> Result<(), Error> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(Error::NotFinite { index: saturated(index) }),
        None => Ok(()),
    }
}
