//! Fewer points of a cloud, evenly: one for each cell of a grid, or none closer than a distance.

use rayon::prelude::*;

use crate::Error;
use crate::spatial::PointTree;

/// The most cells on an axis; beyond, neighbouring positions could not be told apart.
const MAX_CELLS: f64 = (1u64 << 40) as f64;

/// One point for each occupied cell of a grid of cubes: the point nearest to the mean of the cell's points.
///
/// The grid starts at the smallest coordinates of the cloud; `size` is the side of a cell. Indices are given in ascending
/// order, for [`crate::mesh::Mesh::rearranged`]; of equally near points the one with the smallest index is taken.
///
/// Cost: `O(n log n)`, 32 bytes per point. Determinism: means are summed in the order of the indices.
///
/// # Errors
/// [`Error::Input`] for a size that is not positive or too small for the cloud (2^40 cells on an axis), or a point that is
/// not finite.
pub fn thinned_by_voxels(positions: &[[f64; 3]], size: f64) -> Result<Vec<u32>, Error> {
    let cells = VoxelCells::new(positions, size)?;
    let mut kept: Vec<u32> = cells.iter().map(|cell| most_central(positions, cell)).collect();
    kept.sort_unstable();
    Ok(kept)
}

/// The points of a cloud by the occupied cells of a grid of cubes.
#[derive(Debug, Clone)]
pub struct VoxelCells {
    /// Cell and index of every point, in order.
    places: Vec<([u64; 3], u32)>,
}

impl VoxelCells {
    /// The grid starts at the smallest coordinates of the cloud; `size` is the side of a cell.
    ///
    /// # Errors
    /// As [`thinned_by_voxels`].
    pub fn new(positions: &[[f64; 3]], size: f64) -> Result<Self, Error> {
        refuse_length(size, "side of a cell")?;
        if let Some(index) = positions.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(Error::input(format!("point {index} is not finite: remove it")));
        }
        let low = positions.iter().fold([f64::INFINITY; 3], |low, p| std::array::from_fn(|a| low[a].min(p[a])));
        let mut places: Vec<([u64; 3], u32)> = Vec::with_capacity(positions.len());
        for (index, position) in positions.iter().enumerate() {
            let cell: [f64; 3] = std::array::from_fn(|axis| ((position[axis] - low[axis]) / size).floor());
            if cell.iter().any(|&n| !(n < MAX_CELLS)) {
                return Err(Error::input(format!(
                    "cells of side {size} are too small for the cloud: make them larger"
                )));
            }
            places.push((cell.map(|n| n as u64), index as u32));
        }
        places.par_sort_unstable();
        Ok(VoxelCells { places })
    }

    /// The points of each cell, in ascending order; cells in the order of their coordinates.
    pub fn iter(&self) -> impl Iterator<Item = impl Iterator<Item = u32> + Clone + '_> + '_ {
        self.places.chunk_by(|a, b| a.0 == b.0).map(|cell| cell.iter().map(|&(_, index)| index))
    }
}

/// The point of a cell that is nearest to the mean of its points.
fn most_central(positions: &[[f64; 3]], cell: impl Iterator<Item = u32> + Clone) -> u32 {
    let share = 1.0 / cell.clone().count().max(1) as f64;
    let mean = cell.clone().fold([0.0; 3], |sum: [f64; 3], index| {
        std::array::from_fn(|axis| sum[axis] + positions[index as usize][axis] * share)
    });
    let square = |index: u32| (0..3).map(|a| (positions[index as usize][a] - mean[a]).powi(2)).sum::<f64>();
    let nearest = cell.map(|index| (square(index), index)).min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or(0, |(_, index)| index)
}

/// Points none of which are within `distance` of one another, while every other point is within it of one of them.
///
/// Points are taken in their order, each unless one taken earlier is too near. Indices are given in ascending order.
///
/// Cost: one search of a [`PointTree`] for each point that is kept.
///
/// # Errors
/// [`Error::Input`] for a distance that is not positive, and those of [`PointTree::new`]; no points give none.
pub fn thinned_by_distance(positions: &[[f64; 3]], distance: f64) -> Result<Vec<u32>, Error> {
    refuse_length(distance, "distance between points")?;
    if positions.is_empty() {
        return Ok(Vec::new());
    }
    let tree = PointTree::new(positions)?;
    let mut is_near = vec![false; positions.len()];
    let mut kept = Vec::new();
    for (index, &position) in positions.iter().enumerate() {
        if !is_near[index] {
            kept.push(index as u32);
            tree.within(position, distance).iter().for_each(|near| is_near[near.index as usize] = true);
        }
    }
    Ok(kept)
}

fn refuse_length(length: f64, what: &str) -> Result<(), Error> {
    if length > 0.0 && length.is_finite() {
        return Ok(());
    }
    Err(Error::input(format!("a {what} of {length}: give a positive length")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn line() -> Vec<[f64; 3]> {
        [0.0, 0.4, 0.9, 1.0, 2.5, 2.6].map(|x| [5.0 + x, -3.0, 0.0]).to_vec()
    }

    #[test]
    fn a_cell_keeps_its_most_central_point() {
        // Cells [0, 1): 0, 0.4, 0.9 with mean 0.43; [1, 2): 1; [2, 3): 2.5 and 2.6, equally near to their mean up to rounding.
        let kept = thinned_by_voxels(&line(), 1.0).unwrap();
        assert_eq!(kept[..2], [1, 3]);
        assert_eq!(kept.len(), 3);
        assert_eq!(thinned_by_voxels(&[[1.0; 3]; 4], 1.0).unwrap(), [0]);
        assert!(thinned_by_voxels(&[], 1.0).unwrap().is_empty());
    }

    #[test]
    fn points_within_the_distance_of_an_earlier_one_go() {
        assert_eq!(thinned_by_distance(&line(), 0.5).unwrap(), [0, 2, 4]);
        assert!(thinned_by_distance(&[], 0.5).unwrap().is_empty());
    }

    #[test]
    fn refusals_say_what_to_give() {
        let said = |result: Result<Vec<u32>, Error>| result.unwrap_err().to_string();
        for length in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(said(thinned_by_voxels(&line(), length)).contains("positive length"));
            assert!(said(thinned_by_distance(&line(), length)).contains("positive length"));
        }
        assert!(said(thinned_by_voxels(&line(), 1e-300)).contains("make them larger"));
        assert!(said(thinned_by_voxels(&[[0.0; 3], [f64::NAN; 3]], 1.0)).contains("point 1"));
    }

    proptest! {
        #[test]
        fn thinned_points_keep_apart_and_cover(points in proptest::collection::vec(proptest::array::uniform3(-2.0..2.0f64), 1..60)) {
            let distance = |a: u32, b: u32| {
                let (a, b) = (points[a as usize], points[b as usize]);
                (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
            };
            let kept = thinned_by_distance(&points, 0.8).unwrap();
            for (place, &a) in kept.iter().enumerate() {
                prop_assert!(kept[..place].iter().all(|&b| distance(a, b) > 0.8));
            }
            for point in 0..points.len() as u32 {
                prop_assert!(kept.iter().any(|&k| distance(point, k) <= 0.8));
                // A cell's diagonal is sqrt(3) of its side.
                let of_cells = thinned_by_voxels(&points, 0.8).unwrap();
                prop_assert!(of_cells.iter().any(|&k| distance(point, k) <= 0.8 * 1.7321));
            }
        }
    }
}
