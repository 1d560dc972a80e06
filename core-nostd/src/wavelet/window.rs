//! A rectangle of the surface at any level, without the rest of it.

use core::ops::Range;

use super::grid::Grid;
use super::lifting::Wavelet;
use super::lines::split_range;
use super::span::{Interval, Span};
use super::step::{Held, Rows, Samples, Step};
use super::strip::Strip;
use crate::workspace::{Requirement, Workspace, check_len, part, part_mut};
use crate::{Error, Real};

/// A rectangle of nodes at one level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rectangle {
    pub(crate) columns: Interval,
    pub(crate) rows: Interval,
}

impl Rectangle {
    pub(crate) const fn area(&self) -> usize {
        self.columns.len() * self.rows.len()
    }

    /// The spans of the step that ends at `level >= 1` with this rectangle.
    #[inline(always)]
    const fn spans(&self, grid: &Grid, level: usize) -> [Span; 2] {
        [Span::new(grid.width(level - 1), self.columns), Span::new(grid.height(level - 1), self.rows)]
    }

    /// What this rectangle at `level` needs of the level `coarser`, not above it.
    #[inline(always)]
    pub(crate) const fn needed(mut self, grid: &Grid, mut level: usize, coarser: usize) -> Self {
        while level > coarser {
            let [columns, rows] = self.spans(grid, level);
            self = Rectangle { columns: columns.coarse, rows: rows.coarse };
            level -= 1;
        }
        self
    }
}

/// Numbers of the two arrays that levels alternate in, and of the strip.
struct Memory {
    /// Of the levels at odd distance from the finest.
    odd: usize,
    /// Of those at even distance, but the finest.
    even: usize,
    strip: Requirement,
}

impl Memory {
    const fn of(grid: &Grid, level: usize, mut rectangle: Rectangle) -> Self {
        let mut memory = Memory { odd: 0, even: 0, strip: Requirement::NONE };
        let mut at = level;
        while at > 0 {
            let [columns, rows] = rectangle.spans(grid, at);
            memory.strip = memory.strip.or(Strip::<f32>::req(&columns, &rows));
            rectangle = Rectangle { columns: columns.coarse, rows: rows.coarse };
            at -= 1;
            // The base lies among the coefficients.
            if at > 0 {
                let area = rectangle.area();
                if (level - at) % 2 == 1 {
                    memory.odd = if area > memory.odd { area } else { memory.odd };
                } else {
                    memory.even = if area > memory.even { area } else { memory.even };
                }
            }
        }
        memory
    }
}

/// Workspace of [`window`].
///
/// Errors: none; ranges that [`window`] refuses need nothing.
pub const fn window_req(grid: &Grid, level: usize, columns: &Range<usize>, rows: &Range<usize>) -> Requirement {
    match rectangle(grid, level, columns, rows) {
        Ok(Some(rectangle)) => planes_req(grid, level, rectangle, 1),
        _ => Requirement::NONE,
    }
}

/// The ranges as a rectangle; none when they are empty.
const fn rectangle(
    grid: &Grid,
    level: usize,
    columns: &Range<usize>,
    rows: &Range<usize>,
) -> Result<Option<Rectangle>, Error> {
    if level > grid.levels() {
        return Err(Error::IndexOutOfRange { index: clamped(level), limit: clamped(grid.levels() + 1) });
    }
    let columns = match interval(columns, grid.width(level)) {
        Ok(interval) => interval,
        Err(error) => return Err(error),
    };
    let rows = match interval(rows, grid.height(level)) {
        Ok(interval) => interval,
        Err(error) => return Err(error),
    };
    if columns.len() == 0 || rows.len() == 0 { Ok(None) } else { Ok(Some(Rectangle { columns, rows })) }
}

const fn interval(range: &Range<usize>, size: usize) -> Result<Interval, Error> {
    let end = if range.end > range.start { range.end } else { range.start };
    if range.start > range.end || range.end > size {
        return Err(Error::IndexOutOfRange { index: clamped(end), limit: clamped(size) });
    }
    Ok(Interval { from: range.start, to: range.end })
}

const fn clamped(count: usize) -> u32 {
    if count < u32::MAX as usize { count as u32 } else { u32::MAX }
}

/// Writes the nodes `columns` x `rows` of a level of the surface, each with the bits that the whole surface has there.
///
/// | argument | shape | note |
/// |---|---|---|
/// | `level` | `0..=levels` | the surface as it is without the coefficients of finer levels |
/// | `columns`, `rows` | within the width and height of the level | |
/// | `coefficients` | components, [`Grid::len`] | order of [`Grid::node_of`]; those of finer levels are not read |
/// | `out` | components, rows, columns | wholly overwritten, untouched on error |
///
/// The number of components is that of the coefficients' planes.
///
/// Cost: the rectangle, and on each coarser level a rectangle of half the sides and two nodes more; a single node costs about 60 samples a level.
/// Workspace [`window_req`], one component after the other.
/// Determinism: see [`lifting`](super::lifting).
/// Errors: `IndexOutOfRange` for the level or a range, `DimensionMismatch`, `WorkspaceTooSmall`. Panics: never.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
#[allow(clippy::too_many_arguments)]
pub fn window<R: Real>(
    grid: &Grid,
    wavelet: Wavelet,
    level: usize,
    columns: Range<usize>,
    rows: Range<usize>,
    coefficients: &[R],
    out: &mut [R],
    workspace: &mut [R],
) -> Result<(), Error> {
    let rectangle = rectangle(grid, level, &columns, &rows)?;
    let components = components(grid, coefficients.len())?;
    let Some(rectangle) = rectangle else { return check_len(0, out.len()) };
    check_len(rectangle.area().saturating_mul(components), out.len())?;
    window_req(grid, level, &columns, &rows).check(workspace.len())?;
    for component in 0..components {
        let coefficients = part(coefficients, component * grid.len(), grid.len())?;
        let out = [part_mut(out, component * rectangle.area(), rectangle.area())?];
        let base = [Samples { numbers: coefficients, stride: grid.width(0), origin: [0, 0] }];
        let details = &mut Held(coefficients);
        planes::<1, R>(wavelet, grid, level, rectangle, base, details, out, workspace)?;
    }
    Ok(())
}

/// How many planes of coefficients there are.
pub(crate) fn components(grid: &Grid, numbers: usize) -> Result<usize, Error> {
    let components = numbers / grid.len().max(1);
    check_len(components.max(1).saturating_mul(grid.len()), numbers)?;
    Ok(components)
}

/// Workspace of [`planes`] for `N` components.
pub(crate) const fn planes_req(grid: &Grid, level: usize, rectangle: Rectangle, components: usize) -> Requirement {
    let memory = Memory::of(grid, level, rectangle);
    Requirement::of((memory.odd + memory.even + memory.strip.numbers()).saturating_mul(components))
}

/// Coefficients that [`planes`] asks for at a time, at most, of a level above 0.
pub(crate) const fn longest_row(grid: &Grid, level: usize, mut rectangle: Rectangle) -> usize {
    let (mut longest, mut at) = (0, level);
    while at > 0 {
        let [columns, rows] = rectangle.spans(grid, at);
        let [_, of_details] = split_range(&columns);
        longest = if of_details > longest { of_details } else { longest };
        longest = if columns.detail.len() > longest { columns.detail.len() } else { longest };
        rectangle = Rectangle { columns: columns.coarse, rows: rows.coarse };
        at -= 1;
    }
    longest
}

/// `N` components side by side. `base` holds what the rectangle needs of level 0.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn planes<const N: usize, R: Real>(
    wavelet: Wavelet,
    grid: &Grid,
    level: usize,
    rectangle: Rectangle,
    base: [Samples<'_, R>; N],
    details: &mut (impl Rows<N, R> + ?Sized),
    mut out: [&mut [R]; N],
    workspace: &mut [R],
) -> Result<(), Error> {
    if level == 0 {
        for (base, out) in base.iter().zip(out) {
            base.copied(rectangle.columns, rectangle.rows, out).ok_or(Error::Empty)?;
        }
        return Ok(());
    }
    let memory = Memory::of(grid, level, rectangle);
    let mut workspace = Workspace::new(workspace);
    let mut each = |numbers| [(); N].map(|()| workspace.take(numbers).unwrap_or_default());
    // `targets` is where the step in work writes, `sources` where the one before has written.
    let (mut sources, mut targets) = (each(memory.odd), each(memory.even));
    let mut scratch = each(memory.strip.numbers());
    if level.is_multiple_of(2) {
        core::mem::swap(&mut sources, &mut targets);
    }
    for at in 1..=level {
        let wanted = rectangle.needed(grid, level, at);
        let [columns, rows] = wanted.spans(grid, at);
        let origin = [columns.coarse.from, rows.coarse.from];
        let of_step = sources.each_ref().map(|numbers| Samples { numbers, stride: columns.coarse.len(), origin });
        let coarse = if at == 1 { base } else { of_step };
        let to: [&mut [R]; N] =
            if at == level { out.each_mut().map(|to| &mut **to) } else { targets.each_mut().map(|to| &mut **to) };
        let mut strips = scratch.each_mut().map(|scratch| Strip::new(&columns, &rows, scratch).unwrap_or_default());
        let first = grid.coefficients(at).start;
        let step = Step { columns, rows };
        step.synthesis::<N, R>(wavelet, coarse, first, details, to, &mut strips).ok_or(Error::Empty)?;
        core::mem::swap(&mut sources, &mut targets);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Stream;
    use crate::wavelet::transform::{synthesis, synthesis_req};
    use proptest::prelude::*;
    use std::vec::Vec;

    const BOTH: [Wavelet; 2] = [Wavelet::Cubic, Wavelet::Bilinear];

    fn whole(grid: &Grid, wavelet: Wavelet, level: usize, coefficients: &[f32]) -> Vec<f32> {
        let mut out = vec![f32::NAN; coefficients.len() / grid.len() * grid.node_count(level)];
        let mut workspace = vec![f32::NAN; synthesis_req(grid, level).numbers()];
        synthesis(grid, wavelet, level, coefficients, &mut out, &mut workspace).unwrap();
        out
    }

    fn check(
        grid: &Grid,
        wavelet: Wavelet,
        level: usize,
        columns: Range<usize>,
        rows: Range<usize>,
        coefficients: &[f32],
    ) {
        let all = whole(grid, wavelet, level, coefficients);
        let components = coefficients.len() / grid.len();
        let mut out = vec![f32::NAN; components * rows.len() * columns.len()];
        // Every number of the workspace counts, and what is in it does not.
        let mut workspace = vec![f32::NAN; window_req(grid, level, &columns, &rows).numbers()];
        window(grid, wavelet, level, columns.clone(), rows.clone(), coefficients, &mut out, &mut workspace).unwrap();
        let mut found = out.iter();
        for component in 0..components {
            for row in rows.clone() {
                for column in columns.clone() {
                    let expected = all[component * grid.node_count(level) + row * grid.width(level) + column];
                    assert_eq!(found.next().unwrap().to_bits(), expected.to_bits());
                }
            }
        }
    }

    #[test]
    fn every_node_alone() {
        for wavelet in BOTH {
            let grid = Grid::new(2, 3, 3).unwrap();
            let coefficients = Stream::new(3).take(grid.len());
            for level in 0..=3 {
                for row in 0..grid.height(level) {
                    for column in 0..grid.width(level) {
                        check(&grid, wavelet, level, column..column + 1, row..row + 1, &coefficients);
                    }
                }
            }
        }
    }

    #[test]
    fn refusals_leave_the_output_alone() {
        let grid = Grid::new(3, 4, 2).unwrap();
        let coefficients = vec![1.0f32; 2 * grid.len()];
        let mut out = [7.0f32; 12];
        let mut workspace = vec![0.0; 1000];
        let mut run = |level, columns: Range<usize>, rows: Range<usize>, count: usize, len: usize, work: usize| {
            window(
                &grid,
                Wavelet::Cubic,
                level,
                columns,
                rows,
                &coefficients[..count],
                &mut out[..len],
                &mut workspace[..work],
            )
        };
        let n = grid.len();
        assert_eq!(run(3, 0..1, 0..1, n, 1, 1000), Err(Error::IndexOutOfRange { index: 3, limit: 3 }));
        assert_eq!(run(1, 4..6, 0..1, n, 2, 1000), Err(Error::IndexOutOfRange { index: 6, limit: 5 }));
        assert_eq!(run(1, 0..2, 7..8, n, 2, 1000), Err(Error::IndexOutOfRange { index: 8, limit: 7 }));
        #[allow(clippy::reversed_empty_ranges)]
        let reversed = run(1, 2..1, 0..1, n, 0, 1000);
        assert_eq!(reversed, Err(Error::IndexOutOfRange { index: 2, limit: 5 }));
        assert_eq!(run(2, 0..2, 0..3, n, 5, 1000), Err(Error::DimensionMismatch { expected: 6, found: 5 }));
        assert_eq!(
            run(2, 0..2, 0..3, n - 1, 6, 1000),
            Err(Error::DimensionMismatch { expected: n as u32, found: n as u32 - 1 })
        );
        assert_eq!(run(2, 0..2, 3..3, n, 1, 1000), Err(Error::DimensionMismatch { expected: 0, found: 1 }));
        let needed = window_req(&grid, 2, &(0..2), &(0..3)).numbers();
        let refused = run(2, 0..2, 0..3, 2 * n, 12, needed - 1);
        assert_eq!(refused, Err(Error::WorkspaceTooSmall { needed: needed as u32, given: needed as u32 - 1 }));
        assert_eq!(run(2, 0..0, 3..3, n, 0, 0), Ok(()));
        assert_eq!(window_req(&grid, 3, &(0..2), &(0..3)), Requirement::NONE);
        assert!(out.iter().all(|&value| value == 7.0));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::cases()))]

        #[test]
        fn bits_are_those_of_the_whole(
            width in 2usize..9, height in 2usize..9, levels in 0usize..5, coarser in 0usize..3, components in 1usize..3,
            places in proptest::array::uniform4(0.0f64..1.0), seed in 1u32..1000, cubic: bool,
        ) {
            let grid = Grid::new(width, height, levels).unwrap();
            let level = levels.saturating_sub(coarser);
            let coefficients = Stream::new(seed).take(components * grid.len());
            let range = |size: usize, a: f64, b: f64| {
                let (a, b) = ((a * size as f64) as usize, (b * size as f64) as usize);
                a.min(b)..a.max(b) + 1
            };
            let columns = range(grid.width(level), places[0], places[1]);
            let rows = range(grid.height(level), places[2], places[3]);
            check(&grid, BOTH[usize::from(cubic)], level, columns, rows, &coefficients);
        }
    }
}
