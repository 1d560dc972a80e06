//! `cargo xtask lint`: formatting and clippy, warnings as errors.

use crate::process::{Result, cargo, cargo_in, project, succeed};
use crate::{fuzz, golden, no_panic};

/// Checks the workspace, and what of the other packages a host can check.
pub fn run() -> Result<()> {
    succeed(&mut cargo(&["fmt", "--all", "--check"]))?;
    for folder in ["examples/firmware", fuzz::FOLDER, no_panic::FOLDER, golden::FOLDER] {
        succeed(&mut cargo_in(folder, "lint", &["fmt", "--check"]))?;
    }
    succeed(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    // The kernel with its features, which nothing else of the workspace turns on.
    succeed(&mut cargo(&["clippy", "-p", "habitus-core", "--all-features", "--", "-D", "warnings"]))?;
    succeed(&mut cargo_in(
        no_panic::FOLDER,
        no_panic::TARGET,
        &["clippy", "--release", "--no-deps", "--", "-D", "warnings"],
    ))?;
    succeed(&mut cargo_in(
        golden::FOLDER,
        golden::LIBRARY,
        &["clippy", "--release", "--no-deps", "--", "-D", "warnings"],
    ))?;
    // Nothing is linked, so that the fuzzer itself need not be compiled.
    succeed(
        cargo_in(
            fuzz::FOLDER,
            "lint",
            &["clippy", "--features", "control", "--all-targets", "--no-deps", "--", "-D", "warnings"],
        )
        .env("CUSTOM_LIBFUZZER_PATH", project().join("libfuzzer-is-not-linked.a")),
    )
}
