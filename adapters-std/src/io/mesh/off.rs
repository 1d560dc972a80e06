//! OFF (object file format of Geomview), text: `OFF`, `COFF` (vertex colours) and `NOFF` (vertex normals).
//!
//! Read by lines: keyword, counts of vertices, faces and edges (behind the keyword or on the next line), one line per
//! vertex, one per polygon. `#` starts a comment. Colours run to 255, or to 1 when the file writes them with a decimal
//! point and none is above 1. Polygon colours and texture coordinates are passed over.

use std::io::Write;
use std::path::Path;

use super::{check_n_vertices, colour_byte, push_fan};
use crate::io::text::{integer, numbered_lines, push_vector, shown, vector, without_byte_order_mark, words};
use crate::mesh::Mesh;
use crate::{Error, Place};

/// The mesh in the bytes of an OFF file; `path` is for the messages.
///
/// # Errors
/// [`Error::Malformed`] with the line.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, Error> {
    let mut lines = Lines { lines: numbered_lines(without_byte_order_mark(bytes)), path, last: 1 };
    let (header, n_vertices, n_faces) = header(&mut lines)?;
    check_n_vertices(n_vertices, path)?;
    // Whatever the header claims, each vertex takes six bytes and each face at least two.
    let mut mesh = Mesh::default();
    mesh.positions.reserve(n_vertices.min(bytes.len() / 6));
    mesh.faces.reserve(n_faces.min(bytes.len() / 2));
    let mut colours = Vec::new();
    for vertex in 0..n_vertices {
        let (line, text) = lines.wanted(|| format!("vertex {vertex} of the {n_vertices} that its header announces"))?;
        let mut words = words(text);
        mesh.positions.push(vector(&mut words, "vertex", path, line)?);
        if header.normals {
            mesh.normals.push(vector(&mut words, "normal of the vertex", path, line)?);
        }
        if header.colours {
            let mut fraction = false;
            let mut noted = words.inspect(|word| fraction |= word.contains(&b'.'));
            let colour = vector(&mut noted, "colour of the vertex", path, line)?;
            drop(noted);
            colours.push(Colour { channels: colour, fraction, line });
        }
    }
    mesh.colours = colour_bytes(&colours, path)?;
    let mut polygon = Vec::new();
    for face in 0..n_faces {
        let (line, text) = lines.wanted(|| format!("face {face} of the {n_faces} that its header announces"))?;
        corners(text, n_vertices, path, line, &mut polygon)?;
        push_fan(&mut mesh.faces, &polygon);
    }
    if let Some((line, text)) = lines.next() {
        let problem = format!("{:?} follows the last face; does the header announce too few?", shown(text));
        return Err(Error::malformed(path, Place::Line(line), problem));
    }
    Ok(mesh)
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
            let text = text.split(|&byte| byte == b'#').next().unwrap_or_default().trim_ascii();
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

struct Header {
    normals: bool,
    colours: bool,
}

fn header<'a>(lines: &mut Lines<'a, impl Iterator<Item = (usize, &'a [u8])>>) -> Result<(Header, usize, usize), Error> {
    let path = lines.path;
    let (mut line, text) = lines.wanted(|| "its keyword OFF".into())?;
    let malformed = |line, problem: String| Error::malformed(path, Place::Line(line), problem);
    let keyword_length = text.iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
    let (keyword, mut counts) = text.split_at(keyword_length);
    let (normals, colours) = match keyword {
        b"OFF" => (false, false),
        b"COFF" => (false, true),
        b"NOFF" => (true, false),
        // The letters stand in the order of the fields reversed: positions, normals, colours.
        b"CNOFF" => (true, true),
        _ => {
            let problem = format!("{:?} where OFF, COFF, NOFF or CNOFF is expected", shown(text));
            return Err(malformed(line, problem));
        }
    };
    if counts.trim_ascii() == b"BINARY" {
        return Err(malformed(line, "binary OFF is not read: save it as text OFF or as PLY".into()));
    }
    if counts.is_empty() {
        (line, counts) = lines.wanted(|| "its counts of vertices, faces and edges".into())?;
    }
    let mut numbers = words(counts).map(integer::<usize>);
    match (numbers.next(), numbers.next()) {
        (Some(Some(n_vertices)), Some(Some(n_faces))) => Ok((Header { normals, colours }, n_vertices, n_faces)),
        _ => {
            let problem = format!("{:?} where the counts of vertices, faces and edges are expected", shown(counts));
            Err(malformed(line, problem))
        }
    }
}

fn corners(text: &[u8], n_vertices: usize, path: &Path, line: usize, polygon: &mut Vec<u32>) -> Result<(), Error> {
    let malformed = |problem| Error::malformed(path, Place::Line(line), problem);
    let mut words = words(text);
    let count = words.next().unwrap_or_default();
    let n = integer::<usize>(count).filter(|&n| n >= 3).ok_or_else(|| {
        malformed(format!("{:?} where a face's number of corners, at least 3, is expected", shown(count)))
    })?;
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
    Ok(())
}

struct Colour {
    channels: [f64; 3],
    fraction: bool,
    line: usize,
}

fn colour_bytes(colours: &[Colour], path: &Path) -> Result<Vec<[u8; 3]>, Error> {
    let fraction = colours.iter().any(|colour| colour.fraction);
    let small = colours.iter().all(|colour| colour.channels.iter().all(|&channel| channel <= 1.0));
    let one = if fraction && small { 1.0 } else { 255.0 };
    let bytes = |colour: &Colour| match colour.channels.map(|channel| colour_byte(channel, one)) {
        [Some(red), Some(green), Some(blue)] => Ok([red, green, blue]),
        _ => {
            let problem = format!("a colour {:?}; channels lie in 0 to 255, or in 0 to 1", colour.channels);
            Err(Error::malformed(path, Place::Line(colour.line), problem))
        }
    };
    colours.iter().map(bytes).collect()
}

/// The bytes of an OFF file that reads back as the same mesh, which must pass [`Mesh::check`].
pub fn format(mesh: &Mesh) -> Vec<u8> {
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
    text
}

#[cfg(test)]
mod tests {
    use super::super::samples::{any_mesh, assail, meshes};
    use super::*;
    use proptest::prelude::*;

    fn mesh(text: &str) -> Mesh {
        parse(text.as_bytes(), Path::new("t.off")).expect("an OFF file")
    }

    fn error(text: &str) -> String {
        parse(text.as_bytes(), Path::new("t.off")).expect_err("must be refused").to_string()
    }

    #[test]
    fn counts_stand_behind_the_keyword_or_below() {
        let body = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
        for head in ["OFF\n4 1 0\n", "OFF 4 1 0\n", "OFF4 1 0\n", "# c\r\n\r\nOFF # c\r\n# c\r\n4 1\r\n"] {
            let mesh = mesh(&format!("{head}{body}"));
            assert_eq!((mesh.positions.len(), mesh.faces), (4, vec![[0, 1, 2], [0, 2, 3]]), "{head}");
        }
    }

    #[test]
    fn colours_are_bytes_or_fractions() {
        assert_eq!(mesh("COFF\n2 0 0\n0 0 0 255 1 0 255\n0 0 0 1 1 1 255").colours, [[255, 1, 0], [1, 1, 1]]);
        assert_eq!(mesh("COFF\n2 0 0\n0 0 0 1 0 0\n0 0 0 0.5 1 1 1").colours, [[255, 0, 0], [128, 255, 255]]);
        let mesh = mesh("CNOFF\n1 0 0\n0 0 0 0 0 1 9 8 7 255");
        assert_eq!((mesh.normals, mesh.colours), (vec![[0.0, 0.0, 1.0]], vec![[9, 8, 7]]));
    }

    #[test]
    fn colours_of_faces_are_passed_over() {
        assert_eq!(mesh("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 0.5 0.5 0.5\n").faces, [[0, 1, 2]]);
    }

    #[test]
    fn errors_name_the_line_and_the_remedy() {
        for (text, message) in [
            ("", "line 1: the file ends before its keyword OFF"),
            ("4 1 0", "line 1: \"4 1 0\" where OFF, COFF"),
            ("OFF BINARY\n", "save it as text OFF"),
            ("OFF\nx", "line 2: \"x\" where the counts"),
            ("OFF 0 0 0", "there is no vertex"),
            ("OFF 2 0 0\n0 0 0\n", "ends before vertex 1 of the 2"),
            ("OFF 4294967295 0 0\n0 0 0\n", "ends before vertex 1 of the 4294967295"),
            ("OFF 99999999999999999 0 0\n0 0 0\n", "it has 99999999999999999 vertices; at most"),
            ("OFF 1 0 0\n0 0 inf", "line 2: the vertex has \"inf\""),
            ("OFF 1 1 0\n0 0 0\n3 0 0 1", "line 3: a face names vertex 1; 0 to 0 are expected"),
            ("OFF 1 1 0\n0 0 0\n3 0 -1 0", "line 3: a face names vertex -1"),
            ("OFF 1 1 0\n0 0 0\n2 0 0", "at least 3"),
            ("OFF 1 1 0\n0 0 0\n4 0 0 0", "a face of 4 corners has only 3"),
            ("OFF 1 0 0\n0 0 0\n3 0 0 0", "line 3: \"3 0 0 0\" follows the last face"),
            ("COFF 1 0 0\n0 0 0 256 0 0", "line 2: a colour"),
        ] {
            assert!(error(text).contains(message), "{text:?}: {}", error(text));
        }
    }

    #[test]
    fn hostile_bytes_are_refused_or_harmless() {
        for mesh in meshes() {
            assail(&format(&mesh), parse);
        }
    }

    proptest! {
        #[test]
        fn meshes_read_back(mesh in any_mesh()) {
            prop_assert_eq!(parse(&format(&mesh), Path::new("t.off")).unwrap(), mesh);
        }
    }
}
