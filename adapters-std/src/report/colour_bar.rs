//! The legend of a colour scale: a bar with ticks, numbers, title, and the colours beyond its ends.

use super::colour_scale::ColourScale;
use super::picture::Image;
use super::text::Lettering;

/// A legend. Only what occurs is explained: see [`ColourBar::of`].
#[derive(Debug, Clone, PartialEq)]
pub struct ColourBar {
    /// The scale.
    pub scale: ColourScale,
    /// What the numbers are, with their unit, such as `distance, mm`.
    pub title: String,
    /// Whether numbers above the scale occur.
    pub above: bool,
    /// Whether numbers below the scale occur.
    pub below: bool,
    /// Whether numbers are missing.
    pub missing: bool,
    /// What is written beside the colour of missing numbers.
    pub missing_label: String,
}

const BAR: usize = 24;
const TICK: usize = 6;
const BOX: usize = 18;
const INK: [u8; 3] = [40, 40, 44];

impl ColourBar {
    /// The legend of a scale for these values.
    pub fn of(scale: ColourScale, title: impl Into<String>, values: &[f64]) -> Self {
        ColourBar {
            scale,
            title: title.into(),
            above: values.iter().any(|value| *value > scale.high),
            below: values.iter().any(|value| *value < scale.low),
            missing: values.iter().any(|value| value.is_nan()),
            missing_label: "none".into(),
        }
    }

    /// The legend, `height` pixels high (at least 160) and as wide as its texts.
    pub fn drawn(&self, height: usize, background: [u8; 3]) -> Image {
        let plain = Lettering::Plain;
        let height = height.max(160);
        let room = (height / 40).clamp(2, 10);
        let ticks = Ticks::between(self.scale.low, self.scale.high, room);
        let above = format!("> {}", ticks.label(self.scale.high));
        let below = format!("< {}", ticks.label(self.scale.low));
        let labels = ticks.values.iter().map(|value| ticks.label(*value)).chain([above.clone(), below.clone()]);
        let widest = labels
            .map(|label| plain.width(&label))
            .chain([if self.missing { plain.width(&self.missing_label) } else { 0 }])
            .max()
            .unwrap_or(0);
        let left = BAR + TICK + 4;
        let mut image = Image::filled((left + widest).max(plain.width(&self.title)), height, background);
        image.write_text(&self.title, plain, 0, 0, INK);

        // Boxes above and below stand apart from the bar: their colours are not on it.
        let line = BOX.max(plain.height()) + 4;
        let explained = |image: &mut Image, colour: [u8; 3], text: &str, top: usize| {
            fill(image, [0, BAR], [top, top + BOX], INK);
            fill(image, [1, BAR - 1], [top + 1, top + BOX - 1], colour);
            image.write_text(text, plain, left, top + BOX / 2 - plain.height() / 2 + 1, INK);
        };
        let (mut top, mut bottom) = (plain.height() + 8, height);
        if self.missing {
            bottom -= line;
            explained(&mut image, self.scale.missing, &self.missing_label, bottom + 4);
        }
        if self.below {
            bottom -= line;
            explained(&mut image, self.scale.below, &below, bottom + 4);
        }
        if self.above {
            explained(&mut image, self.scale.above, &above, top);
            top += line;
        }
        // Half a line on either side, so that the numbers at the ends do not touch their neighbours.
        let (top, bottom) = (top + plain.height() / 2, bottom - plain.height() / 2);
        fill(&mut image, [0, BAR], [top, bottom], INK);
        let (first, last) = (top + 1, bottom - 1);
        for row in first..last {
            let share = (last - 1 - row) as f64 / (last - first - 1).max(1) as f64;
            fill(&mut image, [1, BAR - 1], [row, row + 1], self.scale.map.colour(share));
        }
        for value in &ticks.values {
            let share = (value / 2.0 - self.scale.low / 2.0) / (self.scale.high / 2.0 - self.scale.low / 2.0);
            let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
            let row = last - 1 - (share * (last - first - 1) as f64).round() as usize;
            fill(&mut image, [BAR, BAR + TICK], [row, row + 1], INK);
            image.write_text(&ticks.label(*value), plain, left, (row + 1).saturating_sub(plain.height() / 2), INK);
        }
        image
    }
}

/// Fills the rectangle of these columns and rows, as far as it lies in the picture.
fn fill(image: &mut Image, columns: [usize; 2], rows: [usize; 2], colour: [u8; 3]) {
    let (width, height) = (image.width, image.height);
    for row in rows[0]..rows[1].min(height) {
        let columns = columns[0].min(width)..columns[1].min(width);
        image.pixels[row * width..][columns].fill(colour);
    }
}

/// Round numbers at equal steps.
#[derive(Debug, Clone, PartialEq)]
struct Ticks {
    values: Vec<f64>,
    step: f64,
}

impl Ticks {
    /// At most `most + 1` multiples of 1, 2 or 5 times a power of ten from `low` to `high`; the two ends where there are none.
    fn between(low: f64, high: f64, most: usize) -> Self {
        let span = high - low;
        let is_divisible = span > 1e-290 && span < 1e290 && span > 1e-12 * low.abs().max(high.abs());
        if !is_divisible {
            return Ticks { values: vec![low], step: 0.0 };
        }
        let least = span / most.max(1) as f64;
        let power = 10.0_f64.powi(least.log10().floor() as i32);
        let steps =
            [1.0, 2.0, 5.0, 10.0, 20.0].map(|digit| digit * power).into_iter().filter(|step| *step >= 0.999 * least);
        // Both ends have a number where a step that is not much larger allows it.
        let meets = |end: f64, step: f64| ((end / step).round() - end / step).abs() < 1e-6;
        let whole = steps.clone().take(2).find(|step| meets(low, *step) && meets(high, *step));
        let step = whole.or_else(|| steps.clone().next()).unwrap_or(10.0 * power);
        // A thousandth of a step of slack keeps an end that rounding has pushed out.
        let (first, last) = ((low / step - 1e-3).ceil(), (high / step + 1e-3).floor());
        let count = ((last - first) as usize + 1).min(most + 2);
        Ticks { values: (0..count).map(|k| (first + k as f64) * step).collect(), step }
    }

    /// A number with as many decimals as the step needs.
    fn label(&self, value: f64) -> String {
        let size = value.abs().max(self.step);
        if value == 0.0 && size >= 1e6 {
            return "0".to_owned();
        }
        if size != 0.0 && !(1e-4..1e6).contains(&size) {
            return format!("{value:.1e}");
        }
        let decimals = |number: f64| {
            (0..6).find(|k| {
                let scaled = number * 10.0_f64.powi(*k);
                (scaled - scaled.round()).abs() < 1e-6 * scaled.abs().max(1e-3)
            })
        };
        let decimals = decimals(self.step).unwrap_or(6).max(decimals(value).unwrap_or(0)) as usize;
        // No minus before a zero.
        format!("{:.decimals$}", value + 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, most: usize) -> Vec<String> {
        let ticks = Ticks::between(low, high, most);
        ticks.values.iter().map(|value| ticks.label(*value)).collect()
    }

    #[test]
    fn ticks_are_round_and_carry_the_decimals_that_they_need() {
        assert_eq!(labels(0.0, 1.0, 5), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(-1.5, 1.5, 6), ["-1.5", "-1.0", "-0.5", "0.0", "0.5", "1.0", "1.5"]);
        assert_eq!(labels(0.0, 300.0, 4), ["0", "100", "200", "300"]);
        assert_eq!(labels(0.0, 0.003, 3), ["0.000", "0.001", "0.002", "0.003"]);
        assert_eq!(labels(7.0, 7.0, 4), ["7"]);
        assert_eq!(labels(0.0, 4e7, 2), ["0", "2.0e7", "4.0e7"]);
        assert_eq!(labels(f64::NAN, 1.0, 4).len(), 1);
        assert_eq!(labels(0.0, f64::INFINITY, 4).len(), 1);
    }

    #[test]
    fn the_bar_shows_its_ends_and_only_the_boxes_that_are_needed() {
        let scale = ColourScale::sequential(0.0, 2.0);
        let has = |image: &Image, colour: [u8; 3]| image.pixels.contains(&colour);
        let within = ColourBar::of(scale, "distance, mm", &[0.0, 2.0]).drawn(300, [255; 3]);
        assert!(has(&within, scale.map.colour(0.0)) && has(&within, scale.map.colour(1.0)));
        assert!(!has(&within, scale.above) && !has(&within, scale.below) && !has(&within, scale.missing));
        let beyond = ColourBar::of(scale, "distance, mm", &[3.0, -1.0, f64::NAN]).drawn(300, [255; 3]);
        assert!(has(&beyond, scale.above) && has(&beyond, scale.below) && has(&beyond, scale.missing));
        assert_eq!(beyond.height, 300);
        let odd = ColourBar::of(ColourScale::sequential(f64::NAN, f64::NAN), "", &[]).drawn(0, [255; 3]);
        assert_eq!(odd.height, 160);
    }
}
