//! The command line `habitus VERB [OBJECT] INPUT... -o OUTPUT`: one file per verb, no algorithm in it.

mod clean;
mod clean_frame;
mod clean_normals;
mod console;
mod convert;
mod convert_shape;
mod demo;
mod export;
mod fit;
mod generate;
mod info;
mod info_mesh;
mod measure_distance;
mod measure_model;
mod outputs;
mod pace;
mod quantise;
mod synth_faces;
mod synth_scans;
mod train_face;
mod validate;

use clap::{Args, Parser, Subcommand};
use std::panic::AssertUnwindSafe;
use std::process::ExitCode;

use console::Console;
use outputs::Outputs;

/// Learns deformation models of human shape from 3D scans and works with them.
#[derive(Debug, Parser)]
#[command(version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
    #[command(flatten)]
    common: Common,
}

/// What every verb takes.
#[derive(Debug, Args)]
struct Common {
    /// Print one JSON object on stdout instead of text; names carry their unit (docs/json.md)
    #[arg(long, global = true)]
    json: bool,
    /// Number of threads, 1 to 1024 [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Make a procedural population, learn from it, fit it, and leave everything in a folder
    Demo(demo::DemoArgs),
    /// Say what a model or mesh file holds
    Info(info::InfoArgs),
    /// Say whether a model file is sound
    Validate(validate::ValidateArgs),
    /// Write a model's content for other programs
    Export(export::ExportArgs),
    /// Write a mesh or point cloud in another format, with other triangles, or as points
    Convert(convert::ConvertArgs),
    /// Make procedural data with known truth
    #[command(subcommand)]
    Synth(Synth),
    /// Learn a model
    #[command(subcommand)]
    Train(Train),
    /// Make a mesh or cloud sound and say what was wrong with it
    Clean(clean::CleanArgs),
    /// Store a model's coefficients in fewer bytes and say how far that moves its shapes
    Quantise(quantise::QuantiseArgs),
    /// Turn weights into vertices
    Generate(generate::GenerateArgs),
    /// Find the weights of a model from a raw scan and its landmarks
    Fit(fit::FitArgs),
    /// Measure quality
    #[command(subcommand)]
    Measure(Measure),
}

#[derive(Debug, Subcommand)]
enum Synth {
    /// A population of faces with expressions on a quad grid
    Faces(synth_faces::FacesArgs),
    /// Raw scans of meshes as a depth scanner takes them, with their truth
    Scans(Box<synth_scans::ScansArgs>),
}

#[derive(Debug, Subcommand)]
enum Train {
    /// A multilinear face model (Wuhrer ch. 12) from registered shapes
    Face(train_face::FaceArgs),
}

#[derive(Debug, Subcommand)]
enum Measure {
    /// How far two meshes or clouds are apart, both ways, in figures and pictures
    Distance(measure_distance::DistanceArgs),
    /// Compactness, generalization, specificity and vertex errors of a face model
    Model(measure_model::ModelArgs),
}

/// Runs the command line. Exit status: 0 done, 1 bad input, 2 usage, 3 a fault of ours.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    let console = Console::new(cli.common.json);
    if let Some(threads) = cli.common.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global();
        if let Err(error) = pool {
            console.error(&format!("{threads} threads cannot be started: {error}"));
            return ExitCode::from(1);
        }
    }
    // A fault of ours must end with status 3 and one sentence, not with a stack trace.
    let fault = std::sync::Arc::new(std::sync::Mutex::new(String::new()));
    let heard = fault.clone();
    std::panic::set_hook(Box::new(move |info| {
        let first = format!("internal fault, please report it: {info}").replace('\n', " ");
        if let Ok(mut fault) = heard.lock()
            && fault.is_empty()
        {
            *fault = first;
        }
    }));
    match std::panic::catch_unwind(AssertUnwindSafe(|| done(&cli.verb, &console))) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            console.error(&error.to_string());
            ExitCode::from(error.exit_code())
        }
        Err(_) => {
            console.error(&fault.lock().map(|fault| fault.clone()).unwrap_or_default());
            ExitCode::from(3)
        }
    }
}

/// Runs the verb.
fn done(verb: &Verb, console: &Console) -> Result<(), crate::Error> {
    match verb {
        Verb::Demo(args) => demo::run(args, console),
        Verb::Info(args) => info::run(args, console),
        Verb::Validate(args) => validate::run(args, console),
        Verb::Export(args) => export::run(args, console),
        Verb::Convert(args) => convert::run(args, console),
        Verb::Synth(Synth::Faces(args)) => synth_faces::run(args, console),
        Verb::Synth(Synth::Scans(args)) => synth_scans::run(args, console),
        Verb::Train(Train::Face(args)) => train_face::run(args, console),
        Verb::Clean(args) => clean::run(args, console),
        Verb::Quantise(args) => quantise::run(args, console),
        Verb::Generate(args) => generate::run(args, console),
        Verb::Fit(args) => fit::run(args, console),
        Verb::Measure(Measure::Distance(args)) => measure_distance::run(args, console),
        Verb::Measure(Measure::Model(args)) => measure_model::run(args, console),
    }
}

/// Refuses an output whose extension is not the one of what is written.
fn expect_extension(path: &std::path::Path, extension: &str) -> Result<(), crate::Error> {
    if path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension)) {
        return Ok(());
    }
    Err(crate::Error::input(format!("{}: the output is a .{extension} file; name it so", path.display())))
}

/// A path as a JSON text; what is not UTF-8 in it is replaced.
fn shown(path: &std::path::Path) -> String {
    path.display().to_string()
}
