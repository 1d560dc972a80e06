//! Binary STL: 80 bytes that nobody agrees on, the number of triangles, 50 bytes for each.

use std::path::Path;

use super::super::coordinates::REMEDY;
use super::super::losses::Losses;
use super::super::{NonFinite, ReadOptions};
use super::corners::Corners;
use super::{HEADER, RECORD};
use crate::{Error, Place};

/// The number of triangles that the file announces; `None` when it is too short to be binary.
pub(super) fn announced(bytes: &[u8]) -> Option<u64> {
    bytes.get(HEADER..)?.first_chunk().map(|count| u64::from(u32::from_le_bytes(*count)))
}

/// Reads the triangles.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    options: &ReadOptions,
    corners: &mut Corners,
    losses: &mut Losses,
) -> Result<(), Error> {
    let malformed = |byte: usize, problem: String| Err(Error::malformed(path, Place::Byte(byte as u64), problem));
    let Some(n) = announced(bytes) else {
        let n = bytes.len();
        return malformed(0, format!("{n} bytes are neither text (\"solid ...\") nor the 84 of a binary STL header"));
    };
    let body = &bytes[HEADER + 4..];
    let (records, rest) = body.as_chunks::<RECORD>();
    if n > records.len() as u64 {
        let problem = format!("{n} triangles take {} bytes, but {} follow: the file is truncated", n * 50, body.len());
        return malformed(HEADER, problem);
    }
    // `n` is no larger than the number of records.
    let (records, more) = records.split_at(n as usize);
    let n_more = more.len() * RECORD + rest.len();
    losses.note(n_more, "byte behind the last triangle", "bytes behind the last triangle");
    corners.reserve(records.len());
    let mut n_attributes = 0;
    for (triangle, record) in records.iter().enumerate() {
        let mut vectors = [[0.0; 3]; 4];
        for (index, (number, bytes)) in vectors.as_flattened_mut().iter_mut().zip(record.as_chunks::<4>().0).enumerate()
        {
            *number = f64::from(f32::from_le_bytes(*bytes));
            if index >= 3 && !number.is_finite() && options.non_finite == NonFinite::Refuse {
                let problem =
                    format!("a coordinate of triangle {triangle} is {number}; a finite number is expected: {REMEDY}");
                return malformed(HEADER + 4 + triangle * RECORD + 4 * index, problem);
            }
        }
        n_attributes += usize::from(record[48..] != [0, 0]);
        let [normal, a, b, c] = vectors;
        corners.push([a, b, c], normal);
    }
    let (one, several) = ("attribute of a triangle (colour)", "attributes of triangles (colours)");
    losses.note(n_attributes, one, several);
    Ok(())
}
