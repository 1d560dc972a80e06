//! How the triangles of a mesh hang together: edges, neighbours, fans, boundary loops, components, genus.
//!
//! Everything lies in flat arrays that are filled once, in time linear in the faces but for the sorting of the edges at
//! each vertex.

mod components;
mod fans;
mod loops;

#[cfg(feature = "models")]
pub(crate) use components::Patches;
pub use components::{Component, Components, NoGenus};
pub use fans::Fan;

use smallvec::SmallVec;

/// Stands for "no index" in flat arrays.
const NONE: u32 = u32::MAX;

/// An edge between two vertices and the faces at it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edge {
    /// Its two vertices, the smaller index first.
    pub vertices: [u32; 2],
    /// The faces that have it as a side, in file order: one at a boundary, two inside, more where the mesh is not a
    /// manifold.
    pub faces: SmallVec<[u32; 2]>,
}

/// What kind of place an edge is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EdgeClass {
    /// One face.
    Boundary,
    /// Two faces that run along it in opposite directions, as neighbours of an oriented surface do.
    Interior,
    /// Two faces that run along it in the same direction: one of them is turned inside out.
    Inconsistent,
    /// Three faces or more.
    NonManifold,
}

/// The connections of a triangle mesh.
///
/// Faces that name a vertex twice, or one that does not exist, have no part in them.
#[derive(Debug, Clone)]
pub struct Topology {
    faces: Vec<[u32; 3]>,
    edges: Vec<Edge>,
    face_edges: Vec<[u32; 3]>,
    /// Faces of vertex `v`: `vertex_faces[first_face[v]..first_face[v + 1]]`.
    first_face: Vec<u32>,
    vertex_faces: Vec<u32>,
}

/// The sides of a face in the order of its corners.
fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Positions at which the groups of sizes `counts` begin when they lie one behind the other, and the end of the last.
fn starts(counts: &[u32]) -> Vec<u32> {
    let mut sum = 0;
    let begins = counts.iter().map(|n| {
        sum += n;
        sum - n
    });
    let mut all: Vec<u32> = begins.collect();
    all.push(sum);
    all
}

impl Topology {
    /// The connections of these faces, of which there may be a thousand million.
    ///
    /// Cost: `O(n log d)` for at most `d` edges at a vertex; about 130 bytes a face.
    pub fn new(n_vertices: usize, faces: &[[u32; 3]]) -> Self {
        let takes_part = |[a, b, c]: [u32; 3]| {
            a != b && b != c && c != a && [a, b, c].iter().all(|&vertex| (vertex as usize) < n_vertices)
        };
        // Counting sorts: sides by their smaller vertex, faces by each of their vertices.
        let (mut n_sides, mut n_faces) = (vec![0u32; n_vertices], vec![0u32; n_vertices]);
        for &face in faces.iter().filter(|&&face| takes_part(face)) {
            face.iter().for_each(|&vertex| n_faces[vertex as usize] += 1);
            sides(face).iter().for_each(|side| n_sides[side[0].min(side[1]) as usize] += 1);
        }
        let (first_side, first_face) = (starts(&n_sides), starts(&n_faces));
        let n_all = first_side.last().map_or(0, |&n| n as usize);
        // A side is its larger vertex, then its face, in one number that sorts as both.
        let (mut side_keys, mut vertex_faces) = (vec![0u64; n_all], vec![0u32; n_all]);
        let (mut side_at, mut face_at) = (first_side.clone(), first_face.clone());
        for (number, &face) in faces.iter().enumerate().filter(|&(_, &face)| takes_part(face)) {
            for [from, to] in sides(face) {
                let at = &mut side_at[from.min(to) as usize];
                side_keys[*at as usize] = u64::from(from.max(to)) << 32 | number as u64;
                *at += 1;
            }
            for vertex in face {
                let at = &mut face_at[vertex as usize];
                vertex_faces[*at as usize] = number as u32;
                *at += 1;
            }
        }
        let mut edges = Vec::<Edge>::with_capacity(n_all / 2 + 1);
        let mut face_edges = vec![[NONE; 3]; faces.len()];
        for small in 0..n_vertices {
            let keys = &mut side_keys[first_side[small] as usize..first_side[small + 1] as usize];
            keys.sort_unstable();
            let mut previous = None;
            for &key in &*keys {
                let (large, face) = ((key >> 32) as u32, key as u32);
                if previous != Some(large) {
                    edges.push(Edge { vertices: [small as u32, large], faces: SmallVec::new() });
                    previous = Some(large);
                }
                let number = edges.len() - 1;
                edges[number].faces.push(face);
                let corners = faces[face as usize];
                let opposite = corners.iter().position(|&corner| corner != small as u32 && corner != large);
                face_edges[face as usize][opposite.map_or(0, |corner| (corner + 1) % 3)] = number as u32;
            }
        }
        Topology { faces: faces.to_vec(), edges, face_edges, first_face, vertex_faces }
    }

    /// The number of vertices, used or not.
    pub fn n_vertices(&self) -> usize {
        self.first_face.len() - 1
    }

    /// The number of faces, those without a part in the connections included.
    pub fn n_faces(&self) -> usize {
        self.faces.len()
    }

    /// The corners of a face.
    pub fn corners(&self, face: u32) -> [u32; 3] {
        self.faces[face as usize]
    }

    /// All edges, sorted by their vertices.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The edges of a face: between its corners 0 and 1, 1 and 2, 2 and 0; `u32::MAX` where the face has no part in the
    /// connections.
    pub fn edges_of_face(&self, face: u32) -> [u32; 3] {
        self.face_edges[face as usize]
    }

    /// The faces at a vertex, in file order.
    pub fn faces_of_vertex(&self, vertex: u32) -> &[u32] {
        let vertex = vertex as usize;
        &self.vertex_faces[self.first_face[vertex] as usize..self.first_face[vertex + 1] as usize]
    }

    /// The edge between two vertices, in either order.
    pub fn edge_between(&self, a: u32, b: u32) -> Option<u32> {
        let vertices = [a.min(b), a.max(b)];
        self.edges.binary_search_by_key(&vertices, |edge| edge.vertices).ok().map(|edge| edge as u32)
    }

    /// What kind of place an edge is.
    pub fn class(&self, edge: u32) -> EdgeClass {
        match *self.edges[edge as usize].faces {
            [] | [_] => EdgeClass::Boundary,
            [first, second] if self.runs_upwards(first, edge) != self.runs_upwards(second, edge) => EdgeClass::Interior,
            [_, _] => EdgeClass::Inconsistent,
            _ => EdgeClass::NonManifold,
        }
    }

    /// The number of edges of a kind.
    pub fn count(&self, class: EdgeClass) -> usize {
        (0..self.edges.len() as u32).filter(|&edge| self.class(edge) == class).count()
    }

    /// Whether every edge has exactly two faces.
    pub fn is_closed(&self) -> bool {
        self.edges.iter().all(|edge| edge.faces.len() == 2)
    }

    /// Whether a face goes from the smaller to the larger vertex of one of its edges.
    fn runs_upwards(&self, face: u32, edge: u32) -> bool {
        let place = self.face_edges[face as usize].iter().position(|&e| e == edge).unwrap_or(0);
        let [from, to] = sides(self.faces[face as usize])[place];
        from < to
    }

    /// The other face of an edge that has two.
    fn across(&self, edge: u32, face: u32) -> Option<u32> {
        match *self.edges[edge as usize].faces {
            [first, second] => Some(if first == face { second } else { first }),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests;
