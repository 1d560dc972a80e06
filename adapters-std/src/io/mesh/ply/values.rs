//! The values behind the header of a PLY file, one after the other, in each of the three encodings.

use std::path::Path;

use super::super::coordinates::REMEDY;
use super::super::{NonFinite, ReadOptions};
use super::header::{Encoding, Header};
use crate::io::text::{any_real, real, shown};
use crate::mesh::Scalar;
use crate::{Error, Place};

/// Goes through the values of a body. Every value is an `f64`, which holds each type of the format exactly.
pub(super) struct Values<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The line that `at` lies on; counted for text only.
    line: usize,
    encoding: Encoding,
    keep_non_finite: bool,
    path: &'a Path,
}

impl<'a> Values<'a> {
    pub(super) fn new(bytes: &'a [u8], header: &Header, path: &'a Path, options: &ReadOptions) -> Self {
        let keep_non_finite = options.non_finite == NonFinite::Keep;
        Values { bytes, at: header.body, line: header.body_line, encoding: header.encoding, keep_non_finite, path }
    }

    /// The bytes that remain.
    pub(super) fn n_remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    pub(super) fn place(&self) -> Place {
        match self.encoding {
            Encoding::Text => Place::Line(self.line),
            _ => Place::Byte(self.at as u64),
        }
    }

    pub(super) fn malformed(&self, problem: impl Into<String>) -> Error {
        Error::malformed(self.path, self.place(), problem)
    }

    /// An error unless the bytes that remain can hold `count` pieces of at least `least_bytes` each.
    pub(super) fn check_room(&self, count: u64, least_bytes: usize, what: &str) -> Result<(), Error> {
        // The last value of a text needs no separator behind it.
        let present = self.n_remaining() as u64 + u64::from(self.encoding == Encoding::Text);
        match count.checked_mul(least_bytes as u64) {
            Some(needed) if needed <= present => Ok(()),
            _ => {
                let present = self.n_remaining();
                let problem = format!("{count} {what} cannot lie in the {present} bytes that remain: truncated file?");
                Err(self.malformed(problem))
            }
        }
    }

    /// The next value, whatever number it is; `what` names it in the error.
    pub(super) fn any(&mut self, scalar: Scalar, what: &str) -> Result<f64, Error> {
        match self.encoding {
            Encoding::Text => {
                let word = self.word(what)?;
                real(word).or_else(|| any_real(word)).ok_or_else(|| {
                    let problem = format!("the {what} is {:?}; a number is expected", shown(word));
                    self.malformed(problem)
                })
            }
            Encoding::LittleEndian => self.binary(scalar, what, false),
            Encoding::BigEndian => self.binary(scalar, what, true),
        }
    }

    /// The next value, which must be finite.
    pub(super) fn finite(&mut self, scalar: Scalar, what: &str) -> Result<f64, Error> {
        let start = self.at;
        let value = self.any(scalar, what)?;
        if value.is_finite() { Ok(value) } else { Err(self.not_finite(start, value, what, "")) }
    }

    /// The next value as a coordinate, which must be finite unless it is to be kept.
    pub(super) fn coordinate(&mut self, scalar: Scalar, what: &str) -> Result<f64, Error> {
        let start = self.at;
        let value = self.any(scalar, what)?;
        if value.is_finite() || self.keep_non_finite {
            return Ok(value);
        }
        Err(self.not_finite(start, value, what, REMEDY))
    }

    /// The error for the value that began at the byte `start`.
    fn not_finite(&self, start: usize, value: f64, what: &str, remedy: &str) -> Error {
        let place = match self.encoding {
            Encoding::Text => self.place(),
            _ => Place::Byte(start as u64),
        };
        let colon = if remedy.is_empty() { "" } else { ": " };
        Error::malformed(self.path, place, format!("the {what} is {value}; a finite number is expected{colon}{remedy}"))
    }

    /// The next value as a number of things or an index.
    pub(super) fn whole(&mut self, scalar: Scalar, what: &str) -> Result<u64, Error> {
        let place = self.place();
        let value = self.finite(scalar, what)?;
        // 2^53: every integer of the format is below, and every f64 below is exact.
        if value.fract() == 0.0 && (0.0..9_007_199_254_740_992.0).contains(&value) {
            return Ok(value as u64);
        }
        let problem = format!("the {what} is {value}; a whole number, not negative, is expected");
        Err(Error::malformed(self.path, place, problem))
    }

    /// Passes over `count` values of a property that is of no interest, whatever they are.
    pub(super) fn skip(&mut self, scalar: Scalar, count: u64, what: &str) -> Result<(), Error> {
        if self.encoding == Encoding::Text {
            for _ in 0..count {
                self.word(what)?;
            }
            return Ok(());
        }
        self.check_room(count, scalar.n_bytes(), what)?;
        // In range: the room has been checked.
        self.at += count as usize * scalar.n_bytes();
        Ok(())
    }

    /// An error if anything but white space remains.
    pub(super) fn check_end(&self) -> Result<(), Error> {
        let rest = &self.bytes[self.at..];
        if rest.iter().all(u8::is_ascii_whitespace) {
            return Ok(());
        }
        let problem = format!(
            "{} bytes follow the last element: the header's counts are wrong, or the file was altered in transfer",
            rest.len()
        );
        Err(self.malformed(problem))
    }

    fn word(&mut self, what: &str) -> Result<&'a [u8], Error> {
        while let Some(byte) = self.bytes.get(self.at).filter(|byte| byte.is_ascii_whitespace()) {
            self.at += 1;
            let is_end = *byte == b'\n' || *byte == b'\r' && self.bytes.get(self.at) != Some(&b'\n');
            self.line += usize::from(is_end);
        }
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.malformed(format!("the file ends before the {what}: is it truncated?")));
        }
        self.at += length;
        Ok(&rest[..length])
    }

    fn binary(&mut self, scalar: Scalar, what: &str, big_endian: bool) -> Result<f64, Error> {
        Ok(match scalar {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.ordered(what, big_endian)?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.ordered(what, big_endian)?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.ordered(what, big_endian)?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.ordered(what, big_endian)?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.ordered(what, big_endian)?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.ordered(what, big_endian)?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.ordered(what, big_endian)?)),
            Scalar::F64 => f64::from_le_bytes(self.ordered(what, big_endian)?),
        })
    }

    /// The next `N` bytes, the least significant first.
    fn ordered<const N: usize>(&mut self, what: &str, big_endian: bool) -> Result<[u8; N], Error> {
        let Some(bytes) = self.bytes[self.at..].first_chunk::<N>() else {
            return Err(self.malformed(format!("the file ends inside the {what}: it is truncated")));
        };
        self.at += N;
        let mut bytes = *bytes;
        if big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }
}
