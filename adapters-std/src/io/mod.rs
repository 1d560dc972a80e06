//! Files: what the rest of the crate reads and writes, and nothing else of the operating system.
//!
//! A reader is a pair: a function over the bytes of a file, which can be tested with any bytes, and a function over a
//! path. A reader never allocates what a file merely claims: sizes are compared with the bytes at hand first.
//! Every writer goes through [`atomic`], so that a file is there completely or as it was before.

pub mod atomic;
pub mod collection;
mod json_place;
pub mod landmarks;
pub mod landmarks_npy;
pub mod mesh;
#[cfg(feature = "models")]
pub mod model;
pub mod npy;
mod text;

use std::path::Path;

use crate::Error;

/// The content of the file at `path`.
///
/// # Errors
/// [`Error::Read`] when it cannot be opened or read.
pub fn file_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let unreadable = |source| Error::Read { path: path.to_owned(), source };
    // A device or a pipe may never end.
    if !std::fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(Error::input(format!("{}: no regular file; copy its content into one", path.display())));
    }
    std::fs::read(path).map_err(unreadable)
}
