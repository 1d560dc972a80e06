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
    /// Principal components of what the model misses, which the file of the model tells: xyz of each vertex, component after component.
    pub components: Vec<Vec<f32>>,
    /// Precision of the amplitudes of bumps and components: the Gram matrix of the bumps over their variance, 1/mm^2; 1 for each component.
    pub precision: Vec<f64>,
}

impl Displacement {
    /// No displacement.
    pub(super) fn none() -> Self {
        Displacement { heights: Vec::new(), components: Vec::new(), precision: Vec::new() }
    }

    /// Of standard deviation `amplitude` (mm) and correlation `length` (mm) over the surface `mean`, beside the components.
    pub(super) fn new(
        mean: &[[f64; 3]],
        area: f64,
        amplitude: f64,
        length: f64,
        components: Vec<Vec<f32>>,
    ) -> Result<Self, Error> {
        let n_centres = ((area / (SPACING * length).powi(2)).ceil() as usize).clamp(1, 200);
        let centres: Vec<DVec3> = farthest_points(mean, n_centres)?
            .iter()
            .map(|point| DVec3::from_array(mean[point.index as usize]))
            .collect();
        let height = |a: DVec3, b: DVec3| (-0.5 * a.distance_squared(b) / (length * length)).exp();
        let heights: Vec<Vec<f32>> = centres
            .iter()
            .map(|&centre| mean.iter().map(|p| height(centre, DVec3::from_array(*p)) as f32).collect())
            .collect();
        let dim = centres.len() + components.len();
        let mut precision = vec![0.0; dim * dim];
        for (i, row) in precision.chunks_exact_mut(dim).enumerate() {
            let Some(&a) = centres.get(i) else {
                row[i] = 1.0;
                continue;
            };
            for (j, (entry, &b)) in row.iter_mut().zip(&centres).enumerate() {
                let jitter = if i == j { JITTER } else { 0.0 };
                *entry = (height(a, b) + jitter) / (amplitude * amplitude);
            }
        }
        Ok(Displacement { heights, components, precision })
    }

    /// Displacement of a vertex by each bump and component at the amplitude 1, where its surface has this normal.
    pub(super) fn columns(&self, vertex: usize, normal: [f64; 3], out: &mut [[f32; 3]]) {
        let (bumps, components) = out.split_at_mut(self.heights.len().min(out.len()));
        for (to, heights) in bumps.iter_mut().zip(&self.heights) {
            *to = normal.map(|x| x as f32 * heights[vertex]);
        }
        for (to, component) in components.iter_mut().zip(&self.components) {
            *to = std::array::from_fn(|axis| component[3 * vertex + axis]);
        }
    }

    /// Number of bumps and components.
    pub(super) fn dim(&self) -> usize {
        self.heights.len() + self.components.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plate() -> Vec<[f64; 3]> {
        (0..41 * 41).map(|k| [f64::from(k % 41) * 2.5, f64::from(k / 41) * 2.5, 0.0]).collect()
    }

    #[test]
    fn bumps_stand_on_the_surface_and_fall_off() {
        let (mean, length) = (plate(), 14.0);
        let made = Displacement::new(&mean, 1e4, 0.4, length, Vec::new()).expect("bumps");
        let n = (1e4f64 / (SPACING * length).powi(2)).ceil() as usize;
        assert_eq!((made.dim(), made.heights.len(), made.precision.len()), (n, n, n * n));
        for heights in &made.heights {
            let top = heights.iter().position(|&height| height == 1.0).expect("a centre on a vertex");
            let centre = DVec3::from_array(mean[top]);
            for (p, &height) in mean.iter().zip(heights) {
                let distance = centre.distance(DVec3::from_array(*p));
                assert!((f64::from(height) - (-0.5 * (distance / length).powi(2)).exp()).abs() < 1e-6);
            }
        }
        // Everywhere there is a bump that can lift the surface.
        let lifted = |v: usize| made.heights.iter().map(|heights| heights[v]).fold(0.0, f32::max);
        assert!((0..mean.len()).all(|v| lifted(v) > 0.4));
    }

    #[test]
    fn the_precision_is_that_of_the_amplitude_and_definite() {
        let components = vec![vec![0.5; 3 * 41 * 41]; 2];
        let made = Displacement::new(&plate(), 1e4, 0.4, 14.0, components).expect("bumps");
        let (dim, n) = (made.dim(), made.heights.len());
        assert_eq!(dim, n + 2);
        let matrix = nalgebra::DMatrix::from_row_slice(dim, dim, &made.precision);
        assert!((&matrix - matrix.transpose()).amax() < 1e-12);
        assert!((matrix[(0, 0)] - (1.0 + JITTER) / 0.16).abs() < 1e-12);
        // Components are independent of the bumps and of one another, of variance 1.
        for k in n..dim {
            assert!((0..dim).all(|j| matrix[(k, j)] == f64::from(u8::from(j == k))));
        }
        assert!(nalgebra::Cholesky::new(matrix).is_some());
    }

    #[test]
    fn no_displacement_has_no_columns() {
        assert_eq!(Displacement::none().dim(), 0);
        // However large the surface and short the length, there is a bound.
        assert_eq!(Displacement::new(&plate(), 1e9, 0.4, 1.0, Vec::new()).expect("bumps").dim(), 200);
        assert_eq!(Displacement::new(&plate(), 0.0, 0.4, 14.0, Vec::new()).expect("bumps").dim(), 1);
    }
}
