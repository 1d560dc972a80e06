//! The golden vectors through the core on this machine: called plainly, and inside the wrappers for wider vectors.

use crate::golden::{Interface, Run};
use crate::process::{Result, cargo, ended, output, succeed, target_dir};
use crate::targets::number;
use std::process::Command;
use std::time::Duration;

const PACKAGE: &str = "habitus-golden";
const PROGRAM: &str = "figures";
const WAYS: [(&str, &str); 2] = [("plain", "Rust"), ("avx2", "Rust, AVX2")];

/// A run for each width of vectors that this processor has.
pub fn runs() -> Result<Vec<Run>> {
    succeed(&mut cargo(&["build", "--release", "--package", PACKAGE, "--example", PROGRAM]))?;
    let program = target_dir("").join("release/examples").join(PROGRAM);
    let version = output(Command::new("rustc").arg("--version")).unwrap_or_default();
    let mut runs = Vec::new();
    for (argument, way) in WAYS {
        let ended = ended(Command::new(&program).arg(argument), Duration::from_secs(120))?;
        let run = Run::new(way, Interface::Rust, format!("rustc {}", number(&version)), String::new(), &ended);
        if run.figure("unsupported") == Some(1) {
            eprintln!("{way}: left out, this processor has no such vectors");
        } else {
            runs.push(run);
        }
    }
    Ok(runs)
}
