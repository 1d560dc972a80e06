//! How far two surfaces are apart: distances of points on one to the closest points of the other, both ways.

mod sample;
mod summary;
mod target;

pub use summary::DistanceSummary;
pub use target::{PointDistance, Target};

use crate::Error;
use crate::mesh::Mesh;

/// What is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceOptions {
    /// Points that are drawn uniformly over the area of each mesh; 0: its vertices are taken. Clouds give all their points in
    /// either case.
    pub samples: usize,
    /// Seed of these points.
    pub seed: u64,
    /// Whether vertices count by the area around them (a third of that of their triangles) instead of all alike; those without
    /// area do not count then. Drawn points and clouds count alike in either case.
    pub area_weighted: bool,
    /// Distances for which the share of points within them is told.
    pub thresholds: Vec<f64>,
}

impl Default for DistanceOptions {
    fn default() -> Self {
        DistanceOptions { samples: 0, seed: 1, area_weighted: false, thresholds: vec![0.5, 1.0, 2.0, 5.0, 10.0] }
    }
}

/// Distances of the points of one shape to the other, in the unit of the shapes.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Of all points.
    pub all: DistanceSummary,
    /// Points whose closest point lies on the boundary of the other surface: they may have no counterpart there.
    pub at_boundary: usize,
    /// Of the points that are not among these; none when there are no others.
    pub inner: Option<DistanceSummary>,
}

/// Distances between two shapes, in their unit.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceDistance {
    /// From the points of the first to the second.
    pub a_to_b: Direction,
    /// From the points of the second to the first.
    pub b_to_a: Direction,
}

impl SurfaceDistance {
    /// The Chamfer distance in its symmetric mean form: the mean of the two mean distances.
    pub fn chamfer_mean(&self) -> f64 {
        self.a_to_b.all.mean / 2.0 + self.b_to_a.all.mean / 2.0
    }

    /// The Hausdorff distance of the sampled points: the largest distance in either direction.
    pub fn hausdorff(&self) -> f64 {
        self.a_to_b.all.largest.max(self.b_to_a.all.largest)
    }
}

/// The distances between two shapes, each a mesh or a cloud, which are in one frame and one unit.
///
/// For a point p of one shape, `d(p) = min over q of the other |p - q|`, where q runs over the triangles of a mesh and the
/// points of a cloud. Vertices that no face uses are no part of a mesh.
///
/// Cost: `O((n_a + n_b) log)` closest-point queries over all threads.
/// Determinism: the same bits for any number of threads; sums run over the points in their order.
///
/// # Errors
/// [`Error::Input`] for a shape that fails [`Mesh::check`] or, where area counts, has none.
pub fn surface_distance(a: &Mesh, b: &Mesh, options: &DistanceOptions) -> Result<SurfaceDistance, Error> {
    let (of_a, of_b) = (Target::new(a).map_err(named("first"))?, Target::new(b).map_err(named("second"))?);
    Ok(SurfaceDistance {
        a_to_b: direction(a, &of_b, options).map_err(named("first"))?,
        b_to_a: direction(b, &of_a, options).map_err(named("second"))?,
    })
}

/// Distances of the points of one shape to a target.
///
/// # Errors
/// As [`surface_distance`].
pub fn direction(from: &Mesh, to: &Target, options: &DistanceOptions) -> Result<Direction, Error> {
    from.check()?;
    let drawn;
    let points = if options.samples > 0 && !from.faces.is_empty() {
        drawn = sample::area_uniform(from, options.samples, options.seed)?;
        &drawn
    } else {
        &from.positions
    };
    let mut distances = to.distances(points);
    let mut weights = vec![1.0; distances.len()];
    if options.samples == 0 && !from.faces.is_empty() {
        if options.area_weighted {
            weights = sample::vertex_areas(from);
        } else {
            weights.fill(0.0);
            from.faces.iter().flatten().for_each(|&vertex| weights[vertex as usize] = 1.0);
        }
        let counts: Vec<bool> = weights.iter().map(|weight| *weight > 0.0).collect();
        let mut keep = counts.iter().copied();
        distances.retain(|_| keep.next().unwrap_or(false));
        weights.retain(|weight| *weight > 0.0);
    }
    let summary = |of: &[(PointDistance, f64)]| DistanceSummary::of(of, &options.thresholds);
    let all: Vec<(PointDistance, f64)> = distances.into_iter().zip(weights).collect();
    let inner: Vec<(PointDistance, f64)> = all.iter().copied().filter(|(point, _)| !point.at_boundary).collect();
    let none = || Error::input("its faces have no area, so nothing can count by area: count its vertices alike");
    Ok(Direction { all: summary(&all).ok_or_else(none)?, at_boundary: all.len() - inner.len(), inner: summary(&inner) })
}

/// Says which of the two shapes an error is about.
fn named(which: &str) -> impl Fn(Error) -> Error + '_ {
    move |error| match error {
        Error::Input(problem) => Error::Input(format!("the {which} shape: {problem}")),
        other => other,
    }
}

/// The factor between two units, when the sizes of two shapes (the diagonals of their boxes, first over second) suggest
/// that they are in different ones: within a fifth of 10, 25.4, 100 or 1000, or of their inverses.
pub fn unit_factor(a: &Mesh, b: &Mesh) -> Option<f64> {
    let diagonal = |mesh: &Mesh| {
        let (low, high) = mesh.bounding_box()?;
        Some((0..3).map(|axis| (high[axis] - low[axis]).powi(2)).sum::<f64>().sqrt())
    };
    let ratio = diagonal(a)? / diagonal(b)?;
    let factors = [10.0, 25.4, 100.0, 1000.0].into_iter().flat_map(|factor: f64| [factor, 1.0 / factor]);
    factors.into_iter().find(|factor| (1.0 / 1.2..=1.2).contains(&(ratio / factor)))
}

#[cfg(test)]
mod tests;
