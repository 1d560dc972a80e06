//! Cholesky, Jacobi, Procrustes, rotations, Levenberg-Marquardt, each in `f32` and `f64`.

use habitus_core::Error;
use habitus_core::linalg::cholesky::{factor_in_place, solve_in_place};
use habitus_core::linalg::symmetric_eigen::diagonalise_in_place;
use habitus_core::rotation::axis_angle::rotation_matrix;
use habitus_core::solve::levenberg_marquardt::{LeastSquares, minimised_in_place, minimised_req};
use habitus_core::solve::procrustes::Moments;

use super::Context;
use super::fit::{limits, numbers_of_placement, placement, status_number};
use crate::backend::Backend;
use crate::memory::{Number, array, integer, number};
use crate::result::Problem;

pub(super) fn cholesky<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, pieces, tally, .. } = context;
    let matrix = pieces.numbers::<R>(case, "matrix")?;
    let rhs = pieces.numbers::<R>(case, "rhs")?;
    factor_in_place(matrix, integer(case, "n")? as usize)?;
    tally.compare("factor", matrix)?;
    solve_in_place(matrix, rhs)?;
    tally.compare("solution", rhs)
}

pub(super) fn eigenpairs<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, pieces, tally, .. } = context;
    let matrix = pieces.numbers::<R>(case, "matrix")?;
    let vectors = pieces.zeros::<R>(matrix.len())?;
    diagonalise_in_place(matrix, vectors, integer(case, "n")? as usize)?;
    tally.compare("diagonal", matrix)?;
    tally.compare("vectors", vectors)
}

pub(super) fn procrustes<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, pieces, tally, .. } = context;
    let sources: &[[R; 3]] = pieces.numbers(case, "sources")?.as_chunks().0;
    let targets: &[[R; 3]] = pieces.numbers(case, "targets")?.as_chunks().0;
    let weights: &[R] = pieces.numbers(case, "weights")?;
    let with_scale = integer(case, "with_scale")? > 0;
    let mut moments = Moments::new();
    for ((&source, &target), &weight) in sources.iter().zip(targets).zip(weights) {
        moments.add(source, target, weight);
    }
    let found = moments.similarity(with_scale)?;
    tally.compare("placement", &numbers_of_placement(&found))
}

pub(super) fn aligned<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, pieces, tally, .. } = context;
    let sources: &[[R; 3]] = pieces.numbers(case, "sources")?.as_chunks().0;
    let targets: &[[R; 3]] = pieces.numbers(case, "targets")?.as_chunks().0;
    let mut moments = Moments::new();
    moments.add_all(sources, targets)?;
    let found = moments.similarity(integer(case, "with_scale")? > 0)?;
    tally.compare("placement", &numbers_of_placement(&found))
}

pub(super) fn rotation<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, tally, .. } = context;
    let vector: [R; 3] = array(case, "vector")?;
    tally.compare("matrix", rotation_matrix(vector).as_flattened())
}

pub(super) fn moved<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, tally, .. } = context;
    let mut place = placement::<R>(case, "placement")?;
    let (rotation, translation) = (array(case, "rotation")?, array(case, "translation")?);
    let log_scale = number(case, "log_scale")?;
    let point: [R; 3] = array(case, "point")?;
    for _ in 0..integer(case, "times")? {
        place = place.moved(rotation, translation, log_scale);
    }
    tally.compare("moved", &numbers_of_placement(&place))?;
    tally.compare("applied", &place.applied(point))?;
    tally.compare("inverse_applied", &place.inverse_applied(point))?;
    tally.compare("inverse_rotated", &place.inverse_rotated(point))
}

pub(super) fn minimised<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, pieces, tally, .. } = context;
    let x = pieces.numbers::<R>(case, "start")?;
    let lower: &[R] = pieces.numbers(case, "lower")?;
    let upper: &[R] = pieces.numbers(case, "upper")?;
    let limits = limits(case)?;
    let workspace = pieces.zeros(minimised_req(x.len()).numbers())?;
    let outcome = match case.word("problem") {
        Some("valley") => minimised_in_place(&mut Valley, x, lower, upper, &limits, workspace),
        Some("decay") => {
            let mut decay = Decay { values: pieces.numbers(case, "values")? };
            minimised_in_place(&mut decay, x, lower, upper, &limits, workspace)
        }
        _ => return Err(Problem::Text("problem")),
    }?;
    tally.compare_integers("iterations_status", &[outcome.iterations, status_number(outcome.status)])?;
    tally.compare("energy_start", &[outcome.energy, outcome.start_energy])?;
    tally.compare("result", x)
}

/// Rosenbrock's valley: `r = (10 (y - x x), 1 - x)`.
struct Valley;

impl<R: Number> LeastSquares<R> for Valley {
    fn dim(&self) -> usize {
        2
    }

    fn normal_equations(&mut self, x: &[R], jtj: &mut [R], jtr: &mut [R]) -> Result<R, Error> {
        let &[x, y] = x else { return Err(Error::Empty) };
        let ten = R::from_f64(10.0);
        let rows = [([-(R::from_f64(20.0) * x), ten], ten * (y - x * x)), ([-R::ONE, R::ZERO], R::ONE - x)];
        Ok(summed(rows.into_iter(), jtj, jtr))
    }
}

/// The curve `a exp(-b t) + c` through values at `t = 0, 1/4, 1/2, ...`: `r = a exp(-b t) + c - value`.
struct Decay<'a, R> {
    values: &'a [R],
}

impl<R: Number> LeastSquares<R> for Decay<'_, R> {
    fn dim(&self) -> usize {
        3
    }

    fn normal_equations(&mut self, x: &[R], jtj: &mut [R], jtr: &mut [R]) -> Result<R, Error> {
        let &[a, b, c] = x else { return Err(Error::Empty) };
        let rows = self.values.iter().enumerate().map(|(k, &value)| {
            let t = R::from_f64(0.25 * k as f64);
            let decayed = (-(b * t)).exp();
            ([decayed, -(a * t * decayed), R::ONE], a * decayed + c - value)
        });
        Ok(summed(rows, jtj, jtr))
    }
}

/// Sums rows and residuals in their order, from zero: `J^T J`, `J^T r`, and returns `r^T r`.
fn summed<R: Number, const N: usize>(rows: impl Iterator<Item = ([R; N], R)>, jtj: &mut [R], jtr: &mut [R]) -> R {
    jtj.fill(R::ZERO);
    jtr.fill(R::ZERO);
    let mut energy = R::ZERO;
    for (row, residual) in rows {
        for ((jtj, jtr), &p) in jtj.chunks_exact_mut(N.max(1)).zip(jtr.iter_mut()).zip(&row) {
            for (sum, &q) in jtj.iter_mut().zip(&row) {
                *sum += p * q;
            }
            *jtr += p * residual;
        }
        energy += residual * residual;
    }
    energy
}
