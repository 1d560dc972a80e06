//! The points of a cloud that are nearest to a position.

use crate::Error;

/// A point of the cloud and how far it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Index of the point.
    pub index: u32,
    /// Distance, in the unit of the cloud.
    pub distance: f64,
}

/// A search structure over points.
#[derive(Debug)]
pub struct PointTree {
    points: Vec<[f64; 3]>,
}

impl PointTree {
    /// The structure over these points.
    ///
    /// # Errors
    /// [`Error::Input`] without points, or for a point that is not finite.
    pub fn new(points: &[[f64; 3]]) -> Result<Self, Error> {
        if points.is_empty() {
            return Err(Error::input("no point to search among: give at least one"));
        }
        Ok(PointTree { points: points.to_vec() })
    }

    /// The nearest point; of several equally near ones the one with the smallest index.
    pub fn nearest(&self, position: [f64; 3]) -> Neighbour {
        self.nearest_n(position, 1)[0]
    }

    /// The `n` nearest points, or all when there are fewer, sorted by distance, then by index.
    pub fn nearest_n(&self, position: [f64; 3], n: usize) -> Vec<Neighbour> {
        let mut all = self.within(position, f64::INFINITY);
        all.truncate(n);
        all
    }

    /// All points at most `radius` away, sorted by distance, then by index.
    pub fn within(&self, position: [f64; 3], radius: f64) -> Vec<Neighbour> {
        let mut all: Vec<Neighbour> = self
            .points
            .iter()
            .enumerate()
            .map(|(index, p)| Neighbour {
                index: index as u32,
                distance: (0..3).map(|k| (p[k] - position[k]).powi(2)).sum::<f64>().sqrt(),
            })
            .filter(|neighbour| neighbour.distance <= radius)
            .collect();
        all.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.index.cmp(&b.index)));
        all
    }

    /// [`Self::nearest`] of each position, over all threads.
    pub fn nearest_all(&self, positions: &[[f64; 3]]) -> Vec<Neighbour> {
        use rayon::prelude::*;
        positions.par_iter().map(|&position| self.nearest(position)).collect()
    }
}
