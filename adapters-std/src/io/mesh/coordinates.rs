//! Coordinates and colours as text files of meshes write them.

use std::path::Path;

use super::losses::Losses;
use super::{NonFinite, ReadOptions};
use crate::io::text::{Words, any_real, real, shown};
use crate::{Error, Place};

/// What is done about a coordinate that is no finite number.
pub(super) const REMEDY: &str = "`habitus clean` removes such vertices";

/// Reads the numbers of one file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coordinates<'a> {
    path: &'a Path,
    keep: bool,
}

impl<'a> Coordinates<'a> {
    pub(super) fn new(path: &'a Path, options: &ReadOptions) -> Self {
        Coordinates { path, keep: options.non_finite == NonFinite::Keep }
    }

    /// The next three words as a vector, called `what` in the error.
    pub(super) fn vector(&self, words: &mut Words<'_>, what: &str, line: usize) -> Result<[f64; 3], Error> {
        let mut vector = [0.0; 3];
        for (slot, axis) in vector.iter_mut().zip(["x", "y", "z"]) {
            let Some(word) = words.next() else {
                let problem = format!("the {what} ends before its {axis}");
                return Err(Error::malformed(self.path, Place::Line(line), problem));
            };
            *slot = match real(word) {
                Some(value) => value,
                None => self.other(word, what, line)?,
            };
        }
        Ok(vector)
    }

    /// The value of a word that is no finite number.
    fn other(&self, word: &[u8], what: &str, line: usize) -> Result<f64, Error> {
        let value = any_real(word);
        if let Some(value) = value.filter(|_| self.keep) {
            return Ok(value);
        }
        let remedy = if value.is_some() { format!(": {REMEDY}") } else { String::new() };
        let problem = format!("the {what} has {:?} where a finite number is expected{remedy}", shown(word));
        Err(Error::malformed(self.path, Place::Line(line), problem))
    }
}

/// The colours of a file as it writes them, whose range is known only when all have been read.
#[derive(Debug, Default)]
pub(super) struct WrittenColours {
    channels: Vec<[f64; 3]>,
    /// The line of each.
    lines: Vec<usize>,
    largest: f64,
}

impl WrittenColours {
    pub(super) fn push(&mut self, channels: [f64; 3], line: usize) {
        self.largest = channels.iter().fold(self.largest, |largest, &channel| largest.max(channel));
        self.channels.push(channels);
        self.lines.push(line);
    }

    pub(super) fn len(&self) -> usize {
        self.channels.len()
    }

    /// The largest channel of all.
    pub(super) fn largest(&self) -> f64 {
        self.largest
    }

    /// The colours as bytes, where `one` is the number of full intensity; those that bytes cannot hold are noted.
    pub(super) fn bytes(&self, one: f64, path: &Path, losses: &mut Losses) -> Result<Vec<[u8; 3]>, Error> {
        let mut rounded = 0;
        let mut bytes = Vec::with_capacity(self.channels.len());
        for (channels, &line) in self.channels.iter().zip(&self.lines) {
            let [Some(red), Some(green), Some(blue)] = channels.map(|channel| colour_byte(channel, one)) else {
                let problem = format!("a colour {channels:?}; channels lie in 0 to 255, or in 0 to 1");
                return Err(Error::malformed(path, Place::Line(line), problem));
            };
            rounded += usize::from(channels.iter().any(|&channel| is_finer_than_bytes(channel, one)));
            bytes.push([red, green, blue]);
        }
        losses.note_rounded_colours(rounded);
        Ok(bytes)
    }
}

/// A colour channel given as a real number, as a byte. `one` is the number of full intensity.
pub(super) fn colour_byte(value: f64, one: f64) -> Option<u8> {
    let scaled = (value / one * 255.0).round();
    (0.0..=255.0).contains(&scaled).then_some(scaled as u8)
}

/// Whether the channel is further from a byte than a fraction written with three decimals is, so that its byte is not
/// what was meant.
pub(super) fn is_finer_than_bytes(value: f64, one: f64) -> bool {
    let scaled = value / one * 255.0;
    (scaled - scaled.round()).abs() > 0.0005 * 255.0 + 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::text::words;

    fn vector(text: &str, non_finite: NonFinite) -> Result<[f64; 3], String> {
        let coordinates = Coordinates::new(Path::new("a"), &ReadOptions { non_finite });
        coordinates.vector(&mut words(text.as_bytes()), "vertex", 7).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_not_finite_is_refused_or_kept() {
        let message = vector("0 1.#QNAN 0", NonFinite::Refuse).unwrap_err();
        assert!(message.contains("line 7") && message.contains("habitus clean"), "{message}");
        let kept = vector("0 1.#QNAN -inf", NonFinite::Keep).unwrap();
        assert!(kept[1].is_nan() && kept[2] == f64::NEG_INFINITY);
        for non_finite in [NonFinite::Refuse, NonFinite::Keep] {
            let message = vector("0 x 0", non_finite).unwrap_err();
            assert!(message.ends_with("\"x\" where a finite number is expected"), "{message}");
            assert!(vector("0 0", non_finite).unwrap_err().ends_with("ends before its z"));
        }
    }

    #[test]
    fn three_decimals_of_a_fraction_are_a_byte() {
        for byte in 0..=255u8 {
            let fraction = (f64::from(byte) / 255.0 * 1e3).round() / 1e3;
            assert_eq!((colour_byte(fraction, 1.0), is_finer_than_bytes(fraction, 1.0)), (Some(byte), false));
        }
        assert!(is_finer_than_bytes(0.5, 1.0) && is_finer_than_bytes(100.2, 255.0));
        assert_eq!((colour_byte(-0.1, 1.0), colour_byte(f64::NAN, 1.0)), (None, None));
    }
}
