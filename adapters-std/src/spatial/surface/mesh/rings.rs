//! The edges round each vertex with their directions. Angles are scaled such that they sum to a full turn inside, to half a turn on the
//! boundary (Part I, 1.3).

use std::f64::consts::{PI, TAU};

use super::super::angles::{positive, wrapped};
use super::super::glue::{NONE, face_of, side_of};
use super::{Layout, Neighbouring};
use crate::mesh::Topology;

/// Beyond the border of a boundary vertex by so much is still on it.
const ROUNDING: f64 = 1e-9;

#[derive(Debug)]
struct Vertex {
    /// The edges of vertex `v` begin here; those of the next follow them.
    start: usize,
    /// The sum of the angles of its faces.
    total: f64,
    /// The angle of its faces before the edge of direction 0.
    base: f64,
    is_closed: bool,
}

/// The edges round the vertices, counter-clockwise; inside from that of direction 0 on, on the boundary from one border to the other.
#[derive(Debug)]
pub(super) struct Rings {
    vertices: Vec<Vertex>,
    edges: Vec<Neighbouring>,
    /// The side of a face along each edge, away from the vertex; `NONE` for the last edge of a boundary vertex.
    sides: Vec<u32>,
    /// The angle of that face at the vertex, unscaled; 0 where there is none.
    angles: Vec<f64>,
}

impl Rings {
    /// The rings of an oriented manifold.
    pub fn new(topology: &Topology, layouts: &[Layout]) -> Rings {
        let mut rings = Rings { vertices: Vec::new(), edges: Vec::new(), sides: Vec::new(), angles: Vec::new() };
        for vertex in 0..topology.n_vertices() as u32 {
            rings.push(topology, layouts, vertex);
        }
        rings.vertices.push(Vertex { start: rings.edges.len(), total: 0.0, base: 0.0, is_closed: true });
        for vertex in 0..topology.n_vertices() as u32 {
            for at in rings.range(vertex) {
                let other = rings.edges[at].j;
                let back = rings.of(other).iter().find(|edge| edge.j == vertex).map_or(0.0, |edge| edge.angle_i);
                rings.edges[at].angle_j = back;
            }
        }
        rings
    }

    fn push(&mut self, topology: &Topology, layouts: &[Layout], vertex: u32) {
        let start = self.edges.len();
        // A manifold has one fan at each vertex.
        let Some(mut fan) = topology.one_ring(vertex) else {
            self.vertices.push(Vertex { start, total: 0.0, base: 0.0, is_closed: true });
            return;
        };
        let least = (0..fan.vertices.len()).min_by_key(|&at| fan.vertices[at]).unwrap_or(0);
        if fan.is_closed {
            fan.vertices.rotate_left(least);
            fan.faces.rotate_left(least);
        }
        let corner = |face: u32| topology.corners(face).iter().position(|&v| v == vertex).unwrap_or(0);
        let (mut total, mut base) = (0.0, 0.0);
        for (at, &j) in fan.vertices.iter().enumerate() {
            if !fan.is_closed && at == least {
                base = total;
            }
            let (side, angle, length) = match fan.faces.get(at) {
                Some(&face) => {
                    let (corner, layout) = (corner(face), &layouts[face as usize]);
                    let length = layout.corners[corner].distance(layout.corners[(corner + 1) % 3]);
                    (side_of(face, corner), layout.angle(corner), length)
                }
                None => {
                    let face = fan.faces[at - 1];
                    let (corner, layout) = (corner(face), &layouts[face as usize]);
                    (NONE, 0.0, layout.corners[corner].distance(layout.corners[(corner + 2) % 3]))
                }
            };
            // The loop below scales it.
            self.edges.push(Neighbouring { j, length, angle_i: total, angle_j: 0.0 });
            self.sides.push(side);
            self.angles.push(angle);
            total += angle;
        }
        self.vertices.push(Vertex { start, total, base, is_closed: fan.is_closed });
        let scale = self.scale(vertex);
        for edge in &mut self.edges[start..] {
            edge.angle_i = wrapped((edge.angle_i - base) * scale);
        }
    }

    fn range(&self, vertex: u32) -> std::ops::Range<usize> {
        self.vertices[vertex as usize].start..self.vertices[vertex as usize + 1].start
    }

    /// What an angle between faces is multiplied with to become one between directions.
    fn scale(&self, vertex: u32) -> f64 {
        let vertex = &self.vertices[vertex as usize];
        (if vertex.is_closed { TAU } else { PI }) / vertex.total
    }

    pub fn of(&self, vertex: u32) -> &[Neighbouring] {
        &self.edges[self.range(vertex)]
    }

    pub fn is_closed(&self, vertex: u32) -> bool {
        self.vertices[vertex as usize].is_closed
    }

    pub fn total_angle(&self, vertex: u32) -> f64 {
        self.vertices[vertex as usize].total
    }

    /// The first face of a vertex and its corner there.
    pub fn first_corner(&self, vertex: u32) -> (u32, usize) {
        face_of(self.sides[self.vertices[vertex as usize].start])
    }

    /// The direction at a vertex that leaves it into this face, `angle` behind the side that leaves it there.
    pub fn direction(&self, vertex: u32, side: u32, angle: f64) -> f64 {
        let range = self.range(vertex);
        let at = range.start + self.sides[range].iter().position(|&s| s == side).unwrap_or(0);
        self.edges[at].angle_i + angle.clamp(0.0, self.angles[at]) * self.scale(vertex)
    }

    /// The face into which a direction leads, as the side of it that leaves the vertex, and the angle behind that side; `None` where the
    /// direction leaves the surface.
    pub fn wedge(&self, vertex: u32, direction: f64) -> Option<(u32, f64)> {
        let Vertex { total, base, is_closed, .. } = self.vertices[vertex as usize];
        let mut rest = if is_closed {
            positive(direction) / self.scale(vertex)
        } else {
            // From -base to total - base; of equal directions the one in that range.
            let turns = [0.0, TAU, -TAU].map(|turn| base + (wrapped(direction) + turn) / self.scale(vertex));
            turns.into_iter().find(|&a| a >= -ROUNDING && a <= total + ROUNDING)?.clamp(0.0, total)
        };
        let faces = self.range(vertex).filter(|&at| self.sides[at] != NONE);
        let mut last = None;
        for at in faces {
            let angle = self.angles[at];
            if rest <= angle {
                return Some((self.sides[at], rest));
            }
            rest -= angle;
            last = Some((self.sides[at], angle));
        }
        // Rounding of the sum.
        last
    }
}
