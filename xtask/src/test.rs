//! `cargo xtask test`: every test of the workspace, with the real data where they are.

use crate::process::{Result, cargo, project, succeed};

/// Options of `cargo xtask test`.
#[derive(clap::Args)]
pub struct Options {
    /// Passed on to `cargo test`, for instance a filter.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    rest: Vec<String>,
}

/// Runs the tests; the last line says how many were skipped.
pub fn run(options: &Options) -> Result<()> {
    let skipped = std::env::temp_dir().join(format!("habitus-skipped-{}", std::process::id()));
    // A stale list of a process with the same number would be counted.
    let _ = std::fs::remove_file(&skipped);
    let mut command = cargo(&["test", "--workspace"]);
    command.args(&options.rest).env("HABITUS_SKIPPED", &skipped);
    // The promise of a change; the default of the crate is a quarter of it.
    if std::env::var_os("PROPTEST_CASES").is_none() {
        command.env("PROPTEST_CASES", "1000");
    }
    let data = project().join("../shared/data");
    if std::env::var_os("HABITUS_DATA").is_none()
        && let Ok(data) = data.canonicalize()
    {
        command.env("HABITUS_DATA", data);
    }
    let result = succeed(&mut command);
    let count = std::fs::read_to_string(&skipped).map_or(0, |list| list.lines().count());
    let _ = std::fs::remove_file(&skipped);
    if count > 0 {
        println!("{count} data tests skipped: set HABITUS_DATA");
    }
    result
}
