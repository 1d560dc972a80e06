//! Lines and numbers of text files, read from bytes because comments may be in any encoding.

use std::io::Write;
use std::path::Path;

use crate::{Error, Place};

/// The file without the mark that some editors put in front of UTF-8 text.
pub(crate) fn without_byte_order_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// Whether the file begins with the mark of UTF-16, of either byte order.
pub(crate) fn begins_as_utf_16(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF")
}

/// Whether the bytes can be text that lines are read from: it is not UTF-16 and has no zero byte, as binary files have.
pub(crate) fn check_is_text(bytes: &[u8], path: &Path) -> Result<(), Error> {
    let (at, problem) = if begins_as_utf_16(bytes) {
        (0, "the text is UTF-16: save it as UTF-8")
    } else if let Some(at) = memchr::memchr(0, bytes) {
        (at, "a zero byte, which text does not have: the file is binary, UTF-16 or damaged; export it again as text")
    } else {
        return Ok(());
    };
    Err(Error::malformed(path, Place::Byte(at as u64), problem))
}

/// The lines with their numbers, counted from 1, without their ends: `\n`, `\r\n`, or the `\r` alone of old Macintoshes.
pub(crate) fn numbered_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let mut rest = Some(bytes);
    let lines = std::iter::from_fn(move || {
        let bytes = rest?;
        let Some(length) = memchr::memchr2(b'\n', b'\r', bytes) else { return rest.take() };
        let end = &bytes[length..];
        rest = end.strip_prefix(b"\r\n").or(end.get(1..));
        Some(&bytes[..length])
    });
    lines.enumerate().map(|(index, line)| (index + 1, line))
}

/// The line without its comment, which begins with `#` unless that is the one of `1.#INF` and its like.
pub(crate) fn without_comment(line: &[u8]) -> &[u8] {
    let begins = |at: &usize| !line[..*at].ends_with(b"1.");
    let length = memchr::memchr_iter(b'#', line).find(begins).unwrap_or(line.len());
    &line[..length]
}

/// The words of a line, separated by white space.
pub(crate) fn words(line: &[u8]) -> Words<'_> {
    Words { rest: line }
}

/// See [`words`].
#[derive(Debug, Clone)]
pub(crate) struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let word = &self.rest[start..];
        let length = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.rest = &word[length..];
        Some(&word[..length])
    }
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
#[inline]
pub(crate) fn real(word: &[u8]) -> Option<f64> {
    if let Some(value) = short_decimal(word) {
        return Some(value);
    }
    let value: f64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    value.is_finite().then_some(value)
}

/// Powers of ten that an `f64` holds exactly, as many as a short decimal can have digits.
const TENS: [f64; 17] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16];

/// The number of a word of at most 17 digits and a point without an exponent, as most are, when its digits are an integer below
/// 2^53: then one division of two exact numbers rounds right (Clinger, How to read floating point numbers accurately, 1990,
/// section 5).
#[inline]
fn short_decimal(word: &[u8]) -> Option<f64> {
    let (is_negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    if digits.len() > TENS.len() {
        return None;
    }
    let (mut integer, mut n_digits, mut n_before_point) = (0_u64, 0, None);
    for &byte in digits {
        let digit = byte.wrapping_sub(b'0');
        if digit < 10 {
            integer = 10 * integer + u64::from(digit);
            n_digits += 1;
        } else if byte == b'.' && n_before_point.is_none() {
            n_before_point = Some(n_digits);
        } else {
            return None;
        }
    }
    if n_digits == 0 || integer > 1 << 53 {
        return None;
    }
    let n_decimals = n_digits - n_before_point.unwrap_or(n_digits);
    let value = integer as f64 / TENS.get(n_decimals)?;
    Some(if is_negative { -value } else { value })
}

/// The word as a number that may also be infinite or no number, in the spellings of C and of Microsoft's C: `-nan`,
/// `nan(ind)`, `1.#QNAN`, `-1.#IND`, `1.#INF`.
pub(crate) fn any_real(word: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(word).ok()?;
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    let magnitude = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
    let value = match magnitude.strip_prefix("1.#") {
        Some(kind) if kind.starts_with("inf") => f64::INFINITY,
        Some(kind) if ["qnan", "snan", "ind", "nan"].iter().any(|nan| kind.starts_with(nan)) => f64::NAN,
        None if magnitude.starts_with("nan(") && magnitude.ends_with(')') => f64::NAN,
        _ => return None,
    };
    Some(if word.starts_with(b"-") { -value } else { value })
}

/// The word as an integer.
#[inline]
pub(crate) fn integer<T: std::str::FromStr + TryFrom<u64>>(word: &[u8]) -> Option<T> {
    // Without a sign and short enough not to overflow, as nearly all are.
    if (1..=19).contains(&word.len()) && word.iter().all(u8::is_ascii_digit) {
        let value = word.iter().fold(0_u64, |value, byte| 10 * value + u64::from(byte - b'0'));
        return T::try_from(value).ok();
    }
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
        for (text, expected) in [
            (&b"a\r\n\nb"[..], &[&b"a"[..], b"", b"b"][..]),
            (b"a\rb\r\rc\n", &[b"a", b"b", b"", b"c", b""]),
            (b"\r\n", &[b"", b""]),
            (b"", &[b""]),
        ] {
            let (numbers, lines): (Vec<_>, Vec<_>) = numbered_lines(text).unzip();
            assert_eq!(lines, expected);
            assert!(numbers.into_iter().eq(1..=lines.len()));
        }
    }

    #[test]
    fn what_is_no_text_is_refused_with_the_byte() {
        let said = |bytes: &[u8]| check_is_text(bytes, Path::new("a")).map_err(|error| error.to_string());
        for utf_16 in [&b"\xFF\xFEv\0"[..], b"\xFE\xFF\0v"] {
            assert_eq!(said(utf_16).unwrap_err(), "a, byte 0: the text is UTF-16: save it as UTF-8");
        }
        assert!(said(b"v 1\n\0").unwrap_err().starts_with("a, byte 4: a zero byte"));
        assert_eq!(said("v 1 # \u{e9}\u{1}".as_bytes()), Ok(()));
    }

    #[test]
    fn comments_begin_with_a_number_sign() {
        for (line, text) in [("a 1#b", "a 1"), ("# a", ""), ("a 1.#INF # b", "a 1.#INF "), ("a", "a")] {
            assert_eq!(without_comment(line.as_bytes()), text.as_bytes());
        }
    }

    #[test]
    fn words_stand_between_white_space() {
        assert!(words(b" \ta  bc\x0Cd ").eq([&b"a"[..], b"bc", b"d"]));
        assert_eq!(words(b" \t").next(), None);
    }

    #[test]
    fn every_spelling_of_what_is_not_finite_is_known() {
        for word in ["nan", "NaN", "-nan", "nan(ind)", "-NAN(0x7f)", "1.#QNAN", "-1.#IND", "1.#QNAN0"] {
            assert!(any_real(word.as_bytes()).is_some_and(f64::is_nan), "{word}");
        }
        for (word, value) in [("inf", 1.0), ("-Infinity", -1.0), ("1.#INF", 1.0), ("-1.#INF00", -1.0), ("1e999", 1.0)] {
            assert_eq!(any_real(word.as_bytes()), Some(value * f64::INFINITY), "{word}");
        }
        for word in ["nano", "1.#", "1.#x", "nan(", "--", ""] {
            assert_eq!(any_real(word.as_bytes()), None, "{word}");
        }
        assert_eq!(any_real(b"-2.5"), Some(-2.5));
    }

    #[test]
    fn what_is_no_finite_number_is_refused() {
        for word in ["nan", "inf", "-infinity", "1e999", "1,5", "0x10", "", "1_0"] {
            assert_eq!(real(word.as_bytes()), None, "{word}");
        }
        assert_eq!(real(b"-.5e1"), Some(-5.0));
    }

    #[test]
    fn integers_of_every_length_are_those_of_the_standard_library() {
        for word in
            ["0", "007", "+5", "-5", "", "-", "+", "255", "256", "18446744073709551615", "18446744073709551616", "1x"]
        {
            assert_eq!(integer::<u8>(word.as_bytes()), word.parse().ok(), "{word}");
            assert_eq!(integer::<i64>(word.as_bytes()), word.parse().ok(), "{word}");
            assert_eq!(integer::<u64>(word.as_bytes()), word.parse().ok(), "{word}");
        }
    }

    #[test]
    fn shown_words_are_short_and_printable() {
        assert_eq!(shown(b"ab\x07"), "ab\u{FFFD}");
        assert_eq!(shown(&[b'x'; 99]).chars().count(), 41);
    }

    proptest! {
        #[test]
        fn short_decimals_are_those_of_the_standard_library(word in "[-+]?[0-9]{0,10}[.]?[0-9]{0,10}(e[0-9])?") {
            let expected = word.parse::<f64>().ok().map(f64::to_bits);
            prop_assert_eq!(real(word.as_bytes()).map(f64::to_bits), expected);
        }

        #[test]
        fn written_numbers_read_back_with_equal_bits(value in any::<f64>().prop_filter("finite", |x| x.is_finite())) {
            let mut text = Vec::new();
            push_real(&mut text, value);
            prop_assert_eq!(real(&text).map(f64::to_bits), Some(value.to_bits()));
        }
    }
}
