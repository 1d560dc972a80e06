//! An 8-bit sRGB picture and its PNG file.

use crate::Error;
use crate::io::atomic;
use std::path::Path;

/// An sRGB picture, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Pixels per row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// `width * height` pixels, row by row from the top left.
    pub pixels: Vec<[u8; 3]>,
}

impl Image {
    /// A picture of one colour.
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Image { width, height, pixels: vec![colour; width * height] }
    }

    /// Copies `other` with its top left corner at (`left`, `top`); what does not fit is cut off.
    pub fn paste(&mut self, other: &Image, left: usize, top: usize) {
        let columns = other.width.min(self.width.saturating_sub(left));
        let rows = other.height.min(self.height.saturating_sub(top));
        if columns == 0 {
            return;
        }
        let targets = self.pixels.chunks_exact_mut(self.width).skip(top);
        for (to, from) in targets.zip(other.pixels.chunks_exact(other.width)).take(rows) {
            to[left..left + columns].copy_from_slice(&from[..columns]);
        }
    }

    /// The picture as the bytes of a PNG file.
    pub fn png_bytes(&self) -> Result<Vec<u8>, Error> {
        let too_large = |_| Error::input("a PNG picture is at most 2^31 - 1 pixels wide and high: use smaller cells");
        let width = u32::try_from(self.width).map_err(too_large)?;
        let height = u32::try_from(self.height).map_err(too_large)?;
        let fault = |error: png::EncodingError| Error::Internal(format!("PNG encoder: {error}"));
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(fault)?;
        writer.write_image_data(self.pixels.as_flattened()).map_err(fault)?;
        writer.finish().map_err(fault)?;
        Ok(bytes)
    }

    /// Writes the picture as a PNG file, completely or not at all (see [`atomic`]).
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        atomic::write(path, &self.png_bytes()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_bytes_decode_to_the_same_pixels() {
        let mut image = Image::filled(5, 3, [10, 20, 30]);
        image.paste(&Image::filled(4, 4, [200, 100, 0]), 3, 1);
        assert_eq!(image.pixels[5 + 3], [200, 100, 0]);
        assert_eq!(image.pixels[5 + 2], [10, 20, 30]);
        let bytes = image.png_bytes().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut decoded = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut decoded).unwrap();
        assert_eq!((info.width, info.height), (5, 3));
        assert_eq!(decoded, image.pixels.as_flattened());
    }

    #[cfg(unix)]
    #[test]
    fn a_picture_is_as_readable_as_any_new_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let [picture, plain] = ["face.png", "plain"].map(|name| folder.path().join(name));
        Image::filled(1, 1, [0; 3]).write_png(&picture).unwrap();
        std::fs::write(&plain, b"").unwrap();
        let mode = |path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(&picture), mode(&plain));
    }

    #[test]
    fn writing_into_a_missing_folder_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing/face.png");
        let message = Image::filled(1, 1, [0; 3]).write_png(&path).unwrap_err().to_string();
        assert!(message.contains("face.png: cannot be written"), "{message}");
    }
}
