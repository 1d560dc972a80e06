//! `wavelet` of the kernel, in both precisions, on grids of any size.

use crate::memory::{Input, Output, status};
use habitus_core::wavelet::basis::{Basis, basis_req, coefficient_lines, support};
use habitus_core::wavelet::line::{analysis_step, step_req, synthesis_step};
use habitus_core::wavelet::transform::{analysis, analysis_req, synthesis, synthesis_req};
use habitus_core::wavelet::window::{window, window_req};
use habitus_core::wavelet::{Axis, Grid, Wavelet};

/// Base width, base height, levels, and which wavelet.
#[repr(C)]
pub struct Shape {
    width: usize,
    height: usize,
    levels: usize,
    bilinear: bool,
}

impl Shape {
    fn wavelet(&self) -> Wavelet {
        if self.bilinear { Wavelet::Bilinear } else { Wavelet::Cubic }
    }
}

#[unsafe(no_mangle)]
extern "C" fn check_wavelet_grid(shape: Shape, coefficient: usize, column: usize, row: usize, level: usize) -> usize {
    let Ok(grid) = Grid::new(shape.width, shape.height, shape.levels) else { return 0 };
    let node = grid.node_of(coefficient).map_or(0, |node| node.level ^ node.column ^ node.row);
    let place = grid.level_of(column, row).unwrap_or(0) ^ grid.coefficient_of(column, row).unwrap_or(0);
    let needed = synthesis_req(&grid, level).numbers() ^ analysis_req(&grid).numbers();
    let window = window_req(&grid, level, &(column..row), &(row..column)).numbers();
    let needed = needed ^ basis_req(&grid.rows(), shape.wavelet()).f32_bytes() ^ step_req(coefficient).numbers();
    let needed = needed ^ grid.node_count(level) ^ usize::from(grid.is_empty());
    node ^ place ^ needed ^ window ^ grid.coefficients(level).len() ^ grid.step(level) ^ grid.len()
}

#[unsafe(no_mangle)]
extern "C" fn check_wavelet_support(base: usize, levels: usize, bilinear: bool, level: usize, index: usize) -> i32 {
    let wavelet = if bilinear { Wavelet::Bilinear } else { Wavelet::Cubic };
    status(Axis::new(base, levels).and_then(|axis| support(&axis, wavelet, level, index)))
}

macro_rules! checks {
    ($real:ty, $synthesis:ident, $analysis:ident, $window:ident, $step:ident, $basis:ident) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $synthesis(
            shape: Shape,
            level: usize,
            coefficients: Input<$real>,
            out: Output<$real>,
            work: Output<$real>,
        ) -> i32 {
            // SAFETY: the caller's promise.
            let (coefficients, out, work) = unsafe { (coefficients.slice(), out.slice(), work.slice()) };
            status(
                Grid::new(shape.width, shape.height, shape.levels)
                    .and_then(|grid| synthesis(&grid, shape.wavelet(), level, coefficients, out, work)),
            )
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $analysis(
            shape: Shape,
            samples: Input<$real>,
            out: Output<$real>,
            work: Output<$real>,
        ) -> i32 {
            // SAFETY: the caller's promise.
            let (samples, out, work) = unsafe { (samples.slice(), out.slice(), work.slice()) };
            status(
                Grid::new(shape.width, shape.height, shape.levels)
                    .and_then(|grid| analysis(&grid, shape.wavelet(), samples, out, work)),
            )
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $window(
            shape: Shape,
            level: usize,
            rectangle: [usize; 4],
            coefficients: Input<$real>,
            out: Output<$real>,
            work: Output<$real>,
        ) -> i32 {
            // SAFETY: the caller's promise.
            let (coefficients, out, work) = unsafe { (coefficients.slice(), out.slice(), work.slice()) };
            let [left, right, top, bottom] = rectangle;
            status(Grid::new(shape.width, shape.height, shape.levels).and_then(|grid| {
                window(&grid, shape.wavelet(), level, left..right, top..bottom, coefficients, out, work)
            }))
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $step(
            bilinear: bool,
            samples: Output<$real>,
            coarse: Output<$real>,
            detail: Output<$real>,
            work: Output<$real>,
        ) -> i32 {
            // SAFETY: the caller's promise.
            let (samples, coarse) = unsafe { (samples.slice(), coarse.slice()) };
            // SAFETY: the caller's promise.
            let (detail, work) = unsafe { (detail.slice(), work.slice()) };
            let wavelet = if bilinear { Wavelet::Bilinear } else { Wavelet::Cubic };
            let there = status(analysis_step(wavelet, samples, coarse, detail, work));
            there.wrapping_add(status(synthesis_step(wavelet, coarse, detail, samples, work)))
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $basis(
            shape: Shape,
            coefficient: usize,
            columns: Output<$real>,
            rows: Output<$real>,
        ) -> usize {
            // SAFETY: the caller's promise.
            let (columns, rows) = unsafe { (columns.slice(), rows.slice()) };
            let Ok(grid) = Grid::new(shape.width, shape.height, shape.levels) else { return 0 };
            let Ok(columns) = Basis::new(grid.columns(), shape.wavelet(), columns) else { return 0 };
            let Ok(rows) = Basis::new(grid.rows(), shape.wavelet(), rows) else { return 0 };
            coefficient_lines(&grid, &columns, &rows, coefficient)
                .map_or(0, |[x, y]| x.first ^ y.first ^ x.values.len() ^ y.values.len())
        }
    };
}

checks!(
    f32,
    check_wavelet_synthesis_f32,
    check_wavelet_analysis_f32,
    check_wavelet_window_f32,
    check_wavelet_step_f32,
    check_wavelet_basis_f32
);
checks!(
    f64,
    check_wavelet_synthesis_f64,
    check_wavelet_analysis_f64,
    check_wavelet_window_f64,
    check_wavelet_step_f64,
    check_wavelet_basis_f64
);
