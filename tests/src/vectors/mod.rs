//! The golden vectors as the reference gives them: the text of every file of `tests/golden/vectors`.

// Indices are what the formulas are written in.
#![allow(clippy::needless_range_loop)]

mod bodies;
mod body_models;
mod files;
mod fit;
mod generator;
mod lbfgsb;
mod linalg;
mod models;
mod solve;
mod stream;
mod text;
mod wavelet_fits;
mod wavelet_models;
mod wavelets;

pub use body_models::{Shape, skinned};
use models::Models;
pub use stream::Stream;
pub use wavelet_models::multiscale;

/// Name and text of each file.
pub fn written() -> Vec<(&'static str, String)> {
    let models = Models::new();
    vec![
        ("models.txt", models.text()),
        ("generator.txt", generator::text(&models)),
        ("fit.txt", fit::text(&models)),
        ("solve.txt", solve::text()),
        ("bodies.txt", bodies::text(&models)),
        ("wavelets.txt", wavelets::text(&models)),
        ("files.txt", files::text(&models)),
    ]
}
