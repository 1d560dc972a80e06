//! Lines and numbers of text files, read from bytes because comments may be in any encoding.

use std::io::Write;
use std::path::Path;

use crate::{Error, Place};

/// The file without the mark that some editors put in front of UTF-8 text.
pub(crate) fn without_byte_order_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// The lines with their numbers, counted from 1, without `\n` or `\r\n`.
pub(crate) fn numbered_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let lines = bytes.split(|&byte| byte == b'\n').map(|line| line.strip_suffix(b"\r").unwrap_or(line));
    lines.enumerate().map(|(index, line)| (index + 1, line))
}

/// The words of a line, separated by white space.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A word as it can be shown in a message: at most 40 characters, unprintable ones replaced.
pub(crate) fn shown(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(word);
    let printable = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    let mut shown: String = text.chars().map(printable).take(40).collect();
    if text.chars().nth(40).is_some() {
        shown.push('…');
    }
    shown
}

/// The word as a number, or `None` when it is no number or not a finite one.
pub(crate) fn real(word: &[u8]) -> Option<f64> {
    let value: f64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    value.is_finite().then_some(value)
}

/// The word as an integer.
pub(crate) fn integer<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The next three words as a vector, called `what` in the error.
pub(crate) fn vector<'a>(
    words: &mut impl Iterator<Item = &'a [u8]>,
    what: &str,
    path: &Path,
    line: usize,
) -> Result<[f64; 3], Error> {
    let mut vector = [0.0; 3];
    for (slot, axis) in vector.iter_mut().zip(["x", "y", "z"]) {
        let Some(word) = words.next() else {
            return Err(Error::malformed(path, Place::Line(line), format!("the {what} ends before its {axis}")));
        };
        *slot = real(word).ok_or_else(|| not_finite(what, word, path, Place::Line(line)))?;
    }
    Ok(vector)
}

/// The error for a number that is none.
pub(crate) fn not_finite(what: &str, word: &[u8], path: &Path, place: Place) -> Error {
    let problem = format!("the {what} has {:?} where a finite number is expected", shown(word));
    Error::malformed(path, place, problem)
}

/// Appends the shortest decimal that reads back as the same `f64`.
pub(crate) fn push_real(text: &mut Vec<u8>, value: f64) {
    let magnitude = value.abs();
    let written = if magnitude == 0.0 || (1e-5..1e16).contains(&magnitude) {
        write!(text, "{value}")
    } else {
        write!(text, "{value:e}")
    };
    debug_assert!(written.is_ok(), "a vector takes every byte");
}

/// Appends the three numbers with spaces between them.
pub(crate) fn push_vector(text: &mut Vec<u8>, [x, y, z]: &[f64; 3]) {
    push_real(text, *x);
    text.push(b' ');
    push_real(text, *y);
    text.push(b' ');
    push_real(text, *z);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn lines_are_counted_from_one_and_lose_their_ends() {
        let lines: Vec<_> = numbered_lines(b"a\r\n\nb").collect();
        assert_eq!(lines, [(1, &b"a"[..]), (2, b""), (3, b"b")]);
    }

    #[test]
    fn what_is_no_finite_number_is_refused() {
        for word in ["nan", "inf", "-infinity", "1e999", "1,5", "0x10", "", "1_0"] {
            assert_eq!(real(word.as_bytes()), None, "{word}");
        }
        assert_eq!(real(b"-.5e1"), Some(-5.0));
    }

    #[test]
    fn shown_words_are_short_and_printable() {
        assert_eq!(shown(b"ab\x07"), "ab\u{FFFD}");
        assert_eq!(shown(&[b'x'; 99]).chars().count(), 41);
    }

    proptest! {
        #[test]
        fn written_numbers_read_back_with_equal_bits(value in any::<f64>().prop_filter("finite", |x| x.is_finite())) {
            let mut text = Vec::new();
            push_real(&mut text, value);
            prop_assert_eq!(real(&text).map(f64::to_bits), Some(value.to_bits()));
        }
    }
}
