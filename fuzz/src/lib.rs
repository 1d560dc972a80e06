//! What the fuzz targets assert: one module for each kind of input, one function `check` over the fuzzer's bytes.
//!
//! A check returns when the input is handled as promised and panics otherwise; libFuzzer keeps the bytes of a panic.
#![deny(unsafe_code)]

pub mod bilinear;
pub mod bodies;
pub mod body_case;
// C functions are called through pointers.
#[allow(unsafe_code)]
pub mod c_calls;
pub mod damage;
pub mod mesh;
pub mod model_file;
pub mod tables;
pub mod wavelet_case;
pub mod wavelets;

mod bits;
mod case;
mod numbers;
