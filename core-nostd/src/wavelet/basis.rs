//! The functions that coefficients stand for: what the surface gains when one coefficient grows by one.
//!
//! The transform is separable, so the function of a coefficient is a product of two lines. For a coefficient at the node `(i, j)` of its level,
//! these are the line of index `i` along a row and that of index `j` along a column: a scaling function for an even index, a detail
//! function for an odd one, scaling functions only at level 0. A fit needs all of them many times; [`Basis`] keeps those of one axis.

use core::ops::Range;

use super::grid::{Axis, Grid};
use super::lifting::Wavelet;
use super::line::{step_req, synthesis_step};
use crate::workspace::{Requirement, Workspace, saturated};
use crate::{Error, Real};

/// Samples of the finest level where the line of `index` at `level` need not be zero.
///
/// Errors: `IndexOutOfRange` for the level, then for the index. Panics: never.
pub fn support(axis: &Axis, wavelet: Wavelet, level: usize, index: usize) -> Result<Range<usize>, Error> {
    if level > axis.levels() {
        return Err(Error::IndexOutOfRange { index: saturated(level), limit: saturated(axis.levels() + 1) });
    }
    if index >= axis.size(level) {
        return Err(Error::IndexOutOfRange { index: saturated(index), limit: saturated(axis.size(level)) });
    }
    if level == 0 {
        return Ok(refined(axis, wavelet, 0, index..index + 1));
    }
    if index.is_multiple_of(2) {
        return Ok(refined(axis, wavelet, level - 1, index / 2..index / 2 + 1));
    }
    // The detail moves the coarse samples beside it, they the details beside them.
    let (detail, last) = (index / 2, axis.size(level - 1) - 1);
    let details = detail.saturating_sub(1)..(detail + 2).min(last);
    let own = match wavelet {
        Wavelet::Cubic => with_samples_beside(details, last),
        // Ends move, and nothing beyond the details beside.
        Wavelet::Bilinear => {
            let from = if detail == 0 { 0 } else { 2 * details.start + 1 };
            from..if detail + 1 == last { 2 * last + 1 } else { 2 * details.end }
        }
    };
    Ok(refined(axis, wavelet, level, own))
}

/// Samples of a step of which the details `details` are not zero: the samples inside the line that the third lift moves come along.
fn with_samples_beside(details: Range<usize>, last: usize) -> Range<usize> {
    let from = if details.start == 0 { 1 } else { 2 * details.start };
    from..if details.end == last { 2 * last } else { 2 * details.end + 1 }
}

/// The samples of the finest level that depend on samples of a level.
fn refined(axis: &Axis, wavelet: Wavelet, level: usize, mut samples: Range<usize>) -> Range<usize> {
    for level in level..axis.levels() {
        let last = axis.size(level) - 1;
        let details = samples.start.saturating_sub(1)..samples.end.min(last);
        let moved = match wavelet {
            Wavelet::Cubic => with_samples_beside(details, last),
            Wavelet::Bilinear => 2 * details.start + 1..2 * details.end,
        };
        samples = moved.start.min(2 * samples.start)..moved.end.max(2 * samples.end - 1);
    }
    samples
}

/// Most samples of a line of a level.
const fn longest(axis: &Axis, wavelet: Wavelet, level: usize) -> usize {
    // A step makes 2n + 3 samples of n, or 2n + 1; a detail begins with 7, or 5.
    let (scaling, detail, beside) = match wavelet {
        Wavelet::Cubic => (4, 10, 3),
        Wavelet::Bilinear => (2, 6, 1),
    };
    let start = if level == 0 { scaling } else { detail };
    let samples = (start << (axis.levels() - level)) - beside;
    let size = axis.size(axis.levels());
    if samples < size { samples } else { size }
}

/// One line: a function of the finest level along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line<'a, R> {
    /// The first sample of its support.
    pub first: usize,
    /// Its values there; it is zero elsewhere.
    pub values: &'a [R],
}

/// The lines of all levels of one axis, in the caller's memory.
#[derive(Debug, Clone, Copy)]
pub struct Basis<'w, R> {
    axis: Axis,
    wavelet: Wavelet,
    values: &'w [R],
}

/// Numbers that the lines of a level take.
const fn level_len(axis: &Axis, wavelet: Wavelet, level: usize) -> usize {
    axis.size(level).saturating_mul(longest(axis, wavelet, level))
}

/// Numbers that the lines of the levels below `level` take.
const fn levels_len(axis: &Axis, wavelet: Wavelet, level: usize) -> usize {
    let (mut numbers, mut at) = (0usize, 0);
    while at < level {
        numbers = numbers.saturating_add(level_len(axis, wavelet, at));
        at += 1;
    }
    numbers
}

/// Memory that the lines of one level take.
pub(crate) const fn level_lines_req(axis: &Axis, wavelet: Wavelet, level: usize) -> Requirement {
    Requirement::of(level_len(axis, wavelet, level))
}

/// Memory that the lines of all levels take.
pub(crate) const fn lines_req(axis: &Axis, wavelet: Wavelet) -> Requirement {
    Requirement::of(levels_len(axis, wavelet, axis.levels() + 1))
}

/// Scratch while lines are written.
pub(crate) const fn scratch_req(axis: &Axis) -> Requirement {
    let size = axis.size(axis.levels());
    Requirement::of(3 * size).and(step_req(size))
}

/// The lines of one level of one axis, in the caller's memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LevelLines<'w, R> {
    axis: Axis,
    wavelet: Wavelet,
    level: usize,
    values: &'w [R],
}

impl<'w, R: Real> LevelLines<'w, R> {
    /// Writes them by synthesis of unit vectors into `values`, [`level_lines_req`].
    pub(crate) fn new(
        axis: Axis,
        wavelet: Wavelet,
        level: usize,
        values: &'w mut [R],
        scratch: &mut [R],
    ) -> Result<Self, Error> {
        for (index, line) in values.chunks_exact_mut(longest(&axis, wavelet, level).max(1)).enumerate() {
            let support = support(&axis, wavelet, level, index)?;
            let all = synthesised(&axis, wavelet, level, index, scratch)?;
            line.fill(R::ZERO);
            for (to, from) in line.iter_mut().zip(all.get(support).unwrap_or_default()) {
                *to = *from;
            }
        }
        Ok(LevelLines { axis, wavelet, level, values })
    }

    /// The line of `index`.
    #[inline(always)]
    pub(crate) fn line(&self, index: usize) -> Option<Line<'w, R>> {
        let support = support(&self.axis, self.wavelet, self.level, index).ok()?;
        let from = index * longest(&self.axis, self.wavelet, self.level);
        Some(Line { first: support.start, values: self.values.get(from..)?.get(..support.len())? })
    }
}

impl<R: Real> Line<'_, R> {
    /// Its value at a sample of the finest level.
    #[inline(always)]
    pub(crate) fn at(&self, sample: usize) -> R {
        sample.checked_sub(self.first).and_then(|index| self.values.get(index)).copied().unwrap_or(R::ZERO)
    }
}

/// Memory of [`Basis::new`]: the lines, about `8 (levels + 1)` numbers a sample, and scratch of a few lines behind them.
pub const fn basis_req(axis: &Axis, wavelet: Wavelet) -> Requirement {
    lines_req(axis, wavelet).and(scratch_req(axis))
}

impl<'w, R: Real> Basis<'w, R> {
    /// Writes the lines of all levels, by synthesis of unit vectors.
    ///
    /// Cost: for each of the about `2 size` lines, a synthesis of `2 size` samples; workspace [`basis_req`], borrowed as long as the result lives.
    /// Errors: `WorkspaceTooSmall`. Panics: never.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub fn new(axis: Axis, wavelet: Wavelet, workspace: &'w mut [R]) -> Result<Self, Error> {
        basis_req(&axis, wavelet).check(workspace.len())?;
        let mut workspace = Workspace::new(workspace);
        let values = workspace.take(levels_len(&axis, wavelet, axis.levels() + 1))?;
        let scratch = workspace.rest();
        Self::write(axis, wavelet, values, scratch)?;
        Ok(Basis { axis, wavelet, values })
    }

    /// Writes the lines into `values`, [`lines_req`].
    pub(crate) fn write(axis: Axis, wavelet: Wavelet, values: &mut [R], scratch: &mut [R]) -> Result<(), Error> {
        let mut rest = values;
        for level in 0..=axis.levels() {
            let (lines, behind) = rest.split_at_mut_checked(level_len(&axis, wavelet, level)).ok_or(Error::Empty)?;
            LevelLines::new(axis, wavelet, level, lines, scratch)?;
            rest = behind;
        }
        Ok(())
    }

    /// The lines that [`Basis::write`] has written.
    #[inline(always)]
    pub(crate) fn of_values(axis: Axis, wavelet: Wavelet, values: &'w [R]) -> Self {
        Basis { axis, wavelet, values }
    }

    /// The line of `index` at `level`; `None` where there is none.
    #[inline(always)]
    pub fn line(&self, level: usize, index: usize) -> Option<Line<'w, R>> {
        let support = support(&self.axis, self.wavelet, level, index).ok()?;
        let from = levels_len(&self.axis, self.wavelet, level) + index * longest(&self.axis, self.wavelet, level);
        Some(Line { first: support.start, values: self.values.get(from..)?.get(..support.len())? })
    }
}

/// The two lines of a coefficient, along rows and along columns: at a node of the finest grid its function is the product of their values.
/// `None` for a coefficient that the grid has not, or lines of another grid.
///
/// Accuracy: the product of rounded lines, not the bits of a synthesis.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub fn coefficient_lines<'w, R: Real>(
    grid: &Grid,
    columns: &Basis<'w, R>,
    rows: &Basis<'w, R>,
    coefficient: usize,
) -> Option<[Line<'w, R>; 2]> {
    if columns.axis != grid.columns() || rows.axis != grid.rows() {
        return None;
    }
    let node = grid.node_of(coefficient)?;
    let shift = grid.levels().checked_sub(node.level)?;
    Some([columns.line(node.level, node.column >> shift)?, rows.line(node.level, node.row >> shift)?])
}

/// A line at all samples of the finest level.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
fn synthesised<'s, R: Real>(
    axis: &Axis,
    wavelet: Wavelet,
    level: usize,
    index: usize,
    scratch: &'s mut [R],
) -> Result<&'s [R], Error> {
    let size = axis.size(axis.levels());
    let mut scratch = Workspace::new(scratch);
    let (mut line, mut next, detail) = (scratch.take(size)?, scratch.take(size)?, scratch.take(size)?);
    let work = scratch.rest();
    line.fill(R::ZERO);
    detail.fill(R::ZERO);
    let is_detail = level > 0 && index % 2 == 1;
    let start = level.saturating_sub(1);
    let unit =
        if is_detail { detail.get_mut(index / 2) } else { line.get_mut(if level == 0 { index } else { index / 2 }) };
    if let Some(unit) = unit {
        *unit = R::ONE;
    }
    for at in start..axis.levels() {
        let (coarse, fine) = (axis.size(at), axis.size(at + 1));
        let (Some(v), Some(e), Some(out)) = (line.get(..coarse), detail.get(..coarse - 1), next.get_mut(..fine)) else {
            return Err(Error::Empty);
        };
        synthesis_step(wavelet, v, e, out, work)?;
        detail.fill(R::ZERO);
        core::mem::swap(&mut line, &mut next);
    }
    Ok(line)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wavelet::transform::{synthesis, synthesis_req};
    use proptest::prelude::*;
    use std::vec::Vec;

    const BOTH: [Wavelet; 2] = [Wavelet::Cubic, Wavelet::Bilinear];

    fn memory(axis: &Axis, wavelet: Wavelet) -> Vec<f64> {
        vec![f64::NAN; basis_req(axis, wavelet).numbers()]
    }

    #[test]
    fn lines_by_hand() {
        let axis = Axis::new(5, 2).unwrap();
        let mut memory = memory(&axis, Wavelet::Cubic);
        let basis = Basis::new(axis, Wavelet::Cubic, &mut memory).unwrap();
        let scaling = basis.line(2, 4).unwrap();
        assert_eq!((scaling.first, scaling.values), (2, &[0.125, 0.5, 0.75, 0.5, 0.125][..]));
        let detail = basis.line(2, 7).unwrap();
        assert_eq!(detail.first, 4);
        assert_eq!(
            detail.values.iter().map(|value| 64.0 * value).collect::<Vec<_>>(),
            [-3.0, -12.0, -5.0, 40.0, -5.0, -12.0, -3.0]
        );
        assert_eq!((basis.line(3, 0), basis.line(2, 17)), (None, None));
    }

    #[test]
    fn refusals() {
        let axis = Axis::new(5, 2).unwrap();
        assert_eq!(support(&axis, Wavelet::Cubic, 3, 0), Err(Error::IndexOutOfRange { index: 3, limit: 3 }));
        assert_eq!(support(&axis, Wavelet::Cubic, 1, 9), Err(Error::IndexOutOfRange { index: 9, limit: 9 }));
        let needed = basis_req(&axis, Wavelet::Cubic).numbers();
        let refused = Basis::new(axis, Wavelet::Cubic, &mut vec![0.0; needed - 1]).map(|_| ());
        assert_eq!(refused, Err(Error::WorkspaceTooSmall { needed: needed as u32, given: needed as u32 - 1 }));
        let (grid, other) = (Grid::new(5, 7, 2).unwrap(), Grid::new(5, 5, 2).unwrap());
        let mut memory = memory(&axis, Wavelet::Cubic);
        let basis = Basis::new(axis, Wavelet::Cubic, &mut memory).unwrap();
        assert_eq!(coefficient_lines(&grid, &basis, &basis, 0), None);
        assert_eq!(coefficient_lines(&other, &basis, &basis, other.len()), None);
        assert!(coefficient_lines(&other, &basis, &basis, 0).is_some());
    }

    /// Samples that a coefficient of each level of the published grid moves: sum over the level, and most for one.
    fn influences(wavelet: Wavelet) -> Vec<(usize, usize)> {
        let grid = Grid::new(5, 7, 5).unwrap();
        let count = |coefficient| {
            let node = grid.node_of(coefficient).unwrap();
            let (column, row) = (node.column / grid.step(node.level), node.row / grid.step(node.level));
            let width = support(&grid.columns(), wavelet, node.level, column).unwrap().len();
            width * support(&grid.rows(), wavelet, node.level, row).unwrap().len()
        };
        (0..=5)
            .map(|level| {
                let counts: Vec<usize> = grid.coefficients(level).map(count).collect();
                (counts.iter().sum(), *counts.iter().max().unwrap())
            })
            .collect()
    }

    #[test]
    fn influence_of_one_coefficient() {
        let cubic = influences(Wavelet::Cubic);
        assert_eq!(cubic.iter().map(|level| level.1).collect::<Vec<_>>(), [15_625, 19_782, 5_929, 1_369, 289, 49]);
        assert_eq!(cubic.iter().map(|level| level.0).sum::<usize>(), 5_455_417);
        let bilinear = influences(Wavelet::Bilinear);
        assert_eq!(bilinear.iter().map(|level| level.1).collect::<Vec<_>>(), [3_969, 9_025, 2_209, 529, 121, 25]);
        assert_eq!(bilinear.iter().map(|level| level.0).sum::<usize>(), 2_151_993);
    }

    #[test]
    fn supports_are_where_lines_are_not_zero() {
        for wavelet in BOTH {
            for base in 2..6 {
                for levels in 0..5 {
                    let axis = Axis::new(base, levels).unwrap();
                    let mut scratch = memory(&axis, wavelet);
                    for level in 0..=levels {
                        for index in 0..axis.size(level) {
                            let line = synthesised(&axis, wavelet, level, index, &mut scratch).unwrap();
                            let first = line.iter().position(|&value| value != 0.0).unwrap();
                            let last = line.iter().rposition(|&value| value != 0.0).unwrap();
                            let support = support(&axis, wavelet, level, index).unwrap();
                            assert_eq!(support, first..last + 1, "{wavelet:?} {base} {levels} {level} {index}");
                            assert!(support.len() <= longest(&axis, wavelet, level));
                        }
                    }
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::cases()))]

        #[test]
        fn products_are_the_synthesis_of_units(
            width in 2usize..6, height in 2usize..6, levels in 0usize..4, at in 0.0f64..1.0, cubic: bool,
        ) {
            let wavelet = BOTH[usize::from(cubic)];
            let grid = Grid::new(width, height, levels).unwrap();
            let coefficient = (at * grid.len() as f64) as usize;
            let mut unit = vec![0.0; grid.len()];
            unit[coefficient] = 1.0;
            let mut surface = vec![f64::NAN; grid.len()];
            let mut workspace = vec![f64::NAN; synthesis_req(&grid, levels).numbers()];
            synthesis(&grid, wavelet, levels, &unit, &mut surface, &mut workspace).unwrap();
            let (mut columns, mut rows) = (memory(&grid.columns(), wavelet), memory(&grid.rows(), wavelet));
            let columns = Basis::new(grid.columns(), wavelet, &mut columns).unwrap();
            let rows = Basis::new(grid.rows(), wavelet, &mut rows).unwrap();
            let [x, y] = coefficient_lines(&grid, &columns, &rows, coefficient).unwrap();
            let value = |line: &Line<'_, f64>, at: usize| at.checked_sub(line.first).and_then(|k| line.values.get(k)).copied().unwrap_or(0.0);
            for (node, &found) in surface.iter().enumerate() {
                let product = value(&x, node % grid.width(levels)) * value(&y, node / grid.width(levels));
                prop_assert!((found - product).abs() < 1e-15);
            }
        }
    }
}
