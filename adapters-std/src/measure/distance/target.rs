//! The shape to which distances are measured.

use crate::Error;
use crate::mesh::Mesh;
use crate::spatial::{PointTree, TriangleTree};

/// The distance of a point from a target, in the unit of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointDistance {
    /// To the closest point, not negative.
    pub distance: f64,
    /// The same, negative behind the surface (on the side from which its triangles appear clockwise); none for a cloud, which has no sides.
    ///
    /// The side is that of the pseudo-normal at the closest point (Bærentzen & Aanæs 2005). Beyond the boundary of an open surface it says little.
    pub signed: Option<f64>,
    /// Whether the closest point lies on the boundary of an open surface.
    pub at_boundary: bool,
}

/// A shape to which distances are measured: the triangles of a mesh, or the points of a cloud.
#[derive(Debug)]
pub struct Target {
    shape: Shape,
}

#[derive(Debug)]
enum Shape {
    Surface(TriangleTree),
    Points(PointTree),
}

impl Target {
    /// The triangles of the mesh, or its vertices when it has no faces.
    ///
    /// # Errors
    /// [`Error::Input`] for a mesh that fails [`Mesh::check`].
    pub fn new(mesh: &Mesh) -> Result<Self, Error> {
        mesh.check()?;
        let shape = if mesh.faces.is_empty() {
            Shape::Points(PointTree::new(&mesh.positions)?)
        } else {
            Shape::Surface(TriangleTree::new(&mesh.positions, &mesh.faces)?)
        };
        Ok(Target { shape })
    }

    /// Whether it is a surface, which has two sides.
    pub fn is_surface(&self) -> bool {
        matches!(self.shape, Shape::Surface(_))
    }

    /// The distance of each point, over all threads.
    pub fn distances(&self, points: &[[f64; 3]]) -> Vec<PointDistance> {
        match &self.shape {
            Shape::Points(tree) => {
                let found = tree.nearest_all(points).into_iter();
                found
                    .map(|nearest| PointDistance { distance: nearest.distance, signed: None, at_boundary: false })
                    .collect()
            }
            Shape::Surface(tree) => {
                let found = std::iter::zip(points, tree.closest_all(points));
                found
                    .map(|(point, closest)| PointDistance {
                        distance: closest.distance,
                        signed: Some(closest.signed_distance(*point)),
                        at_boundary: closest.on_boundary,
                    })
                    .collect()
            }
        }
    }
}
