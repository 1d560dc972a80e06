//! How large the points of a cloud are drawn.

use super::view::visible;
use crate::spatial::PointTree;

/// Points whose neighbourhood is looked at: their median does not move noticeably with more.
const SAMPLES: usize = 256;

/// Radius of the discs over the distance to the fourth nearest point. On a square grid of points discs touch everywhere from
/// 0.71 on; more thickens what is thin, such as fingers.
const SHARE: f64 = 0.75;

/// The radius at which discs around the points close the surface that they lie on: three quarters of the median distance to
/// the fourth nearest point, in the unit of the cloud. Points that are not finite count for nothing; 0 for fewer than two points.
pub(super) fn point_radius(points: &[[f64; 3]]) -> f64 {
    let points: Vec<[f64; 3]> = points.iter().copied().filter(|point| visible(*point)).collect();
    let Ok(tree) = PointTree::new(&points) else { return 0.0 };
    let step = points.len().div_ceil(SAMPLES).max(1);
    let fourth = |point: &[f64; 3]| tree.nearest_n(*point, 5).last().map_or(0.0, |neighbour| neighbour.distance);
    let mut distances: Vec<f64> = points.iter().step_by(step).map(fourth).collect();
    distances.sort_by(f64::total_cmp);
    SHARE * distances.get(distances.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_grid_reach_their_neighbours() {
        let grid: Vec<[f64; 3]> = (0..400).map(|k| [f64::from(k % 20) * 2.0, f64::from(k / 20) * 2.0, 5.0]).collect();
        assert_eq!(point_radius(&grid), 1.5);
    }

    #[test]
    fn clouds_without_spacing_have_no_radius() {
        assert_eq!(point_radius(&[]), 0.0);
        assert_eq!(point_radius(&[[f64::NAN; 3]; 4]), 0.0);
        assert_eq!(point_radius(&[[1.0; 3]; 9]), 0.0);
    }
}
