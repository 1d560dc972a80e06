//! Evaluates and fits deformation models of human shape.
#![no_std]
#![forbid(unsafe_code)]

mod error;
pub use error::{Code, Error};
