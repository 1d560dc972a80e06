//! A mesh under decimation: which edges may be collapsed, and collapsing one.

use glam::DVec3;

use crate::mesh::Topology;

/// Faces turn by less than this angle (its cosine) when one of their vertices moves.
const MIN_TURN_COSINE: f64 = 0.2;
/// Doubled area over squared longest side, below which a triangle may not be made worse.
const MIN_SHAPE: f64 = 0.01;

pub(super) struct Surface {
    pub positions: Vec<DVec3>,
    pub faces: Vec<[u32; 3]>,
    pub is_face: Vec<bool>,
    pub n_faces: usize,
    /// The living faces at each vertex.
    pub faces_of: Vec<Vec<u32>>,
    pub is_boundary: Vec<bool>,
    /// Vertices where the surface is no manifold; they stay.
    pub is_fixed: Vec<bool>,
}

/// The middle vertices of the faces at an edge.
struct Wings {
    n: usize,
    vertices: [u32; 2],
}

impl Surface {
    /// Of these faces, those that name a vertex twice left out.
    pub fn new(positions: Vec<DVec3>, faces: &[[u32; 3]]) -> Self {
        let is_face: Vec<bool> = faces.iter().map(|&[a, b, c]| a != b && b != c && c != a).collect();
        let mut faces_of = vec![Vec::new(); positions.len()];
        for (number, face) in faces.iter().enumerate().filter(|(number, _)| is_face[*number]) {
            face.iter().for_each(|&vertex| faces_of[vertex as usize].push(number as u32));
        }
        let n_faces = is_face.iter().filter(|is| **is).count();
        let (n, none) = (positions.len() as u32, vec![false; positions.len()]);
        let (is_boundary, is_fixed) = (none.clone(), none);
        let mut surface =
            Surface { positions, faces: faces.to_vec(), is_face, n_faces, faces_of, is_boundary, is_fixed };
        // Where the faces at a vertex are neither one ring nor one fan.
        let topology = Topology::new(n as usize, faces);
        surface.is_fixed = (0..n).map(|vertex| topology.has_several_fans(vertex)).collect();
        for edge in topology.edges().iter().filter(|edge| edge.faces.len() > 2) {
            edge.vertices.iter().for_each(|&vertex| surface.is_fixed[vertex as usize] = true);
        }
        // A ring of faces has as many neighbours as faces, a fan one more.
        let is_boundary = |vertex| surface.neighbours(vertex).len() > surface.faces_of[vertex as usize].len();
        surface.is_boundary = (0..n).map(is_boundary).collect();
        surface
    }

    /// The vertices that share a face with this one, ascending.
    pub fn neighbours(&self, vertex: u32) -> Vec<u32> {
        let corners = self.faces_of[vertex as usize].iter().flat_map(|&face| self.faces[face as usize]);
        let mut neighbours: Vec<u32> = corners.filter(|&other| other != vertex).collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        neighbours
    }

    /// Whether collapsing the edge leaves a manifold of the same kind: the link condition (`dey1999`), with the boundary as
    /// one more vertex.
    pub fn may_collapse(&self, u: u32, v: u32) -> bool {
        if self.is_fixed[u as usize] || self.is_fixed[v as usize] {
            return false;
        }
        let Some(wings) = self.wings(u, v) else { return false };
        let (of_u, of_v) = (self.neighbours(u), self.neighbours(v));
        if of_u.iter().filter(|w| of_v.binary_search(w).is_ok()).count() != wings.n {
            return false;
        }
        let [a, b] = wings.vertices;
        match wings.n {
            // A lone triangle would vanish.
            1 => self.n_faces_at(u, a) > 1 || self.n_faces_at(v, a) > 1,
            // An inner edge between two places of the boundary, or an edge of a tetrahedron.
            _ => {
                let is_across = self.is_boundary[u as usize] && self.is_boundary[v as usize];
                let is_of_tetrahedron = self.has_face(u, a, b) && self.has_face(v, a, b);
                !is_across && !is_of_tetrahedron
            }
        }
    }

    fn wings(&self, u: u32, v: u32) -> Option<Wings> {
        let mut wings = Wings { n: 0, vertices: [u; 2] };
        for &face in &self.faces_of[u as usize] {
            let corners = self.faces[face as usize];
            if corners.contains(&v) {
                let wing = corners.into_iter().find(|&w| w != u && w != v)?;
                *wings.vertices.get_mut(wings.n)? = wing;
                wings.n += 1;
            }
        }
        (wings.n > 0).then_some(wings)
    }

    fn n_faces_at(&self, u: u32, v: u32) -> usize {
        self.faces_of[u as usize].iter().filter(|&&face| self.faces[face as usize].contains(&v)).count()
    }

    fn has_face(&self, u: u32, v: u32, w: u32) -> bool {
        let has = |&face: &u32| self.faces[face as usize].contains(&v) && self.faces[face as usize].contains(&w);
        self.faces_of[u as usize].iter().any(has)
    }

    /// Whether no remaining face at the edge turns over or becomes a sliver when both its ends go to `place`.
    pub fn keeps_shape(&self, u: u32, v: u32, place: DVec3) -> bool {
        let keeps = |vertex: u32, other: u32| {
            self.faces_of[vertex as usize].iter().all(|&face| {
                let corners = self.faces[face as usize];
                if corners.contains(&other) {
                    return true;
                }
                let before = corners.map(|w| self.positions[w as usize]);
                let after = corners.map(|w| if w == vertex { place } else { self.positions[w as usize] });
                let (normal, new_normal) = (doubled_normal(before), doubled_normal(after));
                let (length, new_length) = (normal.length(), new_normal.length());
                let turns = new_normal.dot(normal) < MIN_TURN_COSINE * length * new_length;
                let (shape, new_shape) = (length / longest_square(before), new_length / longest_square(after));
                !(turns && length > 0.0) && new_length > 0.0 && (new_shape >= MIN_SHAPE || new_shape >= shape)
            })
        };
        keeps(u, v) && keeps(v, u)
    }

    /// Moves `u` to the place and gives it all that belonged to `v`; `v` and the faces at the edge are gone.
    pub fn collapse(&mut self, u: u32, v: u32, place: DVec3) {
        self.positions[u as usize] = place;
        self.is_boundary[u as usize] |= self.is_boundary[v as usize];
        let of_v = std::mem::take(&mut self.faces_of[v as usize]);
        for face in of_v {
            let corners = self.faces[face as usize];
            if corners.contains(&u) {
                self.is_face[face as usize] = false;
                self.n_faces -= 1;
                for w in corners.into_iter().filter(|&w| w != v) {
                    self.faces_of[w as usize].retain(|&other| other != face);
                }
            } else {
                self.faces[face as usize] = corners.map(|w| if w == v { u } else { w });
                self.faces_of[u as usize].push(face);
            }
        }
        self.faces_of[u as usize].sort_unstable();
    }
}

pub(super) fn doubled_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

fn longest_square([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a))
}
