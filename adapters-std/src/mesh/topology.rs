//! How the triangles of a mesh hang together: edges, neighbours, boundary loops, components, genus.

/// An edge between two vertices and the faces at it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edge {
    /// Its two vertices, the smaller index first.
    pub vertices: [u32; 2],
    /// The faces that have it as a side, in file order: one at a boundary, two inside, more where the mesh is not a
    /// manifold.
    pub faces: Vec<u32>,
}

/// The connections of a triangle mesh. Faces that name a vertex twice have no part in them.
#[derive(Debug, Clone)]
pub struct Topology {
    n_vertices: usize,
    edges: Vec<Edge>,
    face_edges: Vec<[u32; 3]>,
    vertex_faces: Vec<Vec<u32>>,
}

impl Topology {
    /// The connections of these faces, whose indices are below `n_vertices`.
    pub fn new(n_vertices: usize, faces: &[[u32; 3]]) -> Self {
        let mut index = std::collections::BTreeMap::<[u32; 2], Vec<u32>>::new();
        let sides = |face: &[u32; 3]| [[face[0], face[1]], [face[1], face[2]], [face[2], face[0]]];
        let ordered = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        let mut vertex_faces = vec![Vec::new(); n_vertices];
        for (number, face) in faces.iter().enumerate() {
            if face[0] == face[1] || face[1] == face[2] || face[2] == face[0] {
                continue;
            }
            sides(face).into_iter().for_each(|side| index.entry(ordered(side)).or_default().push(number as u32));
            face.iter().for_each(|&vertex| vertex_faces[vertex as usize].push(number as u32));
        }
        let edges: Vec<Edge> = index.into_iter().map(|(vertices, faces)| Edge { vertices, faces }).collect();
        let edge_of =
            |side| edges.binary_search_by_key(&ordered(side), |edge| edge.vertices).map_or(u32::MAX, |e| e as u32);
        let face_edges = faces.iter().map(|face| sides(face).map(edge_of)).collect();
        Topology { n_vertices, edges, face_edges, vertex_faces }
    }

    /// The number of vertices, used or not.
    pub fn n_vertices(&self) -> usize {
        self.n_vertices
    }

    /// All edges, sorted by their vertices.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The edges of a face: between its corners 0 and 1, 1 and 2, 2 and 0; `u32::MAX` where it names a vertex twice.
    pub fn edges_of_face(&self, face: u32) -> [u32; 3] {
        self.face_edges[face as usize]
    }

    /// The faces at a vertex, in file order.
    pub fn faces_of_vertex(&self, vertex: u32) -> &[u32] {
        &self.vertex_faces[vertex as usize]
    }
}
