//! Runs the golden vectors and their negative control on this processor: `cargo run --release -p habitus-golden --example figures`.
//!
//! Prints each failing case, then the figures as lines `@name value`.

use habitus_golden::{CASE_BYTES, Memory, REQUIREMENT, VECTORS, noticed, run};
use std::process::ExitCode;

fn main() -> ExitCode {
    let memory = &mut Memory {
        floats: &mut vec![0.0; REQUIREMENT.floats],
        doubles: &mut vec![0.0; REQUIREMENT.doubles],
        bytes: &mut vec![0; REQUIREMENT.bytes],
        indices: &mut vec![0; REQUIREMENT.indices],
    };
    let sums = run(&VECTORS, memory, &mut |result| {
        if !result.is_equal() {
            println!("{result:?}");
        }
    });
    let (changed, noticed) = noticed(&VECTORS, memory, &mut vec![0; CASE_BYTES], &mut |file, case| {
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
