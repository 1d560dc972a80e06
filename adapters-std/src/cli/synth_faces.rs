//! `habitus synth faces`: a procedural population as training data.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::{Console, Outputs, shown};
use crate::Error;
use crate::synth::faces::{FaceOptions, FacePopulation};
use crate::synth::population_files;

/// Arguments of `synth faces`.
#[derive(Debug, Args)]
pub(super) struct FacesArgs {
    /// Number of people
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    identities: u32,
    /// Level of the grid, 3 to 6: (4*2^l + 1) x (6*2^l + 1) nodes
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(3..=6))]
    level: u32,
    /// Seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder to write: tensor.npy, template.ply, landmarks.json, mirror.npy, expressions.txt, faces.png
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

pub(super) fn run(args: &FacesArgs, console: &Console) -> Result<(), Error> {
    Outputs::beside([]).folder("-o", Some(&args.output), [""; 0]).check()?;
    let population =
        FacePopulation::of(&FaceOptions { identities: args.identities as usize, seed: args.seed, level: args.level })?;
    let files = population_files::write(&population, &args.output)?;
    let vertices = population.grid.n_vertices();
    let text = format!(
        "{}: {} identities x {} expressions, {vertices} vertices, procedural (no person was scanned)\n\
         train with: habitus train face {} --template {} --landmarks {} --mirror {} --expressions {} -o face.hab",
        args.output.display(),
        args.identities,
        files.expressions.len(),
        files.tensor.display(),
        files.template.display(),
        files.landmarks.display(),
        files.mirror.display(),
        files.names.display(),
    );
    console.result(
        &text,
        json!({
            "output": shown(&args.output),
            "identities": args.identities,
            "expressions": files.expressions,
            "vertices": vertices,
            "procedural": true,
        }),
    )
}
