//! Connected components and what is known of each: counts, Euler number, orientability, genus.

use super::{EdgeClass, NONE, Topology, sides};

/// Why a component has no genus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoGenus {
    /// An edge with more than two faces, or a vertex with several fans.
    #[error("not a manifold")]
    NonManifold,
    /// The sides of its faces cannot be told apart, as on a Moebius strip.
    #[error("not orientable")]
    NotOrientable,
}

/// Faces that hang together over common vertices, and their vertices.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Component {
    /// Number of its vertices.
    pub n_vertices: usize,
    /// Number of its edges.
    pub n_edges: usize,
    /// Number of its faces.
    pub n_faces: usize,
    /// Number of its boundary loops ([`Topology::boundary_loops`]).
    pub n_boundary_loops: usize,
    /// Number of its edges with more than two faces.
    pub n_non_manifold_edges: usize,
    /// Number of its vertices with several fans.
    pub n_non_manifold_vertices: usize,
    /// Number of its edges whose two faces disagree about the outside.
    pub n_inconsistent_edges: usize,
    /// Whether its faces can be turned such that all neighbours across edges with two faces agree.
    pub is_orientable: bool,
}

impl Component {
    /// The Euler number, vertices - edges + faces.
    pub fn euler(&self) -> i64 {
        self.n_vertices as i64 - self.n_edges as i64 + self.n_faces as i64
    }

    /// Whether it has no boundary and is a manifold.
    pub fn is_closed(&self) -> bool {
        self.n_boundary_loops == 0 && self.n_non_manifold_vertices == 0
    }

    /// The number of handles, `g = (2 - b - chi) / 2` with `b` boundary loops and the Euler number `chi`.
    ///
    /// # Errors
    /// Why there is none.
    pub fn genus(&self) -> Result<u64, NoGenus> {
        if self.n_non_manifold_edges != 0 || self.n_non_manifold_vertices != 0 {
            return Err(NoGenus::NonManifold);
        }
        if !self.is_orientable {
            return Err(NoGenus::NotOrientable);
        }
        Ok(u64::try_from((2 - self.n_boundary_loops as i64 - self.euler()) / 2).unwrap_or(0))
    }
}

/// The connected components of a mesh, in the order of their first faces.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Components {
    /// What is known of each.
    pub all: Vec<Component>,
    /// The component of each face; `u32::MAX` for faces without a part in the connections.
    pub of_face: Vec<u32>,
    /// The component of each vertex; `u32::MAX` for vertices without faces.
    pub of_vertex: Vec<u32>,
}

/// What hangs together over edges with two faces; of a manifold these are the components.
#[derive(Debug, Clone)]
pub(crate) struct Patches {
    /// The patch of each face, numbered by their first faces; `u32::MAX` for faces without a part in the connections.
    pub of_face: Vec<u32>,
    /// Whether a face must be turned to agree with the first of its patch. Means nothing in a patch without orientation.
    pub is_turned: Vec<bool>,
    /// Whether the faces of a patch can be made to agree.
    pub is_orientable: Vec<bool>,
}

impl Topology {
    /// The connected components. Faces hang together when they share a vertex; vertices without faces belong to none.
    pub fn components(&self) -> Components {
        let (of_face, of_vertex, n) = self.labels();
        let empty = Component {
            n_vertices: 0,
            n_edges: 0,
            n_faces: 0,
            n_boundary_loops: 0,
            n_non_manifold_edges: 0,
            n_non_manifold_vertices: 0,
            n_inconsistent_edges: 0,
            is_orientable: true,
        };
        let mut all = vec![empty; n];
        for &component in of_face.iter().filter(|&&component| component != NONE) {
            all[component as usize].n_faces += 1;
        }
        for (vertex, &component) in of_vertex.iter().enumerate().filter(|&(_, &component)| component != NONE) {
            all[component as usize].n_vertices += 1;
            all[component as usize].n_non_manifold_vertices += usize::from(self.has_several_fans(vertex as u32));
        }
        for (number, edge) in self.edges.iter().enumerate() {
            let component = &mut all[of_vertex[edge.vertices[0] as usize] as usize];
            component.n_edges += 1;
            match self.class(number as u32) {
                EdgeClass::NonManifold => component.n_non_manifold_edges += 1,
                EdgeClass::Inconsistent => component.n_inconsistent_edges += 1,
                EdgeClass::Boundary | EdgeClass::Interior => (),
            }
        }
        for vertices in self.boundary_loops() {
            all[of_vertex[vertices[0] as usize] as usize].n_boundary_loops += 1;
        }
        // Where all neighbours agree there is nothing to ask.
        if all.iter().any(|component| component.n_inconsistent_edges != 0) {
            let patches = self.patches();
            for (&patch, &component) in patches.of_face.iter().zip(&of_face).filter(|&(&patch, _)| patch != NONE) {
                all[component as usize].is_orientable &= patches.is_orientable[patch as usize];
            }
        }
        Components { all, of_face, of_vertex }
    }

    /// Component of each face and of each vertex, and their number.
    fn labels(&self) -> (Vec<u32>, Vec<u32>, usize) {
        let (mut of_face, mut of_vertex) = (vec![NONE; self.faces.len()], vec![NONE; self.n_vertices()]);
        let mut waiting = Vec::new();
        let mut n = 0;
        for first in 0..self.faces.len() {
            if of_face[first] != NONE || self.face_edges[first][0] == NONE {
                continue;
            }
            of_face[first] = n;
            waiting.push(first as u32);
            while let Some(face) = waiting.pop() {
                for vertex in self.faces[face as usize] {
                    if of_vertex[vertex as usize] != NONE {
                        continue;
                    }
                    of_vertex[vertex as usize] = n;
                    for &next in self.faces_of_vertex(vertex) {
                        if of_face[next as usize] == NONE {
                            of_face[next as usize] = n;
                            waiting.push(next);
                        }
                    }
                }
            }
            n += 1;
        }
        (of_face, of_vertex, n as usize)
    }

    /// The patches and how their faces must be turned to agree.
    pub(crate) fn patches(&self) -> Patches {
        let n = self.faces.len();
        let mut patches = Patches { of_face: vec![NONE; n], is_turned: vec![false; n], is_orientable: Vec::new() };
        let mut waiting = Vec::new();
        for first in 0..n {
            if patches.of_face[first] != NONE || self.face_edges[first][0] == NONE {
                continue;
            }
            let number = patches.is_orientable.len() as u32;
            patches.of_face[first] = number;
            let mut agrees = true;
            waiting.push(first as u32);
            while let Some(face) = waiting.pop() {
                let side = patches.is_turned[face as usize];
                let around = sides(self.faces[face as usize]).into_iter().zip(self.face_edges[face as usize]);
                for ([from, to], edge) in around {
                    let Some(next) = self.across(edge, face) else { continue };
                    let wanted = side ^ ((from < to) == self.runs_upwards(next, edge));
                    if patches.of_face[next as usize] == NONE {
                        patches.of_face[next as usize] = number;
                        patches.is_turned[next as usize] = wanted;
                        waiting.push(next);
                    } else {
                        agrees &= patches.is_turned[next as usize] == wanted;
                    }
                }
            }
            patches.is_orientable.push(agrees);
        }
        patches
    }
}
