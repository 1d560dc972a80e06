//! The faces of an oriented manifold by their sides: side `k` of face `f`, from corner `k` to the next, has the number `3 f + k`, and its
//! twin is the same edge seen from the other face.

use glam::DVec3;

use crate::Error;
use crate::mesh::topology::EdgeClass;
use crate::mesh::{Mesh, Topology};

/// Stands for "no face there".
pub(super) const NONE: u32 = u32::MAX;

/// Faces at most: the number of their sides has 32 bits.
const MOST_FACES: usize = 1_000_000_000;

/// The face of a side, and its place there.
pub(super) fn face_of(side: u32) -> (u32, usize) {
    (side / 3, (side % 3) as usize)
}

/// The number of a side.
pub(super) fn side_of(face: u32, place: usize) -> u32 {
    3 * face + (place % 3) as u32
}

/// The connections of a mesh that is an oriented manifold with an area in each face and a face at each vertex.
///
/// # Errors
/// [`Error::Input`] names what is not so.
pub(super) fn oriented_manifold(mesh: &Mesh) -> Result<Topology, Error> {
    mesh.check()?;
    let refused = |what: String| Err(Error::input(format!("{what}: run `habitus clean` on the mesh first")));
    if mesh.faces.is_empty() {
        return Err(Error::input("a surface of triangles needs at least one face: points alone are a cloud"));
    }
    if mesh.faces.len() > MOST_FACES {
        return Err(Error::input(format!("{} faces: at most {MOST_FACES} can be numbered by sides", mesh.faces.len())));
    }
    for (number, &face) in mesh.faces.iter().enumerate() {
        let [a, b, c] = mesh.triangle(number).map(DVec3::from_array);
        let doubled = (b - a).cross(c - a).length();
        if !(doubled > 0.0 && doubled.is_finite()) {
            return refused(format!("face {number} of the vertices {face:?} has no area"));
        }
    }
    let topology = Topology::new(mesh.positions.len(), &mesh.faces);
    for (number, edge) in topology.edges().iter().enumerate() {
        let [a, b] = edge.vertices;
        match topology.class(number as u32) {
            EdgeClass::Boundary | EdgeClass::Interior => (),
            EdgeClass::Inconsistent => {
                let faces = &edge.faces[..];
                return refused(format!(
                    "the faces {faces:?} at the edge of the vertices {a} and {b} disagree about the outside"
                ));
            }
            EdgeClass::NonManifold => {
                return refused(format!("the edge of the vertices {a} and {b} has {} faces", edge.faces.len()));
            }
        }
    }
    if let Some(vertex) = topology.non_manifold_vertices().first() {
        return refused(format!("sheets touch at vertex {vertex} alone"));
    }
    if let Some(vertex) = (0..topology.n_vertices() as u32).find(|&v| topology.faces_of_vertex(v).is_empty()) {
        return refused(format!("vertex {vertex} has no face"));
    }
    Ok(topology)
}

/// The twin of each side, [`NONE`] on the boundary.
pub(super) fn twins(topology: &Topology) -> Vec<u32> {
    let mut twins = Vec::with_capacity(3 * topology.n_faces());
    for face in 0..topology.n_faces() as u32 {
        for edge in topology.edges_of_face(face) {
            let other = topology.edges()[edge as usize].faces.iter().find(|&&other| other != face);
            twins.push(other.map_or(NONE, |&other| {
                let place = topology.edges_of_face(other).iter().position(|&e| e == edge).unwrap_or(0);
                side_of(other, place)
            }));
        }
    }
    twins
}
