//! The shape to which distances are measured.

use crate::Error;
use crate::mesh::{Mesh, Topology};
use crate::spatial::{Closest, Feature, PointTree, TriangleTree};

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
    Surface { tree: TriangleTree, boundary: Boundary },
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
            let tree = TriangleTree::new(&mesh.positions, &mesh.faces)?;
            Shape::Surface { tree, boundary: Boundary::of(mesh) }
        };
        Ok(Target { shape })
    }

    /// Whether it is a surface, which has two sides.
    pub fn is_surface(&self) -> bool {
        matches!(self.shape, Shape::Surface { .. })
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
            Shape::Surface { tree, boundary } => {
                let found = std::iter::zip(points, tree.closest_all(points));
                found.map(|(point, closest)| distance(*point, &closest, boundary.has(&closest))).collect()
            }
        }
    }
}

fn distance(point: [f64; 3], closest: &Closest, at_boundary: bool) -> PointDistance {
    let side: f64 = (0..3).map(|axis| (point[axis] - closest.point[axis]) * closest.normal[axis]).sum();
    let signed = if side < 0.0 { -closest.distance } else { closest.distance };
    PointDistance { distance: closest.distance, signed: Some(signed), at_boundary }
}

/// Which sides and corners of the faces lie on the boundary.
#[derive(Debug)]
struct Boundary {
    /// For each face its sides, then its corners.
    parts: Vec<[bool; 6]>,
}

impl Boundary {
    fn of(mesh: &Mesh) -> Self {
        let topology = Topology::new(mesh.positions.len(), &mesh.faces);
        let edges = topology.edges();
        let mut vertices = vec![false; mesh.positions.len()];
        for edge in edges.iter().filter(|edge| edge.faces.len() == 1) {
            edge.vertices.iter().for_each(|&vertex| vertices[vertex as usize] = true);
        }
        let side = |edge: u32| edges.get(edge as usize).is_some_and(|edge| edge.faces.len() == 1);
        let parts = mesh.faces.iter().enumerate().map(|(face, corners)| {
            let sides = topology.edges_of_face(face as u32).map(side);
            let corners = corners.map(|vertex| vertices[vertex as usize]);
            [sides[0], sides[1], sides[2], corners[0], corners[1], corners[2]]
        });
        Boundary { parts: parts.collect() }
    }

    fn has(&self, closest: &Closest) -> bool {
        let part = match closest.feature {
            Feature::Face => return false,
            Feature::Edge(side) => usize::from(side),
            Feature::Vertex(corner) => 3 + usize::from(corner),
        };
        self.parts.get(closest.face as usize).is_some_and(|parts| parts.get(part).copied().unwrap_or(false))
    }
}
