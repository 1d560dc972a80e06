//! A strip of consecutive rows of a level, lifted along both axes in the caller's fast memory.

use super::lifting::{Lifting, constant};
use super::lines::{Lines, MAX_LINES, copy, first, second, third};
use super::span::Span;
use crate::workspace::{Requirement, Workspace};
use crate::{Error, Real};

/// Coarse rows that come in at a time.
pub(crate) const ROWS: usize = MAX_LINES - 1;

/// Rows of a level, in order: coarse rows and, behind each, its row of details.
///
/// With `count` rows coming in, `j` being the first: line `r` of `even` is coarse row `j + r - 1` (line 0: kept from before), line `r` of `odd`
/// the row of details `j + r - 2` (lines 0 and 1: kept from before, the first of them lifted).
#[derive(Default)]
pub(crate) struct Strip<'w, R> {
    pub(crate) even: Lines<'w, R>,
    pub(crate) odd: Lines<'w, R>,
    kept: Lines<'w, R>,
}

/// Lines of a strip that are lifted along y: `even` and `odd`, each from..to.
#[derive(Clone, Copy)]
pub(crate) struct Ready {
    pub(crate) even: [usize; 2],
    pub(crate) odd: [usize; 2],
}

impl<'w, R: Real> Strip<'w, R> {
    /// Memory of a strip of rows of this span.
    pub(crate) const fn req(columns: &Span, rows: &Span) -> Requirement {
        Lines::<R>::req(columns, 2 * lines(rows) + 4)
    }

    #[inline(always)]
    pub(crate) fn new(columns: &Span, rows: &Span, workspace: &'w mut [R]) -> Result<Self, Error> {
        let mut workspace = Workspace::new(workspace);
        let mut take = |count| Lines::take(columns, count, &mut workspace);
        Ok(Strip { even: take(lines(rows) + 1)?, odd: take(lines(rows) + 2)?, kept: take(1)? })
    }

    /// Lifts along y the lines of the strip for which all is there, when coarse rows `j..j + count` have come in.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(crate) fn lift<S: Lifting>(&mut self, slots: usize, rows: &Span, j: usize, count: usize) -> Option<Ready> {
        let begins = j == rows.coarse.from;
        let stops = j + count > rows.last;
        let ready = Ready {
            even: [usize::from(begins), count + usize::from(stops)],
            odd: [1 + usize::from(begins), count + 1],
        };
        lift_half::<S, R>(slots, rows, j, count, ready, self.even.v, self.odd.v)?;
        lift_half::<S, R>(slots, rows, j, count, ready, self.even.e, self.odd.e)?;
        Some(ready)
    }

    /// Puts aside the last lifted row of details, before lifts along x spoil it for the next rows.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(crate) fn keep(&mut self, slots: usize, count: usize) -> Option<()> {
        copy(lines_of(self.odd.v, slots, count, 1)?, self.kept.v);
        copy(lines_of(self.odd.e, slots, count, 1)?, self.kept.e);
        Some(())
    }

    /// Makes room for the next rows after `count`.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(crate) fn advance(&mut self, slots: usize, count: usize) -> Option<()> {
        for half in [&mut *self.even.v, &mut *self.even.e] {
            move_line(half, slots, count, 0)?;
        }
        for (half, kept) in [(&mut *self.odd.v, &*self.kept.v), (&mut *self.odd.e, &*self.kept.e)] {
            copy(kept, half.get_mut(..slots)?);
            move_line(half, slots, count + 1, 1)?;
        }
        Some(())
    }
}

/// Coarse rows that come in at a time.
pub(crate) const fn lines(rows: &Span) -> usize {
    if rows.coarse.len() < ROWS { rows.coarse.len() } else { ROWS }
}

/// `count` lines from the `from`-th.
#[inline(always)]
pub(crate) fn lines_of<T>(half: &[T], slots: usize, from: usize, count: usize) -> Option<&[T]> {
    half.get(from * slots..)?.get(..count * slots)
}

/// As [`lines_of`].
#[inline(always)]
pub(crate) fn lines_of_mut<T>(half: &mut [T], slots: usize, from: usize, count: usize) -> Option<&mut [T]> {
    half.get_mut(from * slots..)?.get_mut(..count * slots)
}

/// Copies line `from` to line `to`, which is before it.
#[inline(always)]
fn move_line<R: Real>(half: &mut [R], slots: usize, from: usize, to: usize) -> Option<()> {
    let (before, behind) = half.split_at_mut_checked(from * slots)?;
    copy(behind.get(..slots)?, lines_of_mut(before, slots, to, 1)?);
    Some(())
}

/// The lifts along y of one half of the columns.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
#[cfg_attr(not(feature = "inline-kernels"), inline(never))]
fn lift_half<S: Lifting, R: Real>(
    slots: usize,
    rows: &Span,
    j: usize,
    count: usize,
    ready: Ready,
    even: &mut [R],
    odd: &mut [R],
) -> Option<()> {
    let (starts, stops) = (j == 0, j + count > rows.last);
    // First lift: lines 1..=count of `even`, the details before in the line of the same number.
    let (mut from, mut to) = (1, count + 1);
    if starts {
        first_at_end::<S, R>(lines_of_mut(even, slots, 1, 1)?, lines_of(odd, slots, 2, 1)?);
        from += 1;
    }
    if stops {
        to -= 1;
        first_at_end::<S, R>(lines_of_mut(even, slots, to, 1)?, lines_of(odd, slots, to, 1)?);
    }
    let inside = to.checked_sub(from)?;
    first::<S, R>(
        lines_of_mut(even, slots, from, inside)?,
        lines_of(odd, slots, from, inside)?,
        lines_of(odd, slots, from + 1, inside)?,
    );
    // Second lift: the coarse rows beside line `r` of `odd` are lines r - 1 and r of `even`.
    let [mut from, mut to] = ready.odd;
    let weight = constant::<R>(S::END);
    if starts && from < to {
        let b = if rows.last == 1 { weight } else { R::ONE };
        second_beside_end::<S, R>(slots, from, odd, even, weight, b)?;
        from += 1;
    }
    if stops && from < to {
        to -= 1;
        let a = if rows.last == 1 { weight } else { R::ONE };
        second_beside_end::<S, R>(slots, to, odd, even, a, weight)?;
    }
    let inside = to.saturating_sub(from);
    second::<S, R>(
        lines_of_mut(odd, slots, from, inside)?,
        lines_of(even, slots, from - 1, inside)?,
        lines_of(even, slots, from, inside)?,
    );
    // Third lift: the details beside line `r` of `even` are lines r and r + 1 of `odd`.
    let [mut from, mut to] = ready.even;
    if starts && from < to {
        third_at_end::<S, R>(lines_of_mut(even, slots, from, 1)?, lines_of(odd, slots, from + 1, 1)?);
        from += 1;
    }
    if stops && from < to {
        to -= 1;
        third_at_end::<S, R>(lines_of_mut(even, slots, to, 1)?, lines_of(odd, slots, to, 1)?);
    }
    let inside = to.saturating_sub(from);
    third::<S, R>(
        lines_of_mut(even, slots, from, inside)?,
        lines_of(odd, slots, from, inside)?,
        lines_of(odd, slots, from + 1, inside)?,
    );
    Some(())
}

/// The second lift of line `line` of `odd`, `a` and `b` being the weights of the coarse rows beside it.
#[inline(always)]
fn second_beside_end<S: Lifting, R: Real>(
    slots: usize,
    line: usize,
    odd: &mut [R],
    even: &[R],
    a: R,
    b: R,
) -> Option<()> {
    let e = lines_of_mut(odd, slots, line, 1)?;
    let (before, behind) = (lines_of(even, slots, line - 1, 1)?, lines_of(even, slots, line, 1)?);
    for ((e, &before), &behind) in e.iter_mut().zip(before).zip(behind) {
        *e = S::second(*e, a * before, b * behind);
    }
    Some(())
}

#[inline(always)]
fn first_at_end<S: Lifting, R: Real>(v: &mut [R], beside: &[R]) {
    for (v, &e) in v.iter_mut().zip(beside) {
        *v = S::first_at_end(*v, e);
    }
}

#[inline(always)]
fn third_at_end<S: Lifting, R: Real>(v: &mut [R], beside: &[R]) {
    for (v, &e) in v.iter_mut().zip(beside) {
        *v = S::third_at_end(*v, e);
    }
}

/// Lines `from..to` of both halves.
#[inline(always)]
pub(crate) fn halves<'a, R>(
    slots: usize,
    lines: &'a mut Lines<'_, R>,
    [from, to]: [usize; 2],
) -> Option<[&'a mut [R]; 2]> {
    let count = to.saturating_sub(from);
    Some([lines_of_mut(lines.v, slots, from, count)?, lines_of_mut(lines.e, slots, from, count)?])
}
