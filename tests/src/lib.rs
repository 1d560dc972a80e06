//! What the tests that cross crates share.
#![forbid(unsafe_code)]

pub mod data;
pub mod gltf_files;
pub mod models;
pub mod random;
pub mod small_body;
pub mod small_linear;
pub mod small_model;
pub mod small_wavelet;
pub mod vectors;

pub use habitus_reference as reference;

/// The programs in the README compile and run.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
