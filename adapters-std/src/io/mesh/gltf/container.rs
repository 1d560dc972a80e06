//! The container of a `.glb` file: a header of 12 bytes, then chunks; the first is JSON, the second the binary buffer.

use std::path::Path;

use super::super::losses::Losses;
use crate::{Error, Place};

/// The bytes with which a `.glb` file begins.
pub(super) const MAGIC: &[u8; 4] = b"glTF";

/// The parts of a `.glb` file.
#[derive(Debug)]
pub(super) struct Chunks<'a> {
    pub json: &'a [u8],
    /// The byte of the file at which `json` begins.
    pub json_start: usize,
    pub binary: Option<&'a [u8]>,
    /// The byte of the file at which `binary` begins.
    pub binary_start: usize,
}

/// The chunks of a file that begins with [`MAGIC`]; chunks of unknown types are noted.
pub(super) fn chunks<'a>(bytes: &'a [u8], path: &Path, losses: &mut Losses) -> Result<Chunks<'a>, Error> {
    let malformed = |byte: usize, problem: String| Err(Error::malformed(path, Place::Byte(byte as u64), problem));
    let number = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let (Some(version), Some(length)) = (number(4), number(8)) else {
        return malformed(bytes.len(), "the file ends in its header of 12 bytes: it is truncated".into());
    };
    if version != 2 {
        return malformed(4, format!("version {version} of glTF; 2 is read: save it as glTF 2.0"));
    }
    let length = length as usize;
    if length > bytes.len() || length < 12 {
        let problem = format!("the header announces {length} bytes, but the file has {}: it is truncated", bytes.len());
        return malformed(8, problem);
    }
    losses.note(bytes.len() - length, "byte behind the announced end", "bytes behind the announced end");
    let (mut at, mut json, mut binary, mut binary_start, mut n_unknown) = (12, None, None, 0, 0);
    while at < length {
        let (Some(size), Some(kind)) = (number(at).filter(|_| at + 8 <= length), number(at + 4)) else {
            return malformed(at, "the file ends in the header of a chunk, which has 8 bytes: it is truncated".into());
        };
        let start = at + 8;
        // Sizes are below 2^32 and a file in memory is no longer than `isize`: 64 bits hold the sum.
        if start as u64 + u64::from(size) > length as u64 {
            let problem = format!("a chunk of {size} bytes, but {} follow: the file is truncated", length - start);
            return malformed(at, problem);
        }
        let chunk = &bytes[start..start + size as usize];
        match &kind.to_le_bytes() {
            b"JSON" if at == 12 => json = Some((start, chunk)),
            b"BIN\0" if json.is_some() && binary.is_none() => (binary, binary_start) = (Some(chunk), start),
            _ if json.is_none() => {
                return malformed(at + 4, "the first chunk is not JSON: is it a GLB file?".into());
            }
            _ => n_unknown += 1,
        }
        at = start + size as usize;
    }
    losses.note(n_unknown, "chunk of an unknown type", "chunks of unknown types");
    match json {
        Some((json_start, json)) => Ok(Chunks { json, json_start, binary, binary_start }),
        None => malformed(12, "there is no JSON chunk in it".into()),
    }
}

/// The file of these chunks, each padded to a multiple of four bytes; `None` when it is too long for its header.
pub(super) fn file(json: &[u8], binary: &[u8]) -> Option<Vec<u8>> {
    let (json_size, binary_size) = (json.len().next_multiple_of(4), binary.len().next_multiple_of(4));
    let length = 12 + 8 + json_size + 8 + binary_size;
    let mut bytes = Vec::with_capacity(length);
    bytes.extend_from_slice(MAGIC);
    for number in [2, length, json_size] {
        bytes.extend_from_slice(&u32::try_from(number).ok()?.to_le_bytes());
    }
    bytes.extend_from_slice(b"JSON");
    bytes.extend_from_slice(json);
    bytes.resize(20 + json_size, b' ');
    bytes.extend_from_slice(&u32::try_from(binary_size).ok()?.to_le_bytes());
    bytes.extend_from_slice(b"BIN\0");
    bytes.extend_from_slice(binary);
    bytes.resize(length, 0);
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(bytes: &[u8]) -> String {
        chunks(bytes, Path::new("a.glb"), &mut Losses::default()).expect_err("must be refused").to_string()
    }

    #[test]
    fn chunks_are_what_was_written_with_padding() {
        let bytes = file(b"{\"a\"}", b"xyz").unwrap();
        assert_eq!(bytes.len(), 12 + 8 + 8 + 8 + 4);
        let mut losses = Losses::default();
        let chunks = chunks(&bytes, Path::new("a"), &mut losses).unwrap();
        assert_eq!((chunks.json, chunks.json_start, chunks.binary), (&b"{\"a\"}   "[..], 20, Some(&b"xyz\0"[..])));
        assert_eq!(chunks.binary_start, 36);
        assert!(losses.into_clauses().is_empty());
    }

    #[test]
    fn what_is_unknown_is_noted() {
        let mut bytes = file(b"{}", b"").unwrap();
        bytes.extend_from_slice(b"\0\0\0\0ABCD");
        let length = (bytes.len() as u32).to_le_bytes();
        bytes[8..12].copy_from_slice(&length);
        bytes.push(b'x');
        let mut losses = Losses::default();
        assert!(chunks(&bytes, Path::new("a"), &mut losses).is_ok());
        assert_eq!(losses.into_clauses(), ["1 byte behind the announced end", "1 chunk of an unknown type"]);
    }

    #[test]
    fn errors_name_the_byte() {
        let sound = file(b"{}", b"abcd").unwrap();
        let changed = |at: usize, byte: u8| {
            let mut bytes = sound.clone();
            bytes[at] = byte;
            error(&bytes)
        };
        assert!(error(&sound[..11]).contains("byte 11: the file ends in its header"));
        assert!(changed(4, 1).contains("byte 4: version 1 of glTF"));
        assert!(error(&sound[..30]).contains("byte 8: the header announces 36 bytes, but the file has 30"));
        assert!(changed(8, 34).contains("byte 24: a chunk of 4 bytes, but 2 follow"));
        assert!(changed(8, 28).contains("byte 24: the file ends in the header of a chunk"));
        assert!(changed(15, 0xFF).contains("byte 12: a chunk of 4278190084 bytes, but 16 follow"));
        assert!(changed(16, b'X').contains("byte 16: the first chunk is not JSON"));
        assert!(changed(8, 12).contains("byte 12: there is no JSON chunk"));
    }
}
