//! Evaluates and fits deformation models of human shape on anything that runs code: no heap, no operating system, no panic, no `unsafe`.
//!
//! Promises, each held by a check of the project:
//! - no `alloc`: every buffer is the caller's; a function ending in `_req` says how much its twin needs;
//! - no panic is reachable from any public function, whatever the input; a failure is an [`Error`] of 12 bytes;
//! - the same model and parameters give the same bits on every target;
//! - every loop is bounded: solvers by their iteration limits, the reader by the limits of the format.
//!
//! Data flow: [`format::Model::open`] checks the bytes of a model file once and hands out views; a [`generator`] evaluates
//! `F(w): R^d -> R^3n` (Wuhrer, eq. 8.1) by ranges of vertices; [`fit`] finds the weights and the placement that explain landmarks
//! or points. [`prior`], [`solve`], [`rotation`] and [`linalg`] are what they stand on. [`isometry`] measures maps between surfaces (ch. 3).
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
#[macro_use]
extern crate std;

mod error;
pub mod fit;
pub mod format;
pub mod generator;
mod interop;
pub mod isometry;
pub mod linalg;
pub mod prior;
pub mod quantise;
pub mod real;
pub mod rotation;
pub mod skeleton;
pub mod skinning;
pub mod solve;
#[cfg(test)]
mod testing;
pub mod wavelet;
pub mod workspace;

pub use error::{Code, Error};
pub use real::Real;
