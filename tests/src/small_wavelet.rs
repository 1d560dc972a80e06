//! A small wavelet model of known numbers, for programs and tests that need a file and no training.
//!
//! A bulging mask of 17 x 25 nodes, in bytes, with 2 x 2 weights for each coefficient. Only additions, multiplications and divisions make its
//! numbers, so they are the same wherever this runs.

use crate::reference::model_file::{Extras, file};
use crate::reference::multiscale::{Multiscale, Spread};
use crate::reference::storage::Storage;
use crate::reference::wavelet::{Grid, Wavelet, analysis};

const GRID: Grid = Grid { base: [3, 4], levels: 3 };
const IDENTITY: usize = 2;
const POSE: usize = 2;

/// Coefficients of a field over the grid; a place is from -1 to 1 along both axes.
fn coefficients(field: impl Fn(f64, f64) -> [f64; 3]) -> Vec<[f32; 3]> {
    let (width, height) = (GRID.width(GRID.levels), GRID.height(GRID.levels));
    let at = |k: usize, size: usize| 2.0 * k as f64 / (size - 1) as f64 - 1.0;
    let samples: Vec<[f64; 3]> = (0..GRID.len()).map(|k| field(at(k % width, width), at(k / width, height))).collect();
    let axes = [0, 1, 2].map(|axis| {
        let plane: Vec<f64> = samples.iter().map(|sample| sample[axis]).collect();
        analysis(&GRID, Wavelet::Cubic, &plane)
    });
    (0..GRID.len()).map(|q| [0, 1, 2].map(|axis| axes[axis][q] as f32)).collect()
}

/// 1 in the middle, 0 at the rim.
fn bulge(u: f64, v: f64) -> f64 {
    (1.0 - u * u) * (1.0 - v * v)
}

/// The bytes of the model file.
pub fn bytes() -> Vec<u8> {
    let nose = |u: f64, v: f64| 1.0 / (1.0 + 40.0 * u * u + 12.0 * v * v);
    let mut mean = coefficients(|u, v| [70.0 * u, -95.0 * v, 45.0 * bulge(u, v) + 22.0 * nose(u, v)]);
    mean.resize(GRID.len().next_multiple_of(16), [0.0; 3]);
    // Wider, longer; and what an expression makes of either.
    let fields: [fn(f64, f64) -> [f64; 3]; IDENTITY * POSE] = [
        |u, v| [9.0 * u, 0.0, 6.0 * bulge(u, v)],
        |u, v| [2.0 * u * v, -3.0 * u * u, 2.0 * u * u * bulge(u, v)],
        |u, v| [0.0, -11.0 * v, 4.0 * u * u * v],
        |u, v| [0.0, 3.0 * bulge(u, v), -2.0 * v * bulge(u, v)],
    ];
    let core =
        fields.chunks(POSE).map(|row| row.iter().map(|field| Storage::I8.stored(&coefficients(field))).collect());
    let model = Multiscale::new(GRID, Wavelet::Cubic, mean, core.collect());
    let n = GRID.len();
    let spread = |mean: [f32; 2], scale: [f32; 2]| Some(Spread { mean: mean.repeat(n), scale: scale.repeat(n) });
    let spreads = [spread([0.0, 0.0], [1.0, 1.0]), spread([1.0, 0.0], [0.25, 0.5])];
    let (width, height) = (GRID.width(GRID.levels) as u32, GRID.height(GRID.levels) as u32);
    let corner = |row: u32, column: u32| row * width + column;
    let quads = (0..height - 1).flat_map(|row| (0..width - 1).map(move |column| (row, column)));
    let faces = quads.flat_map(|(row, column)| {
        let [a, b, c, d] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(down, right)| corner(row + down, column + right));
        [[a, b, c], [c, b, d]]
    });
    let places = [(8, 4), (10, 4), (10, 12), (12, 8), (8, 12), (14, 8), (18, 5), (18, 11), (20, 8), (24, 8), (4, 8)];
    let extras = Extras {
        faces: faces.collect(),
        landmarks: places.map(|(row, column)| corner(row, column)).to_vec(),
        landmark_names: (0..places.len()).map(|k| format!("point {k}")).collect::<Vec<_>>().join("\n"),
        provenance: "procedural mask, no scan".into(),
        ..Extras::default()
    };
    file(&model.head(), &model.sections(&extras, &spreads))
}
