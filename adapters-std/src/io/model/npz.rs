//! The content of a model file as an NPZ archive for numpy.

use std::path::Path;

use habitus_core::format::{Mode, Model};
use habitus_core::generator::LANES;

use crate::Error;
use crate::io::npy::NpzWriter;

/// Coefficients of a model as numpy wants them: one term after another, `[vertex, 3]` each.
#[derive(Debug, Clone, PartialEq)]
pub struct PlainTerms {
    /// `o`, `[n, 3]`.
    pub offset: Vec<f32>,
    /// Pose-linear terms, `[d_pose, n, 3]`, or empty.
    pub pose_linear: Vec<f32>,
    /// Identity-linear terms, `[d_id, n, 3]`, or empty.
    pub identity_linear: Vec<f32>,
    /// Bilinear terms, `[d_id, d_pose, n, 3]`.
    pub bilinear: Vec<f32>,
}

/// Takes the coefficients of a model out of their blocks.
pub fn plain_terms(model: &Model<'_>) -> Result<PlainTerms, Error> {
    use habitus_core::format::SectionId;
    let header = *model.header();
    let section = model
        .sections()
        .find(SectionId::Coefficients as u32)
        .ok_or_else(|| Error::Internal("an opened model has no coefficients".into()))?;
    let numbers: Vec<f32> = section.bytes.as_chunks::<4>().0.iter().map(|raw| f32::from_le_bytes(*raw)).collect();
    let (n, n_terms) = (header.n_vertices as usize, header.n_terms());
    let term = |index: usize| {
        (0..3 * n).map(move |k| (index, k / 3, k % 3)).map(|(index, vertex, axis)| {
            numbers[((vertex / LANES * n_terms + index) * 3 + axis) * LANES + vertex % LANES]
        })
    };
    let mut plain = PlainTerms {
        offset: term(0).collect(),
        pose_linear: Vec::new(),
        identity_linear: Vec::new(),
        bilinear: Vec::new(),
    };
    let mut next = 1;
    if header.pose_linear {
        plain.pose_linear = (0..header.pose_dim as usize).flat_map(|j| term(next + j)).collect();
        next += header.pose_dim as usize;
    }
    for _ in 0..header.identity_dim {
        if header.identity_linear {
            plain.identity_linear.extend(term(next));
            next += 1;
        }
        for _ in 0..header.pose_dim {
            plain.bilinear.extend(term(next));
            next += 1;
        }
    }
    Ok(plain)
}

/// Writes everything of a model to `path` as an NPZ archive: `mean`, `core` `[identity, expression, vertex, 3]`, linear terms, `faces`,
/// `landmarks`, `mirror`, priors, starts, spectra, `remainder`; texts as UTF-8 bytes are left out (`habitus info --json` prints them).
pub fn write(model: &Model<'_>, path: &Path) -> Result<(), Error> {
    let header = *model.header();
    let (n, identity, pose) = (header.n_vertices as usize, header.identity_dim as usize, header.pose_dim as usize);
    let plain = plain_terms(model)?;
    let faces: Vec<u32> = model.faces().map(|faces| faces.iter().flatten().collect()).unwrap_or_default();
    let landmarks: Vec<u32> = model.landmarks().map(|all| all.iter().collect()).unwrap_or_default();
    let mirror: Vec<u32> = model.mirror().map(|all| all.iter().collect()).unwrap_or_default();
    let floats = |view: Option<habitus_core::format::Floats<'_>>| -> Vec<f32> {
        view.map(|view| view.iter().collect()).unwrap_or_default()
    };
    let starts = floats(model.pose_starts());
    let mut priors = Vec::new();
    for (mode, name, d) in [(Mode::Identity, "identity", identity), (Mode::Pose, "expression", pose)] {
        if let Some(gaussian) = model.gaussian(mode) {
            priors.push((format!("{name}_mean"), vec![d], gaussian.mean.iter().collect::<Vec<f32>>()));
            priors.push((format!("{name}_scale"), vec![d], gaussian.scale.iter().collect()));
            priors.push((format!("{name}_precision"), vec![d, d], gaussian.precision.iter().collect()));
        }
        let spectrum = floats(model.spectrum(mode));
        priors.push((format!("{name}_spectrum"), vec![spectrum.len()], spectrum));
    }
    let mut npz = NpzWriter::new();
    npz.add("mean", &[n, 3], &plain.offset[..])?;
    npz.add("core", &[identity, pose, n, 3], &plain.bilinear[..])?;
    if header.identity_linear {
        npz.add("identity_linear", &[identity, n, 3], &plain.identity_linear[..])?;
    }
    if header.pose_linear {
        npz.add("expression_linear", &[pose, n, 3], &plain.pose_linear[..])?;
    }
    for (name, shape, values) in &priors {
        if !values.is_empty() {
            npz.add(name, shape, &values[..])?;
        }
    }
    if !starts.is_empty() {
        npz.add("expression_starts", &[starts.len() / pose, pose], &starts[..])?;
    }
    let remainder = floats(model.remainder());
    if !remainder.is_empty() {
        npz.add("remainder", &[remainder.len() / (3 * n), n, 3], &remainder[..])?;
    }
    if !faces.is_empty() {
        npz.add("faces", &[faces.len() / 3, 3], &faces[..])?;
    }
    if !landmarks.is_empty() {
        npz.add("landmarks", &[landmarks.len()], &landmarks[..])?;
    }
    if !mirror.is_empty() {
        npz.add("mirror", &[n], &mirror[..])?;
    }
    npz.finish(path)
}
