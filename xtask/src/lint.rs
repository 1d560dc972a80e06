//! `cargo xtask lint`: formatting and clippy, warnings as errors.

use crate::no_panic;
use crate::process::{Result, cargo, cargo_in, succeed};

/// Checks the workspace, and what of the other packages a host can check.
pub fn run() -> Result<()> {
    succeed(&mut cargo(&["fmt", "--all", "--check"]))?;
    for folder in ["examples/firmware", no_panic::FOLDER] {
        succeed(&mut cargo_in(folder, "lint", &["fmt", "--check"]))?;
    }
    succeed(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    succeed(&mut cargo_in(
        no_panic::FOLDER,
        no_panic::TARGET,
        &["clippy", "--release", "--features", "control", "--no-deps", "--", "-D", "warnings"],
    ))
}
