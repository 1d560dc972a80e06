//! OFF (object file format of Geomview), text, with vertex normals (`N`), colours (`C`) and texture coordinates (`ST`).
//!
//! Read by lines: keyword, counts of vertices, faces and edges (behind the keyword or on the next line), one line per
//! vertex, one per polygon. `#` starts a comment. Colours run to 255, or to 1 when the file writes them with a decimal
//! point and none is above 1. Texture coordinates, colours of polygons and polygons of one or two corners are counted
//! and left out. `4OFF`, `nOFF` and binary files are refused.

mod header;

use std::io::Write;
use std::path::Path;

use self::header::{Fields, Header, header};
use super::coordinates::{Coordinates, WrittenColours};
use super::losses::Losses;
use super::{Formatted, MeshFile, ReadOptions, WriteOptions, check_n_vertices, push_fan};
use crate::io::text::{
    Words, check_is_text, integer, numbered_lines, push_vector, real, shown, without_byte_order_mark, without_comment,
    words,
};
use crate::mesh::Mesh;
use crate::{Error, Place};

/// The content of the bytes of an OFF file; `path` is for the messages.
///
/// # Errors
/// [`Error::Malformed`] with the line.
pub fn parse(bytes: &[u8], path: &Path, options: &ReadOptions) -> Result<MeshFile, Error> {
    check_is_text(bytes, path)?;
    let mut lines = Lines { lines: numbered_lines(without_byte_order_mark(bytes)), path, last: 1 };
    let Header { fields, n_vertices, n_faces, line } = header(&mut lines)?;
    check_n_vertices(n_vertices, path, || Place::Line(line))?;
    let mut vertices = Vertices::new(path, options, fields);
    // Whatever the header claims, each vertex takes six bytes and each face at least two.
    vertices.mesh.positions.reserve(n_vertices.min(bytes.len() / 6));
    for vertex in 0..n_vertices {
        let (line, text) = lines.wanted(|| format!("vertex {vertex} of the {n_vertices} that its header announces"))?;
        vertices.take(words(text), line)?;
    }
    let mut losses = Losses::default();
    let mut mesh = vertices.into_mesh(&mut losses)?;
    mesh.faces.reserve(n_faces.min(bytes.len() / 2));
    let mut polygon = Vec::new();
    let (mut n_divided, mut n_small, mut n_coloured) = (0, 0, 0);
    for face in 0..n_faces {
        let (line, text) = lines.wanted(|| format!("face {face} of the {n_faces} that its header announces"))?;
        n_coloured += usize::from(corners(text, n_vertices, path, line, &mut polygon)?);
        n_divided += usize::from(polygon.len() > 3);
        n_small += usize::from(polygon.len() < 3);
        push_fan(&mut mesh.faces, &polygon);
    }
    if let Some((line, text)) = lines.next() {
        let problem = format!("{:?} follows the last face; does the header announce too few?", shown(text));
        return Err(Error::malformed(path, Place::Line(line), problem));
    }
    losses.note_divided(n_divided);
    losses.note_small(n_small);
    losses.note(n_coloured, "colour of a face", "colours of faces");
    Ok(MeshFile { left_out: losses.into_clauses(), ..mesh.into() })
}

/// The lines that hold something, without their comments.
struct Lines<'a, I> {
    lines: I,
    path: &'a Path,
    last: usize,
}

impl<'a, I: Iterator<Item = (usize, &'a [u8])>> Lines<'a, I> {
    fn next(&mut self) -> Option<(usize, &'a [u8])> {
        for (line, text) in self.lines.by_ref() {
            self.last = line;
            let text = without_comment(text).trim_ascii();
            if !text.is_empty() {
                return Some((line, text));
            }
        }
        None
    }

    fn wanted(&mut self, what: impl FnOnce() -> String) -> Result<(usize, &'a [u8]), Error> {
        match self.next() {
            Some(found) => Ok(found),
            None => {
                let problem = format!("the file ends before {}: it is truncated, or the counts are wrong", what());
                Err(Error::malformed(self.path, Place::Line(self.last), problem))
            }
        }
    }
}

/// The lines of the vertices so far.
struct Vertices<'a> {
    path: &'a Path,
    coordinates: Coordinates<'a>,
    fields: Fields,
    mesh: Mesh,
    colours: WrittenColours,
    /// Some colour is written with a decimal point.
    has_fractions: bool,
    /// Opacities that are not 1, and that are not 255.
    opacities: [usize; 2],
    /// Vertices with more numbers than the keyword announces.
    n_long: usize,
}

impl<'a> Vertices<'a> {
    fn new(path: &'a Path, options: &ReadOptions, fields: Fields) -> Self {
        Vertices {
            path,
            coordinates: Coordinates::new(path, options),
            fields,
            mesh: Mesh::default(),
            colours: WrittenColours::default(),
            has_fractions: false,
            opacities: [0; 2],
            n_long: 0,
        }
    }

    fn take(&mut self, mut words: Words<'_>, line: usize) -> Result<(), Error> {
        self.mesh.positions.push(self.coordinates.vector(&mut words, "vertex", line)?);
        if self.fields.normals {
            self.mesh.normals.push(self.coordinates.vector(&mut words, "normal of the vertex", line)?);
        }
        if self.fields.colours {
            self.take_colour(&mut words, line)?;
        }
        if self.fields.texture {
            for axis in ["u", "v"] {
                words.next().filter(|word| real(word).is_some()).ok_or_else(|| {
                    let problem = format!("the texture coordinates of the vertex have no number {axis}");
                    Error::malformed(self.path, Place::Line(line), problem)
                })?;
            }
        }
        self.n_long += usize::from(words.next().is_some());
        Ok(())
    }

    /// Red, green, blue and perhaps opacity: texture coordinates that follow are always two.
    fn take_colour(&mut self, words: &mut Words<'_>, line: usize) -> Result<(), Error> {
        self.has_fractions |= words.clone().take(3).any(|word| word.contains(&b'.'));
        let strict = Coordinates::new(self.path, &ReadOptions::default());
        self.colours.push(strict.vector(words, "colour of the vertex", line)?, line);
        let n_behind = if self.fields.texture { 2 } else { 0 };
        if words.clone().count() > n_behind {
            let opacity = words.next().and_then(real);
            self.opacities[0] += usize::from(opacity != Some(1.0));
            self.opacities[1] += usize::from(opacity != Some(255.0));
        }
        Ok(())
    }

    fn into_mesh(mut self, losses: &mut Losses) -> Result<Mesh, Error> {
        let to_one = self.has_fractions && self.colours.largest() <= 1.0;
        self.mesh.colours = self.colours.bytes(if to_one { 1.0 } else { 255.0 }, self.path, losses)?;
        losses.note(self.opacities[usize::from(!to_one)], "opacity of a vertex", "opacities of vertices");
        if self.fields.texture {
            losses.note(self.mesh.positions.len(), "texture coordinate", "texture coordinates");
        }
        losses.note(self.n_long, "vertex's further numbers", "vertices' further numbers");
        Ok(self.mesh)
    }
}

/// Reads the corners of a face; returns whether anything, its colour, stands behind them.
fn corners(text: &[u8], n_vertices: usize, path: &Path, line: usize, polygon: &mut Vec<u32>) -> Result<bool, Error> {
    let malformed = |problem| Error::malformed(path, Place::Line(line), problem);
    let mut words = words(text);
    let count = words.next().unwrap_or_default();
    let n = integer::<usize>(count)
        .ok_or_else(|| malformed(format!("{:?} where a face's number of corners is expected", shown(count))))?;
    polygon.clear();
    for corner in 0..n {
        let Some(word) = words.next() else {
            return Err(malformed(format!("a face of {n} corners has only {corner} vertices")));
        };
        match integer::<u32>(word).filter(|&vertex| (vertex as usize) < n_vertices) {
            Some(vertex) => polygon.push(vertex),
            None => {
                let problem = format!("a face names vertex {}; 0 to {} are expected", shown(word), n_vertices - 1);
                return Err(malformed(problem));
            }
        }
    }
    Ok(words.next().is_some())
}

/// The bytes of an OFF file that reads back as the same mesh, which must pass [`Mesh::check`].
///
/// # Errors
/// None: what OFF cannot hold is left out and named.
pub fn format(file: &MeshFile, _: &WriteOptions) -> Result<Formatted, String> {
    let mesh = &file.mesh;
    let mut text = Vec::with_capacity(64 * mesh.positions.len() + 24 * mesh.faces.len());
    if !mesh.colours.is_empty() {
        text.push(b'C');
    }
    if !mesh.normals.is_empty() {
        text.push(b'N');
    }
    let counts = writeln!(text, "OFF\n{} {} 0", mesh.positions.len(), mesh.faces.len());
    debug_assert!(counts.is_ok(), "a vector takes every byte");
    for (vertex, position) in mesh.positions.iter().enumerate() {
        push_vector(&mut text, position);
        if let Some(normal) = mesh.normals.get(vertex) {
            text.push(b' ');
            push_vector(&mut text, normal);
        }
        if let Some([red, green, blue]) = mesh.colours.get(vertex) {
            let colour = write!(text, " {red} {green} {blue} 255");
            debug_assert!(colour.is_ok(), "a vector takes every byte");
        }
        text.push(b'\n');
    }
    for [a, b, c] in &mesh.faces {
        let face = writeln!(text, "3 {a} {b} {c}");
        debug_assert!(face.is_ok(), "a vector takes every byte");
    }
    let mut losses = Losses::default();
    losses.note_attributes(mesh);
    losses.note_beyond_mesh(file);
    Ok(losses.formatted(text))
}

#[cfg(test)]
mod tests;
