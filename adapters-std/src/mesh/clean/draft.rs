//! The mesh while it is being cleaned.
//!
//! Vertices keep the numbers of the input until the end, so that every step can report in them; copies that cutting makes
//! are numbered behind. Faces keep their order.

use glam::DVec3;

use super::NONE;
use crate::mesh::{Mesh, Topology};

/// A mesh in work. Steps change `faces`; [`Draft::settle`] draws the conclusions for the vertices.
pub(super) struct Draft<'a> {
    pub input: &'a Mesh,
    /// Positions by vertex, scaled by a power of two such that no square underflows.
    pub positions: Vec<DVec3>,
    /// The factor of that scaling.
    pub factor: f64,
    /// The vertex of the input of which a vertex is a copy, else itself.
    pub origin: Vec<u32>,
    pub is_alive: Vec<bool>,
    /// For each vertex of the input the one that stands for it, or [`NONE`].
    pub now: Vec<u32>,
    pub faces: Vec<[u32; 3]>,
    /// The faces as they were when the present pass began.
    pub before: Vec<[u32; 3]>,
    pub old_of_face: Vec<u32>,
    /// Vertices at one place that cutting parted, in the present pass.
    pub twins: Vec<Vec<u32>>,
}

/// What a pass did to the vertices.
#[derive(Default)]
pub(super) struct Settled {
    /// Vertices that another one replaces, and that one.
    pub welded: Vec<[u32; 2]>,
    /// Vertices that are gone.
    pub orphaned: Vec<u32>,
}

impl<'a> Draft<'a> {
    pub fn new(input: &'a Mesh) -> Self {
        let n = input.positions.len() as u32;
        // Of a vertex that will be removed no coordinate counts: without it the rest must be cleaned in the same way.
        let stays = |position: &&[f64; 3]| position.iter().all(|x| x.is_finite());
        let largest = input.positions.iter().filter(stays).flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        // The fourth power of 2^230, as in the square of an area, is far from overflow; so is that of its inverse. Larger
        // coordinates than about 2^232 have been refused.
        let factor = if largest < 2.0_f64.powi(-230) { 2.0_f64.powi(794) } else { 1.0 };
        Draft {
            input,
            positions: input.positions.iter().map(|&p| DVec3::from_array(p) * factor).collect(),
            factor,
            origin: (0..n).collect(),
            is_alive: vec![true; n as usize],
            now: (0..n).collect(),
            faces: input.faces.clone(),
            before: Vec::new(),
            old_of_face: (0..input.faces.len() as u32).collect(),
            twins: Vec::new(),
        }
    }

    pub fn topology(&self) -> Topology {
        Topology::new(self.positions.len(), &self.faces)
    }

    pub fn corners(&self, face: [u32; 3]) -> [DVec3; 3] {
        face.map(|vertex| self.positions[vertex as usize])
    }

    pub fn area(&self, face: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(face);
        (b - a).cross(c - a).length() / 2.0
    }

    /// Removes the faces for which `is_dropped` holds, which sees a face and its number in the input.
    pub fn drop_faces(&mut self, mut is_dropped: impl FnMut(usize, u32) -> bool) {
        let stays: Vec<bool> = (0..self.faces.len()).map(|face| !is_dropped(face, self.old_of_face[face])).collect();
        if stays.iter().all(|&stays| stays) {
            return;
        }
        fn retain<T>(values: &mut Vec<T>, stays: &[bool]) {
            let mut at = 0;
            values.retain(|_| {
                at += 1;
                stays[at - 1]
            });
        }
        retain(&mut self.faces, &stays);
        retain(&mut self.before, &stays);
        retain(&mut self.old_of_face, &stays);
    }

    /// A further vertex at the place and with the properties of another.
    pub fn copy_of(&mut self, vertex: u32) -> u32 {
        self.positions.push(self.positions[vertex as usize]);
        self.origin.push(self.origin[vertex as usize]);
        self.is_alive.push(true);
        self.positions.len() as u32 - 1
    }

    /// Ends a pass in which `welded_to` replaced vertices: those that no face names any more go, and the vertices of the
    /// input are led to those that stand for them. `was_named` tells the vertices that had faces when the pass began.
    pub fn settle(&mut self, welded_to: &[u32], was_named: &[bool]) -> Settled {
        let n = self.positions.len();
        let mut is_named = vec![false; n];
        let mut moved = vec![NONE; n];
        for (face, before) in self.faces.iter().zip(&self.before) {
            for (&now, &before) in face.iter().zip(before) {
                is_named[now as usize] = true;
                if now != before && moved[before as usize] == NONE {
                    moved[before as usize] = now;
                }
            }
        }
        let mut settled = Settled::default();
        let mut heir = vec![NONE; n];
        for vertex in 0..n {
            let had_faces = was_named.get(vertex).copied().unwrap_or(true);
            let first = welded_to.get(vertex).copied().unwrap_or(vertex as u32);
            // A vertex that never had a face, as all points of a cloud, stays unless it was welded.
            let stays = if had_faces { is_named[vertex] } else { first as usize == vertex };
            if !self.is_alive[vertex] {
                continue;
            }
            heir[vertex] = if stays {
                vertex as u32
            } else if moved[vertex] != NONE {
                moved[vertex]
            } else if first as usize != vertex && (is_named[first as usize] || !had_faces) {
                first
            } else {
                NONE
            };
            match heir[vertex] {
                NONE => settled.orphaned.push(vertex as u32),
                other if !stays => settled.welded.push([vertex as u32, other]),
                _ => (),
            }
            self.is_alive[vertex] = stays;
        }
        for now in self.now.iter_mut().filter(|now| **now != NONE) {
            *now = heir[*now as usize];
        }
        settled
    }
}
