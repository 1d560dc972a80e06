//! The generalised winding number: how often a surface goes round a position, also when it is open, noisy or only points.
//!
//! Jacobson, Kavan, Sorkine-Hornung, Robust inside-outside segmentation using generalized winding numbers, 2013; fast by the tree of
//! Barill, Dickson, Schmidt, Levin, Jacobson, Fast winding numbers for soups and clouds, 2018.

use glam::DVec3;
use rayon::prelude::*;

use super::bvh::{Frame, LARGEST, MOST};
use super::moments::{Expansion, Moments};
use super::order::along_curve;
use super::partition::partition;
use super::triangle::solid_angle;
use super::triangles::{corners, searchable};
use crate::Error;
use crate::mesh::unit;

/// From this many radii away a piece of surface is seen through its moments.
const BETA: f64 = 2.0;

/// Triangles or points in a piece that is not divided.
const LEAF: usize = 8;

/// Positions that one thread takes at a time.
const CHUNK: usize = 128;

/// The whole angle.
const SPHERE: f64 = 4.0 * std::f64::consts::PI;

/// A point of an oriented cloud.
#[derive(Debug, Clone, Copy)]
struct Dipole {
    point: DVec3,
    area: DVec3,
}

#[derive(Debug)]
enum Pieces {
    Triangles(Vec<[DVec3; 3]>),
    Points(Vec<Dipole>),
}

/// A piece of surface. Its parts follow it in the list, up to `skip` places behind it.
#[derive(Debug, Clone, Copy)]
struct Node {
    centre: DVec3,
    /// The square of the distance from which the moments are exact enough.
    far: f64,
    unit: f64,
    expansion: Expansion,
    skip: u32,
    start: u32,
    /// The number of triangles or points; 0 in a piece that is divided.
    len: u32,
}

/// A search structure for winding numbers.
///
/// A piece of surface is seen through its moments up to the second from twice its radius away (`beta = 2`), nearer pieces by their
/// triangles: the error against the exact sum is at most 0.01 (tests `winding`).
///
/// Memory: about 130 bytes a triangle ([`WindingTree::n_bytes`]). Time of building: `n log n`, on all threads; of a query: `log n`.
#[derive(Debug)]
pub struct WindingTree {
    nodes: Vec<Node>,
    pieces: Pieces,
}

impl WindingTree {
    /// The structure over the triangles of a mesh, which count as they are oriented.
    ///
    /// # Errors
    /// [`Error::Input`] without faces, with more than 2^31 - 1 of them, for a face that names a vertex that does not exist, and for one
    /// with a coordinate that is not finite or beyond 1e70.
    pub fn of_mesh(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<Self, Error> {
        if faces.is_empty() {
            return Err(Error::input(
                "no triangle to wind around: give at least one, or points with normals and areas",
            ));
        }
        let (nodes, triangles) = tree(corners(positions, faces)?);
        Ok(WindingTree { nodes, pieces: Pieces::Triangles(triangles) })
    }

    /// The structure over an oriented cloud: points, the normals there (of any length; zero for a point that does not count), and the
    /// area of the surface for which each point stands, in the square of the unit of length.
    ///
    /// Close to a point, compared with the distance from its neighbours, the number means nothing: the point is all that is seen.
    ///
    /// # Errors
    /// [`Error::Input`] without points, with more than 2^31 - 1, when the lists differ in length, for a number that is not finite, a
    /// coordinate or a square root of an area beyond 1e70, and for a negative area.
    pub fn of_points(positions: &[[f64; 3]], normals: &[[f64; 3]], areas: &[f64]) -> Result<Self, Error> {
        let n = positions.len();
        if n == 0 || n > MOST {
            return Err(Error::input(format!("{n} points to wind around: give at least one and at most {MOST}")));
        }
        if normals.len() != n || areas.len() != n {
            return Err(Error::input(format!(
                "{n} points with {} normals and {} areas: give one of each for each point",
                normals.len(),
                areas.len()
            )));
        }
        let dipole = |index: usize| {
            let (position, normal, area) = (positions[index], normals[index], areas[index]);
            let sound = (0.0..=LARGEST * LARGEST).contains(&area) && normal.iter().all(|x| x.is_finite());
            match searchable(position) {
                Some(point) if sound => Ok(Dipole { point, area: DVec3::from_array(unit(normal)) * area }),
                _ => Err(Error::input(format!(
                    "point {index} is at {position:?} with normal {normal:?} and area {area}: coordinates must be finite and at most {LARGEST:e}, areas not negative; remove the point"
                ))),
            }
        };
        let dipoles: Result<Vec<Dipole>, Error> = (0..n).map(dipole).collect();
        let (nodes, points) = tree(dipoles?);
        Ok(WindingTree { nodes, pieces: Pieces::Points(points) })
    }

    /// The bytes that the structure occupies.
    pub fn n_bytes(&self) -> usize {
        let pieces = match &self.pieces {
            Pieces::Triangles(triangles) => triangles.capacity() * size_of::<[DVec3; 3]>(),
            Pieces::Points(points) => points.capacity() * size_of::<Dipole>(),
        };
        self.nodes.capacity() * size_of::<Node>() + pieces
    }

    /// The winding number of the surface around the position: about 1 inside a closed surface that is oriented outwards, about 0
    /// outside, between them near holes, more where layers lie one over the other. NaN for a position that is not finite or beyond
    /// 1e70.
    pub fn at(&self, position: [f64; 3]) -> f64 {
        let Some(p) = searchable(position) else { return f64::NAN };
        match &self.pieces {
            Pieces::Triangles(triangles) => self.sum(p, triangles),
            Pieces::Points(points) => self.sum(p, points),
        }
    }

    /// [`Self::at`] of each position, over all threads.
    pub fn at_all(&self, positions: &[[f64; 3]]) -> Vec<f64> {
        let order = along_curve(positions);
        let numbers: Vec<f64> =
            order.par_iter().with_min_len(CHUNK).map(|&index| self.at(positions[index as usize])).collect();
        let mut placed = vec![0.0; order.len()];
        for (&index, number) in order.iter().zip(numbers) {
            placed[index as usize] = number;
        }
        placed
    }

    /// The sum runs over the pieces in the order of the tree.
    fn sum<P: Piece>(&self, p: DVec3, pieces: &[P]) -> f64 {
        let mut angle = 0.0;
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let r = node.centre - p;
            let squared = r.length_squared();
            if squared > node.far {
                let distance = squared.sqrt();
                angle += node.expansion.solid_angle(r / distance, node.unit / distance);
                at += node.skip as usize;
            } else {
                let range = node.start as usize..(node.start + node.len) as usize;
                angle += pieces[range].iter().map(|piece| piece.solid_angle(p)).sum::<f64>();
                at += 1;
            }
        }
        angle / SPHERE
    }
}

/// What a surface is made of.
trait Piece: Copy + Send + Sync {
    const N: usize;
    fn points(&self) -> &[DVec3];
    fn area(&self) -> f64;
    fn moments(&self, centre: DVec3) -> Moments;
    fn solid_angle(&self, p: DVec3) -> f64;
}

impl Piece for [DVec3; 3] {
    const N: usize = 3;
    fn points(&self) -> &[DVec3] {
        self
    }
    fn area(&self) -> f64 {
        (self[1] - self[0]).cross(self[2] - self[0]).length() * 0.5
    }
    fn moments(&self, centre: DVec3) -> Moments {
        Moments::of_triangle(self, centre)
    }
    #[inline(always)]
    fn solid_angle(&self, p: DVec3) -> f64 {
        solid_angle(p, self)
    }
}

impl Piece for Dipole {
    const N: usize = 1;
    fn points(&self) -> &[DVec3] {
        std::slice::from_ref(&self.point)
    }
    fn area(&self) -> f64 {
        self.area.length()
    }
    fn moments(&self, centre: DVec3) -> Moments {
        Moments::of_point(self.point, self.area, centre)
    }
    #[inline(always)]
    fn solid_angle(&self, p: DVec3) -> f64 {
        let r = self.point - p;
        let distance = r.length();
        // From the point itself nothing is seen of it.
        if distance > 0.0 { self.area.dot(r / distance) / distance / distance } else { 0.0 }
    }
}

/// The nodes of the tree and the pieces in its order.
fn tree<P: Piece>(pieces: Vec<P>) -> (Vec<Node>, Vec<P>) {
    let frame = Frame::of(pieces.iter().flat_map(|piece| piece.points().iter().copied()));
    let bounds: Vec<_> = pieces.par_iter().map(|piece| frame.bounds(piece.points())).collect();
    let tree = partition(&bounds, LEAF);
    let pieces: Vec<P> = tree.order.iter().map(|&index| pieces[index as usize]).collect();
    let mut raw: Vec<Raw> = vec![Raw::NONE; tree.branches.len()];
    // Children follow their parents.
    for (at, branch) in tree.branches.iter().enumerate().rev() {
        let range = branch.start as usize..(branch.start + branch.len) as usize;
        raw[at] = match branch.second as usize {
            0 => Raw::of(&pieces[range]),
            second => Raw::of_both(&raw[at + 1], &raw[at + second], second as u32),
        };
    }
    let nodes = tree.branches.par_iter().zip(&raw).map(|(branch, raw)| {
        let range = branch.start as usize..(branch.start + branch.len) as usize;
        let points = pieces[range].iter().flat_map(Piece::points);
        let squared = points.map(|&point| (point - raw.centre).length_squared()).fold(0.0, f64::max);
        let unit = squared.max(raw.area).sqrt();
        Node {
            centre: raw.centre,
            far: BETA * BETA * squared,
            unit,
            expansion: raw.moments.expansion(unit),
            skip: raw.skip,
            start: branch.start,
            len: if branch.second == 0 { branch.len } else { 0 },
        }
    });
    (nodes.collect(), pieces)
}

/// What of a node follows from its parts.
#[derive(Clone, Copy)]
struct Raw {
    centre: DVec3,
    area: f64,
    moments: Moments,
    skip: u32,
}

impl Raw {
    const NONE: Raw = Raw { centre: DVec3::ZERO, area: 0.0, moments: Moments::NONE, skip: 1 };

    fn of<P: Piece>(pieces: &[P]) -> Self {
        let middles = || pieces.iter().map(|piece| piece.points().iter().sum::<DVec3>() / P::N as f64);
        let area: f64 = pieces.iter().map(P::area).sum();
        let weighted = pieces.iter().zip(middles()).map(|(piece, middle)| middle * (piece.area() / area)).sum();
        let centre =
            if area > 0.0 && area.is_finite() { weighted } else { middles().sum::<DVec3>() / pieces.len() as f64 };
        let moments = pieces.iter().fold(Moments::NONE, |sum, piece| sum.with(&piece.moments(centre)));
        Raw { centre, area, moments, skip: 1 }
    }

    fn of_both(one: &Raw, other: &Raw, second: u32) -> Self {
        let area = one.area + other.area;
        let share = if area > 0.0 { other.area / area } else { 0.5 };
        let centre = one.centre + (other.centre - one.centre) * share;
        let moments = one.moments.shifted(one.centre - centre).with(&other.moments.shifted(other.centre - centre));
        Raw { centre, area, moments, skip: second + other.skip }
    }
}

#[cfg(test)]
#[path = "winding_tests.rs"]
mod tests;
