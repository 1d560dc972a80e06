//! What all plots share: size, letters, colours by light and by dark, axes with ticks, the legend.

use std::ops::Range;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::Error;

/// A plot that is being drawn.
pub(super) type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Width and height in units of the drawing. Coordinates are whole numbers, so the units are small against what is shown.
const SIZE: (u32, u32) = (1600, 1000);
/// Height of letters, in these units.
pub(super) const LETTERS: i32 = 52;
/// Width of curves, in these units.
pub(super) const STROKE: u32 = 6;

const INK: RGBColor = RGBColor(0x3a, 0x36, 0x32);
const GRID: RGBColor = RGBColor(0xdd, 0xd8, 0xd0);
const SERIES: [RGBColor; 4] =
    [RGBColor(0xa4, 0x51, 0x2f), RGBColor(0x2f, 0x6c, 0x9e), RGBColor(0x5c, 0x8a, 0x3a), RGBColor(0x7a, 0x55, 0x9c)];
/// The same colours before a dark page, in the order of ink, grid, series.
const DARK: [RGBColor; 6] = [
    RGBColor(0xdd, 0xd8, 0xd0),
    RGBColor(0x3c, 0x3d, 0x42),
    RGBColor(0xe0, 0x8a, 0x5f),
    RGBColor(0x74, 0xb3, 0xe0),
    RGBColor(0x9c, 0xc9, 0x7a),
    RGBColor(0xc0, 0x9a, 0xe0),
];

/// The colour of a series; they repeat after four.
pub(super) fn colour(series: usize) -> RGBColor {
    SERIES[series % SERIES.len()]
}

/// What the numbers of a plot are, with their unit, and which are shown.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axes<'a> {
    pub x: &'a str,
    pub y: &'a str,
    pub x_range: Range<f64>,
    pub y_range: Range<f64>,
    /// Where the legend stands; none: there is one series.
    pub legend: Option<SeriesLabelPosition>,
}

/// A fault of the drawing, which writes into memory.
pub(super) fn fault(error: impl std::fmt::Display) -> Error {
    Error::Internal(format!("a plot cannot be drawn: {error}"))
}

/// The SVG of axes and what `draw` puts between them.
pub(super) fn svg(
    axes: &Axes<'_>,
    draw: impl FnOnce(&mut Chart<'_, '_>) -> Result<(), Error>,
) -> Result<String, Error> {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
    let mut chart = ChartBuilder::on(&area)
        .margin_top(36)
        .margin_right(44)
        .margin_left(8)
        .margin_bottom(8)
        .x_label_area_size(136)
        .y_label_area_size(196)
        .build_cartesian_2d(sound(&axes.x_range), sound(&axes.y_range))
        .map_err(fault)?;
    let letters = || ("sans-serif", LETTERS).into_font().color(&INK);
    chart
        .configure_mesh()
        .x_desc(axes.x)
        .y_desc(axes.y)
        .x_labels(8)
        .y_labels(6)
        .x_label_formatter(&shown)
        .y_label_formatter(&shown)
        .label_style(letters())
        .axis_desc_style(letters())
        .axis_style(INK.stroke_width(3))
        .bold_line_style(GRID.stroke_width(3))
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(fault)?;
    draw(&mut chart)?;
    if let Some(position) = &axes.legend {
        chart
            .configure_series_labels()
            .position(position.clone())
            .legend_area_size(90)
            .margin(24)
            .label_font(letters())
            .background_style(TRANSPARENT)
            .border_style(TRANSPARENT)
            .draw()
            .map_err(fault)?;
    }
    area.present().map_err(fault)?;
    drop(chart);
    drop(area);
    Ok(dressed(&text))
}

/// A range with an inside: an empty one, or one without an end, becomes 0 to 1.
fn sound(range: &Range<f64>) -> Range<f64> {
    let is_sound = range.start.is_finite() && range.end.is_finite() && range.end > range.start;
    if is_sound { range.clone() } else { 0.0..1.0 }
}

/// A tick's number with no more digits than it needs.
fn shown(value: &f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    // No minus before a zero.
    format!("{}", rounded + 0.0)
}

/// The drawing with the letters of the page around it, and with colours for a dark one.
fn dressed(svg: &str) -> String {
    let hex = |colour: RGBColor| format!("#{:02X}{:02X}{:02X}", colour.0, colour.1, colour.2);
    let mut style = String::from("text{font-family:system-ui,-apple-system,\"Segoe UI\",Roboto,sans-serif}");
    style += "@media(prefers-color-scheme:dark){";
    for (light, dark) in [INK, GRID].into_iter().chain(SERIES).zip(DARK) {
        let (light, dark) = (hex(light), hex(dark));
        style += &format!("[fill=\"{light}\"]{{fill:{dark}}}[stroke=\"{light}\"]{{stroke:{dark}}}");
    }
    let (head, rest) = svg.split_once('\n').unwrap_or((svg, ""));
    format!("{head}\n<style>{style}}}</style>\n{rest}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_no_digits_of_rounding_and_no_negative_zero() {
        assert_eq!([0.1 + 0.2, -0.0, 20.0, 1.25].map(|value| shown(&value)), ["0.3", "0", "20", "1.25"]);
    }

    #[test]
    fn every_colour_has_one_for_dark_pages_and_nothing_is_loaded() {
        let axes = Axes { x: "a < b & \"c\"", y: "share, %", x_range: 0.0..1.0, y_range: f64::NAN..2.0, legend: None };
        let text = svg(&axes, |_| Ok(())).unwrap();
        assert_eq!(text, svg(&axes, |_| Ok(())).unwrap());
        assert!(text.contains("a &lt; b &amp; &quot;c&quot;"), "{text}");
        assert_eq!(text.matches("prefers-color-scheme").count(), 1);
        assert_eq!(text.matches("[stroke=").count(), DARK.len());
        assert!(text.ends_with("</svg>\n") && !text.contains("href") && !text.contains("url("));
    }
}
