//! The faces round a vertex in order. A vertex of a manifold has one fan of them, a bow-tie several.

use super::{EdgeClass, NONE, Topology, sides};

/// Faces round a vertex, each sharing an edge with the next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fan {
    /// The faces in order; counter-clockwise seen from outside where they are oriented alike, else as the first of them
    /// in file order has it.
    pub faces: Vec<u32>,
    /// The vertices at the other ends of the edges: of a closed fan one per face, face `i` between the vertices `i` and
    /// `i + 1` (the last before the first); of an open fan one more.
    pub vertices: Vec<u32>,
    /// Whether the last face meets the first.
    pub is_closed: bool,
}

impl Topology {
    /// The fans of a vertex, in the order of their first faces. Edges with more than two faces part them.
    pub fn fans(&self, vertex: u32) -> Vec<Fan> {
        let faces = self.faces_of_vertex(vertex);
        let mut taken = vec![false; faces.len()];
        let mut fans = Vec::new();
        // `faces` is sorted, so that a face of a fan is found by bisection.
        for (at, &face) in faces.iter().enumerate() {
            if taken[at] {
                continue;
            }
            let fan = self.fan_from(vertex, face);
            for face in &fan.faces {
                if let Ok(at) = faces.binary_search(face) {
                    taken[at] = true;
                }
            }
            fans.push(fan);
        }
        fans
    }

    /// The neighbours of a vertex in order, when its faces are one fan.
    pub fn one_ring(&self, vertex: u32) -> Option<Fan> {
        let faces = self.faces_of_vertex(vertex);
        let fan = self.fan_from(vertex, *faces.first()?);
        (fan.faces.len() == faces.len()).then_some(fan)
    }

    /// Whether a vertex has an edge with one face.
    pub fn is_boundary_vertex(&self, vertex: u32) -> bool {
        let boundary = |&edge: &u32| edge != NONE && self.class(edge) == EdgeClass::Boundary;
        self.faces_of_vertex(vertex).iter().any(|&face| {
            let around = sides(self.faces[face as usize]).into_iter().zip(self.face_edges[face as usize]);
            around.filter(|(side, _)| side.contains(&vertex)).any(|(_, edge)| boundary(&edge))
        })
    }

    /// The vertices whose faces are several fans, in order: bow-ties and the ends and insides of edges with more than two
    /// faces.
    pub fn non_manifold_vertices(&self) -> Vec<u32> {
        (0..self.n_vertices() as u32).filter(|&vertex| self.has_several_fans(vertex)).collect()
    }

    /// Whether the faces of a vertex are more than one fan, without allocating.
    pub(in crate::mesh) fn has_several_fans(&self, vertex: u32) -> bool {
        let faces = self.faces_of_vertex(vertex);
        let Some(&start) = faces.first() else { return false };
        let [backwards, forwards] = self.spokes(vertex, start);
        let mut length = 1;
        let mut end = forwards;
        for (_, edge) in self.walk(vertex, start, forwards) {
            length += 1;
            end = edge;
        }
        if length < faces.len() && !self.closes(backwards, end) {
            length += self.walk(vertex, start, backwards).count();
        }
        length < faces.len()
    }

    fn fan_from(&self, vertex: u32, start: u32) -> Fan {
        let [backwards, forwards] = self.spokes(vertex, start);
        let ahead: Vec<(u32, u32)> = self.walk(vertex, start, forwards).collect();
        let end = ahead.last().map_or(forwards, |&(_, edge)| edge);
        let is_closed = self.closes(backwards, end);
        let mut faces: Vec<u32> = Vec::new();
        let mut edges: Vec<u32> = Vec::new();
        if !is_closed {
            for (face, edge) in self.walk(vertex, start, backwards) {
                faces.push(face);
                edges.push(edge);
            }
            faces.reverse();
            edges.reverse();
        }
        faces.push(start);
        edges.extend([backwards, forwards]);
        for &(face, edge) in &ahead {
            faces.push(face);
            edges.push(edge);
        }
        if is_closed {
            edges.pop();
        }
        let other = |edge: u32| {
            let [a, b] = self.edges[edge as usize].vertices;
            if a == vertex { b } else { a }
        };
        Fan { faces, vertices: edges.into_iter().map(other).collect(), is_closed }
    }

    /// Whether a fan that begins and ends at these edges is closed. An edge with more than two faces closes none.
    fn closes(&self, begin: u32, end: u32) -> bool {
        begin == end && self.edges[begin as usize].faces.len() == 2
    }

    /// The edges of a face at a vertex: the one before the face and the one behind it, counter-clockwise.
    pub(super) fn spokes(&self, vertex: u32, face: u32) -> [u32; 2] {
        let corners = self.faces[face as usize];
        let at = corners.iter().position(|&corner| corner == vertex).unwrap_or(0);
        let edges = self.face_edges[face as usize];
        [edges[at], edges[(at + 2) % 3]]
    }

    /// The faces that follow `face` round a vertex when it is left through `edge`, each with the edge behind it. Ends where
    /// an edge has not exactly two faces, and before `face` would come again.
    pub(super) fn walk(&self, vertex: u32, face: u32, edge: u32) -> impl Iterator<Item = (u32, u32)> + '_ {
        let start = face;
        let (mut face, mut edge) = (face, edge);
        std::iter::from_fn(move || {
            let next = self.across(edge, face).filter(|&next| next != start)?;
            let [one, other] = self.spokes(vertex, next);
            edge = if one == edge { other } else { one };
            face = next;
            Some((face, edge))
        })
    }
}
