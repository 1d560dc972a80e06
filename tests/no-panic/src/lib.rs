//! Every public entry of the kernel as a C function: `cargo xtask no-panic` follows each one's references in
//! the optimised static library and fails if any leads to the panic handler or to an allocator.
//!
//! One file per module of the kernel; the entries for C, `hab_*`, are those of the crate in ffi/ themselves. A function's name begins with `check_`; being exported, its arguments are
//! opaque to the compiler, so nothing is evaluated in advance. What a call returns is folded into the status, so
//! that nothing is optimised away.
#![no_std]
// No C program calls these: they are linked and inspected, never run.
#![allow(improper_ctypes_definitions)]

// Linked for its exported functions.
extern crate habitus_ffi as _;

// They allocate, which the compiler has no crate for where `cargo xtask stack` builds.
#[cfg(not(target_os = "none"))]
mod control;
mod error;
mod fit;
mod format;
mod generator;
mod interop;
mod isometry;
mod linalg;
mod memory;
mod quantise;
mod rotation;
mod solve;
mod wavelet;

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn habitus_panic_path_survived(info: *const core::ffi::c_void) -> !;
    }
    // The argument keeps the source positions of panics in the library, for the report.
    // SAFETY: never runs; a library that contains this call fails the check.
    unsafe { habitus_panic_path_survived(core::ptr::from_ref(info).cast()) }
}
