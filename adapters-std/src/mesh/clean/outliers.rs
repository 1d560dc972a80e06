//! Points of a cloud that lie far from all others.

use glam::DVec3;

use crate::Error;
use crate::spatial::PointTree;

/// Neighbours whose mean distance is compared.
const N_NEIGHBOURS: usize = 8;

/// A point is an outlier when the mean distance of its 8 nearest points is more than `factor` times the median of that
/// number over all points. The numbers of the outliers among `points`, ascending.
///
/// The median, not the mean and the standard deviation, because a single point at a great distance would hide all others in
/// those. Clouds of up to 8 points have no outliers.
///
/// # Errors
/// Those of [`PointTree::new`].
pub(super) fn outliers(points: &[DVec3], factor: f64) -> Result<Vec<u32>, Error> {
    use rayon::prelude::*;
    if points.len() <= N_NEIGHBOURS {
        return Ok(Vec::new());
    }
    let positions: Vec<[f64; 3]> = points.iter().map(|point| point.to_array()).collect();
    let tree = PointTree::new(&positions)?;
    let spread: Vec<f64> = positions
        .par_iter()
        .map(|&position| {
            // The nearest one is the point itself.
            let near = tree.nearest_n(position, N_NEIGHBOURS + 1);
            near.iter().skip(1).map(|neighbour| neighbour.distance).sum::<f64>() / N_NEIGHBOURS as f64
        })
        .collect();
    let mut sorted = spread.clone();
    let middle = sorted.len() / 2;
    let limit = factor * *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    Ok((0..points.len() as u32).filter(|&point| spread[point as usize] > limit).collect())
}
