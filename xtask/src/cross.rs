//! `cargo xtask cross`: the golden vectors on AArch64 and on a big-endian processor, in QEMU.
//!
//! The runner in Rust and the C interface are compiled without the standard library and linked with C programs, as a C host would do it. Their
//! code is searched for fused multiply-adds, which both processors have.

use crate::c_hosts::{PROFILE, emulated_run, refuse_fused};
use crate::compiler::{Build, Compiler, Kind};
use crate::golden::{self, Cases, FOLDER, Interface, LIBRARY, Run};
use crate::process::{Result, ended, project, succeed};
use crate::targets::Target;
use std::process::Command;
use std::time::Duration;

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
    ready()?;
    let (runs, objections) = runs(Optimised::AsShipped)?;
    golden::concluded(&runs, &Cases::read()?, &objections, options.json)
}

/// How the libraries are compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Optimised {
    /// As C programs get them.
    AsShipped,
    /// In two thirds of the time; the same bits are asked of it.
    Quickly,
}

impl Optimised {
    /// Sets a build of the profile [`PROFILE`] so.
    pub fn set(self, build: &mut Command) {
        if self == Optimised::Quickly {
            build.env(format!("CARGO_PROFILE_{}_OPT_LEVEL", PROFILE.to_uppercase()), "1");
        }
    }
}

const TARGETS: [(Target, bool); 2] = [(Target::AArch64, false), (Target::BigEndian, true)];

/// Fails when a tool is missing, before the first build.
pub fn ready() -> Result<()> {
    for (target, _) in TARGETS {
        Compiler::installed(target)?;
        target.c_compiler()?;
        target.emulator()?;
    }
    Ok(())
}

/// The core and the C interface on each target, and what is wrong with a byte order.
pub fn runs(optimised: Optimised) -> Result<(Vec<Run>, Vec<String>)> {
    // A build of one target uses one core most of the time.
    let results = std::thread::scope(|scope| {
        let started = TARGETS
            .map(|(target, _)| scope.spawn(move || [golden_run(target, optimised), emulated_run(target, optimised)]));
        started.map(|thread| thread.join().map_err(|_| String::from("a run panicked")))
    });
    let (mut runs, mut objections) = (Vec::new(), Vec::new());
    for (results, (_, big_endian)) in results.into_iter().zip(TARGETS) {
        for run in results? {
            let run = run?;
            objections.extend(run.byte_order_objection(big_endian));
            runs.push(run);
        }
    }
    Ok((runs, objections))
}

/// The core behind the functions of tests/golden-c.
fn golden_run(target: Target, optimised: Optimised) -> Result<Run> {
    let compiler = Compiler::installed(target)?;
    let kind = Kind::StaticLibrary;
    let mut build = compiler.build(&Build { folder: FOLDER, profile: PROFILE, features: "", kind });
    optimised.set(&mut build);
    succeed(&mut build)?;
    let library = compiler.artefact(kind, PROFILE, LIBRARY);
    refuse_fused(&library, LIBRARY, |symbol| symbol == "abort" || symbol.starts_with("golden_"))?;
    let program = library.with_file_name("golden");
    let mut link = target.c_compiler()?;
    link.args(WARNINGS).args(["-O2", "-static"]).arg(project().join(FOLDER).join("main.c"));
    succeed(link.arg(&library).arg("-o").arg(&program))?;
    let ended = ended(target.emulator()?.arg(&program), Duration::from_secs(300))?;
    let way = format!("Rust, {}", target.title());
    Ok(Run::new(&way, Interface::Rust, compiler.version(), target.emulator_version()?, &ended))
}
