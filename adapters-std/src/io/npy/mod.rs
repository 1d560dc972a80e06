//! NPY arrays of numbers, read and written, and NPZ archives of them, written.
//!
//! Arrays are in C order in memory: the last index runs fastest. NPY is written by the crate `npyz`. Its header is read
//! here, because `npyz` allocates what the header's length claims and multiplies the shape without a check for
//! overflow: a damaged file would end the program.

mod header;
pub mod npz;

use std::io::{self, Write};
use std::path::Path;

use npyz::WriterBuilder;

use self::header::{Header, Kind, header};
use super::{atomic, file_bytes};
use crate::{Error, Place};

/// The shape and the numbers, in C order, of an array of `f2 f4 f8 i1 i2 i4 i8 u1 u2 u4` of either byte order.
///
/// Numbers may be infinite or not a number; integers beyond 2^53 are an error, as `f64` cannot hold them.
///
/// # Errors
/// [`Error::Read`], or [`Error::Malformed`] for another type, or when shape and length of the file disagree.
pub fn read_f64(path: impl AsRef<Path>) -> Result<(Vec<usize>, Vec<f64>), Error> {
    let path = path.as_ref();
    parse_f64(&file_bytes(path)?, path)
}

/// [`read_f64`] of the bytes of a file; `path` is for the messages.
///
/// # Errors
/// [`Error::Malformed`].
pub fn parse_f64(bytes: &[u8], path: &Path) -> Result<(Vec<usize>, Vec<f64>), Error> {
    let header = header(bytes, path)?;
    let body = &bytes[header.body..];
    let values = match (header.kind, header.n_bytes) {
        (Kind::Real, 2) => decoded(&header, body, |b| half(u16::from_le_bytes(b))),
        (Kind::Real, 4) => decoded(&header, body, |b| f64::from(f32::from_le_bytes(b))),
        (Kind::Real, _) => decoded(&header, body, f64::from_le_bytes),
        _ => {
            let integers = integers(&header, body);
            const LIMIT: u64 = 1 << f64::MANTISSA_DIGITS;
            if let Some(at) = integers.iter().position(|x| x.unsigned_abs() > LIMIT) {
                let beyond = integers[at];
                let problem =
                    format!("the integer {beyond} is beyond 2^53 and has no exact f64: store the array as u4 or f8");
                return Err(Error::malformed(path, Place::Byte(header.byte_of(at)), problem));
            }
            integers.into_iter().map(|x| x as f64).collect()
        }
    };
    Ok((header.shape, values))
}

/// The place of the value of this index in C order, in the bytes of an array.
pub(crate) fn place_of_value(bytes: &[u8], path: &Path, index: usize) -> Place {
    header(bytes, path).map_or(Place::Byte(0), |header| Place::Byte(header.byte_of(index)))
}

/// The place of the shape in the header, in the bytes of an array.
pub(crate) fn place_of_shape(bytes: &[u8], path: &Path) -> Place {
    header(bytes, path).map_or(Place::Byte(0), |header| Place::Byte(header.shape_at as u64))
}

/// The shape and the indices, in C order, of an array of integers.
///
/// # Errors
/// As [`read_f64`]; also for real numbers and for an index that is negative or above `u32::MAX`.
pub fn read_u32(path: impl AsRef<Path>) -> Result<(Vec<usize>, Vec<u32>), Error> {
    let path = path.as_ref();
    parse_u32(&file_bytes(path)?, path)
}

/// [`read_u32`] of the bytes of a file; `path` is for the messages.
///
/// # Errors
/// [`Error::Malformed`].
pub fn parse_u32(bytes: &[u8], path: &Path) -> Result<(Vec<usize>, Vec<u32>), Error> {
    let header = header(bytes, path)?;
    if header.kind == Kind::Real {
        let problem = "real numbers where indices are expected: store them as an integer type such as i4";
        return Err(Error::malformed(path, Place::Byte(header.type_at as u64), problem));
    }
    let integers = integers(&header, &bytes[header.body..]);
    let index = |(at, &integer): (usize, &i64)| {
        u32::try_from(integer).map_err(|_| {
            let problem = format!("value {at} is {integer}; an index from 0 to {} is expected", u32::MAX);
            Error::malformed(path, Place::Byte(header.byte_of(at)), problem)
        })
    };
    let indices = integers.iter().enumerate().map(index).collect::<Result<_, _>>()?;
    Ok((header.shape, indices))
}

/// The integers of the body, of a type that `i64` holds.
fn integers(header: &Header, body: &[u8]) -> Vec<i64> {
    match (header.kind, header.n_bytes) {
        (Kind::Signed, 1) => decoded(header, body, |b| i64::from(i8::from_le_bytes(b))),
        (Kind::Signed, 2) => decoded(header, body, |b| i64::from(i16::from_le_bytes(b))),
        (Kind::Signed, 4) => decoded(header, body, |b| i64::from(i32::from_le_bytes(b))),
        (Kind::Unsigned, 1) => decoded(header, body, |b| i64::from(u8::from_le_bytes(b))),
        (Kind::Unsigned, 2) => decoded(header, body, |b| i64::from(u16::from_le_bytes(b))),
        (Kind::Unsigned, 4) => decoded(header, body, |b| i64::from(u32::from_le_bytes(b))),
        _ => decoded(header, body, i64::from_le_bytes),
    }
}

/// The values of a body of `N` bytes each, in C order.
fn decoded<const N: usize, T: Copy>(header: &Header, body: &[u8], value: impl Fn([u8; N]) -> T) -> Vec<T> {
    let value_of = |bytes: &[u8; N]| {
        let mut bytes = *bytes;
        if header.big_endian {
            bytes.reverse();
        }
        value(bytes)
    };
    let stored: Vec<T> = body.as_chunks::<N>().0.iter().map(value_of).collect();
    if header.fortran { in_c_order(&header.shape, &stored) } else { stored }
}

/// Values stored with the first index fastest, with the last index fastest.
fn in_c_order<T: Copy>(shape: &[usize], stored: &[T]) -> Vec<T> {
    let mut strides = Vec::with_capacity(shape.len());
    let mut stride = 1;
    for &extent in shape {
        strides.push(stride);
        stride *= extent;
    }
    let mut index = vec![0; shape.len()];
    let mut at = 0;
    let mut values = Vec::with_capacity(stored.len());
    for _ in 0..stored.len() {
        values.push(stored[at]);
        for axis in (0..shape.len()).rev() {
            index[axis] += 1;
            at += strides[axis];
            if index[axis] < shape[axis] {
                break;
            }
            at -= strides[axis] * shape[axis];
            index[axis] = 0;
        }
    }
    values
}

/// The value of an IEEE 754 half-precision number.
fn half(bits: u16) -> f64 {
    let exponent = i32::from(bits >> 10 & 0x1F);
    let fraction = f64::from(bits & 0x3FF) / 1024.0;
    let magnitude = match exponent {
        0 => fraction * 2f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction) * 2f64.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -magnitude } else { magnitude }
}

/// Writes `f4` numbers, atomically. `values` are in C order.
///
/// # Errors
/// [`Error::Write`], or [`Error::Input`] when the shape does not have as many elements as there are values.
pub fn write_f32(path: impl AsRef<Path>, shape: &[usize], values: &[f32]) -> Result<(), Error> {
    write(path.as_ref(), shape, values)
}

/// Writes `f8` numbers, atomically. `values` are in C order.
///
/// # Errors
/// As [`write_f32`].
pub fn write_f64(path: impl AsRef<Path>, shape: &[usize], values: &[f64]) -> Result<(), Error> {
    write(path.as_ref(), shape, values)
}

/// Writes `u4` indices, atomically. `values` are in C order.
///
/// # Errors
/// As [`write_f32`].
pub fn write_u32(path: impl AsRef<Path>, shape: &[usize], values: &[u32]) -> Result<(), Error> {
    write(path.as_ref(), shape, values)
}

/// The bytes that [`write_f32`] writes.
///
/// # Errors
/// As [`format_f64`].
pub fn format_f32(shape: &[usize], values: &[f32]) -> Result<Vec<u8>, Error> {
    format(shape, values)
}

/// The bytes that [`write_f64`] writes.
///
/// # Errors
/// [`Error::Input`] when the shape does not have as many elements as there are values.
pub fn format_f64(shape: &[usize], values: &[f64]) -> Result<Vec<u8>, Error> {
    format(shape, values)
}

/// The bytes that [`write_u32`] writes.
///
/// # Errors
/// As [`format_f64`].
pub fn format_u32(shape: &[usize], values: &[u32]) -> Result<Vec<u8>, Error> {
    format(shape, values)
}

fn format<T: npyz::AutoSerialize + Copy>(shape: &[usize], values: &[T]) -> Result<Vec<u8>, Error> {
    check_shape("an array", shape, values.len())?;
    let mut bytes = Vec::new();
    array(npyz::WriteOptions::new().writer(&mut bytes), shape, values)
        .map_err(|error| Error::Internal(format!("writing an array to memory failed: {error}")))?;
    Ok(bytes)
}

fn write<T: npyz::AutoSerialize + Copy>(path: &Path, shape: &[usize], values: &[T]) -> Result<(), Error> {
    check_shape(&path.display().to_string(), shape, values.len())?;
    atomic::write_with(path, |writer| array(npyz::WriteOptions::new().writer(writer), shape, values))
}

fn array<T, W, B>(options: B, shape: &[usize], values: &[T]) -> io::Result<()>
where
    T: npyz::AutoSerialize + Copy,
    W: Write,
    B: npyz::write_options::HasWriter<Writer = W> + WriterBuilder<T>,
{
    let shape: Vec<u64> = shape.iter().map(|&extent| extent as u64).collect();
    let mut writer = options.default_dtype().shape(&shape).begin_nd()?;
    writer.extend(values.iter().copied())?;
    writer.finish()
}

fn check_shape(what: &str, shape: &[usize], n: usize) -> Result<(), Error> {
    let n_elements = shape.iter().try_fold(1usize, |n, &extent| n.checked_mul(extent));
    if n_elements == Some(n) {
        return Ok(());
    }
    Err(Error::input(format!("{what} is not written: {n} values for an array of shape {shape:?}")))
}

/// Collects named arrays and writes them as one NPZ archive, uncompressed, so that readers can map it.
///
/// Nothing is written before [`NpzWriter::finish`].
#[derive(Debug, Default)]
pub struct NpzWriter<'a> {
    arrays: Vec<(String, Vec<usize>, Values<'a>)>,
}

/// The values of an array of an archive.
#[derive(Debug, Clone, Copy)]
pub enum Values<'a> {
    /// Stored as `f4`.
    F32(&'a [f32]),
    /// Stored as `f8`.
    F64(&'a [f64]),
    /// Stored as `u4`.
    U32(&'a [u32]),
}

impl Values<'_> {
    fn len(&self) -> usize {
        match self {
            Values::F32(values) => values.len(),
            Values::F64(values) => values.len(),
            Values::U32(values) => values.len(),
        }
    }
}

impl<'a> From<&'a [f32]> for Values<'a> {
    fn from(values: &'a [f32]) -> Self {
        Values::F32(values)
    }
}

impl<'a> From<&'a [f64]> for Values<'a> {
    fn from(values: &'a [f64]) -> Self {
        Values::F64(values)
    }
}

impl<'a> From<&'a [u32]> for Values<'a> {
    fn from(values: &'a [u32]) -> Self {
        Values::U32(values)
    }
}

impl<'a> NpzWriter<'a> {
    /// An archive without arrays.
    pub fn new() -> Self {
        NpzWriter { arrays: Vec::new() }
    }

    /// Adds an array of this name; `values` are in C order.
    ///
    /// # Errors
    /// [`Error::Input`] for a name that is empty or taken, or a shape that does not have as many elements as values.
    pub fn add(&mut self, name: &str, shape: &[usize], values: impl Into<Values<'a>>) -> Result<(), Error> {
        let values = values.into();
        if name.is_empty() || self.arrays.iter().any(|(taken, ..)| taken == name) {
            return Err(Error::input(format!("the array name {name:?} is empty or taken: give each its own")));
        }
        check_shape(&format!("array {name:?}"), shape, values.len())?;
        self.arrays.push((name.to_owned(), shape.to_owned(), values));
        Ok(())
    }

    /// Writes the archive to `path`, atomically. Equal arrays give equal bytes: the entries carry no time.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn finish(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        atomic::write_with(path, |writer| {
            let mut npz = npyz::npz::NpzWriter::new(writer);
            for (name, shape, values) in &self.arrays {
                // Entries of 4 GiB and more need the long form of the directory.
                let options = npyz::zip::write::FileOptions::default()
                    .compression_method(npyz::zip::CompressionMethod::Stored)
                    .last_modified_time(npyz::zip::DateTime::default())
                    .large_file(values.len() as u64 * 8 >= u64::from(u32::MAX));
                match values {
                    Values::F32(values) => array(npz.array::<f32>(name, options)?, shape, values)?,
                    Values::F64(values) => array(npz.array::<f64>(name, options)?, shape, values)?,
                    Values::U32(values) => array(npz.array::<u32>(name, options)?, shape, values)?,
                }
            }
            npz.zip_writer().finish()?;
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests;
