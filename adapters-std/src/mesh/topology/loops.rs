//! The boundary of a mesh as closed loops.

use super::{Topology, sides};

impl Topology {
    /// The boundary loops, each as the vertices that it passes, with the surface on its left seen from outside; the loop of
    /// the first face comes first and begins at that face's side.
    ///
    /// A side of a face is followed by the next side of the border that the fan of the face has at its end. So loops that
    /// touch at a vertex stay apart, and the vertex is in each of them, or several times in one. Edges with more than two
    /// faces count as cut: each of their faces has a side of the border there.
    pub fn boundary_loops(&self) -> Vec<Vec<u32>> {
        let is_border = |edge: u32| self.edges.get(edge as usize).is_some_and(|edge| edge.faces.len() != 2);
        let mut passed = vec![[false; 3]; self.faces.len()];
        let mut loops = Vec::new();
        for first in 0..self.faces.len() {
            for side in 0..3 {
                if passed[first][side] || !is_border(self.face_edges[first][side]) {
                    continue;
                }
                let mut vertices = Vec::new();
                let (mut face, mut place) = (first as u32, side);
                let [mut from, mut to] = sides(self.faces[first])[side];
                // Every side has one successor at each of its ends, so that the walk ends where it began.
                while !passed[face as usize][place] {
                    passed[face as usize][place] = true;
                    vertices.push(from);
                    (face, place) = self.next_side(face, place, to);
                    let [a, b] = sides(self.faces[face as usize])[place];
                    // A face that is turned inside out is passed backwards.
                    (from, to) = if a == to { (a, b) } else { (b, a) };
                }
                loops.push(vertices);
            }
        }
        loops
    }

    /// The side of the border that follows the side `place` of `face` at its end `vertex`.
    fn next_side(&self, face: u32, place: usize, vertex: u32) -> (u32, usize) {
        let here = self.face_edges[face as usize][place];
        let [one, other] = self.spokes(vertex, face);
        let leaving = if one == here { other } else { one };
        let (last, edge) = self.walk(vertex, face, leaving).last().unwrap_or((face, leaving));
        (last, self.face_edges[last as usize].iter().position(|&e| e == edge).unwrap_or(0))
    }
}
