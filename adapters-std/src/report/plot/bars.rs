//! Bars up and down from zero, one for each number, such as the weights of a shape in standard deviations.

use plotters::prelude::*;

use super::axes::{Axes, colour, fault, svg};
use crate::Error;
use crate::report::rounded_up;

/// A plot of bars, numbered from 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Bars {
    /// What the bars are.
    pub x: String,
    /// What their length is, with its unit.
    pub y: String,
    /// One number for each bar.
    pub values: Vec<f64>,
    /// The axis reaches at least so far up and down.
    pub least_reach: f64,
}

impl Bars {
    /// The plot as the text of an SVG file.
    ///
    /// # Errors
    /// [`Error::Internal`] when drawing fails.
    pub fn svg(&self) -> Result<String, Error> {
        let values = || self.values.iter().enumerate().filter(|(_, value)| value.is_finite());
        let reach = rounded_up(values().map(|(_, value)| 1.05 * value.abs()).fold(self.least_reach, f64::max));
        let x_range = 0.4..self.values.len() as f64 + 0.6;
        svg(&Axes { x: &self.x, y: &self.y, x_range, y_range: -reach..reach, legend: None }, |chart| {
            let bar = |(k, value): (usize, &f64)| {
                let middle = k as f64 + 1.0;
                Rectangle::new([(middle - 0.36, 0.0), (middle + 0.36, *value)], colour(0).filled())
            };
            chart.draw_series(values().map(bar)).map_err(fault)?;
            let right = self.values.len() as f64 + 0.6;
            let zero = PathElement::new([(0.4, 0.0), (right, 0.0)], colour(1).stroke_width(3));
            chart.draw_series([zero]).map_err(fault)?;
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_finite_number_has_a_bar() {
        let count = |values: &[f64]| {
            let (x, y) = ("weight".into(), "standard deviations".into());
            let text = Bars { x, y, values: values.to_vec(), least_reach: 3.0 }.svg().unwrap();
            text.matches("<rect").count()
        };
        let none = count(&[]);
        assert_eq!(count(&[1.0, -2.0, 0.5]) - none, 3);
        assert_eq!(count(&[1.0, f64::NAN, f64::INFINITY]) - none, 1);
    }
}
