//! `cargo xtask lint`: formatting and clippy, warnings as errors.

use crate::process::{Result, cargo, cargo_in, succeed};
use crate::{golden, no_panic};

/// Checks the workspace, and what of the other packages a host can check.
pub fn run() -> Result<()> {
    succeed(&mut cargo(&["fmt", "--all", "--check"]))?;
    for folder in ["examples/firmware", no_panic::FOLDER, golden::FOLDER] {
        succeed(&mut cargo_in(folder, "lint", &["fmt", "--check"]))?;
    }
    succeed(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    succeed(&mut cargo_in(
        no_panic::FOLDER,
        no_panic::TARGET,
        &["clippy", "--release", "--features", "control", "--no-deps", "--", "-D", "warnings"],
    ))?;
    succeed(&mut cargo_in(
        golden::FOLDER,
        golden::LIBRARY,
        &["clippy", "--release", "--no-deps", "--", "-D", "warnings"],
    ))
}
