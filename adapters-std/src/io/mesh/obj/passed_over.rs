//! The lines of an OBJ file that are no part of a mesh, counted by what they are.

use std::collections::BTreeMap;

use super::super::losses::Losses;
use crate::io::text::shown;

/// Keywords with the names of one and of several of such lines.
const KNOWN: [(&[&[u8]], &str, &str); 10] = [
    (&[b"vt"], "texture coordinate", "texture coordinates"),
    (&[b"g"], "line of groups", "lines of groups"),
    (&[b"o"], "object name", "object names"),
    (&[b"s"], "line of smoothing groups", "lines of smoothing groups"),
    (&[b"usemtl", b"usemap"], "change of the material", "changes of the material"),
    (&[b"mtllib", b"maplib"], "material library", "material libraries"),
    (&[b"l"], "polyline", "polylines"),
    (&[b"p"], "point element", "point elements"),
    (
        &[
            b"vp", b"cstype", b"deg", b"bmat", b"step", b"curv", b"curv2", b"surf", b"parm", b"trim", b"hole", b"scrv",
            b"sp", b"end", b"con", b"mg",
        ],
        "line of free-form curves and surfaces",
        "lines of free-form curves and surfaces",
    ),
    (
        &[b"bevel", b"c_interp", b"d_interp", b"lod", b"shadow_obj", b"trace_obj", b"ctech", b"stech", b"call", b"csh"],
        "line of display settings",
        "lines of display settings",
    ),
];

/// So many different words that are no keywords are told apart.
const MOST_UNKNOWN: usize = 5;

/// The counts so far.
#[derive(Debug, Default)]
pub(super) struct PassedOver {
    known: [usize; KNOWN.len()],
    unknown: BTreeMap<Vec<u8>, usize>,
    other: usize,
}

impl PassedOver {
    /// Counts a line that begins with `keyword`.
    pub(super) fn count(&mut self, keyword: &[u8]) {
        if let Some(kind) = KNOWN.iter().position(|(keywords, ..)| keywords.contains(&keyword)) {
            self.known[kind] += 1;
        } else if let Some(count) = self.unknown.get_mut(keyword) {
            *count += 1;
        } else if self.unknown.len() < MOST_UNKNOWN {
            self.unknown.insert(keyword.to_vec(), 1);
        } else {
            self.other += 1;
        }
    }

    pub(super) fn note(&self, losses: &mut Losses) {
        for (&n, (_, one, several)) in self.known.iter().zip(&KNOWN) {
            losses.note(n, one, several);
        }
        for (word, &n) in &self.unknown {
            let word = shown(word);
            losses.note(
                n,
                &format!("line {word:?}, which OBJ does not know"),
                &format!("lines {word:?}, which OBJ does not know"),
            );
        }
        losses.note(self.other, "other line that OBJ does not know", "other lines that OBJ does not know");
    }
}
