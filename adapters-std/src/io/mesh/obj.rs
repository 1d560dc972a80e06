//! Wavefront OBJ: vertices, vertex colours, normals and polygons of the text format.
//!
//! Groups, materials, texture coordinates, lines and free-form surfaces are passed over. `v x y z [w]` and
//! `v x y z r g b` are read; colours run to 1, or to 255 when any of the file is above 1. A backslash continues a line.

use std::io::Write;
use std::path::Path;

use super::range::IndexRange;
use super::{check_n_vertices, colour_byte, push_fan};
use crate::io::text::{integer, push_real, push_vector, shown, vector, without_byte_order_mark};
use crate::mesh::Mesh;
use crate::{Error, Place};

/// The mesh in the bytes of an OBJ file; `path` is for the messages.
///
/// Vertices keep their order and number. Normals are kept when the faces give every vertex exactly one (or, without
/// faces, when there is one `vn` per `v`), colours when every vertex has one.
///
/// # Errors
/// [`Error::Malformed`] with the line.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, Error> {
    let mut file = Records::new(path);
    let bytes = without_byte_order_mark(bytes);
    let mut start = 0;
    let mut line = 1;
    while start < bytes.len() {
        let (end, n_lines) = logical_line(bytes, start);
        file.take(&bytes[start..end], line)?;
        start = end;
        line += n_lines;
    }
    file.into_mesh()
}

/// Where the line that starts at `start` ends, behind its line feed, with the lines that a backslash joins to it,
/// and how many lines of the file that is. A comment is never continued: it may end in the backslash of a path.
fn logical_line(bytes: &[u8], start: usize) -> (usize, usize) {
    let mut end = start;
    let mut n_lines = 0;
    loop {
        let length = bytes[end..].iter().position(|&byte| byte == b'\n');
        let line = &bytes[end..length.map_or(bytes.len(), |length| end + length)];
        end += length.map_or(line.len(), |length| length + 1);
        n_lines += 1;
        if end >= bytes.len() || line.contains(&b'#') || !line.strip_suffix(b"\r").unwrap_or(line).ends_with(b"\\") {
            return (end, n_lines);
        }
    }
}

/// What the lines so far have given.
struct Records<'a> {
    path: &'a Path,
    mesh: Mesh,
    /// Colours as written, with the line of each.
    colours: Vec<([f64; 3], usize)>,
    normals: Vec<[f64; 3]>,
    /// The normal, counted from 0, that the faces give each vertex.
    normal_of: Vec<Option<u32>>,
    /// Some corner had no normal, or another than its vertex had before.
    normals_disagree: bool,
    vertex_range: IndexRange,
    normal_range: IndexRange,
    polygon: Vec<u32>,
}

impl<'a> Records<'a> {
    fn new(path: &'a Path) -> Self {
        Records {
            path,
            mesh: Mesh::default(),
            colours: Vec::new(),
            normals: Vec::new(),
            normal_of: Vec::new(),
            normals_disagree: false,
            vertex_range: IndexRange::default(),
            normal_range: IndexRange::default(),
            polygon: Vec::new(),
        }
    }

    fn take(&mut self, text: &[u8], line: usize) -> Result<(), Error> {
        let text = text.split(|&byte| byte == b'#').next().unwrap_or_default();
        // The backslashes of continued lines stand alone between white space or end a word.
        let mut words = text.split(|byte| byte.is_ascii_whitespace() || *byte == b'\\').filter(|word| !word.is_empty());
        match words.next() {
            Some(b"v") => self.take_vertex(&mut words, line),
            Some(b"vn") => {
                self.normals.push(vector(&mut words, "normal", self.path, line)?);
                Ok(())
            }
            Some(b"f") => self.take_face(&mut words, line),
            _ => Ok(()),
        }
    }

    fn take_vertex<'w>(&mut self, words: &mut impl Iterator<Item = &'w [u8]>, line: usize) -> Result<(), Error> {
        self.mesh.positions.push(vector(words, "vertex", self.path, line)?);
        let rest: Vec<&[u8]> = words.collect();
        match rest.len() {
            0 | 1 => Ok(()),
            3 | 4 => {
                // Four: red, green, blue and opacity.
                self.colours.push((vector(&mut rest.into_iter(), "colour of the vertex", self.path, line)?, line));
                Ok(())
            }
            n => {
                let problem = format!("a vertex of {} numbers; 3, 4 or 6 are expected: x y z [w], x y z r g b", n + 3);
                Err(self.malformed(line, problem))
            }
        }
    }

    fn take_face<'w>(&mut self, words: &mut impl Iterator<Item = &'w [u8]>, line: usize) -> Result<(), Error> {
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
                part => Some(self.index(part, self.normals.len(), "normal", word, line)?),
            };
            if parts.next().is_some() {
                return Err(self.corner(word, line));
            }
            self.vertex_range.include(u64::from(vertex), Place::Line(line));
            if let Some(normal) = normal {
                self.normal_range.include(u64::from(normal), Place::Line(line));
            }
            self.note_normal(vertex, normal);
            self.polygon.push(vertex);
        }
        if self.polygon.len() < 3 {
            let problem = format!("a face of {} corners; at least 3 are expected", self.polygon.len());
            return Err(self.malformed(line, problem));
        }
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

    fn note_normal(&mut self, vertex: u32, normal: Option<u32>) {
        let Some(normal) = normal else {
            self.normals_disagree = true;
            return;
        };
        // What comes later in the file is not known yet; faces that stand before their vertices lose the normals.
        if vertex as usize >= self.mesh.positions.len() || normal as usize >= self.normals.len() {
            self.normals_disagree = true;
            return;
        }
        self.normal_of.resize(self.mesh.positions.len(), None);
        let known = &mut self.normal_of[vertex as usize];
        let value = |index: u32| self.normals[index as usize];
        match *known {
            Some(before) if before != normal && value(before) != value(normal) => self.normals_disagree = true,
            Some(_) => {}
            None => *known = Some(normal),
        }
    }

    fn into_mesh(mut self) -> Result<Mesh, Error> {
        let n_vertices = self.mesh.positions.len();
        check_n_vertices(n_vertices, self.path)?;
        self.vertex_range.check(n_vertices, "vertex", 1, self.path)?;
        self.normal_range.check(self.normals.len(), "normal", 1, self.path)?;
        self.mesh.normals = self.vertex_normals().unwrap_or_default();
        if self.colours.len() == n_vertices {
            let unit = self.colours.iter().all(|(colour, _)| colour.iter().all(|&channel| channel <= 1.0));
            let one = if unit { 1.0 } else { 255.0 };
            for &(colour, line) in &self.colours {
                let [Some(red), Some(green), Some(blue)] = colour.map(|channel| colour_byte(channel, one)) else {
                    let problem = format!("a colour {colour:?}; channels lie in 0 to 1, or in 0 to 255");
                    return Err(self.malformed(line, problem));
                };
                self.mesh.colours.push([red, green, blue]);
            }
        }
        Ok(self.mesh)
    }

    /// One normal for each vertex, if that is what the file says.
    fn vertex_normals(&self) -> Option<Vec<[f64; 3]>> {
        let n_vertices = self.mesh.positions.len();
        if self.normals_disagree || self.normals.is_empty() {
            return None;
        }
        let in_order = |(vertex, normal): (usize, &Option<u32>)| normal.is_none_or(|normal| normal as usize == vertex);
        if self.normals.len() == n_vertices && self.normal_of.iter().enumerate().all(in_order) {
            return Some(self.normals.clone());
        }
        if self.normal_of.len() != n_vertices {
            return None;
        }
        self.normal_of.iter().map(|normal| self.normals.get((*normal)? as usize).copied()).collect()
    }

    fn corner(&self, word: &[u8], line: usize) -> Error {
        let problem = format!("{:?} is no corner of a face; v, v/vt, v//vn or v/vt/vn is expected", shown(word));
        self.malformed(line, problem)
    }

    fn malformed(&self, line: usize, problem: String) -> Error {
        Error::malformed(self.path, Place::Line(line), problem)
    }
}

/// The bytes of an OBJ file that reads back as the same mesh, which must pass [`Mesh::check`].
pub fn format(mesh: &Mesh) -> Vec<u8> {
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
    text
}

#[cfg(test)]
mod tests {
    use super::super::samples::{any_mesh, assail, meshes};
    use super::*;
    use proptest::prelude::*;

    fn mesh(text: &str) -> Mesh {
        parse(text.as_bytes(), Path::new("t.obj")).expect("an OBJ file")
    }

    fn error(text: &str) -> String {
        parse(text.as_bytes(), Path::new("t.obj")).expect_err("must be refused").to_string()
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn every_form_of_corner_and_polygon_is_read() {
        let tail = "vt 0 0\nvn 0 0 1\n";
        for face in [
            "f 1 2 3 4",
            "f 1/1 2/1 3/1 4/1",
            "f 1//1 2//1 3//1 4//1",
            "f 1/1/1 2/1/1 3/1/1 4/1/1",
            "f -4 -3 -2 -1",
            "f -4/-1/-1 -3/-1/-1 -2//-1 -1//-1",
            "f\t1  2 \\\n 3\\\r\n4",
        ] {
            let mesh = mesh(&format!("{SQUARE}{tail}{face}\n"));
            assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3]], "{face}");
            assert_eq!(
                mesh.normals.len(),
                if face.contains("-1/-1") || face.contains("/1/1") || face.contains("//1") { 4 } else { 0 }
            );
        }
    }

    #[test]
    fn what_is_not_geometry_is_passed_over() {
        let text = "# C:\\models\\\nmtllib a b.mtl\no head\ng a b\ns off\nusemtl skin\nv 0 0 0 1.0 # w\r\n\
                    v 1 0 0\r\nl 1 2\nv 0 1 0\nf 1 2 3";
        let mesh = mesh(text);
        assert_eq!((mesh.positions.len(), mesh.faces), (3, vec![[0, 1, 2]]));
    }

    #[test]
    fn unused_and_equal_vertices_stay() {
        let mesh = mesh("v 0 0 0\nv 0 0 0\nv 1 0 0\nv 9 9 9\nv 0 1 0\nf 5 3 2\n");
        assert_eq!((mesh.positions.len(), mesh.positions[3], mesh.faces), (5, [9.0; 3], vec![[4, 2, 1]]));
    }

    #[test]
    fn normals_need_to_be_one_per_vertex() {
        let normals = "vn 0 0 1\nvn 1 0 0\nvn 0 0 1\n";
        let of = |face: &str| mesh(&format!("{SQUARE}{normals}{face}")).normals;
        assert_eq!(of("f 1//2 2//1 3//1 4//1")[0], [1.0, 0.0, 0.0]);
        assert!(of("f 1//1 2//1 3//1\nf 1//2 3//1 4//1").is_empty(), "a crease");
        assert_eq!(of("f 1//1 2//1 3//1\nf 1//3 3//1 4//1").len(), 4, "the same normal written twice");
        assert!(of("f 1//1 2//1 3//1").is_empty(), "vertex 4 has none");
        assert!(of("f 1//1 2//1 3//1 4").is_empty(), "a corner has none");
        assert!(mesh("v 0 0 0\nvn 0 0 1\nv 1 0 0\nvn 0 1 0\n").normals.len() == 2, "a point cloud");
    }

    #[test]
    fn colours_run_to_one_or_to_255() {
        assert_eq!(mesh("v 0 0 0 1 0.5 0\nv 0 0 0 0 0 0.25").colours, [[255, 128, 0], [0, 0, 64]]);
        assert_eq!(mesh("v 0 0 0 255 128 0\nv 0 0 0 1 1 1").colours, [[255, 128, 0], [1, 1, 1]]);
        assert!(mesh("v 0 0 0 1 1 1\nv 0 0 0").colours.is_empty());
        assert!(error("v 0 0 0 1 1 -1").contains("line 1: a colour"));
    }

    #[test]
    fn errors_name_the_line_and_the_remedy() {
        for (text, message) in [
            ("", "t.obj: there is no vertex"),
            ("v 0 0 nan", "line 1: the vertex has \"nan\" where a finite number"),
            ("v 0 0", "line 1: the vertex ends before its z"),
            ("v 0 0 0 0 0", "line 1: a vertex of 5 numbers"),
            ("v 0 0 0\nv 1 \\\n 0 0\nv 0 1 0\n\nf 1 2 4", "line 6: a face names vertex 4, but the file has 3"),
            ("v 0 0 0\nf 1 1 0", "line 2: \"0\" names vertex 0; indices count from 1"),
            ("v 0 0 0\nf 1 1 -2", "line 2: \"-2\" names vertex -2, but 1 precede"),
            ("v 0 0 0\nf 1 1", "line 2: a face of 2 corners"),
            ("v 0 0 0\nf 1 1 x", "line 2: \"x\" is no corner"),
            ("v 0 0 0\nf 1 1 1/x", "line 2: \"1/x\" is no corner"),
            ("v 0 0 0\nf 1 1 1/1/1/1", "line 2: \"1/1/1/1\" is no corner"),
            ("v 0 0 0\nf 1//1 1//1 1//1", "line 2: a face names normal 1, but the file has 0"),
            ("v 0 0 0\nf 1 1 99999999999999999999", "is no corner"),
            ("v 0 0 0\nf 1 1 99999999999", "names vertex 99999999999"),
        ] {
            assert!(error(text).contains(message), "{text:?}: {}", error(text));
        }
    }

    #[test]
    fn hostile_bytes_are_refused_or_harmless() {
        for mesh in meshes() {
            assail(&format(&mesh), parse);
        }
        assail(b"o a\nv 0 0 0 1 1 1\nv 1 0 0 0 0 0\nv 0 1 0 1 0 1\nvn 0 0 1\nf 1/1/1 -2//1 \\\n3/2/1\n# e", parse);
    }

    proptest! {
        #[test]
        fn meshes_read_back(mesh in any_mesh()) {
            prop_assert_eq!(parse(&format(&mesh), Path::new("t.obj")).unwrap(), mesh);
        }
    }
}
