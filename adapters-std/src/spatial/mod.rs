//! Where things are: the nearest point of a cloud, the closest point of a mesh, rays, inside and outside.

mod bvh;
pub mod cloud_normals;
pub mod distance_field;
pub mod frame_recovery;
mod holes;
pub mod inside;
mod moments;
mod order;
mod orientation;
mod partition;
pub mod points;
mod pseudo_normals;
mod rays;
#[cfg(test)]
pub(crate) mod samples;
pub mod surface;
mod triangle;
pub mod triangles;
pub mod winding;

pub use cloud_normals::{CloudNormalOptions, CloudNormals, Outside, cloud_normals};
pub use distance_field::{Inside, SignedDistanceOptions, remeshed, signed_distances};
pub use inside::{InsideOptions, InsideTest, Side, Sided};
pub use points::{Neighbour, PointTree};
pub use triangles::{Closest, Feature, Ray, RayHit, TriangleTree};
pub use winding::WindingTree;
