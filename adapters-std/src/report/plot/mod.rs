//! Plots as SVG texts: curves with error bars, histograms, cumulative shares, bars.
//!
//! Axes, ticks and shapes are drawn by the crate `plotters`; what is added here is one look for all, light and dark. The same numbers give the
//! same bytes. Numbers that are not finite are left out.

mod axes;
mod bars;
mod curves;
mod shares;

pub use bars::Bars;
pub use curves::{Curve, CurvePlot, PlotPoint};
pub use shares::{Cumulative, Histogram, Sample};
