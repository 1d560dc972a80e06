//! How numbers are spread: the share of them in each step of a histogram, and the share within each limit.

use plotters::prelude::*;

use super::axes::{Axes, STROKE, colour, fault, svg};
use crate::Error;
use crate::report::rounded_up;

/// Numbers under one name. Numbers that are not finite are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// The name in the legend.
    pub name: String,
    /// The numbers, in any order.
    pub values: Vec<f64>,
}

impl Sample {
    fn sorted(&self) -> Vec<f64> {
        let mut values: Vec<f64> = self.values.iter().copied().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values
    }
}

/// The end of the axis: 99.5 % of every sample is before it, and hardly more; of three or more samples the widest may go on, so that it does not press
/// the others together.
fn end(samples: &[Vec<f64>]) -> f64 {
    let last = |sorted: &Vec<f64>| sorted.get((995 * sorted.len()).div_ceil(1000).saturating_sub(1)).copied();
    let mut reach: Vec<f64> = samples.iter().filter_map(last).collect();
    reach.sort_by(|a, b| b.total_cmp(a));
    let reach = reach.get(usize::from(reach.len() > 2)).map_or(0.0, |reach| reach.max(0.0));
    // A twentieth of the round end above it is a round step.
    let step = rounded_up(reach) / 20.0;
    if reach > 0.0 { (reach / step - 1e-9).ceil() * step } else { 1.0 }
}

/// Steps of a histogram.
const STEPS: usize = 40;

/// A histogram of numbers that are not negative; the samples lie over each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// What the numbers are, with their unit.
    pub x: String,
    /// What is counted, such as `vertices`.
    pub counted: String,
    /// The samples.
    pub samples: Vec<Sample>,
}

impl Histogram {
    /// The plot as the text of an SVG file. The axis ends where 99.5 % of each sample are within it, of three or more of each but the
    /// widest; what is beyond is not shown.
    ///
    /// # Errors
    /// [`Error::Internal`] when drawing fails.
    pub fn svg(&self) -> Result<String, Error> {
        let sorted: Vec<Vec<f64>> = self.samples.iter().map(Sample::sorted).collect();
        let end = end(&sorted);
        let step = end / STEPS as f64;
        let shares: Vec<Vec<f64>> = sorted.iter().map(|sorted| step_shares(sorted, step)).collect();
        let top = shares.iter().flatten().copied().fold(0.0, f64::max);
        let y = format!("share of {}, %", self.counted);
        let axes = Axes {
            x: &self.x,
            y: &y,
            x_range: 0.0..end,
            y_range: 0.0..rounded_up(1.02 * top),
            legend: (self.samples.len() > 1).then_some(SeriesLabelPosition::UpperRight),
        };
        svg(&axes, |chart| {
            for (series, (sample, shares)) in self.samples.iter().zip(&shares).enumerate() {
                let bar = |(k, share): (usize, &f64)| {
                    let corners = [(k as f64 * step, 0.0), ((k + 1) as f64 * step, *share)];
                    Rectangle::new(corners, colour(series).mix(0.35).filled())
                };
                chart.draw_series(shares.iter().enumerate().map(bar)).map_err(fault)?;
                let style = colour(series).stroke_width(STROKE / 2);
                let outline = shares.iter().enumerate().flat_map(|(k, share)| [(k, share), (k + 1, share)]);
                let line = LineSeries::new(outline.map(|(k, share)| (k as f64 * step, *share)), style);
                let entry = chart.draw_series(line).map_err(fault)?;
                if self.samples.len() > 1 {
                    let thick = colour(series).stroke_width(4 * STROKE);
                    entry.label(&sample.name).legend(move |(x, y)| PathElement::new([(x, y), (x + 80, y)], thick));
                }
            }
            Ok(())
        })
    }
}

/// The share of the numbers in each step, %.
fn step_shares(sorted: &[f64], step: f64) -> Vec<f64> {
    let mut counts = vec![0_usize; STEPS];
    for value in sorted {
        if let Some(count) = counts.get_mut((value / step) as usize) {
            *count += 1;
        }
    }
    counts.iter().map(|count| 100.0 * *count as f64 / sorted.len().max(1) as f64).collect()
}

/// Points of a cumulative curve.
const LIMITS: usize = 240;

/// Which share of numbers that are not negative is within each limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Cumulative {
    /// What the numbers are, with their unit.
    pub x: String,
    /// What is counted, such as `vertices`.
    pub counted: String,
    /// The samples.
    pub samples: Vec<Sample>,
}

impl Cumulative {
    /// The plot as the text of an SVG file. The axis ends where 99.5 % of each sample are within it, of three or more of each but the widest.
    ///
    /// # Errors
    /// [`Error::Internal`] when drawing fails.
    pub fn svg(&self) -> Result<String, Error> {
        let sorted: Vec<Vec<f64>> = self.samples.iter().map(Sample::sorted).collect();
        let end = end(&sorted);
        let y = format!("share of {} within, %", self.counted);
        let axes = Axes {
            x: &self.x,
            y: &y,
            x_range: 0.0..end,
            y_range: 0.0..101.0,
            legend: (self.samples.len() > 1).then_some(SeriesLabelPosition::LowerRight),
        };
        svg(&axes, |chart| {
            for (series, (sample, sorted)) in self.samples.iter().zip(&sorted).enumerate() {
                let style = colour(series).stroke_width(STROKE);
                let share = |limit: f64| {
                    let within = sorted.partition_point(|value| *value <= limit);
                    100.0 * within as f64 / sorted.len().max(1) as f64
                };
                let limits = (0..=LIMITS).map(|k| end * k as f64 / LIMITS as f64);
                let line = LineSeries::new(limits.map(|limit| (limit, share(limit))), style);
                let entry = chart.draw_series(line).map_err(fault)?;
                if self.samples.len() > 1 {
                    entry.label(&sample.name).legend(move |(x, y)| PathElement::new([(x, y), (x + 80, y)], style));
                }
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_all_numbers_and_the_end_is_just_beyond_nearly_all() {
        let values: Vec<f64> = (1..=1000).map(|k| f64::from(k) / 100.0).collect();
        assert_eq!(end(&[values.clone(), vec![0.5]]), 10.0);
        assert_eq!(end(&[vec![]]), 1.0);
        assert_eq!(end(&[vec![1.0], vec![2.0]]), 2.0);
        assert_eq!(end(&[vec![1.0], vec![9.0], vec![2.0]]), 2.0);
        // Of one of 200 that is far off nothing is shown, and the axis does not end at 20.
        let few = |far: f64| (1..=199).map(|k| f64::from(k) * 10.6 / 199.0).chain([far]).collect::<Vec<f64>>();
        assert!((end(&[few(90.0), vec![0.5]]) - 11.25).abs() < 1e-9, "{}", end(&[few(90.0)]));
        let shares = step_shares(&values, 0.1);
        assert_eq!(shares.len(), STEPS);
        assert!((shares.iter().sum::<f64>() - 39.9).abs() < 1e-9, "{shares:?}");
    }

    #[test]
    fn samples_are_named_and_what_is_not_finite_is_left_out() {
        let sample = |name: &str, values: &[f64]| Sample { name: name.into(), values: values.to_vec() };
        let plots = |samples: Vec<Sample>| {
            let (x, counted) = ("distance, mm".to_owned(), "vertices".to_owned());
            let histogram = Histogram { x: x.clone(), counted: counted.clone(), samples: samples.clone() };
            [histogram.svg().unwrap(), Cumulative { x, counted, samples }.svg().unwrap()]
        };
        let two = plots(vec![sample("seen", &[0.1, 0.5, 0.7]), sample("hidden", &[2.0, 3.0])]);
        assert!(two.iter().all(|text| text.contains("seen") && text.contains("hidden") && text.contains("vertices")));
        let one = plots(vec![sample("", &[0.1, 0.5])]);
        assert_eq!(one, plots(vec![sample("", &[f64::NAN, 0.5, 0.1, f64::INFINITY])]));
        assert!(plots(vec![])[0].contains("distance, mm"));
        assert!(plots(vec![sample("", &[])])[1].contains("distance, mm"));
    }
}
