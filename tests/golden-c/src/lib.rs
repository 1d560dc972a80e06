//! The golden vectors behind C functions: `cargo xtask cross` links them with `main.c` and `cargo xtask wasm` loads them from
//! `run.mjs`, so that the vectors run where no Rust program does.
//!
//! The host is told of failures through a function that it defines, `golden_report`; no memory changes hands.
#![no_std]

mod control;
mod panic;
mod report;

use habitus_golden::{Memory, Plain, REQUIREMENT, Summary, VECTORS, Vectors};
use report::{Line, report};

/// Runs every vector. Each failing case is reported in a line; the sums go to `golden_figure`.
///
/// Returns 1 when every bit is as it should be, else 0.
#[unsafe(no_mangle)]
pub extern "C" fn golden_run() -> u32 {
    let summary = summary_of(&VECTORS, &mut |result| {
        if !result.is_equal() {
            report(&Line::of_case(result));
        }
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
    let (tried, noticed) = control::noticed();
    report::figure("changed", tried);
    report::figure("noticed", noticed);
    u32::from(noticed == tried && tried > 0)
}

fn summary_of(vectors: &Vectors<'_>, each: &mut dyn FnMut(&habitus_golden::CaseResult<'_>)) -> Summary {
    let mut memory = Memory {
        floats: &mut [0.0; REQUIREMENT.floats],
        doubles: &mut [0.0; REQUIREMENT.doubles],
        bytes: &mut [0; REQUIREMENT.bytes],
        indices: &mut [0; REQUIREMENT.indices],
    };
    habitus_golden::run(vectors, &Plain, &mut memory, each)
}
