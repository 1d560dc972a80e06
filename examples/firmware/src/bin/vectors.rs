//! Compares the golden vectors with what the kernels give on this processor, and shows that a changed bit is noticed.
#![no_std]
#![no_main]

use habitus_firmware::{board, console, entry};
use habitus_golden::{CASE_BYTES, Memory, REQUIREMENT, VECTORS, noticed, run as run_vectors};

entry!(run);

fn run() {
    let mut memory = Memory {
        floats: board::memory(),
        doubles: &mut [0.0; REQUIREMENT.doubles],
        bytes: &mut [0; REQUIREMENT.bytes],
        indices: &mut [0; REQUIREMENT.indices],
    };
    // Clearing all of the RAM for every case would take longer than the cases.
    memory.floats = memory.floats.split_at_mut_checked(REQUIREMENT.floats).unwrap_or_default().0;
    let summary = run_vectors(&VECTORS, &mut memory, &mut |result| {
        if !result.is_equal() {
            console::text(result.file);
            console::text(": ");
            console::text(result.kernel);
            console::text(" ");
            console::line(result.name);
        }
    });
    let (changed, noticed) = noticed(&VECTORS, &mut memory, &mut [0; CASE_BYTES], &mut |file, case| {
        console::text("a changed bit was not noticed: ");
        console::text(file);
        console::text(": ");
        console::text(case.kernel);
        console::text(" ");
        console::line(case.name);
    });
    console::measure("cases", summary.cases);
    console::measure("failed", summary.failed);
    console::measure("numbers", summary.numbers);
    console::measure("differing_bits", summary.differing_bits);
    console::measure("changed", changed);
    console::measure("noticed", noticed);
    console::measure("pointer_bits", usize::BITS);
    if summary.failed > 0 || summary.cases < 240 || noticed < changed {
        board::exit(1);
    }
}
