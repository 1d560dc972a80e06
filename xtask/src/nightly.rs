//! `cargo xtask nightly`: what does not fit into the checks of every change.

use crate::process::{Result, cargo, succeed};
use std::process::Command;
use std::time::Instant;

/// Options of `cargo xtask nightly`.
#[derive(clap::Args)]
pub struct Options {
    /// Random cases for each property of the kernel.
    #[arg(long, default_value_t = 100_000)]
    cases: u32,
}

/// Runs the kernel's properties at length, the tests of its features, the figures on the shared data with their curves, all fits to scans, recovered frames,
/// costs of storage, the golden vectors through the dispatched functions and in all firmware, and the benchmark rows, each optimised and with its seconds.
pub fn run(options: &Options) -> Result<()> {
    let cases = options.cases.to_string();
    timed("properties", cargo(&["test", "--release", "--package", "habitus-core"]).env("PROPTEST_CASES", cases))?;
    let features = ["--all-features", "--lib", "--", "--nocapture", "interop", "fast_functions"];
    timed("features", cargo(&["test", "--release", "--package", "habitus-core"]).args(features))?;
    for (name, test) in [
        ("figures", "face_figures"),
        ("fits", "face_fit"),
        ("frames", "frames"),
        ("storages", "quantised"),
        ("dispatched vectors", "dispatched"),
    ] {
        let figures = ["--test", test, "--", "--include-ignored", "--nocapture"];
        timed(name, cargo(&["test", "--release", "--package", "habitus-tests"]).args(figures))?;
    }
    timed("vectors", &mut cargo(&["xtask", "vectors", "--speed"]))?;
    timed("times of fits", &mut cargo(&["run", "--release", "--package", "habitus-benches", "--bin", "fit"]))?;
    timed("evaluation", &mut cargo(&["run", "--release", "--package", "habitus-benches", "--bin", "evaluation"]))?;
    timed("rows", &mut cargo(&["run", "--release", "--package", "habitus-benches", "--bin", "rows", "--", "--big"]))
}

fn timed(name: &str, command: &mut Command) -> Result<()> {
    let start = Instant::now();
    succeed(command)?;
    println!("-- {name} {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}
