//! The wavelet transform and fits of wavelet models.

use habitus_core::Error;
use habitus_core::fit::{WaveletOptions, WaveletReport, fit_wavelet, fit_wavelet_req};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::wavelet::{Multiscale, Stored};
use habitus_core::quantise::Storage;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::wavelet::basis::{Basis, basis_req, coefficient_lines};
use habitus_core::wavelet::line::{analysis_step, step_req, synthesis_step};
use habitus_core::wavelet::transform::{analysis, analysis_req, synthesis, synthesis_req};
use habitus_core::wavelet::window::window;
use habitus_core::wavelet::{Grid, Wavelet};

use super::fit::{frame, numbers_of_placement, placement};
use crate::memory::{Number, Pieces, integer, number};
use crate::result::{Problem, Tally};
use crate::samples::TextSamples;
use crate::text::{Case, decimal};

/// So many integers of a field.
fn integers<const N: usize>(case: &Case<'_>, key: &'static str) -> Result<[usize; N], Problem> {
    let mut values = case.field(key).ok_or(Problem::Text(key))?;
    let mut found = [0; N];
    for value in &mut found {
        *value = values.next().and_then(decimal).ok_or(Problem::Text(key))? as usize;
    }
    Ok(found)
}

/// The generator of the case's model: at the levels `levels` (detail, resolution) and in the window `window` (columns, then rows), where it says so.
#[inline(never)]
pub(super) fn generator<'m>(
    pieces: &mut Pieces<'m>,
    case: &Case<'_>,
    models: &str,
) -> Result<(Model<'m>, AnyGenerator<'m>), Problem> {
    let model = Model::open(pieces.model(case, models)?)?;
    let mut generator = model.generator()?;
    if case.field("levels").is_some() {
        let [detail, resolution] = integers(case, "levels")?;
        generator = generator.with_levels(detail, resolution)?;
    }
    if case.field("window").is_some() {
        let [left, right, top, bottom] = integers(case, "window")?;
        generator = generator.with_window(left..right, top..bottom)?;
    }
    Ok((model, generator))
}

fn wavelet(case: &Case<'_>) -> Result<Wavelet, Problem> {
    match case.word("wavelet") {
        Some("cubic") => Ok(Wavelet::Cubic),
        Some("bilinear") => Ok(Wavelet::Bilinear),
        _ => Err(Problem::Text("wavelet")),
    }
}

fn grid(case: &Case<'_>) -> Result<Grid, Problem> {
    let [width, height, levels] = integers(case, "grid")?;
    Ok(Grid::new(width, height, levels)?)
}

/// Planes of coefficients. A grid has nodes, which the compiler does not know: a division would keep a panic path in small programs.
fn components<R>(grid: &Grid, coefficients: &[R]) -> Result<usize, Problem> {
    coefficients.len().checked_div(grid.len()).ok_or(Problem::Text("grid"))
}

/// One lifting step of a line and back.
#[inline(never)]
pub(super) fn step<R: Number>(case: &Case<'_>, pieces: &mut Pieces<'_>, tally: &mut Tally<'_>) -> Result<(), Problem> {
    let wavelet = wavelet(case)?;
    let samples: &mut [R] = pieces.numbers(case, "samples")?;
    let m = samples.len() / 2;
    let (coarse, detail) = (pieces.zeros(m + 1)?, pieces.zeros(m)?);
    let workspace = pieces.zeros(step_req(samples.len()).numbers())?;
    analysis_step(wavelet, samples, coarse, detail, workspace)?;
    tally.compare::<R>("coarse", coarse)?;
    tally.compare::<R>("detail", detail)?;
    synthesis_step(wavelet, coarse, detail, samples, workspace)?;
    tally.compare::<R>("back", samples)
}

/// Samples of any number of components to coefficients.
#[inline(never)]
pub(super) fn coefficients<R: Number>(
    case: &Case<'_>,
    pieces: &mut Pieces<'_>,
    tally: &mut Tally<'_>,
) -> Result<(), Problem> {
    let (grid, wavelet) = (grid(case)?, wavelet(case)?);
    let samples: &[R] = pieces.numbers(case, "samples")?;
    let found = pieces.zeros(samples.len())?;
    let workspace = pieces.zeros(analysis_req(&grid).numbers())?;
    analysis(&grid, wavelet, samples, found, workspace)?;
    tally.compare::<R>("coefficients", found)
}

/// Windows of a level, each of which has to have the bits of its part of the whole surface, and this.
#[inline(never)]
pub(super) fn windows<R: Number>(
    case: &Case<'_>,
    pieces: &mut Pieces<'_>,
    tally: &mut Tally<'_>,
) -> Result<(), Problem> {
    let (grid, wavelet, level) = (grid(case)?, wavelet(case)?, integer(case, "level")? as usize);
    let numbers: &[R] = pieces.numbers(case, "coefficients")?;
    let components = components(&grid, numbers)?;
    let memory = pieces.zeros(components * grid.node_count(level))?;
    let workspace = pieces.zeros(synthesis_req(&grid, level).numbers())?;
    for bounds in pieces.integers(case, "windows")?.as_chunks::<4>().0 {
        let [left, right, top, bottom] = bounds.map(|bound| bound as usize);
        let (columns, rows) = (left..right, top..bottom);
        let (width, height) = (right.saturating_sub(left), bottom.saturating_sub(top));
        // A wrong window is refused before the output is looked at.
        let area = (components * width * height).min(memory.len());
        let out = memory.get_mut(..area).ok_or(Problem::Memory)?;
        window(&grid, wavelet, level, columns, rows, numbers, out, workspace)?;
        for (row, out) in out.chunks_exact(width.max(1)).enumerate() {
            let (component, row) = (row / height.max(1), row % height.max(1));
            let first = component * grid.node_count(level) + (top + row) * grid.width(level) + left;
            tally.compare_part::<R>("out", first, out)?;
        }
    }
    synthesis(&grid, wavelet, level, numbers, memory, workspace)?;
    tally.compare::<R>("out", memory)
}

/// The two lines of some coefficients, where they are not zero.
#[inline(never)]
pub(super) fn lines<R: Number>(case: &Case<'_>, pieces: &mut Pieces<'_>, tally: &mut Tally<'_>) -> Result<(), Problem> {
    let (grid, wavelet) = (grid(case)?, wavelet(case)?);
    let [columns, rows] = [grid.columns(), grid.rows()];
    let columns = Basis::<R>::new(columns, wavelet, pieces.zeros(basis_req(&columns, wavelet).numbers())?)?;
    let rows = Basis::<R>::new(rows, wavelet, pieces.zeros(basis_req(&rows, wavelet).numbers())?)?;
    let (mut supports, mut values) = (0, 0);
    for &coefficient in pieces.integers(case, "of")?.iter() {
        let lines = coefficient_lines(&grid, &columns, &rows, coefficient as usize).ok_or(Problem::Text("of"))?;
        for line in lines {
            let support = [line.first as u32, (line.first + line.values.len()) as u32];
            tally.compare_integers_part("supports", supports, &support)?;
            tally.compare_part::<R>("values", values, line.values)?;
            supports += 2;
            values += line.values.len();
        }
    }
    Ok(())
}

/// What a fit changes.
struct Fitted<'m> {
    identity: &'m mut [f32],
    pose: &'m mut [f32],
    placement: Similarity<f32>,
}

#[inline(never)]
fn fitted<'a, S: Storage<'a>>(
    generator: &Multiscale<Stored<'a, S>>,
    samples: &TextSamples<'_>,
    options: &WaveletOptions<'_>,
    fit: &mut Fitted<'_>,
    pieces: &mut Pieces<'_>,
) -> Result<WaveletReport, Problem> {
    let needed = fit_wavelet_req(generator, habitus_core::fit::Samples::len(samples), &options.levels);
    let workspace = pieces.zeros(needed.numbers())?;
    Ok(fit_wavelet(generator, samples, options, fit.identity, fit.pose, &mut fit.placement, workspace)?)
}

/// A fit by levels.
#[inline(never)]
pub(super) fn fit(
    case: &Case<'_>,
    pieces: &mut Pieces<'_>,
    tally: &mut Tally<'_>,
    models: &str,
) -> Result<(), Problem> {
    let (model, generator) = generator(pieces, case, models)?;
    let samples = TextSamples::new(case, pieces)?;
    let [identity_free, pose_free] = integers(case, "free")?;
    let [from, to] = integers(case, "fitted_levels")?;
    let spread = |mode, free| if free > 0 { model.spread(mode) } else { None };
    let options = WaveletOptions {
        frame: frame(case)?,
        identity: spread(Mode::Identity, identity_free),
        pose: spread(Mode::Pose, pose_free),
        kappa: number(case, "kappa")?,
        omega: number(case, "omega")?,
        levels: from..to,
        passes: integer(case, "passes")?,
    };
    let (identity, pose) = (pieces.numbers(case, "identity")?, pieces.numbers(case, "pose")?);
    let mut fit = Fitted { identity, pose, placement: placement(case, "placement")? };
    let report = match &generator {
        AnyGenerator::WaveletF32(of) => fitted(of, &samples, &options, &mut fit, pieces)?,
        AnyGenerator::WaveletF16(of) => fitted(of, &samples, &options, &mut fit, pieces)?,
        AnyGenerator::WaveletI8(of) => fitted(of, &samples, &options, &mut fit, pieces)?,
        other => return Err(Error::WrongKind { expected: 4, found: other.kind() as u32 }.into()),
    };
    tally.compare_integers("passes_reached", &[report.passes, report.reached])?;
    tally.compare("rms_start", &[report.rms, report.start_rms])?;
    tally.compare::<f32>("identity_fitted", fit.identity)?;
    tally.compare::<f32>("pose_fitted", fit.pose)?;
    tally.compare("placement_fitted", &numbers_of_placement(&fit.placement))
}
