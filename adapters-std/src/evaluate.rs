//! The kernel at the speed of the host: eq. 8.1 and its derivatives with the vector width chosen at run time ([`habitus_dispatch`]), and over threads.
//!
//! Each lane sums in the order of the kernel and no operation is fused, so the bits are those of the kernel, whatever the width and the number
//! of threads. Errors are the kernel's.

use std::ops::Range;

use habitus_core::Error;
use habitus_core::format::Mode;
use habitus_core::generator::bilinear::Bilinear;
use habitus_core::generator::prepared::{self, Prepared};
use habitus_core::generator::wavelet::{Locals, Multiscale};
use habitus_core::generator::{At, Generator, LANES, NUMBERS, Weights};
use habitus_core::wavelet::transform::synthesis_req;
use habitus_core::wavelet::window::window_req;
use habitus_core::wavelet::{Grid, Wavelet};
use habitus_dispatch::wavelet_window;
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

/// [`evaluate_batch_at`] over threads, each with a part of the states; otherwise as [`evaluate_parallel`].
///
/// Errors: as [`Generator::evaluate_batch_at`]; `out` is untouched then.
pub fn evaluate_batch_at_parallel<G: Generator + Sync>(
    generator: &G,
    ats: &[At<'_>],
    vertices: Range<usize>,
    out: &mut [f32],
    threads: usize,
) -> Result<(), Error> {
    let each = 3 * vertices.len();
    let fits = each * ats.len() == out.len() && vertices.end <= generator.vertex_count();
    if threads < 2 || each == 0 || !fits {
        return evaluate_batch_at(generator, ats, vertices, out);
    }
    // Every state is looked at before anything is written.
    evaluate_batch_at(generator, ats, 0..0, &mut [])?;
    let count = ats.len().div_ceil(threads).max(1);
    let parts = ats.chunks(count).zip(out.chunks_mut(count * each)).collect();
    on_threads(parts, |(ats, out)| evaluate_batch_at(generator, ats, vertices.clone(), out))
}

/// [`wavelet_synthesis`] over `threads` threads of rayon's pool, this one included (0 counts as 1), each with some rows of every component; the bits do not
/// depend on their number.
///
/// Its memory is its own. Errors: as [`transform::synthesis`](habitus_core::wavelet::transform::synthesis), but for the workspace; `out` is untouched then.
pub fn wavelet_synthesis_parallel(
    grid: &Grid,
    wavelet: Wavelet,
    level: usize,
    coefficients: &[f32],
    out: &mut [f32],
    threads: usize,
) -> Result<(), Error> {
    let (width, height, nodes) = (grid.width(level), grid.height(level), grid.node_count(level));
    let components = coefficients.len() / grid.len();
    let fits = components * grid.len() == coefficients.len() && components * nodes == out.len();
    if threads < 2 || level > grid.levels() || !fits {
        let mut workspace = vec![0.0; synthesis_req(grid, level).numbers()];
        return wavelet_synthesis(grid, wavelet, level, coefficients, out, &mut workspace);
    }
    let mut parts: Vec<_> = split(0..height, threads).map(|rows| (rows, Vec::new())).collect();
    for (coefficients, plane) in coefficients.chunks(grid.len()).zip(out.chunks_mut(nodes)) {
        let mut rest = plane;
        for (rows, pieces) in &mut parts {
            let (piece, behind) = std::mem::take(&mut rest).split_at_mut(width * rows.len());
            rest = behind;
            pieces.push((coefficients, piece));
        }
    }
    on_threads(parts, |(rows, pieces)| {
        let mut workspace = vec![0.0; window_req(grid, level, &(0..width), &rows).numbers()];
        pieces.into_iter().try_for_each(|(coefficients, piece)| {
            wavelet_window(grid, wavelet, level, 0..width, rows.clone(), coefficients, piece, &mut workspace)
        })
    })
}

/// Every vertex of a wavelet model over `threads` threads of rayon's pool, this one included (0 counts as 1), each with some rows of the surface; the bits
/// do not depend on their number.
///
/// A vertex of such a model is only copied from a state, so [`evaluate_at_parallel`] has nothing to share out; here the states are computed side by
/// side, a window each. Errors: as [`Generator::begin`], `DimensionMismatch` for `out`.
pub fn evaluate_surface_parallel<L: Locals + Sync>(
    generator: &Multiscale<L>,
    weights: Weights<'_>,
    out: &mut [f32],
    threads: usize,
) -> Result<(), Error> {
    let n = generator.vertex_count();
    let corners = n.checked_sub(1).and_then(|last| Some((generator.node(0)?, generator.node(last)?)));
    let Some(([left, top], [right, bottom])) = corners else { return Err(Error::Empty) };
    let (columns, rows) = (left..right + 1, top..bottom + 1);
    if threads < 2 || columns.len() * rows.len() != n || out.len() != 3 * n {
        return surface(generator, weights, out);
    }
    let mut rest = out;
    let parts = split(rows, threads).map(|part| {
        let (piece, behind) = std::mem::take(&mut rest).split_at_mut(3 * columns.len() * part.len());
        rest = behind;
        (part, piece)
    });
    on_threads(parts.collect(), |(part, piece)| surface(&generator.with_window(columns.clone(), part)?, weights, piece))
}

/// All vertices on one thread.
fn surface<L: Locals>(generator: &Multiscale<L>, weights: Weights<'_>, out: &mut [f32]) -> Result<(), Error> {
    let mut state = vec![0.0; generator.state_req(false).numbers()];
    let at = generator.begin(weights, false, &mut state)?;
    evaluate_at(generator, at, 0..generator.vertex_count(), out)
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
