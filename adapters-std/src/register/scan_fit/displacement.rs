//! What a model cannot express, as a smooth random displacement along the normals of its surface: a Gaussian process in a basis of bumps.
//!
//! Residuals of a truncated model are alike over centimetres. A fit that took the thousands of points of a scan for independent would trust
//! them too much and bend its weights to what no weights can express. With the displacement beside the weights (and dropped in the end) each
//! residual counts as its covariance asks for: the best linear unbiased prediction of the weights (Rasmussen, Williams 2006, 2.7 and 8.3.1).

use glam::DVec3;

use crate::Error;
use crate::mesh::sampling::farthest_points;

/// Distance between the centres of bumps, in their standard deviations.
const SPACING: f64 = 1.3;
/// Part of the prior's diagonal that keeps it definite.
const JITTER: f64 = 1e-3;

/// Bumps `exp(-|x - c|^2 / (2 l^2))` about centres on the mean surface.
pub(super) struct Displacement {
    /// Height of each bump at each vertex, bump after bump.
    pub heights: Vec<Vec<f32>>,
    /// Precision of the bumps' amplitudes: their Gram matrix over the variance, 1/mm^2.
    pub precision: Vec<f64>,
}

impl Displacement {
    /// No displacement.
    pub(super) fn none() -> Self {
        Displacement { heights: Vec::new(), precision: Vec::new() }
    }

    /// Of standard deviation `amplitude` (mm) and correlation `length` (mm) over the surface `mean`.
    pub(super) fn new(mean: &[[f64; 3]], area: f64, amplitude: f64, length: f64) -> Result<Self, Error> {
        let n_centres = ((area / (SPACING * length).powi(2)).ceil() as usize).clamp(1, 200);
        let centres: Vec<DVec3> = farthest_points(mean, n_centres)?
            .iter()
            .map(|point| DVec3::from_array(mean[point.index as usize]))
            .collect();
        let height = |a: DVec3, b: DVec3| (-0.5 * a.distance_squared(b) / (length * length)).exp();
        let heights = centres
            .iter()
            .map(|&centre| mean.iter().map(|p| height(centre, DVec3::from_array(*p)) as f32).collect())
            .collect();
        let mut precision = Vec::with_capacity(n_centres * n_centres);
        for (i, &a) in centres.iter().enumerate() {
            for (j, &b) in centres.iter().enumerate() {
                let jitter = if i == j { JITTER } else { 0.0 };
                precision.push((height(a, b) + jitter) / (amplitude * amplitude));
            }
        }
        Ok(Displacement { heights, precision })
    }

    /// Number of bumps.
    pub(super) fn dim(&self) -> usize {
        self.heights.len()
    }
}
