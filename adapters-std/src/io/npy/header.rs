//! The header of an NPY file, versions 1 to 3: magic, version, length, and a Python dictionary of three entries.
//!
//! Format: NumPy enhancement proposal 1 (NEP 1) and the documentation of `numpy.lib.format`.

use std::path::Path;

use crate::io::text::shown;
use crate::{Error, Place};

/// What the bits of a value mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Real,
    Signed,
    Unsigned,
}

/// A header that agrees with the length of its file.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub kind: Kind,
    /// Bytes of one value.
    pub n_bytes: usize,
    pub big_endian: bool,
    /// The first index runs fastest.
    pub fortran: bool,
    pub shape: Vec<usize>,
    /// The byte at which the type of the values stands.
    pub type_at: usize,
    /// The byte at which the shape stands.
    pub shape_at: usize,
    /// The byte at which the values begin.
    pub body: usize,
}

impl Header {
    /// The byte at which the value of this index in C order begins.
    pub(super) fn byte_of(&self, index: usize) -> u64 {
        let mut stored = index;
        if self.fortran {
            // The strides of the first indices are the small ones.
            let mut rest = index;
            let mut stride: usize = self.shape.iter().product();
            stored = 0;
            for &extent in self.shape.iter().rev().filter(|&&extent| extent > 0) {
                stride /= extent;
                stored += rest % extent * stride;
                rest /= extent;
            }
        }
        (self.body + stored * self.n_bytes) as u64
    }
}

/// Reads the header at the beginning of the file and compares its shape with the bytes behind it.
pub(super) fn header(bytes: &[u8], path: &Path) -> Result<Header, Error> {
    let malformed = |at: usize, problem: String| Error::malformed(path, Place::Byte(at as u64), problem);
    let Some((preamble, rest)) = bytes.split_first_chunk::<10>() else {
        return Err(malformed(bytes.len(), "an NPY file has at least 10 bytes: is it truncated?".into()));
    };
    if &preamble[..6] != b"\x93NUMPY" {
        return Err(malformed(0, "an NPY file begins with \\x93NUMPY; this one does not".into()));
    }
    let (start, length) = match preamble[6] {
        1 => (10, usize::from(u16::from_le_bytes([preamble[8], preamble[9]]))),
        2 | 3 => {
            let [c, d] = *rest.first_chunk().ok_or_else(|| malformed(10, "the file ends in its header".into()))?;
            (12, u32::from_le_bytes([preamble[8], preamble[9], c, d]) as usize)
        }
        version => return Err(malformed(6, format!("NPY version {version} is not read; 1 to 3 are"))),
    };
    let text = bytes[start..].get(..length).ok_or_else(|| {
        malformed(8, format!("a header of {length} bytes in a file of {}: is it truncated?", bytes.len()))
    })?;
    let body = start + length;
    let mut dictionary = Dictionary { text, at: 0 };
    let header = dictionary.header(start, body).map_err(|problem| malformed(start + dictionary.at, problem))?;
    let present = bytes.len() - body;
    let n_elements = header.shape.iter().try_fold(1usize, |n, &extent| n.checked_mul(extent));
    if n_elements.and_then(|n| n.checked_mul(header.n_bytes)) != Some(present) {
        let (shape, n_bytes) = (&header.shape, header.n_bytes);
        let problem =
            format!("an array of shape {shape:?} of {n_bytes} bytes each, but {present} bytes follow the header");
        return Err(malformed(body, problem));
    }
    Ok(header)
}

/// Reads the dictionary; its three values are a string, a truth value and a tuple of integers.
struct Dictionary<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Dictionary<'a> {
    /// The header of a dictionary that begins at the byte `start`, of a file whose values begin at `body`.
    fn header(&mut self, start: usize, body: usize) -> Result<Header, String> {
        let (mut descr, mut fortran, mut shape) = (None, None, None);
        let (mut type_at, mut shape_at) = (start, start);
        self.expect(b'{')?;
        while !self.take(b'}') {
            let key = self.string()?;
            self.expect(b':')?;
            self.skip_space();
            match key {
                b"descr" => {
                    type_at = start + self.at;
                    descr = Some(element(self.string()?)?);
                }
                b"fortran_order" => fortran = Some(self.truth()?),
                b"shape" => {
                    shape_at = start + self.at;
                    shape = Some(self.tuple()?);
                }
                _ => return Err(format!("the key {:?} is not known", shown(key))),
            }
            if !self.take(b',') {
                self.expect(b'}')?;
                break;
            }
        }
        self.skip_space();
        if self.at != self.text.len() {
            return Err(format!("{:?} follows the dictionary", shown(&self.text[self.at..])));
        }
        match (descr, fortran, shape) {
            (Some((kind, n_bytes, big_endian)), Some(fortran), Some(shape)) => {
                Ok(Header { kind, n_bytes, big_endian, fortran, shape, type_at, shape_at, body })
            }
            _ => Err("the dictionary lacks one of descr, fortran_order and shape".into()),
        }
    }

    fn skip_space(&mut self) {
        let rest = &self.text[self.at..];
        self.at += rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
    }

    fn take(&mut self, byte: u8) -> bool {
        self.skip_space();
        let found = self.text.get(self.at) == Some(&byte);
        self.at += usize::from(found);
        found
    }

    fn expect(&mut self, byte: u8) -> Result<(), String> {
        if self.take(byte) {
            return Ok(());
        }
        let rest = &self.text[self.at..];
        Err(format!("{:?} where '{}' is expected in the header", shown(rest), char::from(byte)))
    }

    fn string(&mut self) -> Result<&'a [u8], String> {
        let quote = if self.take(b'"') { b'"' } else { b'\'' };
        if quote == b'\'' && !self.take(b'\'') {
            let rest = shown(&self.text[self.at..]);
            return Err(format!("{rest:?} where a string is expected: records of several fields are not read"));
        }
        let rest = &self.text[self.at..];
        let length = rest.iter().position(|&byte| byte == quote).ok_or("a string of the header does not end")?;
        self.at += length + 1;
        Ok(&rest[..length])
    }

    fn truth(&mut self) -> Result<bool, String> {
        self.skip_space();
        for (word, value) in [(&b"True"[..], true), (b"False", false)] {
            if self.text[self.at..].starts_with(word) {
                self.at += word.len();
                return Ok(value);
            }
        }
        Err(format!("{:?} where True or False is expected", shown(&self.text[self.at..])))
    }

    fn tuple(&mut self) -> Result<Vec<usize>, String> {
        let mut shape = Vec::new();
        self.expect(b'(')?;
        while !self.take(b')') {
            self.skip_space();
            let rest = &self.text[self.at..];
            let length = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
            let extent = std::str::from_utf8(&rest[..length]).ok().and_then(|digits| digits.parse().ok());
            shape.push(extent.ok_or_else(|| format!("{:?} where an extent of the shape is expected", shown(rest)))?);
            self.at += length;
            if !self.take(b',') {
                self.expect(b')')?;
                break;
            }
        }
        Ok(shape)
    }
}

/// Kind, number of bytes and whether big endian, of a type such as `<f4`.
fn element(descr: &[u8]) -> Result<(Kind, usize, bool), String> {
    let unread = || {
        let known = "f2 f4 f8 i1 i2 i4 i8 u1 u2 u4";
        format!("values of type {:?} are not read; convert the array to one of {known}", shown(descr))
    };
    let (order, name) = descr.split_first().ok_or_else(unread)?;
    let (kind, n_bytes) = match name {
        b"f2" => (Kind::Real, 2),
        b"f4" => (Kind::Real, 4),
        b"f8" => (Kind::Real, 8),
        b"i1" => (Kind::Signed, 1),
        b"i2" => (Kind::Signed, 2),
        b"i4" => (Kind::Signed, 4),
        b"i8" => (Kind::Signed, 8),
        b"u1" => (Kind::Unsigned, 1),
        b"u2" => (Kind::Unsigned, 2),
        b"u4" => (Kind::Unsigned, 4),
        _ => return Err(unread()),
    };
    match order {
        b'<' => Ok((kind, n_bytes, false)),
        b'>' => Ok((kind, n_bytes, true)),
        b'|' if n_bytes == 1 => Ok((kind, n_bytes, false)),
        _ => Err(unread()),
    }
}
