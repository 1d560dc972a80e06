//! Spikes: faces that bridge two layers of a scan, and faces that run to a stray vertex.
//!
//! Length alone does not tell a spike: a mesh that is coarse in one place and fine in another has edges of ten times the
//! median too. So a face whose longest edge is long (more than `factor` times the median edge, Part III, 3.1) is removed
//! only when it is one of two things.
//!
//! - A **needle**: it has a vertex all of whose edges are long, while the edges opposite to it are not, and at which the
//!   angles of the faces sum to less than 1 rad. That is the point of a cone of less than 19 degrees; no part of a body is
//!   so sharp over ten edges.
//! - A **bridge**: it is thin (its shortest edge is below a fifth of the longest), it lies in a component with a boundary, as
//!   all range images do, and it joins two layers that face the same way along their normals: with `e` the direction from
//!   its short edge to its point, `n` and `m` the normals of the other surface at both, `e.n` and `e.m` have the same sign,
//!   both are at least 0.1 and one at least 0.5 in magnitude, and `n.m > 0`. The side of a tall box with fine ends is thin
//!   and long too, but joins surfaces that face away from each other.
//!
//! What is long and neither is reported and kept.

use glam::DVec3;

use super::CleanReport;
use super::draft::Draft;
use crate::mesh::Topology;

/// Removes spikes. Returns whether there were any. The faces that are long and stay are in `report.long_faces`.
pub(super) fn drop_spikes(draft: &mut Draft<'_>, topology: &Topology, factor: f64, report: &mut CleanReport) -> bool {
    report.long_faces = Default::default();
    let lengths: Vec<f64> = topology
        .edges()
        .iter()
        .map(|edge| draft.positions[edge.vertices[0] as usize].distance(draft.positions[edge.vertices[1] as usize]))
        .collect();
    let mut sorted = lengths.clone();
    let middle = sorted.len() / 2;
    let limit = match sorted.get(middle) {
        Some(_) => factor * *sorted.select_nth_unstable_by(middle, f64::total_cmp).1,
        None => return false,
    };
    let is_long: Vec<bool> = lengths.iter().map(|&length| length > limit).collect();
    let candidates: Vec<u32> = (0..draft.faces.len() as u32)
        .filter(|&face| topology.edges_of_face(face).iter().any(|&edge| is_long[edge as usize]))
        .collect();
    if candidates.is_empty() {
        return false;
    }
    let surfaces = Surfaces { draft, topology, lengths: &lengths, is_long: &is_long };
    let has_boundary = surfaces.faces_of_open_components();
    let is_spike: Vec<bool> = candidates
        .iter()
        .map(|&face| surfaces.is_needle(face) || has_boundary[face as usize] && surfaces.is_bridge(face))
        .collect();
    for (&face, _) in candidates.iter().zip(&is_spike).filter(|(_, is_spike)| !**is_spike) {
        report.long_faces.add(draft.old_of_face[face as usize]);
    }
    let spikes: Vec<u32> =
        candidates.into_iter().zip(is_spike).filter(|(_, is_spike)| *is_spike).map(|(face, _)| face).collect();
    draft.drop_faces(|face, old| {
        let is_spike = spikes.binary_search(&(face as u32)).is_ok();
        if is_spike {
            report.spikes.add(old);
        }
        is_spike
    });
    !spikes.is_empty()
}

struct Surfaces<'a> {
    draft: &'a Draft<'a>,
    topology: &'a Topology,
    lengths: &'a [f64],
    is_long: &'a [bool],
}

impl Surfaces<'_> {
    fn faces_of_open_components(&self) -> Vec<bool> {
        let patches = self.topology.patches();
        let mut is_open = vec![false; patches.is_orientable.len()];
        for (face, &patch) in patches.of_face.iter().enumerate() {
            let edges = self.topology.edges_of_face(face as u32);
            is_open[patch as usize] |= edges.iter().any(|&edge| self.topology.edges()[edge as usize].faces.len() == 1);
        }
        patches.of_face.iter().map(|&patch| is_open[patch as usize]).collect()
    }

    fn position(&self, vertex: u32) -> DVec3 {
        self.draft.positions[vertex as usize]
    }

    /// Whether a corner of the face is the point of a needle.
    fn is_needle(&self, face: u32) -> bool {
        self.topology.corners(face).into_iter().any(|vertex| {
            let mut angle = 0.0;
            self.topology.faces_of_vertex(vertex).iter().all(|&face| {
                let corners = self.topology.corners(face);
                let at = corners.iter().position(|&corner| corner == vertex).unwrap_or(0);
                let edges = self.topology.edges_of_face(face);
                let [one, other] = [1, 2].map(|k| self.position(corners[(at + k) % 3]) - self.position(vertex));
                angle += one.cross(other).length().atan2(one.dot(other));
                let [here, opposite, back] = [0, 1, 2].map(|k| self.is_long[edges[(at + k) % 3] as usize]);
                here && back && !opposite && angle < 1.0
            })
        })
    }

    fn is_bridge(&self, face: u32) -> bool {
        let corners = self.topology.corners(face);
        let lengths = self.topology.edges_of_face(face).map(|edge| self.lengths[edge as usize]);
        let short = (0..3).min_by(|&a, &b| lengths[a].total_cmp(&lengths[b])).unwrap_or(0);
        let longest = lengths.into_iter().fold(0.0, f64::max);
        if 5.0 * lengths[short] > longest {
            return false;
        }
        let [a, b, point] = [0, 1, 2].map(|k| corners[(short + k) % 3]);
        let (Some(m), Some(n)) = (self.normal(&[point]), self.normal(&[a, b])) else { return false };
        let along = (self.position(point) - (self.position(a) + self.position(b)) / 2.0).normalize_or_zero();
        let (x, y) = (along.dot(n), along.dot(m));
        x * y > 0.0 && x.abs().min(y.abs()) >= 0.1 && x.abs().max(y.abs()) >= 0.5 && n.dot(m) > 0.0
    }

    /// The normal of the faces at some vertices that have no long edge; `None` where there are none.
    fn normal(&self, vertices: &[u32]) -> Option<DVec3> {
        let mut sum = DVec3::ZERO;
        for &face in vertices.iter().flat_map(|&vertex| self.topology.faces_of_vertex(vertex)) {
            if self.topology.edges_of_face(face).iter().all(|&edge| !self.is_long[edge as usize]) {
                let [a, b, c] = self.draft.corners(self.draft.faces[face as usize]);
                sum += (b - a).cross(c - a);
            }
        }
        sum.try_normalize()
    }
}
