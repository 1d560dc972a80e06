//! Lines and figures for the host, which defines the functions that take them.

use core::fmt::{self, Write};
use habitus_golden::CaseResult;

#[cfg_attr(target_family = "wasm", link(wasm_import_module = "golden"))]
unsafe extern "C" {
    /// Takes a line of `length` bytes of UTF-8, which are not followed by a zero.
    fn golden_report(text: *const u8, length: usize);
    /// Takes a number and its name, as above.
    fn golden_figure(name: *const u8, length: usize, value: u32);
}

/// Hands a line to the host.
pub fn report(line: &Line) {
    let text = line.bytes.get(..line.used).unwrap_or_default();
    // SAFETY: the host reads these bytes and keeps no pointer to them.
    unsafe { golden_report(text.as_ptr(), text.len()) }
}

/// Hands a figure to the host.
pub fn figure(name: &str, value: u32) {
    // SAFETY: as above.
    unsafe { golden_figure(name.as_ptr(), name.len(), value) }
}

/// A line of text; what does not fit is cut off.
pub struct Line {
    bytes: [u8; 256],
    used: usize,
}

impl Line {
    /// The parts in a row.
    pub fn of_text(parts: &[&str]) -> Line {
        let mut line = Line { bytes: [0; 256], used: 0 };
        for part in parts {
            // A full line is an error of `fmt::Write`; it is long enough to tell the case.
            let _ = line.write_str(part);
        }
        line
    }

    /// Which case failed, and how.
    pub fn of_case(result: &CaseResult<'_>) -> Line {
        let mut line = Line::of_text(&[result.file, ": ", result.kernel, " ", result.name]);
        if let Some(first) = result.first {
            // As above.
            let _ = write!(
                line,
                ": {} bits in {} numbers, first {}[{}] {:x} instead of {:x}",
                result.differing_bits, result.numbers, first.field, first.index, first.found, first.expected
            );
        }
        if let Some(problem) = result.problem {
            // As above.
            let _ = write!(line, ": {problem:?}");
        }
        line
    }
}

impl Write for Line {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let free = self.bytes.get_mut(self.used..).unwrap_or_default();
        let mut count = text.len().min(free.len());
        while !text.is_char_boundary(count) {
            count -= 1;
        }
        for (to, from) in free.iter_mut().zip(text.bytes().take(count)) {
            *to = from;
        }
        self.used += count;
        if count < text.len() { Err(fmt::Error) } else { Ok(()) }
    }
}
