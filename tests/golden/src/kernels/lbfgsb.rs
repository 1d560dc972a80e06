//! L-BFGS-B in the chained valley, in `f32` and `f64`.

use habitus_core::Error;
use habitus_core::solve::lbfgsb::{Limits, Objective, Status, minimised_in_place, minimised_req};

use super::Context;
use crate::backend::Backend;
use crate::memory::{Number, integer};
use crate::result::Problem;

pub(super) fn minimised<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, pieces, tally, .. } = context;
    let x = pieces.numbers::<R>(case, "start")?;
    let lower: &[R] = pieces.numbers(case, "lower")?;
    let upper: &[R] = pieces.numbers(case, "upper")?;
    let history = integer(case, "history")?;
    let limits = Limits {
        max_iterations: integer(case, "max_iterations")?,
        max_evaluations: 100,
        relative_decrease: R::EPSILON * R::from_f64(16.0),
        gradient: R::from_f64(1e-6),
        history,
    };
    let workspace = pieces.zeros(minimised_req(x.len(), history as usize).numbers())?;
    let mut chain = Chain { dim: x.len() };
    let outcome = minimised_in_place(&mut chain, x, lower, upper, &limits, workspace)?;
    let status = match outcome.status {
        Status::Stationary => 0,
        Status::Converged => 1,
        Status::IterationLimit => 2,
        Status::EvaluationLimit => 3,
        Status::Stalled => 4,
    };
    tally.compare_integers("counts", &[outcome.iterations, outcome.evaluations, status])?;
    tally.compare("values", &[outcome.value, outcome.start_value, outcome.gradient])?;
    tally.compare("result", x)
}

/// `100 (x_i+1 - x_i x_i)^2 + (1 - x_i)^2`, summed from zero.
struct Chain {
    dim: usize,
}

impl<R: Number> Objective<R> for Chain {
    fn dim(&self) -> usize {
        self.dim
    }

    fn value_and_gradient(&mut self, x: &[R], gradient: &mut [R]) -> Result<R, Error> {
        gradient.fill(R::ZERO);
        let mut value = R::ZERO;
        let pairs = x.iter().zip(x.iter().skip(1));
        for (i, (&x, &next)) in pairs.enumerate() {
            let (up, off) = (next - x * x, R::ONE - x);
            value += R::from_f64(100.0) * up * up + off * off;
            if let Some([here, there]) = gradient.get_mut(i..).and_then(<[R]>::first_chunk_mut) {
                *here -= R::from_f64(400.0) * x * up + R::from_f64(2.0) * off;
                *there += R::from_f64(200.0) * up;
            }
        }
        Ok(value)
    }
}
