//! Faces that are none: with a vertex twice, without area, or the same as another.

use super::CleanReport;
use super::draft::Draft;
use crate::mesh::Topology;

/// Removes faces that name a vertex twice or whose area is below `1e-12 L^2` (Part I, 1.2). Returns whether there were any.
pub(super) fn drop_degenerate(draft: &mut Draft<'_>, scale: f64, report: &mut CleanReport) -> bool {
    let smallest = 1e-12 * scale * scale;
    let n = draft.faces.len();
    let is_repeated = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
    let judged: Vec<(bool, bool)> = draft
        .faces
        .iter()
        .map(|&face| (is_repeated(face), !(draft.area(face) > 0.0) || draft.area(face) < smallest))
        .collect();
    draft.drop_faces(|face, old| {
        let (is_repeated, is_flat) = judged[face];
        if is_repeated {
            report.repeated_index_faces.add(old);
        } else if is_flat {
            report.zero_area_faces.add(old);
        }
        is_repeated || is_flat
    });
    draft.faces.len() != n
}

/// Removes faces with the same three vertices as an earlier one. Returns whether there were any.
///
/// Such faces share all their edges, so that only edges with several faces are looked at, and there the third vertices.
pub(super) fn drop_duplicates(draft: &mut Draft<'_>, topology: &Topology, report: &mut CleanReport) -> bool {
    let mut is_dropped = Vec::new();
    let mut at_edge: Vec<(u32, u32)> = Vec::new();
    for edge in topology.edges().iter().filter(|edge| edge.faces.len() > 1) {
        let third = |face: u32| {
            let corners = draft.faces[face as usize];
            corners.into_iter().find(|corner| !edge.vertices.contains(corner)).unwrap_or(corners[0])
        };
        if let [first, second] = *edge.faces
            && third(first) != third(second)
        {
            continue;
        }
        at_edge.clear();
        at_edge.extend(edge.faces.iter().map(|&face| (third(face), face)));
        at_edge.sort_unstable();
        for same in at_edge.chunk_by(|a, b| a.0 == b.0) {
            for &(_, face) in &same[1..] {
                is_dropped.resize(draft.faces.len(), None);
                is_dropped[face as usize] = Some(same[0].1);
            }
        }
    }
    if is_dropped.is_empty() {
        return false;
    }
    let faces = draft.faces.clone();
    draft.drop_faces(|face, old| {
        let Some(first) = is_dropped[face] else { return false };
        let ([a, b, _], first) = (faces[face], faces[first as usize]);
        let has_side = |from: u32, to: u32| (0..3).any(|k| first[k] == from && first[(k + 1) % 3] == to);
        if has_side(a, b) {
            report.duplicate_faces.add(old);
        } else {
            report.opposite_faces.add(old);
        }
        true
    });
    true
}
