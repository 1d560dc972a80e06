//! `cargo xtask sizes`: what the libraries weigh, as a program gets them.

use crate::c_library::{self, Libraries};
use crate::firmware::{self, Row};
use crate::process::Result;
use crate::{c_hosts, wasm};
use serde_json::{Value, json};
use std::path::Path;

/// Options of `cargo xtask sizes`.
#[derive(clap::Args)]
pub struct Options {
    /// Print the sizes as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

/// What is weighed, and its bytes.
pub type Size = (String, u64);

/// Builds and weighs.
pub fn run(options: &Options) -> Result<()> {
    let mut sizes = of(&c_library::built(c_hosts::PROFILE)?, &firmware::rows(|profile| profile == "c")?)?;
    sizes.extend(wasm::made()?.sizes);
    if options.json {
        println!("{:#}", json_of(&sizes));
    } else {
        println!("{}", table(&sizes));
    }
    Ok(())
}

/// The shared library, and the bare-metal library as the programs in C contain it.
pub fn of(libraries: &Libraries, firmware: &[Row]) -> Result<Vec<Size>> {
    let shared = file_bytes(&libraries.shared_library)?;
    let mut sizes = vec![(format!("shared library, stripped ({})", std::env::consts::ARCH), shared)];
    sizes.extend(firmware::c_code(firmware).into_iter().map(|(program, bytes)| {
        (format!("bare-metal library and caller in {program}.c (Cortex-M4F, for size)"), bytes)
    }));
    Ok(sizes)
}

fn file_bytes(path: &Path) -> Result<u64> {
    Ok(std::fs::metadata(path).map_err(|error| format!("{}: {error}", path.display()))?.len())
}

/// The sizes as Markdown.
pub fn table(sizes: &[Size]) -> String {
    let rows = sizes.iter().map(|(what, bytes)| format!("\n| {what} | {bytes} |"));
    format!("| what | bytes |\n|---|---:|{}", rows.collect::<String>())
}

/// The sizes as JSON.
pub fn json_of(sizes: &[Size]) -> Value {
    sizes.iter().map(|(what, bytes)| json!({ "what": what, "bytes": bytes })).collect()
}
