//! Lines side by side, coarse samples apart from details, so that every lift is one loop over contiguous numbers.

use super::lifting::{Lifting, constant};
use super::span::Span;
use crate::workspace::{Requirement, Workspace};
use crate::{Error, Real};

/// Lines that are lifted together at most: the eight rows that come in at a time, and the one kept from before. Eight rows of 129 or 257 samples stay in
/// the fastest memory; 4, 12 and 16 are not faster.
pub(crate) const MAX_LINES: usize = 9;

/// Lines side by side, each in [`slots`] slots: slot `s` has coarse sample `coarse.from + s - 1` of a span, and the detail behind it. Slots
/// without a sample are zero when lines are loaded; lifts write numbers without meaning there.
#[derive(Default)]
pub(crate) struct Lines<'w, R> {
    pub(crate) v: &'w mut [R],
    pub(crate) e: &'w mut [R],
}

/// Slots of a line: one before the coarse samples, for the detail before the first.
#[inline(always)]
pub(crate) const fn slots(span: &Span) -> usize {
    span.coarse.len() + 1
}

impl<'w, R> Lines<'w, R> {
    /// Memory of `count` lines.
    pub(crate) const fn req(span: &Span, count: usize) -> Requirement {
        Requirement::of(2 * count * slots(span))
    }

    #[inline(always)]
    pub(crate) fn take(span: &Span, count: usize, workspace: &mut Workspace<'w, R>) -> Result<Self, Error> {
        let numbers = count * slots(span);
        Ok(Lines { v: workspace.take(numbers)?, e: workspace.take(numbers)? })
    }
}

/// The first two lifts of at most [`MAX_LINES`] lines, and the third at their ends, as far as the range `out` of the span needs them.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
#[cfg_attr(not(feature = "inline-kernels"), inline(never))]
pub(crate) fn lift_twice<S: Lifting, R: Real>(span: &Span, v: &mut [R], e: &mut [R]) -> Option<()> {
    // Lifts run over all lines as if they were one; the ends, which they spoil, are kept apart.
    let mut kept = [[R::ZERO; 2]; MAX_LINES];
    at_ends(span, v, e, &mut kept, |v, beside, end| *end = S::first_at_end(*v, beside))?;
    let count = v.len().checked_sub(1)?;
    first::<S, R>(v.get_mut(1..)?, e.get(..count)?, e.get(1..)?);
    let weight = constant::<R>(S::END);
    at_ends(span, v, e, &mut kept, |v, _, end| *v = weight * *end)?;
    second::<S, R>(e.get_mut(..count)?, v.get(..count)?, v.get(1..)?);
    at_ends(span, v, e, &mut kept, |v, beside, end| *v = S::third_at_end(*end, beside))
}

/// Visits the two ends of each line, as far as they belong to the span: the coarse sample, the detail beside it, and what is kept of it.
#[inline(always)]
fn at_ends<R: Real>(
    span: &Span,
    v: &mut [R],
    e: &[R],
    kept: &mut [[R; 2]; MAX_LINES],
    visit: impl Fn(&mut R, R, &mut R),
) -> Option<()> {
    let (slots, len, [starts, ends]) = (slots(span), v.len(), [span.starts(), span.ends()]);
    let mut line = 0;
    for [first, last] in kept {
        if line >= len {
            break;
        }
        if starts {
            visit(v.get_mut(line + 1)?, *e.get(line + 1)?, first);
        }
        line += slots;
        if ends {
            visit(v.get_mut(line.wrapping_sub(1))?, *e.get(line.wrapping_sub(2))?, last);
        }
    }
    Some(())
}

/// All three lifts.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub(crate) fn lift<S: Lifting, R: Real>(span: &Span, v: &mut [R], e: &mut [R]) -> Option<()> {
    lift_twice::<S, R>(span, v, e)?;
    lift_again::<S, R>(span, v, e)
}

/// The third lift after [`lift_twice`].
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub(crate) fn lift_again<S: Lifting, R: Real>(span: &Span, v: &mut [R], e: &[R]) -> Option<()> {
    let slots = slots(span);
    let (from, to) = (1 + usize::from(span.starts()), slots.checked_sub(usize::from(span.ends()))?);
    let inside = to.saturating_sub(from);
    let mut line = from;
    for _ in 0..MAX_LINES {
        let (Some(v), Some(before), Some(behind)) = (v.get_mut(line..), e.get(line - 1..), e.get(line..)) else {
            break;
        };
        third::<S, R>(v.get_mut(..inside)?, before.get(..inside)?, behind.get(..inside)?);
        line += slots;
    }
    Some(())
}

/// The first lift of many samples, none at an end.
#[inline(always)]
pub(crate) fn first<S: Lifting, R: Real>(v: &mut [R], before: &[R], behind: &[R]) {
    for ((v, &a), &b) in v.iter_mut().zip(before).zip(behind) {
        *v = S::first(*v, a, b);
    }
}

/// The second lift of many details.
#[inline(always)]
pub(crate) fn second<S: Lifting, R: Real>(e: &mut [R], before: &[R], behind: &[R]) {
    for ((e, &a), &b) in e.iter_mut().zip(before).zip(behind) {
        *e = S::second(*e, a, b);
    }
}

/// The third lift of many samples, none at an end.
#[inline(always)]
pub(crate) fn third<S: Lifting, R: Real>(v: &mut [R], before: &[R], behind: &[R]) {
    for ((v, &a), &b) in v.iter_mut().zip(before).zip(behind) {
        *v = S::third(*v, a, b);
    }
}

/// Copies as many numbers as both have.
#[inline(always)]
pub(crate) fn copy<R: Real>(from: &[R], to: &mut [R]) {
    for (to, &from) in to.iter_mut().zip(from) {
        *to = from;
    }
}

/// Fills the slots of a line with the coarse samples and the details that its span asks for.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub(crate) fn load<R: Real>(span: &Span, coarse: &[R], v: &mut [R], detail: &[R], e: &mut [R]) -> Option<()> {
    clear_spare(v, e)?;
    copy(coarse, v.get_mut(1..)?);
    copy(detail, e.get_mut(usize::from(span.starts())..)?);
    Some(())
}

/// Slots that may have no sample.
#[inline(always)]
fn clear_spare<R: Real>(v: &mut [R], e: &mut [R]) -> Option<()> {
    *v.first_mut()? = R::ZERO;
    *e.first_mut()? = R::ZERO;
    *e.last_mut()? = R::ZERO;
    Some(())
}

/// Fills the slots of a line with the samples that its span asks for, coarse ones and details in turn.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub(crate) fn split<R: Real>(span: &Span, samples: &[R], v: &mut [R], e: &mut [R]) -> Option<()> {
    clear_spare(v, e)?;
    let samples = if span.starts() {
        samples
    } else {
        let (lone, samples) = samples.split_first()?;
        *e.first_mut()? = *lone;
        samples
    };
    let (pairs, last) = samples.as_chunks::<2>();
    let (v, behind) = v.get_mut(1..)?.split_at_mut_checked(pairs.len())?;
    let e = e.get_mut(1..)?.get_mut(..pairs.len())?;
    for ((pair, v), e) in pairs.iter().zip(v).zip(e) {
        [*v, *e] = *pair;
    }
    if let (Some(last), Some(v)) = (last.first(), behind.first_mut()) {
        *v = *last;
    }
    Some(())
}

/// Where the samples that [`split`] takes begin, and how many there are.
#[inline(always)]
pub(crate) const fn split_range(span: &Span) -> [usize; 2] {
    let from = if span.starts() { 0 } else { 2 * span.detail.from + 1 };
    let to = if span.ends() { 2 * span.last + 1 } else { 2 * span.detail.to };
    [from, to.saturating_sub(from)]
}

/// The range `out` of a span from the slots of a line after [`lift_twice`]: the third lift of the coarse samples, and the details, in turn.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
#[cfg_attr(not(feature = "inline-kernels"), inline(never))]
pub(crate) fn merge<S: Lifting, R: Real>(span: &Span, v: &[R], e: &[R], out: &mut [R]) -> Option<()> {
    let (first, last) = (*v.get(1)?, *v.last()?);
    let slot = (span.out.from / 2 + 1).checked_sub(span.coarse.from)?;
    let lone = span.out.from % 2;
    if lone == 1 {
        *out.first_mut()? = *e.get(slot)?;
    }
    let slot = slot + lone;
    let (v, e, before) = (v.get(slot..)?, e.get(slot..)?, e.get(slot - 1..)?);
    let (pairs, behind) = out.get_mut(lone..)?.as_chunks_mut::<2>();
    if let Some(behind) = behind.first_mut() {
        *behind = S::third(*v.get(pairs.len())?, *before.get(pairs.len())?, *e.get(pairs.len())?);
    }
    let count = pairs.len();
    interleave::<S, R>(v.get(..count)?, before.get(..count)?, e.get(..count)?, pairs);
    if span.out.from == 0 {
        *out.first_mut()? = first;
    }
    if span.out.to > 2 * span.last {
        *out.last_mut()? = last;
    }
    Some(())
}

/// The third lift of many samples, none at an end, each with the detail behind it.
#[inline(always)]
fn interleave<S: Lifting, R: Real>(v: &[R], before: &[R], behind: &[R], pairs: &mut [[R; 2]]) {
    for (((pair, &v), &a), &b) in pairs.iter_mut().zip(v).zip(before).zip(behind) {
        *pair = [S::third(v, a, b), b];
    }
}
