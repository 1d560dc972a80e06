//! Inside or outside of a scan that is open, noisy, in layers and here and there turned inside out (Part II, 7.4).
//!
//! Two witnesses: the pseudo-normal at the closest point ([`TriangleTree`]), sharp where the surface is sound, and the winding number
//! ([`WindingTree`]), which sees the surface as a whole. Where they agree they are believed; else the winding number if it is clear.

use rayon::prelude::*;

use super::holes::WideHoles;
use super::orientation::inward_faces;
use super::triangles::{Closest, TriangleTree};
use super::winding::WindingTree;
use crate::Error;
use crate::mesh::Topology;

/// Positions that one thread takes at a time.
const CHUNK: usize = 128;

/// What the test believes. The defaults are those of Part II, 7.4, in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InsideOptions {
    /// What is not farther from the surface is not known to be outside, and counts as inside: the noise of the surface. 3 mm.
    pub eps: f64,
    /// Against the normal, a winding number decides that is farther than this from one half. 0.2.
    pub margin: f64,
    /// At the border of a hole that is wider, nothing is known. 80 mm. Infinite: there are no such holes.
    pub widest_hole: f64,
    /// When more than this share of the faces looks inwards, those are turned first. 0.05; 0: always, 1: never.
    pub most_inward: f64,
}

impl Default for InsideOptions {
    fn default() -> Self {
        InsideOptions { eps: 3.0, margin: 0.2, widest_hole: 80.0, most_inward: 0.05 }
    }
}

/// On which side of a surface a position is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Inside, or not farther from the surface than its noise.
    Inside,
    /// Outside.
    Outside,
    /// The surface does not tell.
    Unknown,
}

/// What a surface tells about a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sided {
    /// The side.
    pub side: Side,
    /// The distance from the surface, negative inside: by the side where that is known and the distance more than `eps`, else by the
    /// normal.
    pub signed_distance: f64,
    /// The winding number.
    pub winding: f64,
    /// The closest point of the surface.
    pub closest: Closest,
}

/// The inside test of one surface.
///
/// | in this order | side |
/// |---|---|
/// | the closest point is on the border of a hole wider than `widest_hole` | unknown |
/// | it is at most `eps` away | inside |
/// | normal and winding number agree: the number is below 1/2 outside | theirs |
/// | the winding number is more than `margin` from 1/2 | that of the winding number |
/// | else | unknown |
///
/// Memory: those of [`TriangleTree`] and [`WindingTree`], about 330 bytes a face.
#[derive(Debug)]
pub struct InsideTest {
    triangles: TriangleTree,
    winding: WindingTree,
    holes: WideHoles,
    options: InsideOptions,
    n_inward: usize,
    turned: Vec<u32>,
}

impl InsideTest {
    /// The test for these triangles; duplicates and layers may stay, vertices at one place should be one (`mesh::clean`).
    ///
    /// # Errors
    /// Those of [`TriangleTree::new`]; [`Error::Input`] for options that are negative or not numbers.
    pub fn new(positions: &[[f64; 3]], faces: &[[u32; 3]], options: InsideOptions) -> Result<Self, Error> {
        let InsideOptions { eps, margin, widest_hole, most_inward } = options;
        let numbers = [("eps", eps), ("margin", margin), ("widest_hole", widest_hole), ("most_inward", most_inward)];
        if let Some((name, x)) = numbers.into_iter().find(|(_, x)| !(*x >= 0.0)) {
            return Err(Error::input(format!("the option {name} of the inside test is {x}: give 0 or more")));
        }
        let mut triangles = TriangleTree::new(positions, faces)?;
        let topology = Topology::new(positions.len(), faces);
        // Two layers may each be displaced by the noise.
        let layer = 2.0 * eps;
        let holes = WideHoles::of(&triangles, &topology, positions, widest_hole, layer);
        let inward = inward_faces(&triangles, &topology, positions, layer);
        let mut turned = Vec::new();
        let n_inward = inward.len();
        let winding = if n_inward as f64 > most_inward * faces.len() as f64 {
            let mut faces = faces.to_vec();
            inward.iter().for_each(|&face| faces[face as usize].swap(1, 2));
            turned = inward;
            triangles = TriangleTree::new(positions, &faces)?;
            WindingTree::of_mesh(positions, &faces)?
        } else {
            WindingTree::of_mesh(positions, faces)?
        };
        Ok(InsideTest { triangles, winding, holes, options, n_inward, turned })
    }

    /// The number of faces that look inwards in the input, or do not agree with their neighbours.
    pub fn n_inward(&self) -> usize {
        self.n_inward
    }

    /// The faces that the test has turned, in ascending order: those that look inwards when they are too many, else none.
    pub fn turned_faces(&self) -> &[u32] {
        &self.turned
    }

    /// The triangles with the faces turned.
    pub fn triangles(&self) -> &TriangleTree {
        &self.triangles
    }

    /// The bytes that it occupies.
    pub fn n_bytes(&self) -> usize {
        let turned = 4 * self.turned.capacity();
        self.triangles.n_bytes() + self.winding.n_bytes() + self.holes.n_bytes() + turned
    }

    /// The side of a position; unknown, with distances of NaN, where it is not finite or beyond 1e70.
    pub fn at(&self, position: [f64; 3]) -> Sided {
        self.told(position, self.triangles.closest(position), self.winding.at(position))
    }

    /// [`Self::at`] of each position, over all threads.
    pub fn at_all(&self, positions: &[[f64; 3]]) -> Vec<Sided> {
        self.at_all_from(positions, &[])
    }

    /// [`Self::at`] of each position, over all threads, found faster where the closest point is near the face that is the position's
    /// hint: the one found last, when positions move little ([`TriangleTree::closest_all_from`]). Hints do not change the result.
    pub fn at_all_from(&self, positions: &[[f64; 3]], hints: &[u32]) -> Vec<Sided> {
        let closest = self.triangles.closest_all_from(positions, hints);
        let winding = self.winding.at_all(positions);
        let told = |((&position, closest), winding)| self.told(position, closest, winding);
        positions.par_iter().zip(closest).zip(winding).with_min_len(CHUNK).map(told).collect()
    }

    fn told(&self, position: [f64; 3], closest: Closest, winding: f64) -> Sided {
        let InsideOptions { eps, margin, .. } = self.options;
        let by_normal = closest.signed_distance(position);
        let by_winding = if winding < 0.5 { Side::Outside } else { Side::Inside };
        let by_sign = if by_normal > 0.0 { Side::Outside } else { Side::Inside };
        let at_wide_hole = self.holes.touch(self.triangles.vertices(closest.face), closest.feature);
        let side = if at_wide_hole || closest.distance.is_nan() {
            Side::Unknown
        } else if closest.distance <= eps {
            Side::Inside
        } else if by_sign == by_winding || (winding - 0.5).abs() > margin {
            by_winding
        } else {
            Side::Unknown
        };
        let signed_distance = match side {
            _ if !(closest.distance > eps) => by_normal,
            Side::Inside => -closest.distance,
            Side::Outside => closest.distance,
            Side::Unknown => by_normal,
        };
        Sided { side, signed_distance, winding, closest }
    }
}

#[cfg(test)]
#[path = "inside_tests.rs"]
mod tests;
