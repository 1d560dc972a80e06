//! Model files: reading with errors that name file and section, writing `.hab`, exporting NPZ.

pub mod hab;
pub mod npz;
mod quantise;
#[cfg(test)]
mod samples;
mod skin;
pub mod source;
mod terms;

pub use hab::{file_len, opened, write};
pub use quantise::{QuantisationError, quantise};
pub use skin::{JointSource, SkinSource};
pub use source::{Coefficients, LinearForm, ModePrior, ModelSource, WaveletForm};
