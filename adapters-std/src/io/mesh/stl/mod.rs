//! STL (stereolithography): loose triangles, text or binary, told apart by content and not by the word "solid".
//!
//! The format has no shared vertices. Corners at equal coordinates become one vertex, in the order in which they first
//! appear, so that a mesh written and read again has its vertices back in that order. Facet normals follow from the
//! corners; those that contradict them are noted, and so are the attribute bytes in which some programs keep colours.

mod binary;
mod corners;
mod text;
mod write;

use std::path::Path;

use self::corners::Corners;
use super::losses::Losses;
use super::{MeshFile, ReadOptions, check_n_vertices};
use crate::io::text::{begins_as_utf_16, check_is_text, without_byte_order_mark, words};
use crate::{Error, Place};

pub use self::write::format;

/// The bytes in front of the number of triangles of a binary file.
const HEADER: usize = 80;
/// The bytes of a triangle of a binary file: normal, three corners, attribute.
const RECORD: usize = 50;

/// The mesh in the bytes of an STL file; `path` is for the messages.
///
/// # Errors
/// [`Error::Malformed`] with the line of a text, the byte of a binary file.
pub fn parse(bytes: &[u8], path: &Path, options: &ReadOptions) -> Result<MeshFile, Error> {
    let mut losses = Losses::default();
    let mut corners = Corners::default();
    let end = if is_text(bytes) {
        check_is_text(bytes, path)?;
        Place::Line(text::read(without_byte_order_mark(bytes), path, options, &mut corners, &mut losses)?)
    } else {
        binary::read(bytes, path, options, &mut corners, &mut losses)?;
        Place::Byte(HEADER as u64)
    };
    let mesh = corners.into_mesh(&mut losses);
    check_n_vertices(mesh.positions.len(), path, || end)?;
    Ok(MeshFile { left_out: losses.into_clauses(), ..mesh.into() })
}

/// Whether the file is text: it begins with "solid", or as UTF-16 does, which is then refused, and is not as long as a
/// binary file of its number of triangles.
fn is_text(bytes: &[u8]) -> bool {
    let announced = binary::announced(bytes).map(|n| (HEADER + 4) as u64 + n * RECORD as u64);
    let begins = without_byte_order_mark(&bytes[..bytes.len().min(HEADER)]);
    let is_solid = words(begins).next().is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    (is_solid || begins_as_utf_16(bytes)) && announced != Some(bytes.len() as u64)
}

#[cfg(test)]
mod tests;
