//! The lines of an OBJ file one after the other, and the mesh that they give in the end.

use std::path::Path;

use super::super::coordinates::{Coordinates, WrittenColours};
use super::super::losses::Losses;
use super::super::range::IndexRange;
use super::super::{MeshFile, ReadOptions, check_n_vertices, push_fan};
use super::normals::CornerNormals;
use super::passed_over::PassedOver;
use crate::io::text::{Words, integer, shown, without_comment, words};
use crate::mesh::Mesh;
use crate::{Error, Place};

/// What the lines so far have given.
pub(super) struct Records<'a> {
    path: &'a Path,
    coordinates: Coordinates<'a>,
    mesh: Mesh,
    colours: WrittenColours,
    /// Opacities that are not 1, and that are not 255.
    opacities: [usize; 2],
    /// Weights of vertices that are not 1.
    n_weights: usize,
    normals: CornerNormals,
    vertex_range: IndexRange,
    normal_range: IndexRange,
    polygon: Vec<u32>,
    n_divided: usize,
    passed_over: PassedOver,
}

impl<'a> Records<'a> {
    pub(super) fn new(path: &'a Path, options: &ReadOptions) -> Self {
        Records {
            path,
            coordinates: Coordinates::new(path, options),
            mesh: Mesh::default(),
            colours: WrittenColours::default(),
            opacities: [0; 2],
            n_weights: 0,
            normals: CornerNormals::default(),
            vertex_range: IndexRange::default(),
            normal_range: IndexRange::default(),
            polygon: Vec::new(),
            n_divided: 0,
            passed_over: PassedOver::default(),
        }
    }

    /// Takes one line, with those that continue it.
    pub(super) fn take(&mut self, text: &[u8], line: usize) -> Result<(), Error> {
        let mut words = words(without_comment(text));
        match words.next() {
            Some(b"v") => self.take_vertex(words, line),
            Some(b"vn") => {
                self.normals.normals.push(self.coordinates.vector(&mut words, "normal", line)?);
                Ok(())
            }
            Some(b"f") => self.take_face(words, line),
            Some(other) => {
                self.passed_over.count(other);
                Ok(())
            }
            None => Ok(()),
        }
    }

    fn take_vertex(&mut self, mut words: Words<'_>, line: usize) -> Result<(), Error> {
        self.mesh.positions.push(self.coordinates.vector(&mut words, "vertex", line)?);
        let rest = words.clone();
        match words.count() {
            0 => Ok(()),
            1 => {
                self.n_weights += usize::from(!rest.clone().all(is_one));
                Ok(())
            }
            3 | 4 => self.take_colour(rest, line),
            n => {
                let problem = format!("a vertex of {} numbers; 3, 4 or 6 are expected: x y z [w], x y z r g b", n + 3);
                Err(self.malformed(line, problem))
            }
        }
    }

    /// Red, green, blue and perhaps opacity.
    fn take_colour(&mut self, mut words: Words<'_>, line: usize) -> Result<(), Error> {
        let strict = Coordinates::new(self.path, &ReadOptions::default());
        self.colours.push(strict.vector(&mut words, "colour of the vertex", line)?, line);
        if let Some(opacity) = words.next() {
            self.opacities[0] += usize::from(!is_one(opacity));
            self.opacities[1] += usize::from(integer::<u8>(opacity) != Some(255));
        }
        Ok(())
    }

    fn take_face(&mut self, words: Words<'_>, line: usize) -> Result<(), Error> {
        self.polygon.clear();
        for word in words {
            let mut parts = word.split(|&byte| byte == b'/');
            let vertex = self.index(parts.next(), self.mesh.positions.len(), "vertex", word, line)?;
            let texture = parts.next().filter(|part| !part.is_empty());
            if texture.is_some_and(|part| integer::<i64>(part).is_none()) {
                return Err(self.corner(word, line));
            }
            let normal = match parts.next() {
                None => None,
                part => Some(self.index(part, self.normals.normals.len(), "normal", word, line)?),
            };
            if parts.next().is_some() {
                return Err(self.corner(word, line));
            }
            self.vertex_range.include(u64::from(vertex), Place::Line(line));
            if let Some(normal) = normal {
                self.normal_range.include(u64::from(normal), Place::Line(line));
            }
            self.normals.note(vertex, normal);
            self.polygon.push(vertex);
        }
        if self.polygon.len() < 3 {
            let problem = format!("a face of {} corners; at least 3 are expected", self.polygon.len());
            return Err(self.malformed(line, problem));
        }
        self.n_divided += usize::from(self.polygon.len() > 3);
        push_fan(&mut self.mesh.faces, &self.polygon);
        Ok(())
    }

    /// The index, counted from 0, that a part of a face's corner names when `n` elements have been read.
    fn index(&self, part: Option<&[u8]>, n: usize, what: &str, word: &[u8], line: usize) -> Result<u32, Error> {
        let written: i64 = part.and_then(integer).ok_or_else(|| self.corner(word, line))?;
        let index = match written {
            1.. => written - 1,
            0 => return Err(self.malformed(line, format!("{:?} names {what} 0; indices count from 1", shown(word)))),
            _ => n as i64 + written,
        };
        // Four thousand million vertices need a file of more than 28 GB, so no real index is refused here.
        u32::try_from(index).map_err(|_| {
            let problem = format!("{:?} names {what} {written}, but {n} precede it in the file", shown(word));
            self.malformed(line, problem)
        })
    }

    /// The content; `last` is the last line of the file.
    pub(super) fn into_file(mut self, last: usize) -> Result<MeshFile, Error> {
        let n_vertices = self.mesh.positions.len();
        check_n_vertices(n_vertices, self.path, || Place::Line(last))?;
        self.vertex_range.check(n_vertices, "vertex", 1, self.path)?;
        self.normal_range.check(self.normals.normals.len(), "normal", 1, self.path)?;
        let mut losses = Losses::default();
        self.mesh.normals = self.normals.of_vertices(n_vertices, &mut losses);
        if self.colours.len() == n_vertices {
            let to_one = self.colours.largest() <= 1.0;
            self.mesh.colours = self.colours.bytes(if to_one { 1.0 } else { 255.0 }, self.path, &mut losses)?;
            losses.note(self.opacities[usize::from(!to_one)], "opacity of a vertex", "opacities of vertices");
        } else {
            losses.note(self.colours.len(), "colour (not every vertex has one)", "colours (not every vertex has one)");
        }
        losses.note(self.n_weights, "weight of a vertex other than 1", "weights of vertices other than 1");
        losses.note_divided(self.n_divided);
        self.passed_over.note(&mut losses);
        Ok(MeshFile { left_out: losses.into_clauses(), ..self.mesh.into() })
    }

    fn corner(&self, word: &[u8], line: usize) -> Error {
        let problem = format!("{:?} is no corner of a face; v, v/vt, v//vn or v/vt/vn is expected", shown(word));
        self.malformed(line, problem)
    }

    fn malformed(&self, line: usize, problem: String) -> Error {
        Error::malformed(self.path, Place::Line(line), problem)
    }
}

/// Whether the word is the number 1, as the weight or opacity of most vertices is.
fn is_one(word: &[u8]) -> bool {
    crate::io::text::real(word) == Some(1.0)
}
