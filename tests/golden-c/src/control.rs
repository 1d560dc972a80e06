//! Negative control on the target: a runner that overlooks a changed bit proves nothing.

use crate::report::{Line, report};
use habitus_golden::{VECTORS, Vectors};

/// Longest case of the vectors, with room.
const CASE_BYTES: usize = 16 * 1024;
const CASE: &str = "\ncase ";

/// Cases tried, each with the lowest bit of its last digit changed, and cases in which the runner noticed.
pub fn noticed() -> (u32, u32) {
    let (mut tried, mut noticed) = (0, 0);
    for (file, text) in VECTORS.files {
        let mut rest = text.find(CASE).and_then(|at| text.get(at + 1..)).unwrap_or_default();
        while !rest.is_empty() {
            let end = rest.find(CASE).map_or(rest.len(), |at| at + 1);
            let (case, after) = rest.split_at(end);
            rest = after;
            tried += 1;
            if is_noticed(file, case) {
                noticed += 1;
            } else {
                report(&Line::of_text(&[
                    "a changed bit was not noticed: ",
                    file,
                    ": ",
                    case.lines().next().unwrap_or(""),
                ]));
            }
        }
    }
    (tried, noticed)
}

fn is_noticed(file: &str, case: &str) -> bool {
    let mut bytes = [0; CASE_BYTES];
    let case = case.trim_ascii_end().as_bytes();
    let Some(copy) = bytes.get_mut(..case.len()) else { return false };
    copy.copy_from_slice(case);
    let Some(last) = copy.last_mut() else { return false };
    let digit = char::from(*last).to_digit(16).and_then(|digit| char::from_digit(digit ^ 1, 16));
    let Some(digit) = digit else { return false };
    *last = digit as u8;
    let Ok(changed) = core::str::from_utf8(copy) else { return false };
    let vectors = Vectors { models: VECTORS.models, files: [(file, changed), ("", ""), ("", ""), ("", "")] };
    let summary = crate::summary_of(&vectors, &mut |_| ());
    (summary.cases, summary.failed) == (1, 1)
}
