//! Developer commands: `cargo xtask COMMAND`. One command, one file; the other files serve several.
#![forbid(unsafe_code)]

mod archive;
mod boards;
mod budgets;
mod c_header;
mod c_hosts;
mod c_library;
mod c_program;
mod call_graph;
mod compiler;
mod cross;
mod declared;
mod docs;
mod example_output;
mod figures;
mod firmware;
mod fused;
mod fuzz;
mod gltf;
mod golden;
mod header;
mod hosts;
mod install;
mod javascript;
mod layout;
mod lint;
mod nightly;
mod nightly_compiler;
mod no_panic;
mod page;
mod process;
mod public_functions;
mod rust_hosts;
mod side_by_side;
mod sizes;
mod stack;
mod targets;
mod test;
mod vectors;
mod wasm;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Developer commands of Habitus.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Runs every test of the workspace and says how many were skipped for want of data.
    Test(test::Options),
    /// Builds the firmware in Rust and in C, runs it on an emulated Cortex-M4F and M7, and compares stack, code size and instructions with the budgets: a part of `vectors`.
    Firmware(firmware::Options),
    /// Runs the golden vectors in every way: Rust, C, C++, JavaScript, this machine and the emulated ones; one table, and one of sizes.
    Vectors(vectors::Options),
    /// Weighs the shared library, the bare-metal library as linked, and the wasm module.
    Sizes(sizes::Options),
    /// Runs the golden vectors on AArch64 and on a big-endian processor, emulated: a part of `vectors`.
    Cross(cross::Options),
    /// Builds the module for browsers, runs its golden vectors and tests in Node.js, and assembles the page in target/web: a part of `vectors`.
    Wasm(wasm::Options),
    /// Drives the assembled page in a headless Chromium.
    Web,
    /// Makes the pages of `demo`, `fit` and `measure model` and opens them in a headless Chromium.
    Page,
    /// Proves that no entry of the kernel can panic or allocate.
    NoPanic,
    /// Sums the stack that every entry of the kernel can take on a Cortex-M, and compares it with the budgets.
    Stack(stack::Options),
    /// Feeds hostile inputs to every reader and compares the kernel with its reference, for a short time.
    Fuzz(fuzz::Options),
    /// Has the Khronos validator judge files of everything that our glTF writer can write.
    Gltf(gltf::Options),
    /// Builds the documentation with warnings as errors.
    Docs,
    /// Writes include/habitus.h from the crate in ffi/, and what JavaScript must know of it; with --check, fails when a committed file differs.
    Header(header::Options),
    /// Builds the libraries for C and C++ and installs them with headers, CMake package and pkg-config file.
    Install(install::Options),
    /// Installs, then builds and runs the examples and checks for C and C++, also under sanitizers and Valgrind.
    Hosts(hosts::Options),
    /// Checks formatting and lints with warnings as errors, the packages outside the workspace included.
    Lint,
    /// Runs what takes too long for every change.
    Nightly(nightly::Options),
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Test(options) => test::run(&options),
        Command::Firmware(options) => firmware::run(&options),
        Command::Vectors(options) => vectors::run(&options),
        Command::Sizes(options) => sizes::run(&options),
        Command::Cross(options) => cross::run(&options),
        Command::Wasm(options) => wasm::run(&options),
        Command::Web => wasm::web(),
        Command::Page => page::run(),
        Command::NoPanic => no_panic::run(),
        Command::Stack(options) => stack::run(&options),
        Command::Fuzz(options) => fuzz::run(&options),
        Command::Gltf(options) => gltf::run(&options),
        Command::Docs => docs::run(),
        Command::Header(options) => header::run(&options),
        Command::Install(options) => install::run(&options),
        Command::Hosts(options) => hosts::run(&options),
        Command::Lint => lint::run(),
        Command::Nightly(options) => nightly::run(&options),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {}", failure.sentence);
            ExitCode::from(failure.status)
        }
    }
}
