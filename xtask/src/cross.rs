//! `cargo xtask cross`: the golden vectors on AArch64 and on a big-endian processor, in QEMU.
//!
//! The kernel is compiled without the standard library and linked with a C program, as a C host would do it. Its code is searched
//! for fused multiply-adds, which both processors have.

use crate::compiler::{Build, Compiler, Kind};
use crate::fused::fused_multiply_adds_of_archive;
use crate::golden::{self, FOLDER, LIBRARY, Run};
use crate::no_panic::MEMORY_FUNCTIONS;
use crate::process::{Result, ended, project, succeed};
use crate::targets::Target;
use std::path::Path;
use std::time::Duration;

const PROFILE: &str = "release";
/// What a C host of ours is compiled with.
const WARNINGS: [&str; 5] = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"];

/// Options of `cargo xtask cross`.
#[derive(clap::Args)]
pub struct Options {
    /// Print the runs as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

/// Builds, searches, runs, compares.
pub fn run(options: &Options) -> Result<()> {
    let targets = [(Target::AArch64, false), (Target::BigEndian, true)];
    // Every missing tool before the first build.
    for (target, _) in targets {
        Compiler::installed(target)?;
        target.c_compiler()?;
        target.emulator()?;
    }
    let cases = golden::cases()?;
    let (mut runs, mut objections) = (Vec::new(), Vec::new());
    // A build of one target uses one core most of the time.
    let results = std::thread::scope(|scope| {
        let started = targets.map(|(target, _)| scope.spawn(move || golden_run(target)));
        started.map(|thread| thread.join().unwrap_or_else(|_| Err(String::from("a run panicked").into())))
    });
    for (result, (_, big_endian)) in results.into_iter().zip(targets) {
        let run = result?;
        objections.extend(run.objections(cases));
        objections.extend(run.byte_order_objection(big_endian));
        runs.push(run);
    }
    golden::concluded(&runs, &objections, options.json)
}

fn golden_run(target: Target) -> Result<Run> {
    let compiler = Compiler::installed(target)?;
    let kind = Kind::StaticLibrary;
    succeed(&mut compiler.build(&Build { folder: FOLDER, profile: PROFILE, features: "", kind }))?;
    let library = compiler.artefact(kind, PROFILE, LIBRARY);
    refuse_fused(&library)?;
    let program = library.with_file_name("golden");
    let mut link = target.c_compiler()?;
    link.args(WARNINGS).args(["-O2", "-static"]).arg(project().join(FOLDER).join("main.c"));
    succeed(link.arg(&library).arg("-o").arg(&program))?;
    let ended = ended(target.emulator()?.arg(&program), Duration::from_secs(300))?;
    Ok(Run::new(target.title(), compiler.version(), target.emulator_version()?, &ended))
}

/// Fails when the library's own objects contain a fused multiply-add.
fn refuse_fused(library: &Path) -> Result<()> {
    let failed = |error: String| format!("{}: {error}", library.display());
    let bytes = std::fs::read(library).map_err(|error| failed(error.to_string()))?;
    match fused_multiply_adds_of_archive(&bytes, &LIBRARY.replace('-', "_"), allowed).map_err(failed)? {
        0 => Ok(()),
        count => Err(failed(format!("{count} fused multiply-adds: its results differ from other targets'")).into()),
    }
}

/// Functions of C that calculate nothing, and the program's own.
fn allowed(symbol: &str) -> bool {
    MEMORY_FUNCTIONS.contains(&symbol) || symbol == "abort" || symbol.starts_with("golden_")
}
