//! Loose triangles become a mesh: corners at equal coordinates are one vertex.

use std::collections::HashMap;

use glam::DVec3;

use super::super::losses::Losses;
use crate::mesh::{Mesh, unit};

/// The cosine of five degrees: programs round normals, and some write those of a smoothed surface.
const SAME_DIRECTION: f64 = 0.996_194_698_091_745_5;

/// The mesh while it grows.
#[derive(Debug, Default)]
pub(super) struct Corners {
    mesh: Mesh,
    vertex_at: HashMap<[u64; 3], u32>,
    n_contradictions: usize,
}

impl Corners {
    pub(super) fn reserve(&mut self, n_triangles: usize) {
        self.mesh.faces.reserve(n_triangles);
        // A closed mesh has half as many vertices as triangles.
        self.mesh.positions.reserve(n_triangles / 2);
        self.vertex_at.reserve(n_triangles / 2);
    }

    /// Adds a triangle; zero and not finite normals say nothing.
    pub(super) fn push(&mut self, corners: [[f64; 3]; 3], normal: [f64; 3]) {
        let own = normal_of(corners);
        let said = unit(normal);
        if own != [0.0; 3] && said != [0.0; 3] && DVec3::from(own).dot(said.into()) < SAME_DIRECTION {
            self.n_contradictions += 1;
        }
        let face = corners.map(|corner| self.vertex(corner));
        self.mesh.faces.push(face);
    }

    fn vertex(&mut self, position: [f64; 3]) -> u32 {
        let next = self.mesh.positions.len() as u32;
        let vertex = *self.vertex_at.entry(key(position)).or_insert(next);
        if vertex == next {
            self.mesh.positions.push(position);
        }
        vertex
    }

    pub(super) fn into_mesh(self, losses: &mut Losses) -> Mesh {
        let (one, several) = (
            "facet normal that is more than 5 degrees off its triangle's",
            "facet normals that are more than 5 degrees off their triangles'",
        );
        losses.note(self.n_contradictions, one, several);
        self.mesh
    }
}

/// What corners of one vertex have in common: numbers that are equal, be they 0 and -0.
pub(super) fn key(position: [f64; 3]) -> [u64; 3] {
    position.map(|x| (x + 0.0).to_bits())
}

/// The unit normal of a triangle; zero where it has none.
pub(super) fn normal_of(corners: [[f64; 3]; 3]) -> [f64; 3] {
    let [a, b, c] = corners.map(DVec3::from);
    unit((b - a).cross(c - a).into())
}
