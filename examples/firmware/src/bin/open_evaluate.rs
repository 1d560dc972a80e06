//! Stack and code of "open a model, evaluate it by ranges".
#![no_std]
#![no_main]

use habitus_core::format::Model;
use habitus_firmware::{board, cases, console, entry, include_model};

entry!(run);

fn run() {
    let bytes = include_model!("../../models/small.hab");
    let (model, stack_open) = board::stack_used(|| Model::open(core::hint::black_box(bytes)));
    let Ok(generator) = model.and_then(|model| model.bilinear()) else { board::exit(1) };
    let mut range = [0.0; 3 * 64];
    let (result, stack_evaluate) = board::stack_used(|| cases::mean_by_ranges(&generator, &mut range));
    let Ok(mean) = result else { board::exit(1) };
    // A host's result, in the same order of summation.
    if mean.to_le_bytes() != *include_model!("../../models/small.mean") {
        console::line("another result than the host's");
        board::exit(1);
    }
    console::text("mean of x + y + z, mm: ");
    console::real(mean);
    console::line("");
    console::measure("stack", stack_open.max(stack_evaluate));
    console::measure("stack_open", stack_open);
    console::measure("stack_evaluate", stack_evaluate);
}
