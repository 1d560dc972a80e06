//! `cargo xtask wasm`: the golden vectors as a wasm module in Node.js.

use crate::compiler::{Build, Compiler, Kind};
use crate::golden::{self, FOLDER, LIBRARY, Run};
use crate::process::{Result, ended, project, succeed};
use crate::targets::Target;
use std::time::Duration;

const PROFILE: &str = "release";

/// Options of `cargo xtask wasm`.
#[derive(clap::Args)]
pub struct Options {
    /// Print the runs as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

/// Builds, runs, compares.
pub fn run(options: &Options) -> Result<()> {
    let compiler = Compiler::installed(Target::Wasm)?;
    Target::Wasm.emulator()?;
    let run = golden_run(&compiler)?;
    let objections = run.objections(golden::cases()?);
    golden::concluded(&[run], &objections, options.json)
}

fn golden_run(compiler: &Compiler) -> Result<Run> {
    let kind = Kind::SharedLibrary;
    succeed(&mut compiler.build(&Build { folder: FOLDER, profile: PROFILE, features: "", kind }))?;
    let module = compiler.artefact(kind, PROFILE, LIBRARY);
    let script = project().join(FOLDER).join("run.mjs");
    let ended = ended(Target::Wasm.emulator()?.arg(script).arg(module), Duration::from_secs(300))?;
    Ok(Run::new(Target::Wasm.title(), compiler.version(), Target::Wasm.emulator_version()?, &ended))
}
