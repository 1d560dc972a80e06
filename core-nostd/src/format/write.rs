//! Writes a model file into the caller's memory. `write(read(file)) == file`, byte for byte.

use super::header::{HEADER_BYTES, Header, field, put};
use super::section::{ALIGNMENT, ENTRY_BYTES, ElementType, Section, entry_bytes};
use super::{crc::crc32, limits, model::Model};
use crate::Error;
use crate::workspace::saturated;

/// One section to be written.
#[derive(Debug, Clone, Copy)]
pub struct SectionSource<'a> {
    /// Identifier.
    pub id: u32,
    /// A reader that does not know the identifier may ignore the section.
    pub may_ignore: bool,
    /// Type of the elements.
    pub element: ElementType,
    /// Length of each axis, slowest first; 1 to 4 axes.
    pub shape: &'a [u32],
    /// Content, little endian.
    pub bytes: &'a [u8],
}

impl<'a> SectionSource<'a> {
    /// A section that was read, to be written again.
    pub fn from_section(section: &'a Section<'_>) -> Self {
        SectionSource {
            id: section.id,
            may_ignore: section.may_ignore,
            element: section.element,
            shape: section.shape.get(..section.rank).unwrap_or_default(),
            bytes: section.bytes,
        }
    }
}

/// Bytes that [`write()`] needs; `None` when they exceed the address space.
pub fn written_len(sections: &[SectionSource<'_>]) -> Option<usize> {
    let head = HEADER_BYTES.checked_add(sections.len().checked_mul(ENTRY_BYTES)?)?;
    sections
        .iter()
        .try_fold(head, |end, section| end.checked_next_multiple_of(ALIGNMENT)?.checked_add(section.bytes.len()))?
        .checked_next_multiple_of(ALIGNMENT)
}

/// Writes a model file and returns the part of `out` that it takes. What was written has passed every check of [`Model::open`].
///
/// Errors: `LimitExceeded` for too many sections, `OutputTooSmall`, and whatever [`Model::open`] says of the result (`out` is then overwritten).
/// Panics: never.
pub fn write<'o>(header: &Header, sections: &[SectionSource<'_>], out: &'o mut [u8]) -> Result<&'o mut [u8], Error> {
    let count = saturated(sections.len());
    if count > limits::MAX_SECTIONS {
        return Err(Error::LimitExceeded { found: count, limit: limits::MAX_SECTIONS });
    }
    let given = out.len();
    let needed = written_len(sections).unwrap_or(usize::MAX);
    let Some(file) = out.get_mut(..needed) else {
        return Err(Error::OutputTooSmall { needed: saturated(needed), given: saturated(given) });
    };
    file.fill(0);
    put(file, 0, &header.bytes(count, needed as u64));
    let mut end = HEADER_BYTES + sections.len() * ENTRY_BYTES;
    for (position, section) in sections.iter().enumerate() {
        let from = end.next_multiple_of(ALIGNMENT);
        let entry = entry_bytes(section, from as u64, crc32(&[section.bytes]));
        put_at(file, HEADER_BYTES + position * ENTRY_BYTES, &entry);
        put_at(file, from, section.bytes);
        end = from + section.bytes.len();
    }
    let table_end = HEADER_BYTES + sections.len() * ENTRY_BYTES;
    let crc = {
        let head = file.get(..field::CRC).unwrap_or_default();
        let table = file.get(HEADER_BYTES..table_end).unwrap_or_default();
        crc32(&[head, table])
    };
    put(file, field::CRC, &crc.to_le_bytes());
    Model::open(file)?;
    Ok(file)
}

fn put_at(file: &mut [u8], from: usize, bytes: &[u8]) {
    if let Some(to) = from.checked_add(bytes.len()).and_then(|end| file.get_mut(from..end)) {
        for (to, &from) in to.iter_mut().zip(bytes) {
            *to = from;
        }
    }
}
