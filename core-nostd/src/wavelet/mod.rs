//! B-spline subdivision wavelets on a grid (Wuhrer, ch. 15): the multiscale form of a surface that is parametrised over a rectangle.
//!
//! A base grid is refined dyadically `L` times ([`grid`]). One lifting step ([`lifting`]) splits the samples of a level into those of the next
//! coarser level and details; repeated, separably along rows and columns, it turns the samples of the finest level into as many
//! coefficients, and back ([`transform`]). A window of the surface, down to a single node, costs only what it depends on and has the bits of
//! the whole ([`window`]). [`basis`] are the functions that the coefficients stand for.
//!
//! Coefficients lie level by level, coarsest first, so that a prefix of them is the surface at a coarser level. Arrays of several
//! components (x, y, z) are planar: all numbers of the first component, then those of the second.

pub mod basis;
pub mod grid;
pub mod lifting;
pub mod line;
mod lines;
pub(crate) mod span;
pub(crate) mod step;
mod strip;
pub mod transform;
pub mod window;

pub use grid::{Axis, Grid, Node};
pub use lifting::Wavelet;
