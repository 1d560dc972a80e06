//! The normals of an OBJ file, which belong to the corners of its faces, as normals of the vertices.

use super::super::losses::Losses;

/// The normals of the file and which of them the corners of its faces name.
#[derive(Debug, Default)]
pub(super) struct CornerNormals {
    pub normals: Vec<[f64; 3]>,
    /// Vertex and normal of each corner that names a normal.
    corners: Vec<[u32; 2]>,
    /// Corners that name none.
    n_bare: usize,
}

/// No normal yet.
const NONE: u32 = u32::MAX;

impl CornerNormals {
    /// Notes a corner of a face.
    pub(super) fn note(&mut self, vertex: u32, normal: Option<u32>) {
        match normal {
            Some(normal) => self.corners.push([vertex, normal]),
            None => self.n_bare += 1,
        }
    }

    /// One normal for each vertex, or none if the file does not give each exactly one. All indices must be in range.
    pub(super) fn of_vertices(self, n_vertices: usize, losses: &mut Losses) -> Vec<[f64; 3]> {
        if self.normals.is_empty() {
            return Vec::new();
        }
        let n = self.normals.len();
        let dropped = |losses: &mut Losses, why: String| {
            losses.note(n, &format!("normal ({why})"), &format!("normals ({why})"));
            Vec::new()
        };
        if self.n_bare > 0 {
            return dropped(losses, format!("{} corners of faces have none", self.n_bare));
        }
        let mut normal_of = vec![NONE; n_vertices];
        let (mut n_disagreeing, mut in_order) = (0, n == n_vertices);
        for &[vertex, normal] in &self.corners {
            let known = &mut normal_of[vertex as usize];
            in_order &= vertex == normal;
            match *known {
                NONE => *known = normal,
                before => {
                    let value = |index: u32| self.normals[index as usize];
                    n_disagreeing += usize::from(before != normal && value(before) != value(normal));
                }
            }
        }
        if n_disagreeing > 0 {
            return dropped(losses, format!("{n_disagreeing} corners of faces disagree with others of their vertex"));
        }
        if in_order {
            return self.normals;
        }
        let n_without = normal_of.iter().filter(|&&normal| normal == NONE).count();
        if n_without > 0 {
            return dropped(losses, format!("{n_without} vertices have none"));
        }
        let mut is_used = vec![false; n];
        self.corners.iter().for_each(|&[_, normal]| is_used[normal as usize] = true);
        let n_unused = is_used.iter().filter(|used| !**used).count();
        losses.note(n_unused, "normal that no face uses", "normals that no face uses");
        normal_of.iter().map(|&normal| self.normals[normal as usize]).collect()
    }
}
