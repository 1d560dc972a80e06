//! The kernel at the speed of the host: eq. 8.1 and its derivatives with the vector width chosen at run time ([`habitus_dispatch`]), and over threads.
//!
//! Each lane sums in the order of the kernel and no operation is fused, so the bits are those of the kernel, whatever the width and the number
//! of threads. Errors are the kernel's.

use std::ops::Range;

use habitus_core::Error;
use habitus_core::format::Mode;
use habitus_core::generator::bilinear::Bilinear;
use habitus_core::generator::prepared::{self, Prepared};
use habitus_core::generator::{At, Generator, LANES, NUMBERS, Weights};
pub use habitus_dispatch::{
    any_prepared, evaluate, evaluate_at, evaluate_batch_at, fit_points, linearise, linearise_at, moments,
    normal_equations, prepared, wavelet_synthesis,
};

/// [`evaluate`] over `threads` threads of rayon's pool, this one included (0 counts as 1); the bits do not depend on their number.
///
/// Each thread takes one range of whole blocks of [`LANES`] vertices. Errors: as [`Generator::evaluate`]; `out` is untouched then.
pub fn evaluate_parallel<G: Generator + Sync>(
    generator: &G,
    weights: Weights<'_>,
    vertices: Range<usize>,
    out: &mut [f32],
    threads: usize,
) -> Result<(), Error> {
    evaluate_at_parallel(generator, generator.begin(weights, false, &mut [])?, vertices, out, threads)
}

/// [`evaluate_at`] over threads, as [`evaluate_parallel`].
///
/// Errors: as [`Generator::evaluate_at`]; `out` is untouched then.
pub fn evaluate_at_parallel<G: Generator + Sync>(
    generator: &G,
    at: At<'_>,
    vertices: Range<usize>,
    out: &mut [f32],
    threads: usize,
) -> Result<(), Error> {
    let fits = vertices.start <= vertices.end && 3 * vertices.len() == out.len();
    if threads < 2 || !fits || vertices.end > generator.vertex_count() {
        return evaluate_at(generator, at, vertices, out);
    }
    let blocks = vertices.start / LANES..vertices.end.div_ceil(LANES);
    let mut rest = out;
    let parts = split(blocks, threads).map(|part| {
        let range = vertices.start.max(LANES * part.start)..vertices.end.min(LANES * part.end);
        let (piece, behind) = std::mem::take(&mut rest).split_at_mut(3 * range.len());
        rest = behind;
        (range, piece)
    });
    on_threads(parts.collect(), |(range, piece)| evaluate_at(generator, at, range, piece))
}

/// [`linearise`] over `threads` threads of rayon's pool, this one included (0 counts as 1); the bits do not depend on their number.
///
/// Errors: as [`Generator::linearise`]; the outputs are untouched then.
pub fn linearise_parallel<G: Generator + Sync>(
    generator: &G,
    weights: Weights<'_>,
    blocks: Range<usize>,
    values: &mut [f32],
    jacobian: &mut [f32],
    threads: usize,
) -> Result<(), Error> {
    linearise_at_parallel(generator, generator.begin(weights, true, &mut [])?, blocks, values, jacobian, threads)
}

/// [`linearise_at`] over threads, as [`linearise_parallel`].
///
/// Errors: as [`Generator::linearise_at`]; the outputs are untouched then.
pub fn linearise_at_parallel<G: Generator + Sync>(
    generator: &G,
    at: At<'_>,
    blocks: Range<usize>,
    values: &mut [f32],
    jacobian: &mut [f32],
    threads: usize,
) -> Result<(), Error> {
    let dim = generator.dim();
    let numbers = NUMBERS * blocks.len();
    let fits = blocks.start <= blocks.end && values.len() == numbers && jacobian.len() == numbers * dim;
    if threads < 2 || !fits || blocks.end > generator.block_count() {
        return linearise_at(generator, at, blocks, values, jacobian);
    }
    let mut rest = (values, jacobian);
    let parts = split(blocks, threads).map(|part| {
        let (values, jacobian) = std::mem::take(&mut rest);
        let (value, values_behind) = values.split_at_mut(NUMBERS * part.len());
        let (columns, jacobian_behind) = jacobian.split_at_mut(NUMBERS * dim * part.len());
        rest = (values_behind, jacobian_behind);
        (part, value, columns)
    });
    on_threads(parts.collect(), |(part, value, columns)| linearise_at(generator, at, part, value, columns))
}

/// [`prepared()`] over `threads` threads of rayon's pool, this one included (0 counts as 1); the bits do not depend on their number.
///
/// Errors: as [`Prepared::new`].
pub fn prepared_parallel<'w>(
    generator: &Bilinear<'_>,
    fixed: Mode,
    weights: &[f32],
    blocks: Range<usize>,
    workspace: &'w mut [f32],
    threads: usize,
) -> Result<Prepared<'w>, Error> {
    let needed = prepared::prepared_req(generator, fixed, &blocks).numbers();
    let fits = blocks.start <= blocks.end && blocks.end <= generator.block_count() && needed <= workspace.len();
    if threads < 2 || !fits {
        return prepared(generator, fixed, weights, blocks, workspace);
    }
    let mut rest = &mut workspace[..needed];
    let parts = split(blocks.clone(), threads).map(|part| {
        let numbers = prepared::prepared_req(generator, fixed, &part).numbers();
        let (piece, behind) = std::mem::take(&mut rest).split_at_mut(numbers);
        rest = behind;
        (part, piece)
    });
    on_threads(parts.collect(), |(part, piece)| prepared(generator, fixed, weights, part, piece).map(|_| ()))?;
    Prepared::of_numbers(generator, fixed, blocks, workspace)
}

/// `count` ranges of nearly the same length, in order.
fn split(blocks: Range<usize>, count: usize) -> impl Iterator<Item = Range<usize>> {
    let n = blocks.len();
    let edge = move |k: usize| blocks.start + n * k / count;
    (0..count).map(move |k| edge(k)..edge(k + 1)).filter(|part| !part.is_empty())
}

/// Runs `work` on every part, the first on this thread; the first error in the order of the parts.
fn on_threads<P: Send>(parts: Vec<P>, work: impl Fn(P) -> Result<(), Error> + Sync) -> Result<(), Error> {
    let mut results = vec![Ok(()); parts.len()];
    let work = &work;
    rayon::in_place_scope(|scope| {
        let mut pairs = parts.into_iter().zip(&mut results);
        let own = pairs.next();
        for (part, result) in pairs {
            scope.spawn(move |_| *result = work(part));
        }
        if let Some((part, result)) = own {
            *result = work(part);
        }
    });
    results.into_iter().collect()
}

#[cfg(test)]
#[path = "evaluate_tests.rs"]
mod tests;
