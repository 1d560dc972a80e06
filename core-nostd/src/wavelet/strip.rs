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

/// Columns that go down the strip together; one where code has to be small.
const WIDE: usize = if cfg!(feature = "inline-kernels") { 16 } else { 1 };

/// The lifts along y of one half of the columns, all three on one way down the strip: a number is read and written once.
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
    let batch = Batch { slots, count, starts: j == 0, stops: j + count > rows.last, ready };
    let wide = slots - slots % WIDE;
    for column in (0..wide).step_by(WIDE) {
        batch.lift_columns::<S, R, WIDE>(column, even, odd)?;
    }
    for column in wide..slots {
        batch.lift_columns::<S, R, 1>(column, even, odd)?;
    }
    Some(())
}

/// The lines of a strip as [`lift_half`] goes over them.
struct Batch {
    slots: usize,
    count: usize,
    /// The first coarse row is the first of the surface, in line 1.
    starts: bool,
    /// The last one is the last, in line `count`.
    stops: bool,
    ready: Ready,
}

impl Batch {
    /// All lifts of `W` columns. On the way down, line `r` of `even` gets its first lift, then the details in line `r` of `odd` their second, then
    /// line `r - 1` of `even` its third.
    #[inline(always)]
    fn lift_columns<S: Lifting, R: Real, const W: usize>(
        &self,
        column: usize,
        even: &mut [R],
        odd: &mut [R],
    ) -> Option<()> {
        let &Batch { slots, count, starts, stops, ready } = self;
        let end = constant::<R>(S::END);
        let (mut v_before, mut e_before) = (numbers::<R, W>(even, column)?, numbers::<R, W>(odd, column)?);
        let mut e = numbers::<R, W>(odd, slots + column)?;
        for r in 1..=count {
            let at = r * slots + column;
            let behind = numbers::<R, W>(odd, at + slots)?;
            let mut v = numbers::<R, W>(even, at)?;
            if starts && r == 1 {
                first_at_end::<S, R>(&mut v, &behind);
            } else if stops && r == count {
                first_at_end::<S, R>(&mut v, &e);
            } else {
                first::<S, R>(&mut v, &e, &behind);
            }
            if r >= ready.odd[0] {
                let (at_start, at_stop) = (starts && r == 2, stops && r == count);
                if at_start || at_stop {
                    let weight = |is_end| if is_end { end } else { R::ONE };
                    let (a, b) = (weight(at_start), weight(at_stop));
                    for ((e, &before), &v) in e.iter_mut().zip(&v_before).zip(&v) {
                        *e = S::second(*e, a * before, b * v);
                    }
                } else {
                    second::<S, R>(&mut e, &v_before, &v);
                }
                *numbers_mut::<R, W>(odd, at)? = e;
            }
            if r > ready.even[0] {
                if starts && r == 2 {
                    third_at_end::<S, R>(&mut v_before, &e);
                } else {
                    third::<S, R>(&mut v_before, &e_before, &e);
                }
                *numbers_mut::<R, W>(even, at.checked_sub(slots)?)? = v_before;
            }
            (v_before, e_before, e) = (v, e, behind);
        }
        if stops {
            third_at_end::<S, R>(&mut v_before, &e_before);
        }
        *numbers_mut::<R, W>(even, count * slots + column)? = v_before;
        Some(())
    }
}

/// `W` numbers from the `at`-th.
#[inline(always)]
fn numbers<R: Real, const W: usize>(half: &[R], at: usize) -> Option<[R; W]> {
    half.get(at..)?.first_chunk().copied()
}

/// As [`numbers`], in place.
#[inline(always)]
fn numbers_mut<R: Real, const W: usize>(half: &mut [R], at: usize) -> Option<&mut [R; W]> {
    half.get_mut(at..)?.first_chunk_mut()
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
