//! Runs the golden vectors and their negative control on this processor: `cargo run --release -p habitus-golden --example figures -- plain|avx2`.
//!
//! Prints each failing case, then the figures as lines `@name value`; `@unsupported 1` alone where the processor lacks these vectors.

use habitus_golden::{Backend, CASE_BYTES, Memory, Plain, REQUIREMENT, VECTORS, noticed, run};
use std::process::ExitCode;

#[cfg(target_arch = "x86_64")]
#[path = "../tests/wide/mod.rs"]
mod wide;

fn main() -> ExitCode {
    let way = std::env::args().nth(1).unwrap_or_default();
    match way.as_str() {
        "plain" => figures(&Plain),
        #[cfg(target_arch = "x86_64")]
        "avx2" => pulp::x86::V3::try_new().map_or_else(unsupported, |arch| figures(&wide::Avx2(arch))),
        #[cfg(not(target_arch = "x86_64"))]
        "avx2" => unsupported(),
        other => {
            eprintln!("`{other}` is no way to run the vectors: plain or avx2");
            ExitCode::from(2)
        }
    }
}

/// This processor has no such vectors.
fn unsupported() -> ExitCode {
    println!("@unsupported 1");
    ExitCode::SUCCESS
}

fn figures(backend: &impl Backend) -> ExitCode {
    let memory = &mut Memory {
        floats: &mut vec![0.0; REQUIREMENT.floats],
        doubles: &mut vec![0.0; REQUIREMENT.doubles],
        bytes: &mut vec![0; REQUIREMENT.bytes],
        indices: &mut vec![0; REQUIREMENT.indices],
    };
    let sums = run(&VECTORS, backend, memory, &mut |result| {
        if !result.is_equal() {
            println!("{result:?}");
        }
    });
    let (changed, noticed) = noticed(&VECTORS, backend, memory, &mut vec![0; CASE_BYTES], &mut |file, case| {
        println!("a changed bit was not noticed: {file}: {} {}", case.kernel, case.name);
    });
    for (name, value) in [
        ("cases", sums.cases),
        ("failed", sums.failed),
        ("numbers", sums.numbers),
        ("differing_bits", sums.differing_bits),
        ("changed", changed),
        ("noticed", noticed),
        ("pointer_bits", usize::BITS),
    ] {
        println!("@{name} {value}");
    }
    if sums.failed == 0 && sums.cases > 0 && noticed == changed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
