//! `habitus generate`: weights to vertices.

use std::path::{Path, PathBuf};

use clap::Args;
use habitus_core::format::{Kind, Mode};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::json;

use super::{Console, Outputs, shown};
use crate::Error;
use crate::generate::{
    deviations_of_weights, mesh, positions, weight_count, weights_from_deviations, weights_of_expression,
};
use crate::io::model::opened;
use crate::io::{self, npy};
use crate::parameters::Parameters;

/// Arguments of `generate`.
#[derive(Debug, Args)]
pub(super) struct GenerateArgs {
    /// Model file
    model: PathBuf,
    /// Identity weights in standard deviations, separated by commas; missing ones are 0, the mean
    #[arg(long, value_name = "T,T,...", value_delimiter = ',', allow_hyphen_values = true)]
    identity: Vec<f64>,
    /// Expression weights in standard deviations, likewise
    #[arg(
        long,
        value_name = "T,T,...",
        value_delimiter = ',',
        allow_hyphen_values = true,
        conflicts_with = "expression_name"
    )]
    expression: Vec<f64>,
    /// A training expression by its name (see `habitus info`)
    #[arg(long, value_name = "NAME")]
    expression_name: Option<String>,
    /// Weights and placement from a file: what `habitus fit --parameters` or `--json` wrote. The output lies where the fit did, in its unit
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["identity", "expression", "expression_name", "random"])]
    parameters: Option<PathBuf>,
    /// Leave the placement of --parameters out: the shape in the frame of the model, in mm
    #[arg(long, requires = "parameters")]
    unplaced: bool,
    /// Draw the weights that are not given at random: independent normal deviates. The angles of a body whose file does not say how they are distributed
    /// stay zero
    #[arg(long)]
    random: bool,
    /// Seed of --random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Output; the extension chooses the format: ply, obj, off, glb, or npy [n, 3] f32; in mm unless --parameters say where it lies
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

pub(super) fn run(args: &GenerateArgs, console: &Console) -> Result<(), Error> {
    io::mesh::expect_written(&args.output)?;
    Outputs::beside([Some(&args.model), args.parameters.as_ref()].into_iter().flatten().map(PathBuf::as_path))
        .file("-o", Some(&args.output))
        .check()?;
    let bytes = io::file_bytes(&args.model)?;
    let model = opened(&bytes, &args.model)?;
    let mut stream = ChaCha12Rng::seed_from_u64(args.seed);
    let mut completed = |given: &[f64], mode: Mode| -> Vec<f64> {
        let drawn: Vec<f64> = (0..weight_count(&model, mode)).map(|_| StandardNormal.sample(&mut stream)).collect();
        let unknown = mode == Mode::Pose && model.header().kind == Kind::Skinned && model.spread(mode).is_none();
        let random = args.random && !unknown;
        let rest = drawn.into_iter().skip(given.len()).map(|t| if random { t } else { 0.0 });
        given.iter().copied().chain(rest).collect()
    };
    let given = match &args.parameters {
        Some(path) => Parameters::read(path)?,
        None => Parameters { identity: args.identity.clone(), expression: args.expression.clone(), placement: None },
    };
    let of_file = |error: Error| match (&args.parameters, error) {
        (Some(path), Error::Input(problem)) => Error::Input(format!("{}: {problem}", path.display())),
        (_, error) => error,
    };
    let identity_deviations = completed(&given.identity, Mode::Identity);
    let pose_deviations = completed(&given.expression, Mode::Pose);
    let identity = weights_from_deviations(&model, Mode::Identity, &identity_deviations).map_err(of_file)?;
    let pose = match &args.expression_name {
        Some(name) => weights_of_expression(&model, name)?,
        None => weights_from_deviations(&model, Mode::Pose, &pose_deviations).map_err(of_file)?,
    };
    let mut vertices = positions(&model, &identity, &pose)?;
    if let Some(placement) = given.placement.filter(|_| !args.unplaced) {
        for vertex in vertices.as_chunks_mut::<3>().0 {
            *vertex = placement.point(vertex.map(f64::from)).map(|x| x as f32);
        }
    }
    write_vertices(&model, &vertices, &args.output)?;
    console.result(
        &format!("{}: {} vertices", args.output.display(), vertices.len() / 3),
        json!({
            "output": shown(&args.output),
            "vertices": vertices.len() / 3,
            "identity_deviations": deviations_of_weights(&model, Mode::Identity, &identity),
            "expression_deviations": deviations_of_weights(&model, Mode::Pose, &pose),
        }),
    )
}

/// Writes vertices as NPY or as a mesh, by the extension.
pub(super) fn write_vertices(
    model: &habitus_core::format::Model<'_>,
    vertices: &[f32],
    output: &Path,
) -> Result<(), Error> {
    if output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npy")) {
        return npy::write_f32(output, &[vertices.len() / 3, 3], vertices);
    }
    let mut mesh = mesh(model, vertices);
    if mesh.faces.is_empty() {
        return Err(Error::input(format!(
            "{}: the model has no triangles; write .npy, or train the model with --template",
            output.display()
        )));
    }
    mesh.normals = mesh.vertex_normals();
    io::mesh::write(output, &mesh)
}
