//! The intrinsic Delaunay triangulation of a mesh: the same surface, triangulated anew by straight lines on it, so that operators built
//! of edge lengths have no negative weights.
//!
//! Fisher, Springborn, Bobenko, Schroeder, An algorithm for the construction of intrinsic Delaunay triangulations, 2006; the lengthening
//! of edges: Sharp, Crane, A Laplacian for nonmanifold triangle meshes, 2020, section 4.5. Part I, 1.2, step 7.

use std::collections::VecDeque;

use glam::{DVec2, DVec3};

use super::glue::{NONE, face_of, oriented_manifold, side_of, twins};
use crate::Error;
use crate::mesh::Mesh;

/// An edge whose cotangents sum to no less than this is Delaunay; so no rounding flips an edge to and fro.
const DELAUNAY: f64 = -1e-11;

/// Flips for each edge, after which a mesh counts as too degenerate. Bodies take about 0.1.
const FLIPS: usize = 1000;

/// A triangulation given by lengths alone: triangles between vertices of a mesh, glued side to side. Two vertices may have several edges
/// between them, and a triangle may be glued to itself.
#[derive(Debug, Clone, PartialEq)]
pub struct IntrinsicTriangulation {
    faces: Vec<[u32; 3]>,
    lengths: Vec<[f64; 3]>,
    twins: Vec<u32>,
}

impl IntrinsicTriangulation {
    /// The triangulation that a mesh has, with the lengths of its edges.
    ///
    /// # Errors
    /// [`Error::Input`] as for [`super::MeshSurface::new`].
    pub fn of_mesh(mesh: &Mesh) -> Result<Self, Error> {
        let topology = oriented_manifold(mesh)?;
        let at = |vertex: u32| DVec3::from_array(mesh.positions[vertex as usize]);
        // From the smaller vertex, so that both sides of an edge have the same bits.
        let length = |a: u32, b: u32| at(a.min(b)).distance(at(a.max(b)));
        let lengths = mesh.faces.iter().map(|&[a, b, c]| [length(a, b), length(b, c), length(c, a)]).collect();
        Ok(IntrinsicTriangulation { faces: mesh.faces.clone(), lengths, twins: twins(&topology) })
    }

    /// Its Delaunay triangulation, of edges that were made longer first where a triangle was almost degenerate, by what it takes that two
    /// sides exceed the third by `1e-5` of the mean length. What Laplacians and heat are to be built on.
    ///
    /// # Errors
    /// Those of [`Self::of_mesh`] and [`Self::flip_to_delaunay`].
    pub fn delaunay(mesh: &Mesh) -> Result<Self, Error> {
        let mut triangulation = Self::of_mesh(mesh)?;
        triangulation.mollify(1e-5);
        triangulation.flip_to_delaunay()?;
        Ok(triangulation)
    }

    /// The number of triangles.
    pub fn n_faces(&self) -> usize {
        self.faces.len()
    }

    /// The vertices of each triangle.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The lengths of the sides of each triangle: between its corners 0 and 1, 1 and 2, 2 and 0; in the unit of the mesh.
    pub fn lengths(&self) -> &[[f64; 3]] {
        &self.lengths
    }

    /// The triangle at the other side of a side, and which of its sides that is; `None` on the boundary.
    pub fn across(&self, face: u32, side: usize) -> Option<(u32, usize)> {
        let twin = self.twins[side_of(face, side) as usize];
        (twin != NONE).then(|| face_of(twin))
    }

    /// The area of a triangle (Heron's formula in Kahan's order); 0 where the lengths make no triangle.
    pub fn area(&self, face: u32) -> f64 {
        area(self.lengths[face as usize])
    }

    /// The sum of the areas.
    pub fn total_area(&self) -> f64 {
        (0..self.faces.len() as u32).map(|face| self.area(face)).sum()
    }

    /// The cotangent of the angle opposite to a side.
    pub fn cotangent(&self, face: u32, side: usize) -> f64 {
        let lengths = self.lengths[face as usize];
        let [a, b, c] = [lengths[side], lengths[(side + 1) % 3], lengths[(side + 2) % 3]];
        // b^2 + c^2 - a^2 without the loss of digits of a thin triangle.
        ((b - a) * (b + a) + c * c) / (4.0 * area(lengths))
    }

    /// Makes every edge longer by the least amount with which in each triangle two sides exceed the third by at least `share` of the mean
    /// length of the edges; returns that amount, which is 0 for a mesh without needles.
    pub fn mollify(&mut self, share: f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (side, _) in self.twins.iter().enumerate().filter(|&(side, &twin)| twin == NONE || side < twin as usize) {
            let (face, place) = face_of(side as u32);
            sum += self.lengths[face as usize][place];
            count += 1.0;
        }
        let least = share * sum / count;
        let missing = |&[a, b, c]: &[f64; 3]| least - (a + b - c).min(b + c - a).min(c + a - b);
        let amount = self.lengths.iter().map(missing).fold(0.0, f64::max);
        if amount > 0.0 {
            self.lengths.iter_mut().flatten().for_each(|length| *length += amount);
        }
        amount
    }

    /// Flips edges until all are Delaunay: the angles opposite to each sum to at most `pi`. Returns the number of flips.
    ///
    /// Cost: about one flip for ten edges of a scanned body; at worst quadratic. Deterministic: edges in order, first in, first out.
    ///
    /// # Errors
    /// [`Error::Input`] when flipping does not end, as rounding may have it among triangles without an area.
    pub fn flip_to_delaunay(&mut self) -> Result<usize, Error> {
        let mut waiting: VecDeque<u32> =
            (0..self.twins.len() as u32).filter(|&side| side < self.twins[side as usize]).collect();
        let mut is_waiting = vec![false; self.twins.len()];
        waiting.iter().for_each(|&side| is_waiting[side as usize] = true);
        let limit = FLIPS * self.twins.len();
        let mut flips = 0;
        while let Some(side) = waiting.pop_front() {
            is_waiting[side as usize] = false;
            let Some(around) = self.flipped(side) else { continue };
            flips += 1;
            if flips > limit {
                return Err(Error::input(format!(
                    "{flips} flips did not make the triangulation Delaunay: `habitus clean` removes triangles without area"
                )));
            }
            for side in around {
                let twin = self.twins[side as usize];
                if twin != NONE && !is_waiting[side as usize] && !is_waiting[twin as usize] {
                    is_waiting[side as usize] = true;
                    waiting.push_back(side);
                }
            }
        }
        Ok(flips)
    }

    /// Flips an edge that is not Delaunay; returns the four sides round the new one.
    fn flipped(&mut self, side: u32) -> Option<[u32; 4]> {
        let twin = self.twins[side as usize];
        let ((f, i), (g, j)) = (face_of(side), face_of(twin));
        if twin == NONE || f == g || !(self.cotangent(f, i) + self.cotangent(g, j) < DELAUNAY) {
            return None;
        }
        // f = (a, b, c) and g = (b, a, d), counted from the common side, become (d, b, c) and (c, a, d).
        let (at_f, at_g) = (|k: usize| (i + k) % 3, |k: usize| (j + k) % 3);
        let ([ab, bc, ca], [_, ad, db]) = (
            [0, 1, 2].map(|k| self.lengths[f as usize][at_f(k)]),
            [0, 1, 2].map(|k| self.lengths[g as usize][at_g(k)]),
        );
        let [a, b, c] = [0, 1, 2].map(|k| self.faces[f as usize][at_f(k)]);
        let d = self.faces[g as usize][at_g(2)];
        let cd = diagonal(ab, [ca, bc], [ad, db]);
        if !(cd > 0.0 && cd.is_finite()) {
            return None;
        }
        let old = [side_of(g, at_g(2)), side_of(f, at_f(1)), side_of(f, at_f(2)), side_of(g, at_g(1))];
        let new = [side_of(f, 0), side_of(f, 1), side_of(g, 0), side_of(g, 1)];
        let moved = |side: u32| old.iter().position(|&o| o == side).map_or(side, |at| new[at]);
        let twins = old.map(|side| self.twins[side as usize]).map(|twin| if twin == NONE { NONE } else { moved(twin) });
        self.faces[f as usize] = [d, b, c];
        self.faces[g as usize] = [c, a, d];
        self.lengths[f as usize] = [db, bc, cd];
        self.lengths[g as usize] = [ca, ad, cd];
        for (side, twin) in new.into_iter().zip(twins).chain([(side_of(f, 2), side_of(g, 2))]) {
            self.twins[side as usize] = twin;
            if twin != NONE {
                self.twins[twin as usize] = side;
            }
        }
        Some(new)
    }
}

/// The distance of the apexes of two triangles on the two sides of a base, each with its distances from the base's ends.
fn diagonal(base: f64, above: [f64; 2], below: [f64; 2]) -> f64 {
    let apex = |[left, right]: [f64; 2]| {
        let x = (base + (left - right) * (left + right) / base) / 2.0;
        DVec2::new(x, 2.0 * area([base, left, right]) / base)
    };
    let (above, below) = (apex(above), apex(below));
    (above.x - below.x).hypot(above.y + below.y)
}

fn area(lengths: [f64; 3]) -> f64 {
    let [mut a, mut b, mut c] = lengths;
    if a < b {
        std::mem::swap(&mut a, &mut b);
    }
    if b < c {
        std::mem::swap(&mut b, &mut c);
    }
    if a < b {
        std::mem::swap(&mut a, &mut b);
    }
    let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    product.max(0.0).sqrt() / 4.0
}

#[cfg(test)]
#[path = "intrinsic_tests.rs"]
mod tests;
