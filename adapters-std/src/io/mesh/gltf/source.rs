//! The parts of a file, and where in it an error of its document is.

use std::path::Path;

use serde_json::Value;

use super::super::losses::Losses;
use super::container;
use super::problem::Problem;
use crate::io::json_place::{byte_of_error, byte_of_value, place_of_byte, sentence};
use crate::io::text::without_byte_order_mark;
use crate::{Error, Place};

/// A `.glb` or `.gltf` file.
pub(super) struct Source<'a> {
    path: &'a Path,
    json: &'a [u8],
    /// The byte of the file at which `json` begins; `None` in a file that is text, whose places are lines.
    json_start: Option<usize>,
    pub binary: Option<&'a [u8]>,
    binary_start: usize,
}

impl<'a> Source<'a> {
    /// The parts of the file, told apart by its first bytes; what is passed over is noted.
    pub(super) fn of(bytes: &'a [u8], path: &'a Path, losses: &mut Losses) -> Result<Self, Error> {
        if bytes.starts_with(container::MAGIC) {
            let container::Chunks { json, json_start, binary, binary_start } = container::chunks(bytes, path, losses)?;
            return Ok(Source { path, json, json_start: Some(json_start), binary, binary_start });
        }
        let json = without_byte_order_mark(bytes);
        if !json.trim_ascii_start().starts_with(b"{") {
            let problem = "the file neither begins with \"glTF\", as a GLB file does, nor is it JSON, which begins with {: \
                           is it a glTF file, and in UTF-8?";
            return Err(Error::malformed(path, Place::Byte(0), problem));
        }
        Ok(Source { path, json, json_start: None, binary: None, binary_start: 0 })
    }

    /// The document.
    pub(super) fn document(&self) -> Result<Value, Error> {
        serde_json::from_slice(self.json).map_err(|error| {
            let problem = format!("the JSON of the document is wrong: {}", sentence(&error));
            Error::malformed(self.path, self.place(byte_of_error(self.json, &error)), problem)
        })
    }

    /// The place of the value of a path in the document.
    pub(super) fn place_of(&self, path: &str) -> Place {
        let text = std::str::from_utf8(self.json).unwrap_or_default();
        self.place(byte_of_value(text, path))
    }

    fn place(&self, byte: usize) -> Place {
        match self.json_start {
            Some(start) => Place::Byte((start + byte) as u64),
            None => place_of_byte(self.json, byte),
        }
    }

    /// The error: at the number that is wrong when it is in the file, else at the value of the document.
    pub(super) fn refused(&self, document: &Value, problem: &Problem) -> Error {
        let at_value = || self.place_of(problem.path());
        let Some(datum) = problem.datum else {
            return Error::malformed(self.path, at_value(), problem.to_string());
        };
        if datum.buffer == 0 && self.binary.is_some() && document["buffers"][0]["uri"].is_null() {
            let place = Place::Byte((self.binary_start + datum.byte) as u64);
            return Error::malformed(self.path, place, problem.to_string());
        }
        let problem = format!("{problem} (byte {} of buffers[{}])", datum.byte, datum.buffer);
        Error::malformed(self.path, at_value(), problem)
    }
}
