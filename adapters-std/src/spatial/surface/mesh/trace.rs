//! Straightest geodesics on a mesh: straight on in the unfolded faces, and through a vertex such that the angles to the left and to the
//! right are equal (Polthier, Schmies, Straightest geodesics on polyhedral surfaces, 1998; Part I, 2.4).

use std::f64::consts::PI;

use glam::DVec2;

use super::super::angles::{angle_of, turned, turned_back, wrapped};
use super::super::glue::{NONE, face_of, side_of};
use super::super::{LONGEST, Location, Stop, SurfacePoint, Trace};
use super::{AT_VERTEX, MeshSurface, corner_at};

/// A path that passes a vertex at this share of the size of the face, or nearer, goes through it.
const HIT: f64 = 1e-10;

/// Faces that a path may cross, for each face of the mesh and for each spacing of its length, before it counts as stuck.
const CROSSINGS: f64 = 64.0;

/// How a path came into a face.
#[derive(Debug, Clone, Copy)]
enum Entry {
    /// It began there.
    Start,
    /// From a corner.
    Corner(usize),
    /// Over a side.
    Side(usize),
}

/// Where a path leaves a face.
enum Exit {
    Corner(usize),
    /// Over the side, at the share of it from its first corner.
    Side(usize, f64),
}

/// Where the path is.
#[derive(Debug, Clone, Copy)]
enum Place {
    /// At a vertex, going on in a direction of its frame.
    Vertex { vertex: u32, direction: f64 },
    /// In a face.
    Face { face: u32, point: DVec2, direction: DVec2, entry: Entry },
}

/// The straightest geodesic from a location.
pub(super) fn straightest(surface: &MeshSurface, from: &Location, angle: f64, length: f64) -> Trace {
    let start = surface.checked(from).filter(|_| angle.is_finite() && length.abs() <= LONGEST * surface.spacing);
    let Some(start) = start else {
        return Trace { end: *from, turn: 0.0, length: 0.0, stopped: Some(Stop::NoStart) };
    };
    // A vector in a direction opposite to the path's is transported like any other.
    let angle = wrapped(if length < 0.0 { angle + PI } else { angle });
    let place = match corner_at(&start) {
        Some(corner) => Place::Vertex { vertex: surface.faces[start.face as usize][corner], direction: angle },
        None => Place::Face {
            face: start.face,
            point: surface.layouts[start.face as usize].point(start.barycentric),
            direction: DVec2::from_angle(angle),
            entry: Entry::Start,
        },
    };
    if length == 0.0 {
        return Trace { end: Location::Mesh(start), turn: 0.0, length: 0.0, stopped: None };
    }
    let length = length.abs();
    let mut path = Path { surface, place, rest: length };
    let stopped = path.walk(length);
    let (end, arriving) = path.end();
    Trace { end: Location::Mesh(end), turn: wrapped(arriving - angle), length: length - path.rest, stopped }
}

struct Path<'a> {
    surface: &'a MeshSurface,
    place: Place,
    rest: f64,
}

impl Path<'_> {
    fn walk(&mut self, length: f64) -> Option<Stop> {
        let limit = CROSSINGS * (self.surface.faces.len() as f64 + length / self.surface.spacing);
        let mut crossings = 0.0;
        while self.rest > 0.0 {
            let stopped = match self.place {
                Place::Vertex { vertex, direction } => self.leave_vertex(vertex, direction),
                Place::Face { face, point, direction, entry } => self.cross(face, point, direction, entry),
            };
            crossings += 1.0;
            if stopped.is_some() {
                return stopped;
            }
            if crossings > limit {
                return Some(Stop::DegenerateFace);
            }
        }
        None
    }

    fn leave_vertex(&mut self, vertex: u32, direction: f64) -> Option<Stop> {
        let Some((side, angle)) = self.surface.rings.wedge(vertex, direction) else { return Some(Stop::Boundary) };
        let (face, corner) = face_of(side);
        let layout = &self.surface.layouts[face as usize];
        let (point, direction) = (layout.corners[corner], layout.leaving(corner, angle));
        self.place = Place::Face { face, point, direction, entry: Entry::Corner(corner) };
        None
    }

    /// To the end of the path or of the face.
    fn cross(&mut self, face: u32, point: DVec2, direction: DVec2, entry: Entry) -> Option<Stop> {
        let layout = &self.surface.layouts[face as usize];
        let hit = HIT * layout.size;
        let Some(exit) = exit(&layout.corners, point, direction, entry, hit) else { return Some(Stop::DegenerateFace) };
        let target = match exit {
            Exit::Corner(corner) => layout.corners[corner],
            Exit::Side(side, share) => layout.corners[side].lerp(layout.corners[(side + 1) % 3], share),
        };
        let distance = direction.dot(target - point).max(0.0);
        let ends_at_corner = matches!(exit, Exit::Corner(_)) && (self.rest - distance).abs() <= hit;
        if self.rest <= distance && !ends_at_corner {
            self.place = Place::Face { face, point: point + direction * self.rest, direction, entry };
            self.rest = 0.0;
            return None;
        }
        self.rest = if ends_at_corner { 0.0 } else { self.rest - distance };
        match exit {
            Exit::Corner(corner) => {
                let back = angle_of(turned_back(-direction, layout.directions[corner]));
                let vertex = self.surface.faces[face as usize][corner];
                let back = self.surface.rings.direction(vertex, side_of(face, corner), back);
                self.place = Place::Vertex { vertex, direction: wrapped(back + PI) };
            }
            Exit::Side(side, share) => {
                let twin = self.surface.twins[side_of(face, side) as usize];
                if twin == NONE {
                    self.place = Place::Face { face, point: target, direction, entry };
                    return Some(Stop::Boundary);
                }
                let (next, place) = face_of(twin);
                let unfolded = &self.surface.layouts[next as usize];
                let point = unfolded.corners[(place + 1) % 3].lerp(unfolded.corners[place], share);
                let along = turned_back(direction, layout.directions[side]);
                let direction = turned(along, -unfolded.directions[place]).normalize();
                self.place = Place::Face { face: next, point, direction, entry: Entry::Side(place) };
            }
        }
        None
    }

    /// The location at the end and the direction in its frame.
    fn end(&self) -> (SurfacePoint, f64) {
        match self.place {
            Place::Vertex { vertex, direction } => (self.surface.vertex_location(vertex), direction),
            Place::Face { face, point, direction, .. } => {
                let mut point =
                    SurfacePoint { face, barycentric: self.surface.layouts[face as usize].barycentric(point) };
                if let Some(corner) = corner_at(&point) {
                    // The direction is that of the face, not of the vertex, so that the location must be the face's.
                    let share = 4.0 * AT_VERTEX;
                    point.barycentric = [share / 2.0; 3];
                    point.barycentric[corner] = 1.0 - share;
                }
                (point, angle_of(direction))
            }
        }
    }
}

/// Where a straight line leaves a triangle; `None` when rounding leaves it nowhere to go.
fn exit(corners: &[DVec2; 3], point: DVec2, direction: DVec2, entry: Entry, hit: f64) -> Option<Exit> {
    // How far the corners are to the left of the line. A line leaves over a side whose first corner is to its right and whose second is
    // to its left.
    let left = corners.map(|corner| direction.perp_dot(corner - point));
    let over = |side: usize| {
        let (right, left) = ((-left[side]).max(0.0), left[(side + 1) % 3].max(0.0));
        let share = if right + left > 0.0 { right / (right + left) } else { 0.5 };
        Some(Exit::Side(side, share))
    };
    match entry {
        Entry::Corner(corner) => {
            let [first, second] = [(corner + 1) % 3, (corner + 2) % 3];
            // Of a thin triangle both corners may be near the line.
            if left[first] >= -hit && -left[first] <= left[second] {
                return Some(Exit::Corner(first));
            }
            if left[second] <= hit {
                return Some(Exit::Corner(second));
            }
            over(first)
        }
        Entry::Side(side) => {
            let opposite = (side + 2) % 3;
            if left[opposite].abs() <= hit {
                Some(Exit::Corner(opposite))
            } else {
                over(if left[opposite] > 0.0 { (side + 1) % 3 } else { opposite })
            }
        }
        Entry::Start => {
            let ahead = |corner: usize| direction.dot(corners[corner] - point);
            let met = (0..3).filter(|&corner| left[corner].abs() <= hit && ahead(corner) > hit);
            if let Some(corner) = met.min_by(|&a, &b| ahead(a).total_cmp(&ahead(b))) {
                return Some(Exit::Corner(corner));
            }
            over((0..3).find(|&side| left[side] < 0.0 && left[(side + 1) % 3] > 0.0)?)
        }
    }
}
