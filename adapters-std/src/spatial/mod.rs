//! Where things are: the nearest point of a cloud, the closest point of a mesh, rays, inside and outside.

pub mod points;
pub mod triangles;
pub mod winding;

pub use points::{Neighbour, PointTree};
pub use triangles::{Closest, Feature, RayHit, TriangleTree};
pub use winding::WindingTree;
