//! A small wavelet model: the mask of [`small_model`](crate::small_model) on a grid of 17 x 25 nodes, levels 0 to 2, local models of 2 x 2 weights.

use crate::small_model::mask;
use habitus::io::model::{Coefficients, ModePrior, ModelSource, WaveletForm, hab};
use habitus_core::wavelet::transform::{analysis, analysis_req};
use habitus_core::wavelet::{Grid, Wavelet};

/// Weights of each coefficient and mode.
const DIM: usize = 2;

/// The bytes of the model file.
///
/// # Panics
/// When the library refuses to write it.
pub fn bytes() -> Vec<u8> {
    let grid = Grid::new(5, 7, 2).expect("a small grid");
    let (width, height, n) = (grid.width(2), grid.height(2), grid.len());
    let part = |k: usize, size: usize| k as f32 * (2.0 / (size - 1) as f32) - 1.0;
    let points: Vec<[f32; 3]> =
        (0..n).map(|node| mask(part(node % width, width), part(node / width, height))).collect();
    let planes: Vec<f64> = (0..3).flat_map(|axis| points.iter().map(move |point| f64::from(point[axis]))).collect();
    let mut coefficients = vec![0.0; 3 * n];
    let mut workspace = vec![0.0; analysis_req(&grid).numbers()];
    analysis(&grid, Wavelet::Cubic, &planes, &mut coefficients, &mut workspace).expect("the mask has a transform");
    let mean: Vec<f64> = (0..3 * n).map(|k| coefficients[k % 3 * n + k / 3]).collect();
    // A coefficient moves by a few millimetres, on each finer level by a third.
    let size = |q: usize| 4.0 / [1.0, 3.0, 9.0][(0..2).filter(|&level| q >= grid.node_count(level)).count()];
    let term = |k: usize| {
        (0..3 * n).map(move |at| {
            size(at / 3) * f64::from(((at / 3 * 5 + at % 3 * 3 + k * 7) % 11) as u8) / 5.0 - size(at / 3)
        })
    };
    let core: Vec<f64> = (0..DIM * DIM).flat_map(term).collect();
    let form =
        WaveletForm { grid, wavelet: Wavelet::Cubic, identity_dim: DIM, pose_dim: DIM, mean: &mean, core: &core };
    let mut source = ModelSource::new(Coefficients::Wavelet(form));
    // Not zero: a product of two weights that are zero does not move with either.
    let prior = || ModePrior { mean: vec![1.0; DIM * n], scale: vec![1.0; DIM * n], precision: Vec::new() };
    (source.identity_prior, source.pose_prior) = (prior(), prior());
    let corners = [
        (7, 5),
        (9, 5),
        (3, 7),
        (5, 7),
        (11, 7),
        (13, 7),
        (6, 12),
        (10, 12),
        (8, 14),
        (5, 18),
        (11, 18),
        (8, 20),
        (8, 24),
    ];
    source.landmarks = corners.map(|(column, row)| (row * width + column) as u32).to_vec();
    let quads = (0..height - 1).flat_map(|row| (0..width - 1).map(move |column| (row * width + column) as u32));
    let below = width as u32;
    source.faces = quads.flat_map(|a| [[a, a + below, a + 1], [a + 1, a + below, a + below + 1]]).collect();
    source.provenance = "procedural mask, no scan".into();
    hab::bytes(&source).expect("a small model can be written")
}
