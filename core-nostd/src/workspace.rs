//! Requirements of scratch memory, and the carving of one caller's slice.
//!
//! A function that needs scratch numbers takes `workspace: &mut [R]`; its twin ending in `_req` says how many. Requirements
//! compose: [`Requirement::and`] for memory that is alive at the same time, [`Requirement::or`] for memory that is reused.

use crate::Error;

/// How many scratch numbers a function needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Requirement {
    numbers: usize,
}

impl Requirement {
    /// Nothing.
    pub const NONE: Self = Self::of(0);

    /// `numbers` scratch numbers.
    pub const fn of(numbers: usize) -> Self {
        Requirement { numbers }
    }

    /// Both at the same time.
    pub const fn and(self, other: Self) -> Self {
        Requirement { numbers: self.numbers.saturating_add(other.numbers) }
    }

    /// One after the other.
    pub const fn or(self, other: Self) -> Self {
        Requirement { numbers: if self.numbers > other.numbers { self.numbers } else { other.numbers } }
    }

    /// The length that the workspace must have at least.
    pub const fn numbers(self) -> usize {
        self.numbers
    }

    /// The same in bytes of `f32`.
    pub const fn f32_bytes(self) -> usize {
        self.numbers.saturating_mul(4)
    }

    /// `Ok` when `given` numbers are enough.
    ///
    /// Errors: `WorkspaceTooSmall`. Panics: never.
    pub fn check(self, given: usize) -> Result<(), Error> {
        if given < self.numbers {
            return Err(Error::WorkspaceTooSmall { needed: saturated(self.numbers), given: saturated(given) });
        }
        Ok(())
    }
}

/// A caller's slice of which pieces are taken from the front.
#[derive(Debug)]
pub struct Workspace<'w, R> {
    rest: &'w mut [R],
}

impl<'w, R> Workspace<'w, R> {
    /// The whole of the caller's slice.
    pub fn new(slice: &'w mut [R]) -> Self {
        Workspace { rest: slice }
    }

    /// The next `numbers` numbers.
    ///
    /// Errors: `WorkspaceTooSmall`.
    pub fn take(&mut self, numbers: usize) -> Result<&'w mut [R], Error> {
        let rest = core::mem::take(&mut self.rest);
        let given = rest.len();
        match rest.split_at_mut_checked(numbers) {
            Some((piece, rest)) => {
                self.rest = rest;
                Ok(piece)
            }
            None => Err(Error::WorkspaceTooSmall { needed: saturated(numbers), given: saturated(given) }),
        }
    }

    /// All that is left.
    pub fn rest(self) -> &'w mut [R] {
        self.rest
    }
}

/// A count for an error message.
pub(crate) fn saturated(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// `Ok` when a slice has the length that the model asks for.
pub(crate) fn check_len(expected: usize, found: usize) -> Result<(), Error> {
    if expected != found {
        return Err(Error::DimensionMismatch { expected: saturated(expected), found: saturated(found) });
    }
    Ok(())
}

/// A part of a slice, or an error instead of a panic.
#[inline(always)]
pub(crate) fn part<T>(slice: &[T], from: usize, len: usize) -> Result<&[T], Error> {
    let found = slice.len();
    from.checked_add(len)
        .and_then(|to| slice.get(from..to))
        .ok_or(Error::IndexOutOfRange { index: saturated(from.saturating_add(len)), limit: saturated(found) })
}

/// A mutable part of a slice, or an error instead of a panic.
#[inline(always)]
pub(crate) fn part_mut<T>(slice: &mut [T], from: usize, len: usize) -> Result<&mut [T], Error> {
    let found = slice.len();
    from.checked_add(len)
        .and_then(|to| slice.get_mut(from..to))
        .ok_or(Error::IndexOutOfRange { index: saturated(from.saturating_add(len)), limit: saturated(found) })
}
