//! `habitus info`: what a file holds; a model is described here, a mesh in [`super::info_mesh`].

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use habitus_core::format::{ElementType, Header, Kind, Mode, Model, SectionId};
use habitus_core::skinning::Blend;
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
        label(header),
    );
    text += &of_kind(&model);
    if let Some([mean, rms, largest]) = model.quantisation_error() {
        let _ = writeln!(
            text,
            "coefficients as {}: vertices of random shapes are {mean:.4} mm off on average ({rms:.4} mm root mean square), {largest:.4} mm at most",
            match model.element() {
                ElementType::F16 => "f16",
                ElementType::I8 => "i8",
                _ => "f32",
            },
        );
    }
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

/// By which equation the model makes shapes.
fn label(header: &Header) -> &'static str {
    match header.kind {
        Kind::Linear => " (eq. 9.1)",
        Kind::Skinned => " (eqs 9.1 to 9.3)",
        Kind::Wavelet => " for each coefficient (eq. 12.1, ch. 15)",
        _ if header.identity_linear || header.pose_linear => ", with linear terms (eq. 8.2)",
        _ => " (eq. 12.1)",
    }
}

/// What only models of its kind have.
fn of_kind(model: &Model<'_>) -> String {
    if let Some(body) = body(model) {
        let corrected = if model.header().pose_linear { ", the rest shape corrected by the pose" } else { "" };
        let joints = if body.regressed { "follow the identity" } else { "stay where the mean shape has them" };
        return format!("{} joints, which {joints}; blends {}{corrected}\n", body.joints, body.blend);
    }
    grid(model).map_or_else(String::new, |grid| {
        format!(
            "base grid of {} x {} and {} levels above it, {} transform\n",
            grid.base[0], grid.base[1], grid.levels, grid.transform
        )
    })
}

/// What poses a body.
struct Body {
    joints: usize,
    regressed: bool,
    blend: &'static str,
}

fn body(model: &Model<'_>) -> Option<Body> {
    let skeleton = model.skeleton().ok()?;
    let blend = match model.generator().ok()?.blend()? {
        Blend::Linear => "matrices",
        Blend::DualQuaternion => "dual quaternions",
    };
    Some(Body { joints: skeleton.n_joints(), regressed: skeleton.is_regressed(), blend })
}

/// The grid of a wavelet model.
struct WaveletGrid {
    base: [u32; 2],
    levels: u32,
    transform: &'static str,
}

fn grid(model: &Model<'_>) -> Option<WaveletGrid> {
    let section = model.sections().find(SectionId::Grid as u32)?;
    let words = section.bytes.as_chunks::<4>().0;
    let word = |index: usize| words.get(index).map(|raw| u32::from_le_bytes(*raw));
    let transform = if word(3)? == 0 { "cubic" } else { "bilinear" };
    Some(WaveletGrid { base: [word(0)?, word(1)?], levels: word(2)?, transform })
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
        "element": format!("{:?}", model.element()),
        "quantisation_error": model.quantisation_error().map(|[mean, rms, largest]| {
            json!({ "mean_mm": mean, "rms_mm": rms, "largest_mm": largest })
        }),
        "body": body(model).map(|body| {
            json!({
                "joints": body.joints,
                "joint_names": model.joint_names().map(|all| all.iter().collect::<Vec<_>>()),
                "joints_follow_identity": body.regressed,
                "blend": body.blend,
                "corrected_by_pose": header.pose_linear,
            })
        }),
        "grid": grid(model).map(|grid| {
            json!({ "base": grid.base, "levels": grid.levels, "transform": grid.transform })
        }),
        "identity_energy_percent": energy_percent(model, Mode::Identity),
        "pose_energy_percent": energy_percent(model, Mode::Pose),
        "unit": "mm",
        "axes": "right-handed, y up, x to the subject's left, z to the front",
        "provenance": model.provenance(),
        "sections": sections,
    })
}
