//! Generalised Procrustes analysis: rigid alignment of many corresponding shapes to their own mean (ch. 12).
//!
//! Size is part of identity, so nothing is scaled. The mean keeps the orientation of the initial mean and its centroid
//! becomes the origin, so that the frame of a model does not drift with the iterations.

use crate::error::Error;
use crate::register::rigid::{Similarity, alignment};
use rayon::prelude::*;

/// Coordinates of the mean that one task sums; fixed, so that the sums do not depend on the thread count.
const CHUNK: usize = 1024;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GpaOptions {
    /// Most rounds of "align to the mean, average again".
    pub rounds: usize,
    /// Root mean square movement of the mean's vertices in mm below which a round is the last.
    pub tolerance_mm: f64,
}

impl Default for GpaOptions {
    fn default() -> Self {
        GpaOptions { rounds: 10, tolerance_mm: 1e-6 }
    }
}

/// What happened.
#[derive(Debug, Clone, PartialEq)]
pub struct GpaReport {
    /// Root mean square movement of the mean in mm, one value per round made.
    pub movement_mm: Vec<f64>,
    /// Whether the last movement is below the tolerance.
    pub converged: bool,
    /// The mean of the aligned shapes, xyz after xyz, mm.
    pub mean: Vec<f64>,
}

/// Aligns all shapes in place. `shapes` holds them one after another, each of `shape_len` coordinates (xyz after xyz).
///
/// Errors: a shape whose points lie on a line.
pub fn align_in_place(shapes: &mut [f64], shape_len: usize, options: &GpaOptions) -> Result<GpaReport, Error> {
    if shape_len == 0 || !shape_len.is_multiple_of(3) || shapes.is_empty() || !shapes.len().is_multiple_of(shape_len) {
        return Err(Error::input(format!(
            "{} coordinates cannot be cut into shapes of {shape_len}; give whole shapes of three coordinates a vertex",
            shapes.len()
        )));
    }
    let initial = mean_of_shapes(shapes, shape_len);
    let mut mean = initial.clone();
    let mut movement_mm = Vec::new();
    let mut converged = false;
    while movement_mm.len() < options.rounds && !converged {
        align_each(shapes, shape_len, &mean)?;
        let next = mean_of_shapes(shapes, shape_len);
        let square: f64 = next.iter().zip(&mean).map(|(a, b)| (a - b) * (a - b)).sum();
        let movement = (square / (shape_len / 3) as f64).sqrt();
        movement_mm.push(movement);
        converged = movement < options.tolerance_mm;
        mean = next;
    }
    let mut gauge = alignment(&mean, &initial, None, false)?;
    let centroid = centroid(&mean);
    let turned = Similarity { translation: [0.0; 3], ..gauge }.point(centroid);
    gauge.translation = turned.map(|x| -x);
    shapes.par_chunks_mut(shape_len).for_each(|shape| gauge.apply_in_place(shape));
    gauge.apply_in_place(&mut mean);
    Ok(GpaReport { movement_mm, converged, mean })
}

/// Moves every shape rigidly onto `reference`, which it may not be part of: test faces onto a model's mean.
pub fn align_each(shapes: &mut [f64], shape_len: usize, reference: &[f64]) -> Result<(), Error> {
    let outcomes: Vec<Result<(), Error>> = shapes
        .par_chunks_mut(shape_len)
        .map(|shape| {
            alignment(shape, reference, None, false)?.apply_in_place(shape);
            Ok(())
        })
        .collect();
    for (index, outcome) in outcomes.into_iter().enumerate() {
        outcome.map_err(|error| Error::input(format!("shape {index} cannot be aligned: {error}")))?;
    }
    Ok(())
}

/// The mean of shapes of `shape_len` coordinates each, summed in their order.
pub fn mean_of_shapes(shapes: &[f64], shape_len: usize) -> Vec<f64> {
    let n_shapes = (shapes.len() / shape_len) as f64;
    let mut mean = vec![0.0; shape_len];
    mean.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, mean)| {
        let start = chunk * CHUNK;
        for shape in shapes.chunks_exact(shape_len) {
            for (m, x) in mean.iter_mut().zip(&shape[start..]) {
                *m += x;
            }
        }
        mean.iter_mut().for_each(|m| *m /= n_shapes);
    });
    mean
}

fn centroid(shape: &[f64]) -> [f64; 3] {
    let points = shape.as_chunks::<3>().0;
    std::array::from_fn(|axis| points.iter().map(|x| x[axis]).sum::<f64>() / points.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn scattered() -> (Vec<f64>, usize) {
        let base: Vec<f64> = (0..60).map(|i| 40.0 * (f64::from(i) * 1.7).sin()).collect();
        let mut shapes = Vec::new();
        for k in 0..9 {
            let angle = 0.15 * f64::from(k);
            let r = Rotation3::from_euler_angles(angle, -angle, 0.5 * angle);
            let motion = Similarity {
                scale: 1.0,
                rotation: std::array::from_fn(|i| std::array::from_fn(|j| r[(i, j)])),
                translation: [f64::from(k), -3.0 * f64::from(k), 100.0],
            };
            let mut shape = base.clone();
            motion.apply_in_place(&mut shape);
            shapes.extend(shape);
        }
        (shapes, base.len())
    }

    #[test]
    fn copies_of_one_shape_coincide_afterwards_and_the_centroid_is_the_origin() {
        let (mut shapes, len) = scattered();
        let report = align_in_place(&mut shapes, len, &GpaOptions::default()).unwrap();
        for shape in shapes.chunks_exact(len) {
            assert!(shape.iter().zip(&report.mean).all(|(a, b)| (a - b).abs() < 1e-9));
        }
        assert!(centroid(&report.mean).iter().all(|x| x.abs() < 1e-12));
        assert!(report.converged && report.movement_mm.len() <= 4, "{:?}", report.movement_mm);
    }

    #[test]
    fn gauge_keeps_the_orientation_of_the_initial_mean() {
        let (mut shapes, len) = scattered();
        let initial = mean_of_shapes(&shapes, len);
        let report = align_in_place(&mut shapes, len, &GpaOptions::default()).unwrap();
        let left = alignment(&report.mean, &initial, None, false).unwrap().rotation;
        let identity = Similarity::IDENTITY.rotation;
        assert!((0..9).all(|i| (left[i / 3][i % 3] - identity[i / 3][i % 3]).abs() < 1e-12), "{left:?}");
    }

    #[test]
    fn bits_do_not_depend_on_the_thread_count() {
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut shapes: Vec<f64> = (0..20 * 3 * 700).map(|i| 50.0 * (f64::from(i) * 0.731).sin()).collect();
            let report = pool.install(|| align_in_place(&mut shapes, 3 * 700, &GpaOptions::default()).unwrap());
            (shapes, report)
        };
        let one = run(1);
        assert_eq!(one, run(2));
        assert_eq!(one, run(8));
    }

    #[test]
    fn shape_on_a_line_is_named() {
        let (mut shapes, len) = scattered();
        for (i, x) in shapes[2 * len..3 * len].iter_mut().enumerate() {
            *x = (i / 3) as f64;
        }
        let said = align_in_place(&mut shapes, len, &GpaOptions::default()).unwrap_err().to_string();
        assert!(said.contains("shape 2") && said.contains("line"), "{said}");
    }
}
