//! The range of the vertex indices of a file whose vertices may follow its faces.

use std::path::Path;

use crate::{Error, Place};

/// The largest index seen and where: once all vertices are known, it alone decides whether every index is good.
#[derive(Debug, Default)]
pub(super) struct IndexRange {
    largest: Option<(u64, Place)>,
}

impl IndexRange {
    /// Notes `index`, counted from 0 and found at `place`.
    pub(super) fn include(&mut self, index: u64, place: Place) {
        if self.largest.is_none_or(|(largest, _)| index > largest) {
            self.largest = Some((index, place));
        }
    }

    /// Whether all indices are below `n`; `what` they index and the number they count `from` are for the message.
    pub(super) fn check(&self, n: usize, what: &str, from: u64, path: &Path) -> Result<(), Error> {
        match self.largest {
            Some((index, place)) if index >= n as u64 => {
                let problem =
                    format!("a face names {what} {}, but the file has {n}, counted from {from}", index + from);
                Err(Error::malformed(path, place, problem))
            }
            _ => Ok(()),
        }
    }
}
