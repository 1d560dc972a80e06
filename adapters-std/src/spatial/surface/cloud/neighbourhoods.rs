//! The points round a point of a cloud that lie on the same sheet, and the triangles among them.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use spade::{DelaunayTriangulation, Point2, Triangulation};

use super::super::angles::{frame_towards, positive};
use crate::spatial::PointTree;

/// Points that are looked at, and where these leave a gap.
const NEAREST: [usize; 2] = [16, 24];

/// Normals of one sheet have at least this product.
const SAME_SIDE: f64 = 0.3;

/// A point of the same sheet rises from the tangent plane by at most this share of its distance.
const STEEPEST: f64 = 0.5;

/// A wider gap between the directions of neighbours is one beyond the border of the surface.
const GAP: f64 = 2.0 * PI / 3.0;

/// For the triangulation alone points are moved by up to this share of the spacing, each always the same way, so that all points agree
/// about how to divide four points on a circle, as there are on every grid.
const NUDGE: f64 = 1e-3;

/// The points round a point.
#[derive(Debug)]
pub(super) struct Neighbourhood {
    /// The nearest points of the same sheet, nearest first.
    pub neighbours: Vec<u32>,
    /// The distance to the sixth neighbour, or to the last if there are fewer, over the root of 2; 0 without neighbours.
    pub spacing: f64,
}

/// The triangles round a point.
#[derive(Debug)]
pub(super) struct Star {
    /// The other two corners of the triangles at the point, counter-clockwise, in the Delaunay triangulation of its neighbours in the
    /// tangent plane.
    pub corners: Vec<[u32; 2]>,
    /// Whether the surface ends at the point.
    pub is_boundary: bool,
}

/// Points with normals and the tree over them.
pub(super) struct Oriented<'a> {
    pub points: &'a [DVec3],
    pub normals: &'a [DVec3],
    pub tree: &'a PointTree,
}

impl Oriented<'_> {
    /// The neighbourhood of a point. Where 16 neighbours leave a gap and 24 do not these are taken: by chance 16 scattered points leave
    /// one at one in thirty places inside a surface. At a border they are not, since the farther reach other sheets.
    pub fn neighbourhood(&self, point: u32) -> Neighbourhood {
        let mut neighbours = Vec::new();
        for n in NEAREST {
            let found = self.same_sheet(point, n);
            let has_gap = largest_gap(&self.places(point, &found)) > GAP;
            if n == NEAREST[0] || !has_gap {
                neighbours = found;
            }
            if !has_gap {
                break;
            }
        }
        let sixth = neighbours.get(5).or(neighbours.last());
        let distance = sixth.map_or(0.0, |&other| self.points[other as usize].distance(self.points[point as usize]));
        Neighbourhood { neighbours, spacing: distance / 2.0_f64.sqrt() }
    }

    /// The triangles of a point with these neighbours, at this spacing.
    pub fn star(&self, point: u32, neighbours: &[u32], spacing: f64) -> Star {
        let frame = frame_towards(self.normals[point as usize], DVec3::ZERO);
        let flat = self.places(point, neighbours);
        let is_boundary = largest_gap(&flat) > GAP;
        let places: Vec<DVec2> = neighbours
            .iter()
            .zip(&flat)
            .map(|(&other, &flat)| {
                let chord = self.points[other as usize] - self.points[point as usize];
                let nudge = frame.coordinates(((nudge(other) - nudge(point)) * (NUDGE * spacing)).to_array());
                // Seen from the opposite end of the sphere through both points that touches the tangent plane: circles stay circles, so
                // that the points of a round surface agree about its triangles.
                flat * (chord.length_squared() / flat.length_squared()) + DVec2::from_array(nudge)
            })
            .collect();
        // A triangle in the gap is none of the surface.
        let is_kept =
            |&[a, b]: &[usize; 2]| !is_boundary || flat[a].perp_dot(flat[b]).atan2(flat[a].dot(flat[b])) <= GAP;
        let corners = star(&places).into_iter().filter(is_kept).map(|corners| corners.map(|k| neighbours[k]));
        Star { corners: corners.collect(), is_boundary }
    }

    /// Those of the `n` nearest points that lie on the same sheet.
    fn same_sheet(&self, point: u32, n: usize) -> Vec<u32> {
        let (here, normal) = (self.points[point as usize], self.normals[point as usize]);
        let nearest = self.tree.nearest_n(here.to_array(), n + 1);
        let is_same_sheet = |&other: &u32| {
            let chord = self.points[other as usize] - here;
            other != point
                && self.normals[other as usize].dot(normal) > SAME_SIDE
                && chord.dot(normal).abs() <= STEEPEST * chord.length()
        };
        nearest.iter().map(|other| other.index).filter(is_same_sheet).collect()
    }

    /// The projections of points to the tangent plane of a point.
    fn places(&self, point: u32, others: &[u32]) -> Vec<DVec2> {
        let frame = frame_towards(self.normals[point as usize], DVec3::ZERO);
        let chord = |&other: &u32| (self.points[other as usize] - self.points[point as usize]).to_array();
        others.iter().map(|other| DVec2::from_array(frame.coordinates(chord(other)))).collect()
    }
}

/// A vector of length 1 or less that depends on the index alone.
fn nudge(point: u32) -> DVec3 {
    // The fractional parts of the powers of the plastic number's relative in three dimensions spread evenly (Roberts 2018).
    [0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_2]
        .map(|step| (step * f64::from(point)).fract() - 0.5)
        .into()
}

/// The largest angle between consecutive directions; a whole turn for fewer than two.
fn largest_gap(places: &[DVec2]) -> f64 {
    let mut angles: Vec<f64> = places.iter().map(|p| positive(p.y.atan2(p.x))).collect();
    angles.sort_unstable_by(f64::total_cmp);
    let Some(&first) = angles.first() else { return TAU };
    let next = angles.iter().skip(1).copied().chain([first + TAU]);
    angles.iter().zip(next).map(|(a, b)| b - a).fold(0.0, f64::max)
}

/// The triangles at the origin in the Delaunay triangulation of the origin and these places, by the numbers of their other corners,
/// counter-clockwise.
fn star(places: &[DVec2]) -> Vec<[usize; 2]> {
    let reach = places.iter().fold(0.0_f64, |most, p| most.max(p.length()));
    if !(reach > 0.0) {
        return Vec::new();
    }
    let mut triangulation = DelaunayTriangulation::<Point2<f64>>::new();
    let Ok(origin) = triangulation.insert(Point2::new(0.0, 0.0)) else { return Vec::new() };
    // The place of each vertex after the origin; of places that coincide the first.
    let mut inserted = Vec::with_capacity(places.len());
    for (number, &place) in places.iter().enumerate() {
        // The crate takes no numbers near the smallest.
        let scaled = (place / reach).to_array().map(|x| if x.abs() < 1e-100 { 0.0 } else { x });
        let Ok(vertex) = triangulation.insert(Point2::new(scaled[0], scaled[1])) else { continue };
        if vertex.index() == inserted.len() + 1 {
            inserted.push(number);
        }
    }
    let mut triangles: Vec<[usize; 2]> = triangulation
        .vertex(origin)
        .out_edges()
        .filter(|edge| edge.face().as_inner().is_some())
        .filter_map(|edge| {
            let corner = |vertex: usize| inserted.get(vertex.checked_sub(1)?).copied();
            Some([corner(edge.to().index())?, corner(edge.next().to().index())?])
        })
        .collect();
    triangles.sort_unstable();
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_star_of_a_ring_is_its_fan_and_farther_points_are_left_out() {
        let ring = |k: usize| DVec2::from_angle(TAU * k as f64 / 6.0 + 0.1);
        let places: Vec<DVec2> = (0..6).map(ring).chain((0..6).map(|k| 3.0 * ring(k))).collect();
        assert_eq!(star(&places), [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0]]);
        assert_eq!(star(&[]), [[0; 2]; 0]);
        assert_eq!(star(&[DVec2::X, DVec2::X * 2.0, -DVec2::X]), [[0; 2]; 0]);
        assert_eq!(star(&[DVec2::X, DVec2::X, DVec2::Y]), [[0, 2]]);
    }

    #[test]
    fn gaps_are_those_between_neighbours() {
        assert_eq!(largest_gap(&[]), TAU);
        assert_eq!(largest_gap(&[DVec2::Y]), TAU);
        assert!((largest_gap(&[DVec2::Y, DVec2::X, -DVec2::X]) - PI).abs() < 1e-15);
    }
}
