//! Fitting a wavelet model to landmarks or corresponding points, level by level and one coefficient at a time (Wuhrer, ch. 15).

use core::ops::Range;

use super::local::{Local, Quadratic, Variables, local_req};
use super::normal_equations::{Frame, check_sample};
use super::samples::{Sample, Samples};
use crate::Error;
use crate::Real;
use crate::format::Spread;
use crate::generator::wavelet::{Locals, Multiscale, Stored};
use crate::generator::{Generator, Weights};
use crate::quantise::Storage;
use crate::rotation::similarity::Similarity;
use crate::solve::procrustes::Moments;
use crate::wavelet::Grid;
use crate::wavelet::basis::{LevelLines, Line, level_lines_req, scratch_req};
use crate::workspace::{Requirement, Workspace, check_len, saturated};

/// How to fit a wavelet model.
#[derive(Debug, Clone)]
pub struct WaveletOptions<'a> {
    /// Which placement is sought, before every pass and in the end, by Procrustes from the samples.
    pub frame: Frame,
    /// Mean and scale of the identity weights ([`Model::spread`](crate::format::Model::spread)), at least as many as are fitted; none: they are held.
    pub identity: Option<Spread<'a>>,
    /// The same for the pose weights.
    pub pose: Option<Spread<'a>>,
    /// Half the box of each weight, in scales about its mean; above 0, infinite for no box. Weights that start outside may stay.
    pub kappa: f32,
    /// Pull of every weight to its mean: `omega ((w - mean) / scale)^2` is added to the squared distances, mm^2; at least 0.
    pub omega: f32,
    /// The levels whose coefficients are fitted, coarse to fine.
    pub levels: Range<usize>,
    /// Passes over the coefficients of a level, at least one.
    pub passes: u32,
}

/// How a fit of a wavelet model ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveletReport {
    /// Root of the weighted mean squared distance of the samples, millimetres.
    pub rms: f32,
    /// The same after the first placement.
    pub start_rms: f32,
    /// Passes over a level.
    pub passes: u32,
    /// Coefficients that a sample reaches, summed over the levels.
    pub reached: u32,
}

/// Samples whose numbers an `f32` holds exactly.
const MAX_SAMPLES: usize = 1 << 24;

/// Numbers that are kept of a sample.
const KEPT: usize = 10;

/// A sample on its way: where its node lies now, what is missing to its target in the frame of the model, and the chain of its cell.
struct Kept {
    position: [f32; 3],
    residual: [f32; 3],
    weight: f32,
    node: [usize; 2],
    /// One more than the index of the next sample of the cell; 0 at the end.
    next: usize,
}

impl Kept {
    #[inline(always)]
    fn load([a, b, c, x, y, z, weight, column, row, next]: &[f32; KEPT]) -> Self {
        Kept {
            position: [*a, *b, *c],
            residual: [*x, *y, *z],
            weight: *weight,
            // Nodes and samples are few enough to be numbers of 24 bits.
            node: [*column as usize, *row as usize],
            next: *next as usize,
        }
    }

    #[inline(always)]
    fn store(&self, to: &mut [f32; KEPT]) {
        let ([a, b, c], [x, y, z], [column, row]) = (self.position, self.residual, self.node);
        *to = [a, b, c, x, y, z, self.weight, column as f32, row as f32, self.next as f32];
    }
}

/// The samples by cells of a grid.
struct Cells<'w> {
    kept: &'w mut [[f32; KEPT]],
    /// One more than the index of the first sample of each cell; 0 when there is none.
    heads: &'w mut [f32],
    width: usize,
    shift: usize,
}

impl Cells<'_> {
    /// Visits the samples that a function of two lines reaches, with its value there.
    #[inline(always)]
    fn each(&mut self, [x, y]: [Line<'_, f32>; 2], mut visit: impl FnMut(usize, f32, &mut Kept) -> bool) {
        let cells = |line: &Line<'_, f32>| {
            let last = line.first + line.values.len().saturating_sub(1);
            line.first >> self.shift..(last >> self.shift) + 1
        };
        for row in cells(&y) {
            let heads = self.heads.get(row * self.width..).unwrap_or_default();
            for head in heads.get(cells(&x)).unwrap_or_default() {
                let mut next = *head as usize;
                // A chain is no longer than there are samples.
                for _ in 0..self.kept.len() {
                    let Some(index) = next.checked_sub(1) else { break };
                    let Some(numbers) = self.kept.get_mut(index) else { break };
                    let mut kept = Kept::load(numbers);
                    next = kept.next;
                    let value = x.at(kept.node[0]) * y.at(kept.node[1]);
                    if value != 0.0 && visit(index, value, &mut kept) {
                        kept.store(numbers);
                    }
                }
            }
        }
    }
}

/// Scratch of [`fit_wavelet`]: ten numbers a sample, one a node of the finest fitted level, and the transform's lines of one level. The first two levels of the
/// published grid with 13 landmarks take 17 KiB.
pub fn fit_wavelet_req<'a, S: Storage<'a>>(
    generator: &Multiscale<Stored<'a, S>>,
    n_samples: usize,
    levels: &Range<usize>,
) -> Requirement {
    let grid = generator.grid();
    let heads = grid.node_count(levels.end.saturating_sub(1));
    Requirement::of(n_samples.saturating_mul(KEPT))
        .and(Requirement::of(heads))
        .and(lines_req(generator))
        .and(local_req(generator.locals().identity_dim(), generator.locals().pose_dim()))
}

/// Lines of a level along both axes, and the scratch behind them.
fn lines_req<'a, S: Storage<'a>>(generator: &Multiscale<Stored<'a, S>>) -> Requirement {
    let (grid, wavelet) = (generator.grid(), generator.wavelet());
    let (columns, rows) = (grid.columns(), grid.rows());
    let mut lines = Requirement::NONE;
    for level in 0..=grid.levels() {
        let both = level_lines_req(&columns, wavelet, level).and(level_lines_req(&rows, wavelet, level));
        lines = lines.or(both);
    }
    lines.and(scratch_req(&columns).or(scratch_req(&rows)))
}

/// Finds weights of the levels `levels`, coarse to fine, that bring nodes of the surface to measured positions.
///
/// For one coefficient at a time the sum over all samples that it reaches collapses to a problem of its few weights, which is solved in their box by
/// alternating between identity and pose. Weights of coefficients that no sample reaches, and of other levels, stay. It is how landmarks
/// start a fit (levels 0 to 2, four passes) and how corresponding points go on with it, level by level.
///
/// | argument | shape | note |
/// |---|---|---|
/// | `samples` | at least one with a weight | those with a weight each at a vertex of the generator, with one barycentric weight, 1 |
/// | `identity`, `pose` | `identity_dim`, `pose_dim` | start (commonly the means) and result; untouched on error |
/// | `placement` | model to scan | start for [`Frame::Fixed`], result; untouched on error |
/// | `workspace` | [`fit_wavelet_req`] | |
///
/// Energy: `sum_k weight_k |s R x_k(w) + t - target_k|^2 + omega sum ((w - mean) / scale)^2`, with a normal the distance along it alone. For points without normals no
/// step raises it (but the placement is found from points, normals or not).
/// Cost: each pass visits, for each coefficient of the level, the samples in the cells that its function covers. Before, positions of the samples
/// are summed over the coefficients that reach them, which reads the model once at most: no grid of positions is needed.
/// Accuracy: tests `planted_weights_come_back` and `landmarks_lower_the_error_at_every_pass`.
/// Determinism: coefficients in the order of [`Grid`], samples by cells in rows, within a cell the last first.
/// Errors: `DimensionMismatch`, `NotFinite`, `IndexOutOfRange` (level or vertex), `BadSample` (normal, or a point that is no vertex), `BadOption` (1 kappa, 2 omega, 3 levels or passes: none), `Empty`, `Degenerate` (placement), `LimitExceeded` (2^24 samples),
/// `WorkspaceTooSmall` for levels or samples beyond the workspace, with what they need.
/// Panics: never.
#[allow(clippy::too_many_arguments)]
pub fn fit_wavelet<'a, S: Storage<'a>, P: Samples + ?Sized>(
    generator: &Multiscale<Stored<'a, S>>,
    samples: &P,
    options: &WaveletOptions<'_>,
    identity: &mut [f32],
    pose: &mut [f32],
    placement: &mut Similarity<f32>,
    workspace: &mut [f32],
) -> Result<WaveletReport, Error> {
    let grid = *generator.grid();
    check(generator, samples, options, Weights { identity, pose })?;
    if options.frame == Frame::Fixed && !placement.is_finite() {
        return Err(Error::NotFinite { index: 0 });
    }
    let levels = options.levels.clone();
    fit_wavelet_req(generator, samples.len(), &levels).check(workspace.len())?;
    let mut pieces = Workspace::new(workspace);
    let finest = levels.end.saturating_sub(1);
    let cells = Cells {
        kept: pieces.take(samples.len() * KEPT)?.as_chunks_mut().0,
        heads: pieces.take(grid.node_count(finest))?,
        width: grid.width(finest),
        shift: grid.levels() - finest.min(grid.levels()),
    };
    let local = Local::take(generator.locals().identity_dim(), generator.locals().pose_dim(), &mut pieces)?;
    let mut fit = Fit { generator, samples, options, grid, cells, local, placement: *placement };
    fit.sort();
    let lines = pieces.rest();
    for level in 0..=grid.levels() {
        let lines = fit.lines(level, lines)?;
        fit.add_level(level, &lines, Weights { identity, pose });
    }
    if options.frame != Frame::Fixed {
        fit.placement = fit.placed()?;
    }
    let start_rms = fit.residuals();
    let (mut passes, mut reached) = (0, 0);
    for level in levels {
        let lines = fit.lines(level, lines)?;
        for _ in 0..options.passes {
            reached += fit.pass(level, &lines, identity, pose);
            passes += 1;
            fit.place_again();
        }
    }
    *placement = fit.placement;
    Ok(WaveletReport { rms: fit.residuals(), start_rms, passes, reached })
}

fn check<'a, S: Storage<'a>, P: Samples + ?Sized>(
    generator: &Multiscale<Stored<'a, S>>,
    samples: &P,
    options: &WaveletOptions<'_>,
    start: Weights<'_>,
) -> Result<(), Error> {
    start.check(generator.identity_dim(), generator.pose_dim())?;
    for (spread, dim) in [(options.identity, generator.identity_dim()), (options.pose, generator.pose_dim())] {
        if let Some(spread) = spread {
            let (mean, scale) = (spread.mean.len(), spread.scale.len());
            check_len(dim.max(mean), mean)?;
            check_len(dim.max(scale), scale)?;
        }
    }
    if !(options.kappa > 0.0) {
        return Err(Error::BadOption { option: 1 });
    }
    if !(options.omega >= 0.0 && options.omega.is_finite()) {
        return Err(Error::BadOption { option: 2 });
    }
    if options.levels.is_empty() || options.passes == 0 {
        return Err(Error::BadOption { option: 3 });
    }
    let limit = generator.detail().min(generator.grid().levels()) + 1;
    if options.levels.end > limit {
        return Err(Error::IndexOutOfRange { index: saturated(options.levels.end - 1), limit: saturated(limit) });
    }
    if samples.len() >= MAX_SAMPLES {
        return Err(Error::LimitExceeded { found: saturated(samples.len()), limit: saturated(MAX_SAMPLES - 1) });
    }
    let mut any = false;
    for index in 0..samples.len() {
        let Some(sample) = samples.get(index) else { continue };
        check_sample(&sample, index, generator.vertex_count())?;
        if sample.weight > 0.0 {
            vertex(&sample).ok_or(Error::BadSample { index: saturated(index) })?;
            any = true;
        }
    }
    if any { Ok(()) } else { Err(Error::Empty) }
}

/// The vertex that a sample is at.
fn vertex(sample: &Sample) -> Option<usize> {
    let mut parts = sample.point.vertices.iter().zip(&sample.point.barycentric).filter(|(_, part)| **part != 0.0);
    let (vertex, part) = parts.next()?;
    if *part == 1.0 && parts.next().is_none() { Some(*vertex as usize) } else { None }
}

struct Fit<'f, 'w, 'a, S: Storage<'a>, P: ?Sized> {
    generator: &'f Multiscale<Stored<'a, S>>,
    samples: &'f P,
    options: &'f WaveletOptions<'f>,
    grid: Grid,
    cells: Cells<'w>,
    local: Local<'w>,
    placement: Similarity<f32>,
}

impl<'a, S: Storage<'a>, P: Samples + ?Sized> Fit<'_, '_, 'a, S, P> {
    /// Puts the samples into the cells of the finest fitted level.
    fn sort(&mut self) {
        let Cells { kept, heads, width, shift } = &mut self.cells;
        heads.fill(0.0);
        for (index, to) in kept.iter_mut().enumerate() {
            *to = [0.0; KEPT];
            let Some(sample) = self.samples.get(index).filter(|sample| sample.weight > 0.0) else { continue };
            let Some([column, row]) = vertex(&sample).and_then(|vertex| self.generator.node(vertex)) else { continue };
            let Some(head) = heads.get_mut((row >> *shift) * *width + (column >> *shift)) else { continue };
            let node = [column, row];
            let next = *head as usize;
            Kept { position: [0.0; 3], residual: [0.0; 3], weight: sample.weight, node, next }.store(to);
            *head = (index + 1) as f32;
        }
    }

    /// The lines of a level along both axes.
    fn lines<'l>(&self, level: usize, memory: &'l mut [f32]) -> Result<[LevelLines<'l, f32>; 2], Error> {
        let (columns, rows, wavelet) = (self.grid.columns(), self.grid.rows(), self.generator.wavelet());
        let mut memory = Workspace::new(memory);
        let x = memory.take(level_lines_req(&columns, wavelet, level).numbers())?;
        let y = memory.take(level_lines_req(&rows, wavelet, level).numbers())?;
        let scratch = memory.rest();
        Ok([LevelLines::new(columns, wavelet, level, x, scratch)?, LevelLines::new(rows, wavelet, level, y, scratch)?])
    }

    /// The two lines of a coefficient.
    fn function<'l>(&self, coefficient: usize, [x, y]: &[LevelLines<'l, f32>; 2]) -> Option<[Line<'l, f32>; 2]> {
        let node = self.grid.node_of(coefficient)?;
        let shift = self.grid.levels().checked_sub(node.level)?;
        Some([x.line(node.column >> shift)?, y.line(node.row >> shift)?])
    }

    /// Adds what the coefficients of a level give to the positions of the samples.
    fn add_level(&mut self, level: usize, lines: &[LevelLines<'_, f32>; 2], weights: Weights<'_>) {
        let locals = *self.generator.locals();
        let weighted = level <= self.generator.detail();
        for coefficient in self.grid.coefficients(level) {
            let Some(function) = self.function(coefficient, lines) else { continue };
            let mut value = None;
            let local = &mut self.local;
            self.cells.each(function, |_, influence, kept| {
                let value = *value.get_or_insert_with(|| {
                    if weighted {
                        load(local, weights, coefficient);
                        let mean = locals.one(coefficient, local.core).unwrap_or_default();
                        local.value(mean)
                    } else {
                        locals.one(coefficient, &mut []).unwrap_or_default()
                    }
                });
                for (sum, value) in kept.position.iter_mut().zip(value) {
                    *sum += influence * value;
                }
                true
            });
        }
    }

    /// The placement that brings the samples to their targets.
    fn placed(&self) -> Result<Similarity<f32>, Error> {
        let mut moments = Moments::new();
        for (index, kept) in self.cells.kept.iter().enumerate() {
            let kept = Kept::load(kept);
            if let Some(sample) = self.samples.get(index).filter(|_| kept.weight > 0.0) {
                moments.add(kept.position, sample.target, kept.weight);
            }
        }
        moments.similarity(self.options.frame == Frame::Similarity)
    }

    /// Places again, if a placement is sought and is found.
    fn place_again(&mut self) {
        if self.options.frame != Frame::Fixed
            && let Ok(placement) = self.placed()
        {
            self.placement = placement;
        }
        self.residuals();
    }

    /// Writes the residuals and returns the root mean square.
    fn residuals(&mut self) -> f32 {
        let (mut sum, mut total) = (0.0, 0.0);
        for (index, numbers) in self.cells.kept.iter_mut().enumerate() {
            let mut kept = Kept::load(numbers);
            let Some(sample) = self.samples.get(index).filter(|_| kept.weight > 0.0) else { continue };
            let target = self.placement.inverse_applied(sample.target);
            for ((residual, target), position) in kept.residual.iter_mut().zip(target).zip(kept.position) {
                *residual = target - position;
            }
            let [x, y, z] = kept.residual;
            let square = match sample.normal.map(|normal| self.placement.inverse_rotated(normal)) {
                Some([a, b, c]) => {
                    let along = a * x + b * y + c * z;
                    along * along
                }
                None => x * x + y * y + z * z,
            };
            sum += kept.weight * square;
            total += kept.weight;
            kept.store(numbers);
        }
        self.placement.scale * Real::sqrt(sum / total)
    }

    /// Improves the coefficients of a level, each once, and returns how many the samples reach.
    fn pass(&mut self, level: usize, lines: &[LevelLines<'_, f32>; 2], identity: &mut [f32], pose: &mut [f32]) -> u32 {
        let mut reached = 0;
        // Residuals are in the frame of the model; the energy is that of the scan.
        let factor = self.placement.scale * self.placement.scale;
        for coefficient in self.grid.coefficients(level) {
            let Some(function) = self.function(coefficient, lines) else { continue };
            let mut quadratic = Quadratic::default();
            let (samples, placement) = (self.samples, self.placement);
            self.cells.each(function, |index, influence, kept| {
                let normal = samples.get(index).and_then(|sample| sample.normal);
                let normal = normal.map(|normal| placement.inverse_rotated(normal));
                quadratic.add(factor * kept.weight, influence, kept.residual, normal);
                false
            });
            if !(quadratic.trace() >= 1e-12) {
                continue;
            }
            reached += 1;
            let Some(mean) = self.generator.locals().one(coefficient, self.local.core) else { continue };
            load(&mut self.local, Weights { identity, pose }, coefficient);
            bound(&mut self.local.identity, self.options, self.options.identity, coefficient);
            bound(&mut self.local.pose, self.options, self.options.pose, coefficient);
            let Some(change) = self.local.improved(mean, &quadratic, self.options.omega) else { continue };
            if change.iter().any(|value| !value.is_finite()) {
                continue;
            }
            for (all, own) in [(&mut *identity, &self.local.identity), (&mut *pose, &self.local.pose)] {
                let from = coefficient * own.weights.len();
                for (to, from) in all.get_mut(from..).unwrap_or_default().iter_mut().zip(own.weights.iter()) {
                    *to = *from;
                }
            }
            self.cells.each(function, |_, influence, kept| {
                for ((position, residual), change) in kept.position.iter_mut().zip(&mut kept.residual).zip(change) {
                    *position += influence * change;
                    *residual -= influence * change;
                }
                true
            });
        }
        reached
    }
}

/// The weights of a coefficient into the memory of its problem.
fn load(local: &mut Local<'_>, weights: Weights<'_>, coefficient: usize) {
    for (mode, all) in [(&mut local.identity, weights.identity), (&mut local.pose, weights.pose)] {
        let own = all.get(coefficient * mode.weights.len()..).unwrap_or_default();
        for (to, from) in mode.weights.iter_mut().zip(own) {
            *to = *from;
        }
    }
}

/// Means, precisions and the box of a coefficient's weights.
fn bound(mode: &mut Variables<'_>, options: &WaveletOptions<'_>, spread: Option<Spread<'_>>, coefficient: usize) {
    mode.free = spread.is_some();
    let dim = mode.weights.len();
    let bounds = mode.lower.iter_mut().zip(mode.upper.iter_mut());
    let statistics = mode.mean.iter_mut().zip(mode.precision.iter_mut());
    for (k, ((&mut weight, (lower, upper)), (mean, precision))) in
        mode.weights.iter_mut().zip(bounds).zip(statistics).enumerate()
    {
        let index = coefficient * dim + k;
        let Some((centre, scale)) = spread.and_then(|all| Some((all.mean.get(index)?, all.scale.get(index)?))) else {
            (*mean, *precision, *lower, *upper) = (weight, 0.0, weight, weight);
            continue;
        };
        let half = options.kappa * scale;
        (*mean, *precision) = (centre, 1.0 / (scale * scale));
        *lower = if centre - half < weight { centre - half } else { weight };
        *upper = if centre + half > weight { centre + half } else { weight };
    }
}
