//! The golden vectors through the core on this machine: called plainly.

use crate::golden::{Interface, Run};
use crate::process::{Result, cargo, ended, output, succeed, target_dir};
use crate::targets::number;
use std::process::Command;
use std::time::Duration;

const PACKAGE: &str = "habitus-golden";
const PROGRAM: &str = "figures";

/// The run with the checks of a development build and the vectors of the target; wider ones are in the libraries for C and in the test `dispatched`.
pub fn runs() -> Result<Vec<Run>> {
    succeed(&mut cargo(&["build", "--package", PACKAGE, "--example", PROGRAM]))?;
    let program = target_dir("").join("debug/examples").join(PROGRAM);
    let version = output(Command::new("rustc").arg("--version")).unwrap_or_default();
    let ended = ended(&mut Command::new(program), Duration::from_secs(120))?;
    Ok(vec![Run::new("Rust", Interface::Rust, format!("rustc {}", number(&version)), String::new(), &ended)])
}
