//! Nothing but the start-up and the console: what the other programs' sizes are counted from.
#![no_std]
#![no_main]

use habitus_firmware::{board, console, entry};

entry!(run);

fn run() {
    let ((), bytes) = board::stack_used(|| ());
    console::measure("stack", bytes);
    console::real(board::memory().len() as f32);
    console::line("");
}
