//! The content of a model file as an NPZ archive for numpy; `docs/model-file.md` lists its arrays.

use std::path::Path;

use habitus_core::format::{ElementType, Kind, Model, SectionId};
use habitus_core::generator::LANES;

pub use super::terms::{PlainTerms, plain_terms};
use crate::Error;
use crate::io::npy::NpzWriter;

/// Numbers of an array.
enum Numbers {
    Floats(Vec<f32>),
    Words(Vec<u32>),
}

/// Name, shape, numbers.
type Array = (String, Vec<usize>, Numbers);

/// Writes everything numeric of a model to `path` as an NPZ archive, coefficients decoded to `f32`: terms, statistics, topology, and of a body the skeleton and
/// who holds which vertex. Texts are left out (`habitus info --json` prints them), and so are sections that this version does not know.
pub fn write(model: &Model<'_>, path: &Path) -> Result<(), Error> {
    let mut arrays = terms(model)?;
    arrays.extend(statistics(model));
    arrays.extend(rest(model));
    if model.header().kind == Kind::Skinned {
        arrays.extend(influences(model));
        arrays.push(("dual_quaternions".into(), vec![1], Numbers::Words(vec![model.header().dual_quaternion.into()])));
    }
    let mut npz = NpzWriter::new();
    for (name, shape, numbers) in &arrays {
        match numbers {
            Numbers::Floats(values) if !values.is_empty() => npz.add(name, shape, &values[..])?,
            Numbers::Words(values) if !values.is_empty() => npz.add(name, shape, &values[..])?,
            _ => {}
        }
    }
    npz.finish(path)
}

/// What the shape is summed from.
fn terms(model: &Model<'_>) -> Result<Vec<Array>, Error> {
    let header = *model.header();
    let (n, identity, pose) = (header.n_vertices as usize, header.identity_dim as usize, header.pose_dim as usize);
    let plain = plain_terms(model)?;
    let floats = |name: &str, shape: &[usize], values: Vec<f32>| (name.into(), shape.to_vec(), Numbers::Floats(values));
    let joints = plain.corrections.len() / (9 * 3 * n);
    Ok(match header.kind {
        Kind::Linear | Kind::Skinned => vec![
            floats("mean", &[n, 3], plain.offset),
            floats("components", &[identity, n, 3], plain.identity_linear),
            floats("corrections", &[joints, 9, n, 3], plain.corrections),
        ],
        Kind::Wavelet => vec![
            floats("coefficients_mean", &[n, 3], plain.offset),
            floats("coefficients", &[identity, pose, n, 3], plain.bilinear),
        ],
        _ => vec![
            floats("mean", &[n, 3], plain.offset),
            floats("core", &[identity, pose, n, 3], plain.bilinear),
            floats("identity_linear", &[identity, n, 3], plain.identity_linear),
            floats("expression_linear", &[pose, n, 3], plain.pose_linear),
        ],
    })
}

/// What the file says of its weights.
fn statistics(model: &Model<'_>) -> impl Iterator<Item = Array> {
    let header = model.header();
    let (wavelet, n) = (header.kind == Kind::Wavelet, header.n_vertices as usize);
    let pose = if header.kind == Kind::Skinned { "pose" } else { "expression" };
    // Of a wavelet model each coefficient has weights of its own.
    let by_weight = move |dim: u32| if wavelet { vec![n, dim as usize] } else { vec![dim as usize] };
    let (of_identity, of_pose) = (by_weight(header.identity_dim), by_weight(header.pose_dim));
    let (d_id, d_pose) = (header.identity_dim as usize, header.pose_dim as usize);
    let all = [
        (SectionId::IdentityMean, "identity_mean".into(), Some(of_identity.clone())),
        (SectionId::IdentityScale, "identity_scale".into(), Some(of_identity)),
        (SectionId::IdentityPrecision, "identity_precision".into(), Some(vec![d_id, d_id])),
        (SectionId::IdentitySpectrum, "identity_spectrum".into(), None),
        (SectionId::PoseMean, format!("{pose}_mean"), Some(of_pose.clone())),
        (SectionId::PoseScale, format!("{pose}_scale"), Some(of_pose)),
        (SectionId::PosePrecision, format!("{pose}_precision"), Some(vec![d_pose, d_pose])),
        (SectionId::PoseSpectrum, format!("{pose}_spectrum"), None),
        (SectionId::PoseStarts, format!("{pose}_starts"), None),
    ];
    let model = *model;
    all.into_iter().filter_map(move |(id, name, shape)| {
        let (stored, numbers) = section(&model, id)?;
        Some((name, shape.unwrap_or(stored), numbers))
    })
}

/// Sections that are written as they are.
fn rest(model: &Model<'_>) -> impl Iterator<Item = Array> {
    let model = *model;
    let all = [
        (SectionId::Remainder, "remainder"),
        (SectionId::Faces, "faces"),
        (SectionId::Landmarks, "landmarks"),
        (SectionId::Mirror, "mirror"),
        (SectionId::QuantisationError, "quantisation_error"),
        (SectionId::JointParents, "joint_parents"),
        (SectionId::JointAxes, "joint_axes"),
        (SectionId::JointPositions, "joint_positions"),
        (SectionId::JointBasis, "joint_basis"),
        (SectionId::PoseLower, "pose_lower"),
        (SectionId::PoseUpper, "pose_upper"),
        (SectionId::Grid, "grid"),
    ];
    all.into_iter().filter_map(move |(id, name)| {
        let (shape, numbers) = section(&model, id)?;
        Some((name.into(), shape, numbers))
    })
}

/// Which joint holds which vertex and how much, vertex by vertex, the joints ascending.
fn influences(model: &Model<'_>) -> Vec<Array> {
    let words = |id| match section(model, id) {
        Some((_, Numbers::Words(words))) => words,
        _ => Vec::new(),
    };
    let (starts, joints) = (words(SectionId::SkinStarts), words(SectionId::SkinJoints));
    let Some((_, Numbers::Floats(weights))) = section(model, SectionId::SkinWeights) else { return Vec::new() };
    let n = model.header().n_vertices;
    let all: Vec<(u32, u32, f32)> = (0..n)
        .flat_map(|vertex| {
            let (block, lane) = (vertex as usize / LANES, vertex as usize % LANES);
            let entries = starts[block] as usize..starts[block + 1] as usize;
            entries.zip(std::iter::repeat((vertex, lane)))
        })
        .map(|(entry, (vertex, lane))| (vertex, joints[entry], weights[entry * LANES + lane]))
        .filter(|&(_, _, weight)| weight != 0.0)
        .collect();
    let shape = vec![all.len()];
    vec![
        ("influence_vertices".into(), shape.clone(), Numbers::Words(all.iter().map(|one| one.0).collect())),
        ("influence_joints".into(), shape.clone(), Numbers::Words(all.iter().map(|one| one.1).collect())),
        ("influence_weights".into(), shape, Numbers::Floats(all.iter().map(|one| one.2).collect())),
    ]
}

/// Shape and numbers of a section of 32-bit numbers.
fn section(model: &Model<'_>, id: SectionId) -> Option<(Vec<usize>, Numbers)> {
    let section = model.sections().find(id as u32)?;
    let shape = section.shape.iter().take(section.rank).map(|&axis| axis as usize).collect();
    let raw = section.bytes.as_chunks::<4>().0.iter();
    let numbers = match section.element {
        ElementType::F32 => Numbers::Floats(raw.map(|raw| f32::from_le_bytes(*raw)).collect()),
        ElementType::U32 => Numbers::Words(raw.map(|raw| u32::from_le_bytes(*raw)).collect()),
        _ => return None,
    };
    Some((shape, numbers))
}

#[cfg(test)]
#[path = "npz_tests.rs"]
mod tests;
