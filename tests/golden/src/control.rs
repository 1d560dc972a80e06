//! Negative control on the target: a runner that overlooks a changed bit proves nothing.

use crate::backend::Backend;
use crate::memory::Memory;
use crate::{Vectors, run};

/// Bytes of a case that [`noticed`] needs: the longest of the vectors, with room.
pub const CASE_BYTES: usize = 16 * 1024;
const CASE: &str = "\ncase ";

/// Runs each case with the lowest bit of its last digit changed, in a copy in `copy`. Returns the cases tried and those in which the runner
/// noticed; hands file and first line of the others to `overlooked`. Panics: never.
pub fn noticed<B: Backend>(
    vectors: &Vectors<'_>,
    backend: &B,
    memory: &mut Memory<'_>,
    copy: &mut [u8],
    overlooked: &mut dyn FnMut(&str, &str),
) -> (u32, u32) {
    let (mut tried, mut noticed) = (0, 0);
    for (file, text) in vectors.files {
        let mut rest = text.find(CASE).and_then(|at| text.get(at + 1..)).unwrap_or_default();
        while !rest.is_empty() {
            let end = rest.find(CASE).map_or(rest.len(), |at| at + 1);
            let (case, after) = rest.split_at_checked(end).unwrap_or_default();
            rest = after;
            tried += 1;
            if is_noticed(vectors, backend, memory, copy, file, case).is_some() {
                noticed += 1;
            } else {
                overlooked(file, case.lines().next().unwrap_or_default());
            }
        }
    }
    (tried, noticed)
}

fn is_noticed<B: Backend>(
    vectors: &Vectors<'_>,
    backend: &B,
    memory: &mut Memory<'_>,
    copy: &mut [u8],
    file: &str,
    case: &str,
) -> Option<()> {
    let case = case.trim_ascii_end().as_bytes();
    let copy = copy.get_mut(..case.len())?;
    copy.copy_from_slice(case);
    let last = copy.last_mut()?;
    let digit = char::from(*last).to_digit(16).and_then(|digit| char::from_digit(digit ^ 1, 16))?;
    *last = digit as u8;
    let changed = core::str::from_utf8(copy).ok()?;
    let vectors = Vectors { models: vectors.models, files: [(file, changed), ("", ""), ("", ""), ("", "")] };
    let summary = run(&vectors, backend, memory, &mut |_| ());
    ((summary.cases, summary.failed) == (1, 1)).then_some(())
}
