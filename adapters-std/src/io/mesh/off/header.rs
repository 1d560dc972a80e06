//! The keyword and the counts at the beginning of an OFF file.

use super::Lines;
use crate::io::text::{integer, shown, words};
use crate::{Error, Place};

/// What the lines of the vertices hold beside positions, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fields {
    pub normals: bool,
    pub colours: bool,
    pub texture: bool,
}

/// What the header says.
pub(super) struct Header {
    pub fields: Fields,
    pub n_vertices: usize,
    pub n_faces: usize,
    /// The line of the numbers.
    pub line: usize,
}

/// Reads the header.
pub(super) fn header<'a>(lines: &mut Lines<'a, impl Iterator<Item = (usize, &'a [u8])>>) -> Result<Header, Error> {
    let path = lines.path;
    let (mut line, text) = lines.wanted(|| "its keyword OFF".into())?;
    let malformed = |line, problem: String| Error::malformed(path, Place::Line(line), problem);
    // The letters stand in an order of their own, not in that of the numbers.
    let mut rest = text;
    let mut has = |letters: &[u8]| {
        let behind = rest.strip_prefix(letters);
        rest = behind.unwrap_or(rest);
        behind.is_some()
    };
    let fields = Fields { texture: has(b"ST"), colours: has(b"C"), normals: has(b"N") };
    let (homogeneous, any_dimension, is_off) = (has(b"4"), has(b"n"), has(b"OFF"));
    let mut counts = rest.trim_ascii();
    if !is_off {
        let problem = format!("{:?} where OFF, COFF, NOFF, CNOFF or STOFF is expected", shown(text));
        return Err(malformed(line, problem));
    }
    if homogeneous || any_dimension {
        let problem = format!(
            "{:?}: vertices of another number of coordinates than three are not read: project them and save as OFF",
            shown(text)
        );
        return Err(malformed(line, problem));
    }
    if counts.starts_with(b"BINARY") {
        return Err(malformed(line, "binary OFF is not read: save it as text OFF or as PLY".into()));
    }
    if counts.is_empty() {
        (line, counts) = lines.wanted(|| "its counts of vertices, faces and edges".into())?;
    }
    let mut numbers = words(counts).map(integer::<usize>);
    match (numbers.next(), numbers.next()) {
        (Some(Some(n_vertices)), Some(Some(n_faces))) => Ok(Header { fields, n_vertices, n_faces, line }),
        _ => {
            let problem = format!("{:?} where the counts of vertices, faces and edges are expected", shown(counts));
            Err(malformed(line, problem))
        }
    }
}
