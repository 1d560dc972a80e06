//! A row of the table: a broken file, and what must come of it.

use std::path::Path;

use habitus::Error;
use habitus::io::mesh::{NonFinite, ReadOptions, read_file};
use habitus::mesh::clean::{CleanOptions, Cleaned, clean};

/// What reading and cleaning must give.
pub enum Outcome {
    /// Vertices, faces, components, boundary loops and the sum of the genera of the result, and the beginnings of all that
    /// the report says.
    Cleaned([usize; 5], &'static [&'static str]),
    /// Pieces of the error's text.
    Refused(&'static [&'static str]),
}

pub struct Row {
    pub name: &'static str,
    pub file: &'static str,
    pub bytes: Vec<u8>,
    pub outcome: Outcome,
}

pub fn cleaned(
    name: &'static str,
    file: &'static str,
    bytes: impl Into<Vec<u8>>,
    counts: [usize; 5],
    said: &'static [&'static str],
) -> Row {
    Row { name, file, bytes: bytes.into(), outcome: Outcome::Cleaned(counts, said) }
}

pub fn refused(
    name: &'static str,
    file: &'static str,
    bytes: impl Into<Vec<u8>>,
    pieces: &'static [&'static str],
) -> Row {
    Row { name, file, bytes: bytes.into(), outcome: Outcome::Refused(pieces) }
}

fn outcome(path: &Path) -> Result<Cleaned, Error> {
    let file = read_file(path, &ReadOptions { non_finite: NonFinite::Keep })?;
    clean(&file.mesh, &CleanOptions::default())
}

impl Row {
    /// The line of the table, and whether it is as expected.
    pub fn tried(&self, folder: &Path) -> (String, bool) {
        let path = folder.join(self.file);
        std::fs::write(&path, &self.bytes).expect("the temporary folder is writable");
        match (outcome(&path), &self.outcome) {
            (Ok(result), outcome) => {
                let components = &result.report.components;
                let loops = components.iter().map(|component| component.boundary_loops).sum();
                let genus = components.iter().filter_map(|component| component.genus).sum::<u64>() as usize;
                let counts = [result.mesh.positions.len(), result.mesh.faces.len(), components.len(), loops, genus];
                let said = [result.report.changes(), result.report.remarks()].concat();
                let is_right = matches!(outcome, Outcome::Cleaned(wanted, pieces)
                    if *wanted == counts && pieces.len() == said.len()
                        && pieces.iter().zip(&said).all(|(piece, clause)| clause.starts_with(piece)));
                result.mesh.check().expect("a cleaned mesh is sound");
                (format!("{counts:?} {}", said.join("; ")), is_right)
            }
            (Err(error), outcome) => {
                let text = error.to_string();
                let is_right = matches!(outcome, Outcome::Refused(pieces)
                    if pieces.iter().all(|piece| text.contains(piece)));
                (text.replace(&format!("{}/", folder.display()), ""), is_right)
            }
        }
    }
}
