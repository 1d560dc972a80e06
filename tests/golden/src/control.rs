//! Negative control on the target: a runner that overlooks a changed bit proves nothing.

use crate::Vectors;
use crate::backend::Plain;
use crate::kernels::case_result;
use crate::memory::Memory;
use crate::text::{Case, Cases};

/// Bytes of a case that [`noticed`] needs: the longest of the vectors, with room.
pub const CASE_BYTES: usize = 16 * 1024;
const DIGITS: &[u8; 16] = b"0123456789abcdef";

/// Runs each case with the lowest bit of its last digit changed, in a copy in `copy`. Returns the cases tried and those in which the runner
/// noticed; hands file and case of the others to `overlooked`. Panics: never.
pub fn noticed(
    vectors: &Vectors<'_>,
    memory: &mut Memory<'_>,
    copy: &mut [u8],
    overlooked: &mut dyn FnMut(&str, &Case<'_>),
) -> (u32, u32) {
    let (mut tried, mut noticed) = (0, 0);
    for (file, text) in vectors.files {
        for case in Cases::new(text) {
            tried += 1;
            let changed = changed(case.fields(), copy);
            let result = changed.map(|body| case_result(file, case.with_fields(body), vectors.models, &Plain, memory));
            if result.is_some_and(|result| !result.is_equal()) {
                noticed += 1;
            } else {
                overlooked(file, &case);
            }
        }
    }
    (tried, noticed)
}

/// A copy of a text with its last digit changed; `None` when it does not fit or does not end in a digit.
fn changed<'c>(text: &str, copy: &'c mut [u8]) -> Option<&'c str> {
    let copy = copy.get_mut(..text.len())?;
    for (to, from) in copy.iter_mut().zip(text.bytes()) {
        *to = from;
    }
    let last = copy.last_mut()?;
    let digit = DIGITS.iter().position(|digit| digit == last)?;
    *last = *DIGITS.get(digit ^ 1)?;
    core::str::from_utf8(copy).ok()
}
