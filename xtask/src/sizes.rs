//! `cargo xtask sizes`: what the libraries weigh, as a program gets them.

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
    let sizes = of(&firmware::rows(Some("c"))?)?;
    if options.json {
        println!("{:#}", json_of(&sizes));
    } else {
        println!("{}", table(&sizes));
    }
    Ok(())
}

/// The shared library, the bare-metal library as the programs in C contain it, and the module for browsers.
pub fn of(firmware: &[Row]) -> Result<Vec<Size>> {
    let mut sizes = vec![(
        format!("shared library, stripped ({})", std::env::consts::ARCH),
        file_bytes(&c_hosts::shared_library()?)?,
    )];
    sizes.extend(firmware::c_code(firmware).into_iter().map(|(program, bytes)| {
        (format!("bare-metal library with its caller, linked into {program}.c (Cortex-M4F, for size)"), bytes)
    }));
    sizes.push((String::from("wasm module"), file_bytes(&wasm::c_module()?)?));
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
