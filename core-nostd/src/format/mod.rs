//! The model file `.hab`: header, sections, checksums, typed zero-copy views, limits. Specified in `docs/model-file.md`.
//!
//! [`Model::open`] checks everything once; what it hands out cannot leave the file. [`write()`] makes a file from its sections.

pub mod limits;

mod content;
mod content_skin;
mod crc;
mod header;
mod model;
mod section;
mod view;
mod write;

pub use header::{Header, Kind};
pub use model::{Checksums, Gaussian, Mode, Model, Spread};
pub use section::{ElementType, Section, SectionId, Sections};
pub use view::{Faces, Floats, Indices, Lines};
pub use write::{SectionSource, write, written_len};

#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::forged;
