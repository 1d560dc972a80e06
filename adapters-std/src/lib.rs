//! Learns deformation models of human shape from 3D scans and works with them.
//!
//! Data flow: [`io`] reads files into [`mesh`] values and tensors, `face` learns a model from them,
//! `measure` tells how good it is, `report` shows it; the model itself is evaluated and fitted by `habitus_core`.
#![forbid(unsafe_code)]

pub mod error;
pub mod io;
pub mod mesh;
pub mod report;
pub mod synth;

pub use error::{Error, Place};
