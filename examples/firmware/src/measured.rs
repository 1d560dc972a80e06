//! What the programs that open and evaluate a model share. Each of them is this with one kind and storage, so that no other's code is linked.

use crate::{board, cases, console};
use core::hint::black_box;
use habitus_core::Error;
use habitus_core::format::Model;
use habitus_core::generator::Generator;

/// Opens a model and evaluates it by ranges; prints a number and the stack of both. `mean` is a host's result, in the same order of summation.
pub fn open_evaluate<'a, G: Generator>(
    bytes: &'a [u8],
    mean: &[u8; 4],
    generator: impl FnOnce(&Model<'a>) -> Result<G, Error>,
) {
    let (model, stack_open) = board::stack_used(|| Model::open(black_box(bytes)));
    let Ok(generator) = model.and_then(|model| generator(&model)) else { board::exit(1) };
    let memory = board::memory();
    let (result, stack_evaluate) = board::stack_used(|| cases::mean_by_ranges(&generator, memory));
    let Ok(found) = result else { board::exit(1) };
    if found.to_le_bytes() != *mean {
        console::line("another result than the host's");
        board::exit(1);
    }
    console::text("mean of x + y + z, mm: ");
    console::real(found);
    console::line("");
    console::measure("stack", stack_open.max(stack_evaluate));
    console::measure("stack_open", stack_open);
    console::measure("stack_evaluate", stack_evaluate);
}
