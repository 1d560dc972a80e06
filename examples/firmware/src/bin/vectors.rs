//! Compares the golden vectors with what the kernels give on this processor.
#![no_std]
#![no_main]

use habitus_firmware::{board, console, entry};
use habitus_golden::{Memory, Plain, REQUIREMENT, VECTORS, run as run_vectors};

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
    let summary = run_vectors(&VECTORS, &Plain, &mut memory, &mut |result| {
        if !result.is_equal() {
            console::text(result.file);
            console::text(": ");
            console::text(result.kernel);
            console::text(" ");
            console::line(result.name);
        }
    });
    console::number(summary.cases);
    console::text(" golden vectors, ");
    console::number(summary.numbers);
    console::text(" numbers, differing bits: ");
    console::number(summary.differing_bits);
    console::line("");
    console::measure("cases", summary.cases);
    console::measure("failed", summary.failed);
    console::measure("numbers", summary.numbers);
    console::measure("differing_bits", summary.differing_bits);
    if summary.failed > 0 || summary.cases < 240 {
        board::exit(1);
    }
}
