//! Lettering of pictures, in Noto Sans Mono.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use super::picture::Image;

/// Size and weight of letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lettering {
    /// 16 pixels high: numbers, captions.
    Plain,
    /// 20 pixels high and bold: titles.
    Title,
}

impl Lettering {
    /// Pixels from one line to the next.
    pub fn height(self) -> usize {
        self.style().1.val() + 2
    }

    /// Pixels that a text is wide on one line.
    pub fn width(self, text: &str) -> usize {
        text.chars().count() * self.advance()
    }

    /// The text, with its middle replaced by "..." where it is wider than `width` pixels.
    pub fn shortened(self, text: &str, width: usize) -> String {
        let (length, room) = (text.chars().count(), width / self.advance());
        if length <= room {
            return text.to_owned();
        }
        let kept = room.saturating_sub(3);
        let first = kept.div_ceil(2);
        let start: String = text.chars().take(first).collect();
        let end: String = text.chars().skip(length - (kept - first)).collect();
        format!("{start}{}{end}", &"..."[..room.min(3)])
    }

    fn style(self) -> (FontWeight, RasterHeight) {
        match self {
            Lettering::Plain => (FontWeight::Regular, RasterHeight::Size16),
            Lettering::Title => (FontWeight::Bold, RasterHeight::Size20),
        }
    }

    fn advance(self) -> usize {
        let (weight, height) = self.style();
        get_raster_width(weight, height).max(1)
    }
}

impl Image {
    /// Writes a line of text with its top left corner at (`left`, `top`); what does not fit is cut off. Letters beyond Latin-1 appear
    /// as question marks.
    pub fn write_text(&mut self, text: &str, lettering: Lettering, left: usize, top: usize, colour: [u8; 3]) {
        let (weight, height) = lettering.style();
        for (place, letter) in text.chars().enumerate() {
            let Some(glyph) = get_raster(letter, weight, height).or_else(|| get_raster('?', weight, height)) else {
                continue;
            };
            let left = left + place * lettering.advance();
            if left >= self.width {
                return;
            }
            for (row, line) in glyph.rows().enumerate() {
                if top + row >= self.height {
                    break;
                }
                for (column, cover) in line.iter().enumerate().take(self.width - left) {
                    let pixel = &mut self.pixels[(top + row) * self.width + left + column];
                    let blend = |under: u8, over: u8| {
                        let cover = u32::from(*cover);
                        ((u32::from(over) * cover + u32::from(under) * (255 - cover) + 127) / 255) as u8
                    };
                    *pixel = std::array::from_fn(|channel| blend(pixel[channel], colour[channel]));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_drawn_where_it_belongs_and_cut_off_at_the_border() {
        let mut image = Image::filled(60, 20, [255; 3]);
        image.write_text("1,0 mm\u{4e00} and much more", Lettering::Plain, 10, 2, [0; 3]);
        let dark = |column: usize| (0..20).any(|row| image.pixels[row * 60 + column][0] < 128);
        assert!(!(0..10).any(dark) && (10..20).any(dark) && (50..60).any(dark));
        let before = image.clone();
        image.write_text("far away", Lettering::Title, 60, 0, [0; 3]);
        image.write_text("far away", Lettering::Title, 0, 20, [0; 3]);
        image.write_text("", Lettering::Title, 0, 0, [0; 3]);
        assert_eq!(image, before);
    }

    #[test]
    fn long_texts_lose_their_middle() {
        let style = Lettering::Plain;
        let room = style.width("ten letter");
        assert_eq!(style.shortened("ten letter", room), "ten letter");
        assert_eq!(style.shortened("eleven lette", room), "elev...tte");
        assert_eq!(style.shortened("anything", style.width("ab")), "..");
        assert_eq!(style.shortened("anything", 0), "");
    }
}
