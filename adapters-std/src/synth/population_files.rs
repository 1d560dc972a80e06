//! A procedural population as the files that training reads.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::face_grid::LANDMARKS;
use super::face_motion::EXPRESSIONS;
use super::faces::FacePopulation;
use crate::Error;
use crate::io::{self, atomic, npy};
use crate::mesh::Mesh;
use crate::report::View;
use crate::report::portrait::LINING;
use crate::report::sheet::contact_sheet;

/// Where the parts of a population were written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PopulationFiles {
    /// `[identity, expression, vertex, 3]` f32, mm.
    pub tensor: PathBuf,
    /// Mean neutral face with triangles.
    pub template: PathBuf,
    /// JSON with `landmarks13` and `landmarks13_names`.
    pub landmarks: PathBuf,
    /// Vertex of the other side, `[n]`.
    pub mirror: PathBuf,
    /// One expression name per line.
    pub names: PathBuf,
    /// Contact sheet.
    pub picture: PathBuf,
    /// Names of the expressions.
    pub expressions: Vec<String>,
}

/// People on the contact sheet.
const SHOWN: usize = 6;

/// Writes a population into the folder `to`, which is made when it does not exist.
///
/// Errors: [`Error::Write`].
pub fn write(population: &FacePopulation, to: &Path) -> Result<PopulationFiles, Error> {
    std::fs::create_dir_all(to).map_err(|source| Error::Write { path: to.to_owned(), source })?;
    let files = PopulationFiles {
        tensor: to.join("tensor.npy"),
        template: to.join("template.ply"),
        landmarks: to.join("landmarks.json"),
        mirror: to.join("mirror.npy"),
        names: to.join("expressions.txt"),
        picture: to.join("faces.png"),
        expressions: EXPRESSIONS.map(str::to_owned).to_vec(),
    };
    let n = population.grid.n_vertices();
    let identities = population.factors.len();
    npy::write_f32(&files.tensor, &[identities, EXPRESSIONS.len(), n, 3], &population.tensor)?;
    io::mesh::write(&files.template, &mean_neutral(population))?;
    let landmarks = json!({ "landmarks13": population.landmarks, "landmarks13_names": LANDMARKS, "procedural": true });
    atomic::write(&files.landmarks, format!("{landmarks:#}\n").as_bytes())?;
    npy::write_u32(&files.mirror, &[n], &population.mirror)?;
    atomic::write(&files.names, (EXPRESSIONS.join("\n") + "\n").as_bytes())?;
    contact_sheet(&people(population, SHOWN), &[View::THREE_QUARTER], [200, 260], Some(LINING))
        .write_png(&files.picture)?;
    Ok(files)
}

/// One row of faces per person, every expression in its column.
pub fn people(population: &FacePopulation, count: usize) -> Vec<Vec<Mesh>> {
    let rows = 0..population.factors.len().min(count);
    rows.map(|identity| (0..EXPRESSIONS.len()).filter_map(|expression| population.mesh(identity, expression)).collect())
        .collect()
}

/// The mean of all neutral faces.
fn mean_neutral(population: &FacePopulation) -> Mesh {
    let len = 3 * population.grid.n_vertices();
    let mut sum = vec![0.0; len];
    for shapes in population.tensor.chunks_exact(len * EXPRESSIONS.len()) {
        sum.iter_mut().zip(shapes).for_each(|(sum, value)| *sum += f64::from(*value));
    }
    let count = population.factors.len() as f64;
    Mesh {
        positions: sum.as_chunks::<3>().0.iter().map(|point| point.map(|value| value / count)).collect(),
        faces: population.faces.clone(),
        ..Mesh::default()
    }
}
