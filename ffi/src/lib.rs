//! The kernel behind a C ABI; `include/habitus.h` is generated from this crate (`cargo xtask header`) and is its documentation for C.
//!
//! Every function checks what C cannot promise (null, alignment, overlap, lengths) in one place (`memory`), then calls the kernel. Nothing is
//! allocated on either side, nothing panics, and what a call writes is untouched when it returns an error.
//!
//! | module | what C sees |
//! |---|---|
//! | [`code`] | error codes, their names and sentences |
//! | [`model`] | opening a file, counts |
//! | [`sections`] | what a file holds: triangles, landmarks, names, statistics |
//! | [`body`] | joints of skinned models, how they move what they hold |
//! | [`evaluate`] | positions and derivatives by ranges, of models that need no workspace |
//! | [`prepared`] | forms with the identity or the pose fixed |
//! | [`evaluation`] | positions and derivatives of models and forms of every kind |
//! | [`fit`] | weights and placement from landmarks or points |
//! | [`wavelet`] | levels and windows of wavelet models, fits level by level |
#![cfg_attr(not(feature = "std"), no_std)]
// The names are those of the C header.
#![allow(non_camel_case_types)]

// In the order in which the header presents them; blank lines keep it.
pub mod code;

pub mod model;

pub mod sections;

pub mod body;

pub mod evaluate;

pub mod prepared;

pub mod evaluation;

pub mod fit;

pub mod wavelet;

#[cfg(feature = "layout")]
pub mod layout;
mod measurements;
mod memory;
mod shape;
mod tagged;
#[cfg(target_arch = "wasm32")]
mod wasm_layout;

#[cfg(target_arch = "wasm32")]
use {body::*, code::*, evaluation::*, fit::*, model::*, prepared::*, sections::*, wavelet::*};

/// Number of the binary interface. It grows with every function that is added; what exists keeps its meaning.
pub const HAB_ABI_VERSION: u32 = 1;

/// The `HAB_ABI_VERSION` that the library was built with: at least the header's that a program was compiled with, else the library is too old for it.
#[unsafe(no_mangle)]
pub extern "C" fn hab_abi_version() -> u32 {
    HAB_ABI_VERSION
}

/// What a bare-metal or browser build does on a panic, which no entry can reach: `cargo xtask no-panic` proves it.
#[cfg(all(not(feature = "std"), not(feature = "foreign-panic-handler"), not(test)))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
