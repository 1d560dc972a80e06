//! Normals of edges and vertices by which the closest point tells inside from outside (Baerentzen, Aanaes 2005).

use glam::DVec3;
use rayon::prelude::*;

use super::triangles::Feature;
use crate::mesh::unit;

/// The unit pseudo-normals of the edges and vertices of a mesh, and which of them lie on its boundary.
#[derive(Debug)]
pub(super) struct PseudoNormals {
    faces: Vec<[u32; 3]>,
    /// The edges of each face: from its first corner to the second, and so on.
    face_edges: Vec<[u32; 3]>,
    edges: Vec<[f64; 3]>,
    vertices: Vec<[f64; 3]>,
    boundary_edges: Vec<bool>,
    boundary_vertices: Vec<bool>,
}

/// The unit normal of a triangle, or zero where it has none.
pub(super) fn face_normal(&[a, b, c]: &[DVec3; 3]) -> DVec3 {
    DVec3::from_array(unit((b - a).cross(c - a).to_array()))
}

impl PseudoNormals {
    /// Those of the mesh, whose faces name existing vertices. Edges are matched by the indices of their vertices; a face that names a
    /// vertex twice adds nothing. Sums run over faces in file order.
    pub fn of(n_vertices: usize, faces: &[[u32; 3]], triangles: &[[DVec3; 3]]) -> Self {
        let normals: Vec<DVec3> = triangles.par_iter().map(face_normal).collect();
        let proper = |face: &[u32; 3]| face[0] != face[1] && face[1] != face[2] && face[2] != face[0];

        let mut sides: Vec<(u64, u32)> = faces
            .iter()
            .enumerate()
            .flat_map(|(index, face)| {
                (0..3).map(move |side| (edge_key(face[side], face[(side + 1) % 3]), (3 * index + side) as u32))
            })
            .collect();
        sides.par_sort_unstable();
        let mut face_edges = vec![[0; 3]; faces.len()];
        let (mut edges, mut boundary_edges) = (Vec::new(), Vec::new());
        let mut boundary_vertices = vec![false; n_vertices];
        for group in sides.chunk_by(|a, b| a.0 == b.0) {
            let (mut sum, mut n_faces) = (DVec3::ZERO, 0);
            for &(_, side) in group {
                let face = side as usize / 3;
                face_edges[face][side as usize % 3] = edges.len() as u32;
                if proper(&faces[face]) {
                    sum += normals[face];
                    n_faces += 1;
                }
            }
            let boundary = n_faces <= 1;
            if boundary {
                boundary_vertices[(group[0].0 >> 32) as usize] = true;
                boundary_vertices[group[0].0 as u32 as usize] = true;
            }
            edges.push(unit(sum.to_array()));
            boundary_edges.push(boundary);
        }

        let mut sums = vec![DVec3::ZERO; n_vertices];
        for (face, corners) in
            faces.iter().zip(triangles).zip(&normals).filter(|((face, _), _)| proper(face)).map(
                |((face, corners), normal)| (face, std::array::from_fn::<_, 3, _>(|k| *normal * angle(corners, k))),
            )
        {
            for (&vertex, part) in face.iter().zip(corners) {
                sums[vertex as usize] += part;
            }
        }
        let vertices = sums.into_iter().map(|sum| unit(sum.to_array())).collect();
        PseudoNormals { faces: faces.to_vec(), face_edges, edges, vertices, boundary_edges, boundary_vertices }
    }

    /// The pseudo-normal of a part of a face, and whether the part lies on the boundary: on an edge with one face, or on a vertex of
    /// such an edge.
    pub fn at(&self, face: usize, feature: Feature, triangle: &[DVec3; 3]) -> ([f64; 3], bool) {
        let normal = match feature {
            Feature::Face => face_normal(triangle).to_array(),
            Feature::Edge(side) => self.edges[self.edge(face, side)],
            Feature::Vertex(corner) => self.vertices[self.vertex(face, corner)],
        };
        (normal, self.is_boundary(face, feature))
    }

    /// Whether a part of a face lies on the boundary.
    pub fn is_boundary(&self, face: usize, feature: Feature) -> bool {
        match feature {
            Feature::Face => false,
            Feature::Edge(side) => self.boundary_edges[self.edge(face, side)],
            Feature::Vertex(corner) => self.boundary_vertices[self.vertex(face, corner)],
        }
    }

    fn edge(&self, face: usize, side: u8) -> usize {
        self.face_edges[face][usize::from(side)] as usize
    }

    fn vertex(&self, face: usize, corner: u8) -> usize {
        self.faces[face][usize::from(corner)] as usize
    }

    /// The vertices of a face.
    pub fn vertices(&self, face: u32) -> [u32; 3] {
        self.faces[face as usize]
    }

    /// The bytes that it occupies.
    pub fn n_bytes(&self) -> usize {
        24 * (self.faces.capacity() + self.edges.capacity() + self.vertices.capacity())
            + self.boundary_edges.capacity()
            + self.boundary_vertices.capacity()
    }
}

/// The two vertices of an edge as one number, the smaller index above.
pub(super) fn edge_key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// The angle of a triangle at a corner.
fn angle(corners: &[DVec3; 3], corner: usize) -> f64 {
    let to = |k: usize| DVec3::from_array(unit((corners[(corner + k) % 3] - corners[corner]).to_array()));
    let (one, other) = (to(1), to(2));
    one.cross(other).length().atan2(one.dot(other))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_folded_along_its_diagonal() {
        // One half in the plane z = 0, the other upright in x = 0; both share the side from (0, 0, 0) to (0, 1, 0).
        let positions = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]].map(DVec3::from_array);
        let faces = [[0, 2, 1], [0, 1, 3], [2, 2, 0]];
        let triangles = faces.map(|face: [u32; 3]| face.map(|v| positions[v as usize]));
        let normals = PseudoNormals::of(4, &faces, &triangles);
        let half = 0.5_f64.sqrt();
        let (edge, boundary) = normals.at(0, Feature::Edge(2), &triangles[0]);
        assert!((DVec3::from_array(edge) - DVec3::new(half, 0.0, half)).length() < 1e-15 && !boundary);
        assert_eq!(normals.at(1, Feature::Edge(0), &triangles[1]), (edge, false));
        assert_eq!(normals.at(0, Feature::Edge(0), &triangles[0]), ([0.0, 0.0, 1.0], true));
        // At (0, 0, 0) both have a right angle, at (0, 1, 0) both 45 degrees.
        for corner in [0, 2] {
            let (vertex, boundary) = normals.at(0, Feature::Vertex(corner), &triangles[0]);
            assert!((DVec3::from_array(vertex) - DVec3::new(half, 0.0, half)).length() < 1e-15 && boundary);
        }
        assert_eq!(normals.at(0, Feature::Face, &triangles[0]), ([0.0, 0.0, 1.0], false));
        assert_eq!(normals.at(2, Feature::Face, &triangles[2]), ([0.0; 3], false));
    }
}
