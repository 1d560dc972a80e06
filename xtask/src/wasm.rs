//! `cargo xtask wasm`: the golden vectors as a wasm module in Node.js.

use crate::c_hosts;
use crate::compiler::{Build, Compiler, Kind};
use crate::golden::{self, Cases, FOLDER, Interface, LIBRARY, Run, VECTORS};
use crate::process::{Result, ended, project, succeed};
use crate::targets::Target;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The profile of the module for browsers.
const PROFILE: &str = "wasm";
/// What runs the vectors through the JavaScript wrapper.
const WRAPPED: &str = "examples/web/tests/golden.mjs";

/// Options of `cargo xtask wasm`.
#[derive(clap::Args)]
pub struct Options {
    /// Print the runs as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

/// Builds, runs, compares.
pub fn run(options: &Options) -> Result<()> {
    ready()?;
    golden::concluded(&runs()?, &Cases::read()?, &[], options.json)
}

/// Fails when a tool is missing, before the first build.
pub fn ready() -> Result<()> {
    Compiler::installed(Target::Wasm)?;
    Target::Wasm.emulator()?;
    Ok(())
}

/// The core behind the functions of tests/golden-c, and the C interface behind the JavaScript wrapper.
pub fn runs() -> Result<Vec<Run>> {
    let core = module(FOLDER, PROFILE, LIBRARY, &[])?;
    let rust = golden_run("Rust, wasm", Interface::Rust, &[&project().join(FOLDER).join("run.mjs"), &core])?;
    let arguments: [&Path; 3] = [&project().join(WRAPPED), &c_module()?, &project().join(VECTORS)];
    Ok(vec![rust, golden_run("JavaScript, wasm", Interface::JavaScript, &arguments)?])
}

/// Builds the module for browsers.
pub fn c_module() -> Result<PathBuf> {
    module(c_hosts::CRATE, PROFILE, c_hosts::LIBRARY, &["--no-default-features"])
}

fn module(folder: &str, profile: &str, library: &str, options: &[&str]) -> Result<PathBuf> {
    let compiler = Compiler::installed(Target::Wasm)?;
    let kind = Kind::SharedLibrary;
    succeed(compiler.build(&Build { folder, profile, features: "", kind }).args(options))?;
    Ok(compiler.artefact(kind, profile, library))
}

fn golden_run(way: &str, interface: Interface, arguments: &[&Path]) -> Result<Run> {
    let compiler = Compiler::installed(Target::Wasm)?;
    let ended = ended(Target::Wasm.emulator()?.args(arguments), Duration::from_secs(300))?;
    Ok(Run::new(way, interface, compiler.version(), Target::Wasm.emulator_version()?, &ended))
}
