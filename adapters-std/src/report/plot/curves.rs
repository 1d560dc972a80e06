//! Curves of measured points, with error bars where a point has an uncertainty.

use plotters::prelude::*;

use super::axes::{Axes, STROKE, colour, fault, svg};
use crate::Error;
use crate::report::rounded_up;

/// A measured point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlotPoint {
    /// Along the horizontal axis.
    pub x: f64,
    /// Along the vertical axis.
    pub y: f64,
    /// The bar reaches so far up and down; none: no bar.
    pub spread: Option<f64>,
}

/// Points that belong together, in the order in which they are joined.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Its name in the legend.
    pub name: String,
    /// The points.
    pub points: Vec<PlotPoint>,
}

/// A plot of curves.
#[derive(Debug, Clone, PartialEq)]
pub struct CurvePlot {
    /// What runs to the right, with its unit.
    pub x: String,
    /// What runs upwards, with its unit.
    pub y: String,
    /// The curves; up to four have colours of their own.
    pub curves: Vec<Curve>,
    /// The least and the largest number upwards; none: from 0 to above the largest point.
    pub y_range: Option<[f64; 2]>,
}

impl CurvePlot {
    /// The plot as the text of an SVG file.
    ///
    /// # Errors
    /// [`Error::Internal`] when drawing fails.
    pub fn svg(&self) -> Result<String, Error> {
        let is_finite = |p: &&PlotPoint| p.x.is_finite() && p.y.is_finite();
        let curves: Vec<Vec<PlotPoint>> =
            self.curves.iter().map(|curve| curve.points.iter().filter(is_finite).copied().collect()).collect();
        let all = || curves.iter().flatten();
        let top = all().map(|p| p.y + p.spread.unwrap_or(0.0)).fold(0.0, f64::max);
        let right = all().map(|p| p.x).fold(0.0, f64::max);
        let [low, high] = self.y_range.unwrap_or([0.0, rounded_up(1.02 * top)]);
        let falls = |curve: &Vec<PlotPoint>| curve.first().zip(curve.last()).is_some_and(|(a, b)| a.y > b.y);
        let legend =
            if curves.iter().any(falls) { SeriesLabelPosition::UpperRight } else { SeriesLabelPosition::LowerRight };
        let axes = Axes {
            x: &self.x,
            y: &self.y,
            x_range: 0.0..1.03 * right,
            y_range: low..high,
            legend: (self.curves.len() > 1).then_some(legend),
        };
        svg(&axes, |chart| {
            for (series, (curve, points)) in self.curves.iter().zip(&curves).enumerate() {
                let style = colour(series).stroke_width(STROKE);
                let line = LineSeries::new(points.iter().map(|p| (p.x, p.y)), style);
                let entry = chart.draw_series(line).map_err(fault)?;
                if self.curves.len() > 1 {
                    entry.label(&curve.name).legend(move |(x, y)| PathElement::new([(x, y), (x + 80, y)], style));
                }
                let dots = points.iter().map(|p| Circle::new((p.x, p.y), 2 * STROKE as i32, colour(series).filled()));
                chart.draw_series(dots).map_err(fault)?;
                let bars = points.iter().filter_map(|p| {
                    let spread = p.spread.filter(|spread| spread.is_finite() && *spread > 0.0)?;
                    let (least, most) = (p.y - spread, p.y + spread);
                    Some(ErrorBar::new_vertical(p.x, least, p.y, most, colour(series).stroke_width(STROKE / 2), 24))
                });
                chart.draw_series(bars).map_err(fault)?;
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(curves: Vec<Curve>) -> CurvePlot {
        CurvePlot { x: "identity weights".into(), y: "error, mm".into(), curves, y_range: None }
    }

    fn curve(name: &str, points: &[(f64, f64, Option<f64>)]) -> Curve {
        let points = points.iter().map(|&(x, y, spread)| PlotPoint { x, y, spread }).collect();
        Curve { name: name.into(), points }
    }

    #[test]
    fn a_plot_names_its_axes_and_curves_and_repeats_exactly() {
        let falling = curve("one left out", &[(1.0, 3.0, Some(0.2)), (5.0, 1.0, Some(0.1)), (9.0, 0.5, None)]);
        let other = curve("random <faces>", &[(1.0, 1.0, None), (9.0, 2.0, None)]);
        let text = plot(vec![falling.clone(), other.clone()]).svg().unwrap();
        for words in ["identity weights", "error, mm", "one left out", "random &lt;faces&gt;"] {
            assert!(text.contains(words), "{words}");
        }
        assert_eq!(text, plot(vec![falling.clone(), other]).svg().unwrap());
        assert!(!plot(vec![falling]).svg().unwrap().contains("one left out"), "one curve needs no legend");
    }

    #[test]
    fn what_is_not_finite_is_left_out_and_nothing_is_still_a_plot() {
        let sound = curve("", &[(1.0, 3.0, Some(0.2)), (5.0, 1.0, None)]);
        let mut broken = sound.clone();
        broken.points.push(PlotPoint { x: 2.0, y: f64::NAN, spread: None });
        broken.points.push(PlotPoint { x: f64::INFINITY, y: 1.0, spread: Some(f64::NAN) });
        assert_eq!(plot(vec![broken]).svg().unwrap(), plot(vec![sound]).svg().unwrap());
        assert!(plot(vec![]).svg().unwrap().contains("identity weights"));
        assert!(plot(vec![curve("", &[])]).svg().is_ok());
    }
}
