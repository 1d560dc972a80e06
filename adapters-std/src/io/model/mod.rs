//! Model files: reading with errors that name file and section, writing `.hab`, exporting NPZ.

pub mod hab;
pub mod npz;
pub mod source;

pub use hab::{file_len, opened, write};
pub use source::{Coefficients, ModePrior, ModelSource};
