//! Learns deformation models of human shape from 3D scans and works with them.
//!
//! Data flow: [`io`] reads files into [`mesh`] values and tensors, `face` learns a model from them,
//! `measure` tells how good it is, `report` shows it; the model itself is evaluated and fitted by `habitus_core`.
//!
//! Without the feature `models` (on by default) there are only [`io`], but for `io::model`, and [`mesh`].
#![forbid(unsafe_code)]

#[cfg(feature = "models")]
pub mod cli;
#[cfg(feature = "models")]
pub mod demo;
#[cfg(feature = "models")]
mod dense;
pub mod error;
#[cfg(feature = "models")]
pub mod evaluate;
#[cfg(feature = "models")]
pub mod face;
#[cfg(feature = "models")]
pub mod generate;
pub mod io;
#[cfg(feature = "models")]
pub mod measure;
pub mod mesh;
#[cfg(feature = "models")]
pub mod parameters;
#[cfg(feature = "models")]
pub mod register;
#[cfg(feature = "models")]
pub mod report;
#[cfg(feature = "models")]
pub mod spatial;
#[cfg(feature = "models")]
pub mod synth;

pub use error::{Error, Place};
