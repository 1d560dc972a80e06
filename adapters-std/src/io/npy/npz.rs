//! Reading arrays out of an NPZ archive, stored or deflated.

use std::io::{Cursor, Read};
use std::path::Path;

use npyz::zip::{CompressionMethod, ZipArchive};

use super::{parse_f64, parse_u32};
use crate::io::file_bytes;
use crate::{Error, Place};

/// Deflate cannot grow data by more than this.
const LARGEST_RATIO: u64 = 1032;

/// An NPZ archive whose bytes are in memory.
pub struct NpzReader<'a> {
    path: &'a Path,
    archive: ZipArchive<Cursor<Vec<u8>>>,
}

impl<'a> NpzReader<'a> {
    /// Opens the archive at `path`.
    ///
    /// # Errors
    /// [`Error::Read`]; [`Error::Malformed`] for what is no zip archive.
    pub fn open(path: &'a Path) -> Result<Self, Error> {
        Self::parse(file_bytes(path)?, path)
    }

    /// Opens the bytes of an archive that came from `path`.
    ///
    /// # Errors
    /// [`Error::Malformed`].
    pub fn parse(bytes: Vec<u8>, path: &'a Path) -> Result<Self, Error> {
        let archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| {
            Error::malformed(path, Place::Whole, format!("no NPZ archive ({error}); save it with numpy.savez"))
        })?;
        Ok(NpzReader { path, archive })
    }

    /// The names of the arrays, sorted.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            self.archive.file_names().filter_map(|name| name.strip_suffix(".npy")).map(str::to_owned).collect();
        names.sort();
        names
    }

    /// Shape and values of a numeric array, in C order.
    ///
    /// # Errors
    /// [`Error::Input`] for an unknown name; [`Error::Malformed`] for a damaged entry and all that [`parse_f64`] refuses.
    pub fn f64(&mut self, name: &str) -> Result<(Vec<usize>, Vec<f64>), Error> {
        parse_f64(&self.entry(name)?, &self.path.join(name))
    }

    /// Shape and values of an array of indices.
    ///
    /// # Errors
    /// As [`NpzReader::f64`], with [`parse_u32`].
    pub fn u32(&mut self, name: &str) -> Result<(Vec<usize>, Vec<u32>), Error> {
        parse_u32(&self.entry(name)?, &self.path.join(name))
    }

    /// The bytes of an entry; memory grows with the data, not with what the archive claims.
    fn entry(&mut self, name: &str) -> Result<Vec<u8>, Error> {
        let known = self.names().join(", ");
        let entry = self.archive.by_name(&format!("{name}.npy")).map_err(|error| match error {
            npyz::zip::result::ZipError::FileNotFound => {
                Error::input(format!("{}: no array {name:?}; it holds {known}", self.path.display()))
            }
            error => Error::malformed(self.path, Place::Whole, format!("array {name:?} is damaged: {error}")),
        })?;
        // Other methods have windows of any size: a few bytes of Zstandard ask for 128 MB.
        let method = entry.compression();
        if !matches!(method, CompressionMethod::Stored | CompressionMethod::Deflated) {
            let problem = format!("array {name:?} is compressed by {method}; save it with numpy.savez_compressed");
            return Err(Error::malformed(self.path, Place::Whole, problem));
        }
        let mut bytes = Vec::new();
        let most = entry.compressed_size().saturating_mul(LARGEST_RATIO).saturating_add(64);
        entry.take(most).read_to_end(&mut bytes).map_err(|error| {
            Error::malformed(
                self.path,
                Place::Whole,
                format!("array {name:?} is damaged ({error}); copy the file again"),
            )
        })?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::super::NpzWriter;
    use super::*;

    fn archive() -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        let mut npz = NpzWriter::new();
        npz.add("tensor", &[2, 3], &[1.0f32, 2.0, 3.0, 4.0, 5.0, 6.5][..]).unwrap();
        npz.add("faces", &[1, 3], &[0u32, 1, 2][..]).unwrap();
        npz.finish(&path).unwrap();
        std::fs::read(path).unwrap()
    }

    #[test]
    fn what_was_written_is_read() {
        let mut npz = NpzReader::parse(archive(), Path::new("a.npz")).unwrap();
        assert_eq!(npz.names(), ["faces", "tensor"]);
        assert_eq!(npz.f64("tensor").unwrap(), (vec![2, 3], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.5]));
        assert_eq!(npz.u32("faces").unwrap(), (vec![1, 3], vec![0, 1, 2]));
        assert!(npz.f64("absent").unwrap_err().to_string().contains("it holds faces, tensor"));
    }

    #[test]
    fn a_deflated_archive_is_read() {
        let npy = {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("x.npy");
            super::super::write_f64(&path, &[100], &[0.25; 100]).unwrap();
            std::fs::read(path).unwrap()
        };
        let mut zip = npyz::zip::ZipWriter::new(Cursor::new(Vec::new()));
        let options = npyz::zip::write::FileOptions::default().compression_method(CompressionMethod::Deflated);
        zip.start_file("x.npy", options).unwrap();
        std::io::Write::write_all(&mut zip, &npy).unwrap();
        let bytes = zip.finish().unwrap().into_inner();
        assert!(bytes.len() < npy.len());
        let mut npz = NpzReader::parse(bytes, Path::new("x.npz")).unwrap();
        assert_eq!(npz.f64("x").unwrap().1, [0.25; 100]);
    }

    /// A frame of 34 bytes whose header asks for a window of 128 MB; found by the fuzz target `tables`.
    #[test]
    fn a_method_that_numpy_does_not_write_is_refused_before_it_is_unpacked() {
        let mut zip = npyz::zip::ZipWriter::new(Cursor::new(Vec::new()));
        let options = npyz::zip::write::FileOptions::default().compression_method(CompressionMethod::Stored);
        zip.start_file("x.npy", options).unwrap();
        std::io::Write::write_all(&mut zip, b"\x28\xb5\x2f\xfd\x00\x88\x01\x00\x00").unwrap();
        let mut bytes = zip.finish().unwrap().into_inner();
        // The method stands in the local header and in the directory: 93 is Zstandard.
        let directory = bytes.windows(4).position(|word| word == b"PK\x01\x02").unwrap();
        bytes[8] = 93;
        bytes[directory + 10] = 93;
        let mut npz = NpzReader::parse(bytes, Path::new("x.npz")).unwrap();
        let message = npz.f64("x").unwrap_err().to_string();
        assert!(message.contains("\"x\" is compressed by Zstd; save it with numpy.savez_compressed"), "{message}");
    }

    #[test]
    fn every_truncation_and_flip_is_an_error_or_an_array() {
        let bytes = archive();
        let read = |bytes: Vec<u8>| {
            if let Ok(mut npz) = NpzReader::parse(bytes, Path::new("a.npz")) {
                for name in npz.names() {
                    let _ = npz.f64(&name);
                }
            }
        };
        for len in 0..bytes.len() {
            read(bytes[..len].to_vec());
        }
        for at in 0..bytes.len() {
            for flip in [0xff, 1, 0x80] {
                let mut damaged = bytes.clone();
                damaged[at] ^= flip;
                read(damaged);
            }
        }
    }
}
