//! The point of a triangle mesh that is closest to a position, with the side of the surface on which the position is.
//!
//! Our own tree rather than that of parry3d: one set of boxes serves points and rays, ties and starting bounds are ours to decide.

use glam::DVec3;
use rayon::prelude::*;

use super::bvh::{Bvh, LARGEST, MOST};
use super::order::along_curve;
use super::pseudo_normals::PseudoNormals;
use super::triangle::on_triangle;
use crate::Error;

pub use super::rays::{Ray, RayHit};

/// Positions that one thread takes at a time; along them each search starts from the face that the one before has found.
const CHUNK: usize = 128;

/// The part of a triangle on which a point lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    /// Its inside.
    Face,
    /// The edge from this corner (0 to 2) to the next.
    Edge(u8),
    /// This corner.
    Vertex(u8),
}

/// The point of a mesh that is closest to a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// The point.
    pub point: [f64; 3],
    /// Its distance from the position.
    pub distance: f64,
    /// The face on which it lies; of several, the one with the smallest index.
    pub face: u32,
    /// Its barycentric coordinates in the face; they sum to 1.
    pub barycentric: [f64; 3],
    /// The part of the face on which it lies.
    pub feature: Feature,
    /// The unit pseudo-normal of that part (Baerentzen, Aanaes 2005): of the face, the mean of the faces at the edge, the
    /// angle-weighted mean of those at the vertex. The position is outside where its difference from the point has a positive product
    /// with it. Zero where no face at the part has an area.
    pub normal: [f64; 3],
    /// Whether the part is an edge of one face only, or a vertex of such an edge: there the surface ends, and the normal does not tell
    /// the side.
    pub on_boundary: bool,
}

impl Closest {
    /// The distance of `position`, for which this is the closest point: positive on the side to which the normal points, negative on
    /// the other. Right for a closed mesh whose faces are all oriented outwards.
    pub fn signed_distance(&self, position: [f64; 3]) -> f64 {
        let from_point = DVec3::from_array(position) - DVec3::from_array(self.point);
        if from_point.dot(DVec3::from_array(self.normal)) < 0.0 { -self.distance } else { self.distance }
    }
}

/// A search structure over the triangles of a mesh. It holds copies of what it needs of them.
///
/// Memory: about 200 bytes a face of a closed mesh ([`TriangleTree::n_bytes`]); a search touches a small part of it.
/// Time of building: `n log n`, on all threads.
#[derive(Debug)]
pub struct TriangleTree {
    bvh: Bvh,
    /// The triangles in the order of the tree, and the face of each.
    triangles: Vec<[DVec3; 3]>,
    faces: Vec<u32>,
    /// Where the triangle of each face is.
    slots: Vec<u32>,
    normals: PseudoNormals,
}

/// The best triangle so far.
#[derive(Clone, Copy)]
struct Best {
    squared: f64,
    face: u32,
    slot: usize,
}

impl TriangleTree {
    /// The structure over these triangles.
    ///
    /// # Errors
    /// [`Error::Input`] without faces, with more than 2^31 - 1 of them, for a face that names a vertex that does not exist, and for one
    /// with a coordinate that is not finite or beyond 1e70.
    pub fn new(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<Self, Error> {
        let corners = corners(positions, faces)?;
        let normals = PseudoNormals::of(positions.len(), faces, &corners);
        let (bvh, order) = Bvh::new(&corners);
        let triangles = order.iter().map(|&face| corners[face as usize]).collect();
        let mut slots = vec![0; faces.len()];
        for (slot, &face) in order.iter().enumerate() {
            slots[face as usize] = slot as u32;
        }
        Ok(TriangleTree { bvh, triangles, faces: order, slots, normals })
    }

    /// The number of triangles.
    pub fn n_faces(&self) -> usize {
        self.faces.len()
    }

    /// The bytes that the structure occupies.
    pub fn n_bytes(&self) -> usize {
        let triangles = self.triangles.capacity() * size_of::<[DVec3; 3]>();
        self.bvh.n_bytes() + triangles + 4 * (self.faces.capacity() + self.slots.capacity()) + self.normals.n_bytes()
    }

    /// The closest point.
    ///
    /// Exact: the smallest of the distances from all triangles as computed in 64 bits, of equal ones that of the smallest face index.
    /// From a position that is not finite, or beyond 1e70, every face is at a distance of NaN.
    pub fn closest(&self, position: [f64; 3]) -> Closest {
        self.found(DVec3::from_array(position), None)
    }

    /// The closest point if it is at most `radius` away.
    pub fn closest_within(&self, position: [f64; 3], radius: f64) -> Option<Closest> {
        let p = searchable(position)?;
        if !(radius >= 0.0) {
            return None;
        }
        // A little farther than asked for, since the square is rounded; the distance itself decides.
        let none =
            Best { squared: radius * radius * (1.0 + 1e-15) + f64::MIN_POSITIVE, face: u32::MAX, slot: usize::MAX };
        let best = self.search(p, none);
        let found = (best.slot != usize::MAX).then(|| self.described(p, best));
        found.filter(|closest| closest.distance <= radius)
    }

    /// The closest point, found faster when it is on a face near `hint`. The result does not depend on the hint; one that is no face
    /// is no hint.
    pub fn closest_from(&self, position: [f64; 3], hint: u32) -> Closest {
        self.found(DVec3::from_array(position), self.slots.get(hint as usize).copied())
    }

    /// The distance of the closest point, negative where its normal points away from the position ([`Closest::signed_distance`]).
    pub fn signed_distance(&self, position: [f64; 3]) -> f64 {
        self.closest(position).signed_distance(position)
    }

    /// [`Self::closest`] of each position, over all threads, faster than one by one: positions are taken in an order in which the
    /// result of one is a good hint for the next.
    pub fn closest_all(&self, positions: &[[f64; 3]]) -> Vec<Closest> {
        self.closest_along_curve(positions, |_| None)
    }

    /// [`Self::closest_from`] of each position and its hint, over all threads, in the order of [`Self::closest_all`]; where there is no
    /// hint, the position before gives one.
    pub fn closest_all_from(&self, positions: &[[f64; 3]], hints: &[u32]) -> Vec<Closest> {
        self.closest_along_curve(positions, |index| self.slots.get(*hints.get(index)? as usize).copied())
    }

    fn closest_along_curve(&self, positions: &[[f64; 3]], hint: impl Fn(usize) -> Option<u32> + Sync) -> Vec<Closest> {
        let order = along_curve(positions);
        let found: Vec<Vec<Closest>> = order
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut previous = None;
                let closest = chunk.iter().map(|&index| {
                    let position = DVec3::from_array(positions[index as usize]);
                    let closest = self.found(position, hint(index as usize).or(previous));
                    previous = Some(self.slots[closest.face as usize]);
                    closest
                });
                closest.collect()
            })
            .collect();
        let mut placed = vec![0_u32; order.len()];
        for (at, &index) in order.iter().enumerate() {
            placed[index as usize] = at as u32;
        }
        placed.iter().map(|&at| found[at as usize / CHUNK][at as usize % CHUNK]).collect()
    }

    pub(super) fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The triangle at a place in the tree, and its face.
    pub(super) fn triangle(&self, slot: usize) -> (&[DVec3; 3], u32) {
        (&self.triangles[slot], self.faces[slot])
    }

    /// The vertices of a face.
    pub(super) fn vertices(&self, face: u32) -> [u32; 3] {
        self.normals.vertices(face)
    }

    /// Whether the surface ends at this part of a face ([`Closest::on_boundary`]).
    pub(super) fn ends_at(&self, face: u32, feature: Feature) -> bool {
        self.normals.is_boundary(face as usize, feature)
    }

    fn found(&self, p: DVec3, hint: Option<u32>) -> Closest {
        if searchable(p.to_array()).is_none() {
            let nowhere = Best { squared: f64::NAN, face: 0, slot: self.slots[0] as usize };
            return Closest { distance: f64::NAN, ..self.described(self.triangles[nowhere.slot][0], nowhere) };
        }
        let start = match hint {
            Some(slot) => {
                let slot = slot as usize;
                Best { squared: on_triangle(p, &self.triangles[slot]).squared, face: self.faces[slot], slot }
            }
            None => Best { squared: f64::INFINITY, face: u32::MAX, slot: self.slots[0] as usize },
        };
        self.described(p, self.search(p, start))
    }

    /// The best triangle; `best` where none is better.
    #[inline]
    fn search(&self, p: DVec3, mut best: Best) -> Best {
        self.bvh.nearest(p, best.squared, |slot| {
            let squared = on_triangle(p, &self.triangles[slot]).squared;
            if squared < best.squared || (squared == best.squared && self.faces[slot] < best.face) {
                best = Best { squared, face: self.faces[slot], slot };
            }
            best.squared
        });
        best
    }

    fn described(&self, p: DVec3, best: Best) -> Closest {
        let triangle = &self.triangles[best.slot];
        let on = on_triangle(p, triangle);
        let face = self.faces[best.slot];
        let (normal, on_boundary) = self.normals.at(face as usize, on.feature, triangle);
        Closest {
            point: on.point.to_array(),
            distance: on.squared.sqrt(),
            face,
            barycentric: on.barycentric,
            feature: on.feature,
            normal,
            on_boundary,
        }
    }
}

/// The position if distances from it are finite.
pub(super) fn searchable(position: [f64; 3]) -> Option<DVec3> {
    position.iter().all(|x| x.abs() <= LARGEST).then(|| DVec3::from_array(position))
}

/// The corners of the faces.
pub(super) fn corners(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<Vec<[DVec3; 3]>, Error> {
    if faces.is_empty() {
        return Err(Error::input("no triangle to search among: give at least one, or use a tree of points"));
    }
    if faces.len() > MOST {
        return Err(Error::input(format!(
            "{} triangles: at most {MOST} can be searched, divide the mesh",
            faces.len()
        )));
    }
    let n_vertices = positions.len();
    let corner = |face: usize, vertex: u32| {
        match positions.get(vertex as usize) {
        Some(&position) => searchable(position).ok_or_else(|| {
            Error::input(format!(
                "vertex {vertex} of face {face} is at {position:?}: coordinates must be finite and at most {LARGEST:e}; remove the vertex"
            ))
        }),
        None => Err(Error::input(format!(
            "face {face} names vertex {vertex}, but there are {n_vertices}: indices count from 0"
        ))),
    }
    };
    faces
        .iter()
        .enumerate()
        .map(|(face, &[a, b, c])| Ok([corner(face, a)?, corner(face, b)?, corner(face, c)?]))
        .collect()
}

#[cfg(test)]
#[path = "triangles_tests.rs"]
mod tests;
