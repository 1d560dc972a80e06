//! Normals of a point cloud that agree with one another and point outwards.
//!
//! Three steps: the plane of each point's neighbourhood (`planes`); one side chosen for all points that hang together
//! (`propagation`); each such part turned outwards as a whole (`outside`), or, where that leaves it open, to the side
//! of its neighbours (`bridging`).

mod bridging;
mod outside;
mod planes;
mod propagation;
#[cfg(test)]
mod tests;

use super::points::PointTree;
use crate::Error;
use planes::Planes;
use propagation::Parts;

/// Where the outside of a cloud is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outside {
    /// All around: the normals point out of the body whose surface was sampled, also when parts of the surface are missing.
    Around,
    /// Where this position is, in the unit of the cloud: a scanner that has seen each part from its outer side.
    Towards([f64; 3]),
}

/// How the normals of a cloud are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudNormalOptions {
    /// Nearest points whose plane is that of a point, and through which its side is told to others.
    pub n_neighbours: usize,
    /// Where the outside is.
    pub outside: Outside,
}

impl Default for CloudNormalOptions {
    /// 16 neighbours, the outside all around.
    fn default() -> Self {
        CloudNormalOptions { n_neighbours: 16, outside: Outside::Around }
    }
}

/// Points that hang together over nearest neighbours, so that their normals agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPart {
    /// The number of its points.
    pub n_points: usize,
    /// How clear it is that it had to be turned this way, from 0 (either way fits as well, as for a flat sheet alone) to 1.
    pub certainty: f64,
}

/// The normals of a cloud and how they came about.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudNormals {
    /// One unit normal per point; zero for a point without one.
    pub normals: Vec<[f64; 3]>,
    /// The parts, the largest first.
    pub parts: Vec<CloudPart>,
    /// Points without a normal: their neighbours lie in one place or on a line.
    pub n_without_normal: usize,
}

/// Normals of the points of a cloud.
///
/// A normal is the direction in which the point and its neighbours spread least. Sides are passed on along the edges of a
/// minimum spanning tree of the graph of neighbours (`hoppe1992`); of two points the one's normal is that of the other mirrored
/// at the plane in the middle between them, which is exact where the surface between them is an arc of a circle (`koenig2009`
/// compares such criteria). Edges cost more the less well that fits, and most where they leave the planes of their points. Parts are then turned so that the winding numbers
/// at all points come as near as possible to 1/2, the value on a closed surface that is oriented outwards (`xu2023`), or
/// towards the given position. A part for which that says little sides with the points of others that are near.
///
/// Cost: `O(k n log n)` for `k` neighbours, about `30 k` bytes a point. Determinism: the same result for any number of threads.
///
/// # Errors
/// Those of [`PointTree::new`]; [`Error::Input`] for fewer than 3 neighbours or more than 1000, or a position that is not
/// finite.
pub fn cloud_normals(points: &[[f64; 3]], options: &CloudNormalOptions) -> Result<CloudNormals, Error> {
    let k = options.n_neighbours;
    if !(3..=1000).contains(&k) {
        return Err(Error::input(format!("normals from {k} neighbours: give at least 3 and at most 1000")));
    }
    if let Outside::Towards(position) = options.outside
        && position.iter().any(|x| !x.is_finite())
    {
        return Err(Error::input(format!("normals towards {position:?}: give a finite position")));
    }
    let planes = Planes::of(&PointTree::new(points)?, points, k);
    let mut parts = Parts::of(points, &planes);
    let mut certainties = match options.outside {
        Outside::Around => outside::turn_outwards(points, &planes, &mut parts)?,
        Outside::Towards(position) => outside::turn_towards(points, position, &mut parts),
    };
    bridging::side_with_neighbours(points, &mut parts, &mut certainties)?;
    let sizes = parts.members.iter().map(Vec::len);
    let described = sizes.zip(certainties).map(|(n_points, certainty)| CloudPart { n_points, certainty });
    Ok(CloudNormals {
        parts: described.collect(),
        n_without_normal: points.len() - parts.members.iter().map(Vec::len).sum::<usize>(),
        normals: parts.normals.iter().map(|normal| normal.to_array()).collect(),
    })
}
