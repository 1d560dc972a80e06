//! `cargo xtask vectors`: the golden vectors in every way that there is, in one table, and what the libraries weigh.
//!
//! Fails on a differing bit, a case that did not run, or a changed bit that was not noticed; and on what `cargo xtask firmware` objects to,
//! whose programs it runs.

use crate::cross::Optimised;
use crate::golden::{self, Cases};
use crate::process::Result;
use crate::{c_hosts, c_library, cross, firmware, rust_hosts, sizes, wasm};
use serde_json::json;
use std::time::Instant;

/// Options of `cargo xtask vectors`.
#[derive(clap::Args)]
pub struct Options {
    /// Print runs and sizes as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
    /// Also the firmware that is optimised for speed, and the other processors with the libraries as they are shipped.
    #[arg(long)]
    speed: bool,
}

/// Builds, runs, compares.
pub fn run(options: &Options) -> Result<()> {
    // Every missing tool before the first build.
    firmware::ready()?;
    cross::ready()?;
    wasm::ready()?;
    let known = Cases::read()?;
    let mut runs = timed("Rust on this machine", rust_hosts::runs)?;
    let optimised = if options.speed { Optimised::AsShipped } else { Optimised::Quickly };
    // One build after the other leaves cores idle: two rows of them, of about the same length.
    let (here, there) = std::thread::scope(|scope| {
        let there = scope.spawn(|| -> Result<_> {
            Ok((timed("wasm", wasm::made)?, timed("AArch64 and s390x", || cross::runs(optimised))?))
        });
        let here = || -> Result<_> {
            let libraries = timed("library for C and C++", || c_library::built(c_hosts::PROFILE))?;
            let native = timed("C and C++ on this machine", || c_hosts::native_runs(&libraries))?;
            let rows =
                timed("Cortex-M4F and M7", || firmware::rows(|profile| options.speed || profile != firmware::SPEED))?;
            Ok((libraries, native, rows))
        };
        (here(), there.join().unwrap_or_else(|_| Err(String::from("a run panicked").into())))
    });
    let ((libraries, native, rows), (wasm, (emulated, mut objections))) = (here?, there?);
    runs.extend(native);
    runs.extend(wasm.runs);
    runs.extend(firmware::golden_runs(&rows)?);
    runs.extend(emulated);
    objections.extend(wasm.objections);
    let mut sizes = sizes::of(&libraries, &rows)?;
    sizes.extend(wasm.sizes);
    if options.json {
        println!("{:#}", json!({ "runs": golden::json_of(&runs, &known), "sizes": sizes::json_of(&sizes) }));
    } else {
        println!("{}\n\n{}\n\n{}", golden::table(&runs, &known), sizes::table(&sizes), firmware::table(&rows));
    }
    objections.extend(firmware::objections(&rows)?);
    let wrong = runs.iter().flat_map(|run| run.objections(&known));
    let all: Vec<String> = wrong.chain(objections).collect();
    if all.is_empty() { Ok(()) } else { Err(all.join("\n").into()) }
}

/// Says how long a part took.
fn timed<T>(part: &str, work: impl FnOnce() -> Result<T>) -> Result<T> {
    let start = Instant::now();
    let result = work()?;
    eprintln!("-- {part}: {:.0} s", start.elapsed().as_secs_f64());
    Ok(result)
}
