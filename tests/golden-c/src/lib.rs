//! The golden vectors behind C functions: `cargo xtask cross` links them with `main.c` and `cargo xtask wasm` loads them from
//! `run.mjs`, so that the vectors run where no Rust program does.
//!
//! The host is told of failures through a function that it defines, `golden_report`; no memory changes hands.
#![no_std]

mod panic;
mod report;

use habitus_golden::{CASE_BYTES, Memory, REQUIREMENT, Summary, VECTORS};
use report::{Line, report};

/// Runs every vector. Each failing case is reported in a line; the sums go to `golden_figure`.
///
/// Returns 1 when every bit is as it should be, else 0.
#[unsafe(no_mangle)]
pub extern "C" fn golden_run() -> u32 {
    let summary = with_memory(|memory| {
        habitus_golden::run(&VECTORS, memory, &mut |result| {
            if !result.is_equal() {
                report(&Line::of_case(result));
            }
        })
    });
    let Summary { cases, failed, numbers, differing_bits } = summary;
    for (name, value) in
        [("cases", cases), ("failed", failed), ("numbers", numbers), ("differing_bits", differing_bits)]
    {
        report::figure(name, value);
    }
    report::figure("pointer_bits", usize::BITS);
    report::figure("big_endian", u32::from(cfg!(target_endian = "big")));
    u32::from(failed == 0 && cases > 0)
}

/// Negative control: runs each case with one bit of its last number changed. Each case that passes in spite of it is reported; the
/// number of those that were noticed goes to `golden_figure`.
///
/// Returns 1 when every change was noticed, else 0.
#[unsafe(no_mangle)]
pub extern "C" fn golden_control() -> u32 {
    let (tried, noticed) = with_memory(|memory| {
        habitus_golden::noticed(&VECTORS, memory, &mut [0; CASE_BYTES], &mut |file, case| {
            let parts = ["a changed bit was not noticed: ", file, ": ", case.kernel, " ", case.name];
            report(&Line::of_text(&parts));
        })
    });
    report::figure("changed", tried);
    report::figure("noticed", noticed);
    u32::from(noticed == tried && tried > 0)
}

fn with_memory<T>(work: impl FnOnce(&mut Memory<'_>) -> T) -> T {
    work(&mut Memory {
        floats: &mut [0.0; REQUIREMENT.floats],
        doubles: &mut [0.0; REQUIREMENT.doubles],
        bytes: &mut [0; REQUIREMENT.bytes],
        indices: &mut [0; REQUIREMENT.indices],
    })
}
