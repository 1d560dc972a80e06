//! Learns deformation models of human shape from 3D scans and works with them.
//!
//! Data flow: [`io`] reads files into [`mesh`] values and tensors, `face` learns a model from them,
//! `measure` tells how good it is, `report` shows it; the model itself is evaluated and fitted by `habitus_core`.
#![forbid(unsafe_code)]

pub mod cli;
pub mod demo;
mod dense;
pub mod error;
pub mod evaluate;
pub mod face;
pub mod generate;
pub mod io;
pub mod measure;
pub mod mesh;
pub mod register;
pub mod report;
pub mod synth;

pub use error::{Error, Place};
