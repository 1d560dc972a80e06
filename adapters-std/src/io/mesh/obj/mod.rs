//! Wavefront OBJ: vertices, vertex colours, normals and polygons of the text format.
//!
//! `v x y z [w]` and `v x y z r g b [a]` are read; colours run to 1, or to 255 when any of the file is above 1. Indices
//! may be negative, polygons become fans, a backslash continues a line. Texture coordinates, groups, materials, lines
//! and free-form surfaces are counted and left out.

mod normals;
mod passed_over;
mod records;

use std::io::Write;
use std::path::Path;

use self::records::Records;
use super::losses::Losses;
use super::{Formatted, MeshFile, ReadOptions, WriteOptions};
use crate::Error;
use crate::io::text::{check_is_text, numbered_lines, push_real, push_vector, without_byte_order_mark};

/// The content of the bytes of an OBJ file; `path` is for the messages.
///
/// Vertices keep their order and number. Normals are kept when the faces give every vertex exactly one (or, without
/// faces, when there is one `vn` per `v`), colours when every vertex has one.
///
/// # Errors
/// [`Error::Malformed`] with the line.
pub fn parse(bytes: &[u8], path: &Path, options: &ReadOptions) -> Result<MeshFile, Error> {
    check_is_text(bytes, path)?;
    let mut records = Records::new(path, options);
    let mut last = 1;
    let mut lines = numbered_lines(without_byte_order_mark(bytes)).inspect(|(line, _)| last = *line);
    let mut joined = Vec::new();
    while let Some((line, text)) = lines.next() {
        if !is_continued(text) {
            records.take(text, line)?;
            continue;
        }
        joined.clear();
        let mut text = text;
        while is_continued(text) {
            joined.extend_from_slice(&text[..text.len() - 1]);
            joined.push(b' ');
            text = lines.next().map_or(b"", |(_, text)| text);
        }
        joined.extend_from_slice(text);
        records.take(&joined, line)?;
    }
    records.into_file(last)
}

/// Whether the next line belongs to this one. A comment is never continued: it may end in the backslash of a path.
fn is_continued(line: &[u8]) -> bool {
    line.ends_with(b"\\") && !line.contains(&b'#')
}

/// The bytes of an OBJ file that reads back as the same mesh, which must pass [`crate::mesh::Mesh::check`].
///
/// # Errors
/// None: what OBJ cannot hold is left out and named.
pub fn format(file: &MeshFile, _: &WriteOptions) -> Result<Formatted, String> {
    let mesh = &file.mesh;
    let mut text = Vec::with_capacity(64 * mesh.positions.len() + 24 * mesh.faces.len());
    for (vertex, position) in mesh.positions.iter().enumerate() {
        text.extend_from_slice(b"v ");
        push_vector(&mut text, position);
        for &channel in mesh.colours.get(vertex).into_iter().flatten() {
            text.push(b' ');
            push_real(&mut text, f64::from(channel) / 255.0);
        }
        text.push(b'\n');
    }
    for normal in &mesh.normals {
        text.extend_from_slice(b"vn ");
        push_vector(&mut text, normal);
        text.push(b'\n');
    }
    for face in &mesh.faces {
        text.push(b'f');
        for corner in face.map(|vertex| u64::from(vertex) + 1) {
            let written = match mesh.normals.is_empty() {
                true => write!(text, " {corner}"),
                false => write!(text, " {corner}//{corner}"),
            };
            debug_assert!(written.is_ok(), "a vector takes every byte");
        }
        text.push(b'\n');
    }
    let mut losses = Losses::default();
    losses.note_attributes(mesh);
    losses.note_beyond_mesh(file);
    Ok(losses.formatted(text))
}

#[cfg(test)]
mod tests;
