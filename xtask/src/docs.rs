//! `cargo xtask docs`: the documentation, with warnings (broken links, missing text) as errors.

use crate::process::{Result, cargo, succeed};

/// Builds the documentation of the workspace's own crates.
pub fn run() -> Result<()> {
    succeed(cargo(&["doc", "--workspace", "--no-deps", "--document-private-items"]).env("RUSTDOCFLAGS", "-D warnings"))
}
