//! `habitus export`: a model's content for other programs.

use std::path::PathBuf;

use clap::Args;
use habitus_core::format::Mode;
use serde_json::json;

use super::{Console, Outputs, shown};
use crate::Error;
use crate::generate::{mesh, positions, weights_from_deviations};
use crate::io;
use crate::io::mesh::{MeshFile, MorphTarget, WriteOptions, write_file};
use crate::io::model::{npz, opened};

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// Model file (.hab)
    model: PathBuf,
    /// Identity weights that become morph targets of a GLB
    #[arg(long, default_value_t = 10, value_name = "N")]
    identity_morphs: usize,
    /// Output: .npz (everything, for numpy) or .glb (mean shape with named morph targets: each training expression, and the first identity weights
    /// by one standard deviation)
    #[arg(short, long, value_name = "FILE.npz|FILE.glb")]
    output: PathBuf,
}

pub(super) fn run(args: &ExportArgs, console: &Console) -> Result<(), Error> {
    Outputs::beside([&*args.model]).file("-o", Some(&args.output)).check()?;
    let bytes = io::file_bytes(&args.model)?;
    let model = opened(&bytes, &args.model)?;
    let extension = args.output.extension().map(|extension| extension.to_ascii_lowercase());
    let morphs = match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("npz") => {
            npz::write(&model, &args.output)?;
            0
        }
        Some("glb") => write_glb(args, &model, console)?,
        _ => {
            return Err(Error::input(format!(
                "{}: a model is exported as .npz or .glb; name the output so",
                args.output.display()
            )));
        }
    };
    console.result(
        &format!("{}: written", args.output.display()),
        json!({ "output": shown(&args.output), "morph_targets": morphs }),
    )
}

/// The mean shape and its morph targets; returns their number.
fn write_glb(args: &ExportArgs, model: &habitus_core::format::Model<'_>, console: &Console) -> Result<usize, Error> {
    let mean_identity = weights_from_deviations(model, Mode::Identity, &[])?;
    let mean_pose = weights_from_deviations(model, Mode::Pose, &[])?;
    let mean = positions(model, &mean_identity, &mean_pose)?;
    let mut base = mesh(model, &mean);
    if base.faces.is_empty() {
        return Err(Error::input("the model has no triangles; export .npz, or train it with --template"));
    }
    base.normals = base.vertex_normals();
    let displacement = |moved: &[f32]| -> Vec<[f64; 3]> {
        let pairs = moved.as_chunks::<3>().0.iter().zip(mean.as_chunks::<3>().0);
        pairs.map(|(a, b)| [0, 1, 2].map(|axis| f64::from(a[axis]) - f64::from(b[axis]))).collect()
    };
    let mut morphs = Vec::new();
    let dim = model.header().pose_dim as usize;
    if let Some(starts) = model.pose_starts() {
        for row in 0..starts.len() / dim {
            let weights: Vec<f32> = (0..dim).filter_map(|k| starts.get(row * dim + k)).collect();
            let name =
                model.pose_names().and_then(|names| names.get(row)).map_or(format!("expression_{row}"), str::to_owned);
            let displacements = displacement(&positions(model, &mean_identity, &weights)?);
            morphs.push(MorphTarget { name, displacements });
        }
    }
    let mut identity_morphs = args.identity_morphs.min(model.header().identity_dim as usize);
    if identity_morphs > 0 && model.spread(Mode::Identity).is_none() {
        console.warn("the model does not say how its identity weights are distributed, so they have no morph targets");
        identity_morphs = 0;
    }
    for weight in 0..identity_morphs {
        let mut deviations = vec![0.0; weight];
        deviations.push(1.0);
        let identity = weights_from_deviations(model, Mode::Identity, &deviations)?;
        let displacements = displacement(&positions(model, &identity, &mean_pose)?);
        morphs.push(MorphTarget { name: format!("identity_{weight}"), displacements });
    }
    let n_morphs = morphs.len();
    let file = MeshFile { mesh: base, morphs, ..MeshFile::default() };
    // What is left out are roundings to f32, of which the model's own numbers are.
    write_file(&args.output, &file, &WriteOptions::default())?;
    Ok(n_morphs)
}
