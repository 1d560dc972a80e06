//! `error.rs` of the kernel: codes and texts.

use core::fmt::{self, Write};
use habitus_core::Error;

/// A text of fixed size for `Display`.
struct Text {
    bytes: [u8; 128],
    used: usize,
}

impl Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let free = self.bytes.get_mut(self.used..).ok_or(fmt::Error)?;
        let to = free.get_mut(..text.len()).ok_or(fmt::Error)?;
        to.copy_from_slice(text.as_bytes());
        self.used += text.len();
        Ok(())
    }
}

#[unsafe(no_mangle)]
extern "C" fn check_error(which: u32, first: u32, second: u32) -> i32 {
    let error = match which {
        0 => Error::DimensionMismatch { expected: first, found: second },
        1 => Error::BadContent { section: first, index: second },
        2 => Error::BadChecksum { section: first },
        3 => Error::Degenerate,
        4 => Error::NotConverged { iterations: first },
        _ => Error::WorkspaceTooSmall { needed: first, given: second },
    };
    let mut text = Text { bytes: [0; 128], used: 0 };
    let written = write!(text, "{error}").is_ok();
    let sum: i32 = text.bytes.iter().map(|&byte| i32::from(byte)).sum();
    error.code() as i32 + sum + i32::from(written)
}
