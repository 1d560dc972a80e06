//! `habitus info`: what a file holds; a model is described here, a mesh in [`super::info_mesh`].

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use habitus_core::format::{Mode, Model, SectionId};
use serde_json::{Value, json};

use super::{Console, info_mesh};
use crate::Error;
use crate::io;
use crate::io::model::opened;

/// Arguments of `info`.
#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    /// Model file (.hab), or mesh or point cloud, as its extension says
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

pub(super) fn run(args: &InfoArgs, console: &Console) -> Result<(), Error> {
    if io::mesh::is_read(&args.file) {
        return info_mesh::run(&args.file, console);
    }
    let bytes = io::file_bytes(&args.file)?;
    if !bytes.starts_with(b"\x89HAB")
        && !args.file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("hab"))
    {
        return Err(Error::input(format!(
            "{}: not a .hab model file, nor a mesh by its extension; meshes are {}",
            args.file.display(),
            io::mesh::read_extensions().join(", ")
        )));
    }
    let model = opened(&bytes, &args.file)?;
    let object = described(&model, bytes.len());
    let mut text = format!("{}: {} bytes, format version 1\n", args.file.display(), bytes.len());
    let header = model.header();
    let _ = writeln!(
        text,
        "{:?} model: {} vertices, {} identity weights, {} pose weights{}",
        header.kind,
        header.n_vertices,
        header.identity_dim,
        header.pose_dim,
        if header.identity_linear || header.pose_linear { ", with linear terms (eq. 8.2)" } else { " (eq. 12.1)" },
    );
    for (mode, name) in [(Mode::Identity, "identity"), (Mode::Pose, "pose")] {
        let shares = energy_percent(&model, mode);
        let shown: Vec<String> = shares.iter().take(10).map(|share| format!("{share:.1}")).collect();
        if !shown.is_empty() {
            let _ = writeln!(text, "{name} energy by number of weights, %: {}", shown.join(" "));
        }
    }
    if let Some(names) = model.pose_names() {
        let _ = writeln!(text, "expressions: {}", names.iter().collect::<Vec<_>>().join(", "));
    }
    if let (Some(names), Some(vertices)) = (model.landmark_names(), model.landmarks()) {
        let all: Vec<String> =
            names.iter().zip(vertices.iter()).map(|(name, vertex)| format!("{name} {vertex}")).collect();
        let _ = writeln!(text, "landmarks: {}", all.join(", "));
    }
    let _ = writeln!(text, "sections:");
    for section in model.sections().iter() {
        let name = SectionId::from_u32(section.id).map_or("unknown".into(), |id| format!("{id:?}"));
        let shape = section.shape.get(..section.rank).unwrap_or_default();
        let _ =
            writeln!(text, "  {:>4} {name} {:?} {shape:?}, {} bytes", section.id, section.element, section.bytes.len());
    }
    if let Some(provenance) = model.provenance() {
        let _ = writeln!(text, "provenance: {provenance}");
    }
    console.result(&text, object)
}

/// Share of a mode's variation that the first k weights hold, for every k of the training data.
pub(super) fn energy_percent(model: &Model<'_>, mode: Mode) -> Vec<f64> {
    let spectrum: Vec<f64> = model.spectrum(mode).map(|all| all.iter().map(f64::from).collect()).unwrap_or_default();
    let total: f64 = spectrum.iter().sum();
    let mut sum = 0.0;
    let shares = spectrum.iter().map(|value| {
        sum += value;
        100.0 * sum / total
    });
    shares.collect()
}

fn described(model: &Model<'_>, bytes: usize) -> Value {
    let header = model.header();
    let sections: Vec<Value> = model
        .sections()
        .iter()
        .map(|section| {
            json!({
                "id": section.id,
                "name": SectionId::from_u32(section.id).map(|id| format!("{id:?}")),
                "element": format!("{:?}", section.element),
                "shape": section.shape.get(..section.rank),
                "bytes": section.bytes.len(),
            })
        })
        .collect();
    json!({
        "bytes": bytes,
        "kind": format!("{:?}", header.kind),
        "vertices": header.n_vertices,
        "identity_dim": header.identity_dim,
        "pose_dim": header.pose_dim,
        "identity_linear": header.identity_linear,
        "pose_linear": header.pose_linear,
        "faces": model.faces().map(|faces| faces.len()),
        "landmarks": model.landmarks().map(|all| all.iter().collect::<Vec<_>>()),
        "landmark_names": model.landmark_names().map(|all| all.iter().collect::<Vec<_>>()),
        "expressions": model.pose_names().map(|all| all.iter().collect::<Vec<_>>()),
        "identity_energy_percent": energy_percent(model, Mode::Identity),
        "pose_energy_percent": energy_percent(model, Mode::Pose),
        "unit": "mm",
        "axes": "right-handed, y up, x to the subject's left, z to the front",
        "provenance": model.provenance(),
        "sections": sections,
    })
}
