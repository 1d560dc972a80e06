//! One level of the transform in two dimensions, strip by strip, so that a level is read and written once.
//!
//! The order is that of the separable transform: columns then rows in the synthesis, rows then columns in the analysis.

use super::lifting::{BilinearSynthesis, CubicSynthesis, Lifting, Plain, Wavelet};
use super::lines::{copy, lift, lift_twice, load, merge, slots, split, split_range};
use super::span::{Interval, Span};
use super::strip::{Strip, halves, lines, lines_of, lines_of_mut};
use crate::Real;

/// Samples of a level, or a window of them.
#[derive(Clone, Copy)]
pub(crate) struct Samples<'a, R> {
    pub(crate) numbers: &'a [R],
    /// Numbers from row to row.
    pub(crate) stride: usize,
    /// Column and row of the first number.
    pub(crate) origin: [usize; 2],
}

impl<'a, R: Real> Samples<'a, R> {
    /// Copies a rectangle.
    pub(crate) fn copied(&self, columns: Interval, rows: Interval, out: &mut [R]) -> Option<()> {
        for row in rows.from..rows.to {
            copy(self.row(row, columns)?, part_mut(out, (row - rows.from) * columns.len(), columns.len())?);
        }
        Some(())
    }

    #[inline(always)]
    fn row(&self, row: usize, columns: Interval) -> Option<&'a [R]> {
        let [x, y] = self.origin;
        part(self.numbers, row.saturating_sub(y) * self.stride + columns.from.saturating_sub(x), columns.len())
    }
}

#[inline(always)]
fn part<T>(slice: &[T], from: usize, len: usize) -> Option<&[T]> {
    slice.get(from..)?.get(..len)
}

#[inline(always)]
fn part_mut<T>(slice: &mut [T], from: usize, len: usize) -> Option<&mut [T]> {
    slice.get_mut(from..)?.get_mut(..len)
}

/// Where the coefficients come from, of `N` components that are transformed side by side. They are asked for once each, in their order.
pub(crate) trait Rows<const N: usize, R> {
    /// The coefficients `from..from + len` of each component, counted over all levels.
    fn row(&mut self, from: usize, len: usize) -> Option<[&[R]; N]>;
}

/// The coefficients of one component, which the caller holds.
pub(crate) struct Held<'a, R>(pub(crate) &'a [R]);

impl<R> Rows<1, R> for Held<'_, R> {
    #[inline(always)]
    fn row(&mut self, from: usize, len: usize) -> Option<[&[R]; 1]> {
        Some([part(self.0, from, len)?])
    }
}

/// A call with the arithmetic of a wavelet's synthesis. It is chosen where it is used, so that what the wavelets have in common is in a program once.
macro_rules! synthesis {
    ($wavelet:expr, $S:ident => $call:expr) => {
        match $wavelet {
            Wavelet::Cubic => {
                type $S = CubicSynthesis;
                $call
            }
            Wavelet::Bilinear => {
                type $S = BilinearSynthesis;
                $call
            }
        }
    };
}

/// The step between a level and the next coarser one.
pub(crate) struct Step {
    pub(crate) columns: Span,
    pub(crate) rows: Span,
}

impl Step {
    /// Where coarse row `j` has its new coefficients, and where those of the row of details behind it are, counted within the level.
    #[inline(always)]
    fn detail_rows(&self, j: usize) -> [usize; 2] {
        let start = j * (3 * self.columns.last + 1);
        [start, start + self.columns.last]
    }

    /// Row `j` of details to line `line`; `first` is the first coefficient of the level.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    #[cfg_attr(not(feature = "inline-kernels"), inline(never))]
    fn load_details<const N: usize, R: Real>(
        &self,
        j: usize,
        first: usize,
        details: &mut (impl Rows<N, R> + ?Sized),
        line: usize,
        strips: &mut [Strip<'_, R>; N],
    ) -> Option<()> {
        let slots = slots(&self.columns);
        let [from, len] = split_range(&self.columns);
        let samples = details.row(first + self.detail_rows(j)[1] + from, len)?;
        for (strip, samples) in strips.iter_mut().zip(samples) {
            let (v, e) = (lines_of_mut(strip.odd.v, slots, line, 1)?, lines_of_mut(strip.odd.e, slots, line, 1)?);
            split(&self.columns, samples, v, e)?;
        }
        Some(())
    }

    /// The window `columns.out` x `rows.out` of a level from the next coarser one and the level's coefficients, which begin at `first`; both as
    /// far as the spans ask for.
    #[inline(always)]
    pub(crate) fn synthesis<const N: usize, R: Real>(
        &self,
        wavelet: Wavelet,
        coarse: [Samples<'_, R>; N],
        first: usize,
        details: &mut (impl Rows<N, R> + ?Sized),
        mut out: [&mut [R]; N],
        strips: &mut [Strip<'_, R>; N],
    ) -> Option<()> {
        let (columns, rows) = (&self.columns, &self.rows);
        let slots = slots(columns);
        if !rows.starts() {
            self.load_details(rows.detail.from, first, details, 1, strips)?;
        }
        for j in (rows.coarse.from..rows.coarse.to).step_by(lines(rows).max(1)) {
            let count = lines(rows).min(rows.coarse.to - j);
            for r in 1..=count {
                let row = j + r - 1;
                let from = first + self.detail_rows(row)[0] + columns.detail.from;
                let new = details.row(from, columns.detail.len())?;
                for ((strip, coarse), new) in strips.iter_mut().zip(&coarse).zip(new) {
                    let v = lines_of_mut(strip.even.v, slots, r, 1)?;
                    let e = lines_of_mut(strip.even.e, slots, r, 1)?;
                    load(columns, coarse.row(row, columns.coarse)?, v, new, e)?;
                }
                if row < rows.last {
                    self.load_details(row, first, details, r + 1, strips)?;
                }
            }
            for (strip, out) in strips.iter_mut().zip(&mut out) {
                self.lifted(wavelet, j, count, strip, out)?;
            }
        }
        Some(())
    }

    /// The rows of one component that coarse rows `j..j + count`, which have come in, make complete.
    #[inline(always)]
    fn lifted<R: Real>(
        &self,
        wavelet: Wavelet,
        j: usize,
        count: usize,
        strip: &mut Strip<'_, R>,
        out: &mut [R],
    ) -> Option<()> {
        let (columns, rows) = (&self.columns, &self.rows);
        let (slots, width) = (slots(columns), columns.out.len());
        let ready = synthesis!(wavelet, S => strip.lift::<S>(slots, rows, j, count)?);
        strip.keep(slots, count)?;
        for (lines, range) in [(&mut strip.even, ready.even), (&mut strip.odd, ready.odd)] {
            let [v, e] = halves(slots, lines, range)?;
            if !v.is_empty() {
                synthesis!(wavelet, S => lift_twice::<S, R>(columns, v, e)?);
            }
        }
        // Line r is row 2 (j + r - 1), or 2 (j + r - 2) + 1; some are there for the sake of their neighbours alone.
        for (lines, [from, to], back) in [(&strip.even, ready.even, 2), (&strip.odd, ready.odd, 3)] {
            for r in from..to {
                let row = (2 * (j + r)).checked_sub(back)?;
                if row >= rows.out.from && row < rows.out.to {
                    let (v, e) = (lines_of(lines.v, slots, r, 1)?, lines_of(lines.e, slots, r, 1)?);
                    let out = part_mut(out, (row - rows.out.from) * width, width)?;
                    synthesis!(wavelet, S => merge::<S, R>(columns, v, e, out)?);
                }
            }
        }
        strip.advance(slots, count)
    }

    /// The next coarser level and the coefficients of a whole level from its samples.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(crate) fn analysis<S: Lifting, R: Real>(
        &self,
        samples: &[R],
        coarse: &mut [R],
        details: &mut [R],
        strip: &mut Strip<'_, R>,
    ) -> Option<()> {
        let (columns, rows) = (&self.columns, &self.rows);
        let (slots, width, nv) = (slots(columns), columns.out.len(), columns.coarse.len());
        for j in (0..=rows.last).step_by(lines(rows).max(1)) {
            let count = lines(rows).min(rows.last + 1 - j);
            let odd_count = count.min(rows.last - j);
            for (lines, first, count, row) in
                [(&mut strip.even, 1, count, 2 * j), (&mut strip.odd, 2, odd_count, 2 * j + 1)]
            {
                for r in 0..count {
                    let samples = part(samples, (row + 2 * r) * width, width)?;
                    let v = lines_of_mut(lines.v, slots, first + r, 1)?;
                    split(columns, samples, v, lines_of_mut(lines.e, slots, first + r, 1)?)?;
                }
                let [v, e] = halves(slots, lines, [first, first + count])?;
                if !v.is_empty() {
                    lift::<S, R>(columns, v, e)?;
                }
            }
            let ready = strip.lift::<S>(slots, rows, j, count)?;
            for r in ready.even[0]..ready.even[1] {
                let row = j + r - 1;
                let (v, e) = (lines_of(strip.even.v, slots, r, 1)?, lines_of(strip.even.e, slots, r, 1)?);
                copy(v.get(1..)?, part_mut(coarse, row * nv, nv)?);
                copy(e.get(1..)?, part_mut(details, self.detail_rows(row)[0], columns.last)?);
            }
            for r in ready.odd[0]..ready.odd[1] {
                let (v, e) = (lines_of(strip.odd.v, slots, r, 1)?, lines_of(strip.odd.e, slots, r, 1)?);
                merge::<Plain, R>(columns, v, e, part_mut(details, self.detail_rows(j + r - 2)[1], width)?)?;
            }
            strip.keep(slots, count)?;
            strip.advance(slots, count)?;
        }
        Some(())
    }
}
