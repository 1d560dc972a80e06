//! One surface for triangle meshes and oriented point clouds: samples with areas, tangent frames and neighbours, and geodesics that
//! start in a direction, so that what walks on surfaces is written once.
//!
//! A surface is known by its *samples* (vertices or points), but a [`Location`] may lie anywhere on it. Each location has a tangent
//! plane with a fixed orthonormal [`Frame`]; a *direction* is an angle in it, counter-clockwise seen from outside, 0 along `u`.
//! [`Surface::trace`] is the exponential map: it walks straight on and tells by how much the frame turned; [`Surface::local_log`] is its
//! inverse at short range. Directions at mesh vertices are intrinsic: the angles of the faces round a vertex are scaled so that they sum
//! to a full turn, or to half a turn on the boundary.
//!
//! Two back ends: [`MeshSurface`] and [`CloudSurface`]. [`IntrinsicTriangulation`] is the triangulation on which operators of a mesh
//! are built; [`PartialMap`] stores a map from one surface to another.
//!
//! Source: Part I, sections 1.1-1.5 and 2.4.

mod angles;
mod cloud;
mod glue;
mod intrinsic;
mod log;
mod mesh;
mod partial_map;
#[cfg(test)]
mod shapes;

pub use angles::wrapped;
pub use cloud::{CloudSurface, SoupTriangle};
pub use intrinsic::IntrinsicTriangulation;
pub use mesh::MeshSurface;
pub use partial_map::{Entry, Orientation, OrientedPair, PartialMap, RejectReason};

pub use crate::mesh::sampling::SurfacePoint;

/// The longest path, in spacings of the samples.
const LONGEST: f64 = 1e6;

/// A point of the surface of a cloud: above or below a point of the tangent plane of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPoint {
    /// The sample.
    pub anchor: u32,
    /// Coordinates in the frame of the sample, with the sample as the origin; in the unit of the cloud.
    pub offset: [f64; 2],
}

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Location {
    /// Of a mesh.
    Mesh(SurfacePoint),
    /// Of a cloud.
    Cloud(CloudPoint),
}

/// A right-handed orthonormal frame of the tangent plane: `normal = u x v` points outwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The direction of angle 0.
    pub u: [f64; 3],
    /// The direction of angle `pi / 2`.
    pub v: [f64; 3],
    /// The outward normal.
    pub normal: [f64; 3],
}

/// A neighbour `j` of a sample `i`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbouring {
    /// The neighbour.
    pub j: u32,
    /// The length of the edge, in the unit of the surface.
    pub length: f64,
    /// The direction of the edge in the frame of `i`, from `-pi` to `pi`.
    pub angle_i: f64,
    /// The direction of the edge, seen from `j`, in the frame of `j`.
    pub angle_j: f64,
}

impl Neighbouring {
    /// The parallel transport along the edge, `rho_ij = angle_j + pi - angle_i`: a tangent vector with the angle `a` in the frame of
    /// `i` has `a + rho_ij` in that of `j`.
    pub fn transport(&self) -> f64 {
        wrapped(self.angle_j + std::f64::consts::PI - self.angle_i)
    }
}

/// Why a path ended before its length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The surface ends there.
    Boundary,
    /// No straight way on could be computed among faces, or samples, that are almost degenerate.
    DegenerateFace,
    /// The path did not begin: the start is no location of this surface, or the angle or the length is not finite, or the length is more
    /// than a million spacings.
    NoStart,
}

/// Where a path led.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trace {
    /// Its end.
    pub end: Location,
    /// The parallel transport along it, from `-pi` to `pi`: a tangent vector with the angle `a` in the frame of the start has
    /// `a + turn` in that of the end. So the path arrives in the direction `angle + turn`.
    pub turn: f64,
    /// The length walked.
    pub length: f64,
    /// Why it ended early, if it did.
    pub stopped: Option<Stop>,
}

/// A surface that can be walked on.
///
/// Samples count from 0; what is asked of one that does not exist panics, as slices do. Locations are checked.
pub trait Surface: Send + Sync {
    /// The number of samples: vertices or points.
    fn n_samples(&self) -> usize;

    /// The spacing `h` of the samples: the mean length of the edges of a mesh; of a cloud the mean distance to the sixth neighbour over
    /// the root of 2.
    fn spacing(&self) -> f64;

    /// The share of a sample in the area.
    fn area(&self, sample: u32) -> f64;

    /// Whether the surface ends at a sample.
    fn is_boundary(&self, sample: u32) -> bool;

    /// The number of connected components.
    fn n_components(&self) -> usize;

    /// The component of a sample, numbered by their first samples.
    fn component(&self, sample: u32) -> u32;

    /// The neighbours of a sample, counter-clockwise.
    fn neighbours(&self, sample: u32) -> &[Neighbouring];

    /// The location of a sample.
    fn sample(&self, sample: u32) -> Location;

    /// The nearest sample as the location tells it: the corner with the largest coordinate, or the anchor; `None` for a location that
    /// is not of this surface.
    fn nearest_sample(&self, at: &Location) -> Option<u32>;

    /// The tangent frame of a sample.
    fn frame(&self, sample: u32) -> Frame;

    /// The tangent frame of a location; `None` for one that is not of this surface.
    fn frame_at(&self, at: &Location) -> Option<Frame>;

    /// Where a location lies; `None` for one that is not of this surface.
    fn position(&self, at: &Location) -> Option<[f64; 3]>;

    /// The location closest to a position.
    fn locate(&self, position: [f64; 3]) -> Location;

    /// The straightest geodesic from a location in a direction, the exponential map. A negative length walks backwards.
    ///
    /// The same call gives the same bits. A path always ends ([`Stop`]).
    fn trace(&self, from: &Location, angle: f64, length: f64) -> Trace;

    /// The tangent vector at `at`, in its frame, whose straightest geodesic leads to `to`, the logarithmic map; `None` when it is longer
    /// than `longest` or no such vector was found, as for places on another sheet or far beyond curvature.
    ///
    /// For short ranges, a few spacings. Found by shooting: along the chord, or where that misses along the edges of a shortest path; then
    /// corrections by what is missing at the end. Behind a vertex of negative curvature there is a wedge that no straightest geodesic
    /// reaches; there the nearest miss, at most 5 % of the length, is added to the vector.
    fn local_log(&self, at: &Location, to: &Location, longest: f64) -> Option<[f64; 2]>;
}

/// The sum of the areas of the samples.
pub fn total_area(surface: &dyn Surface) -> f64 {
    (0..surface.n_samples() as u32).map(|sample| surface.area(sample)).sum()
}
