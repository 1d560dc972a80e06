//! Makes a mesh a manifold: edges with more than two faces are cut, vertices with several fans get a copy for each.
//!
//! An edge with four faces is where two sheets touch, the usual fault of surfaces drawn round bodies whose parts come too
//! close; its faces are paired as two sheets (Part I, 1.2). At other edges the faces stay unconnected.
//!
//! Where vertices had been welded before, a fan takes one of those that its own faces named, so that a mesh that is cut
//! already comes out as it went in.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use super::CleanReport;
use super::draft::Draft;
use crate::mesh::Topology;

/// Pairs of faces that are connected across an edge with four.
type Pairs = BTreeMap<u32, [[u32; 2]; 2]>;

/// The fans of the vertices that have several: vertex, then fans as sorted lists of faces, in the order of their first.
type Fans = Vec<(u32, Vec<Vec<u32>>)>;

/// Cuts; `topology` is that of the faces. Returns whether a face changed.
pub(super) fn cut(draft: &mut Draft<'_>, topology: &Topology, report: &mut CleanReport) -> bool {
    draft.twins.clear();
    let vertices = topology.non_manifold_vertices();
    if vertices.is_empty() {
        return false;
    }
    let edges: Vec<u32> =
        (0..topology.edges().len() as u32).filter(|&edge| topology.edges()[edge as usize].faces.len() > 2).collect();
    let mut pairs = paired(draft, topology, &edges);
    let fans = loop {
        let fans = fans(topology, &vertices, &pairs);
        // Two sheets that are one fan at both ends of the edge would need two edges between the same vertices.
        let is_one = |vertex: u32, faces: &[u32]| {
            let place = fans.binary_search_by_key(&vertex, |(vertex, _)| *vertex);
            place.is_ok_and(|at| fans[at].1.iter().any(|fan| faces.iter().all(|face| fan.binary_search(face).is_ok())))
        };
        let n = pairs.len();
        pairs.retain(|&edge, _| {
            let edge = &topology.edges()[edge as usize];
            !edge.vertices.iter().all(|&vertex| is_one(vertex, &edge.faces))
        });
        if pairs.len() == n {
            break fans;
        }
    };
    let changed = part(draft, &fans, report);
    if changed {
        for edge in edges {
            let [a, b] = topology.edges()[edge as usize].vertices;
            let is_new = topology.edges()[edge as usize].faces.iter().any(|&face| {
                let (now, before) = (draft.faces[face as usize], draft.before[face as usize]);
                let corners = topology.corners(face);
                (0..3).any(|k| [a, b].contains(&corners[k]) && now[k] != before[k])
            });
            if is_new {
                report.non_manifold_edges.add([a, b].map(|vertex| draft.origin[vertex as usize]));
                report.paired_edges += usize::from(pairs.contains_key(&edge));
            }
        }
    }
    changed
}

/// How the faces of edges with four are paired.
///
/// Two and two of different patches (what hangs together elsewhere) belong together: two bodies that touch. Else the pairs
/// are neighbours in the order round the edge, so that the sheets touch and do not cross, and of the two such ways the one
/// whose pairs are nearer to flat; of equal ones that in which the first face goes with the earlier.
fn paired(draft: &Draft<'_>, topology: &Topology, edges: &[u32]) -> Pairs {
    let mut pairs = Pairs::new();
    let mut patch_of_face = Vec::new();
    for &edge in edges {
        let [a, b] = topology.edges()[edge as usize].vertices;
        let [p, q, r, s] = *topology.edges()[edge as usize].faces else { continue };
        if patch_of_face.is_empty() {
            patch_of_face = topology.patches().of_face;
        }
        let ways = [[[p, q], [r, s]], [[p, r], [q, s]], [[p, s], [q, r]]];
        let patch = |face: u32| patch_of_face[face as usize];
        let is_apart = |[one, other]: [[u32; 2]; 2]| {
            patch(one[0]) == patch(one[1]) && patch(other[0]) == patch(other[1]) && patch(one[0]) != patch(other[0])
        };
        let way = ways.into_iter().find(|&way| is_apart(way)).unwrap_or_else(|| {
            let origin = draft.positions[a as usize];
            let axis = (draft.positions[b as usize] - origin).normalize_or_zero();
            let mut first_side = None;
            let mut angles = [p, q, r, s].map(|face| {
                let third = topology.corners(face).into_iter().find(|corner| ![a, b].contains(corner)).unwrap_or(a);
                let away = draft.positions[third as usize] - origin;
                let side = away - axis * away.dot(axis);
                let first = *first_side.get_or_insert(side);
                (axis.cross(first).dot(side).atan2(first.dot(side)), face)
            });
            angles.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
            let bend = |from: usize| {
                let gap = (angles[(from + 1) % 4].0 - angles[from].0).rem_euclid(TAU);
                (PI - gap).abs()
            };
            let [f, g, h, i] = angles.map(|(_, face)| face);
            let (one, other) = ([[f, g], [h, i]], [[g, h], [i, f]]);
            let difference = bend(0) + bend(2) - bend(1) - bend(3);
            // `p` is the first face.
            let partner = |way: [[u32; 2]; 2]| way.into_iter().find(|pair| pair.contains(&p)).map(|[x, y]| x.max(y));
            let is_one = if difference.abs() > 1e-9 { difference < 0.0 } else { partner(one) < partner(other) };
            if is_one { one } else { other }
        });
        pairs.insert(edge, way);
    }
    pairs
}

/// The fans of the vertices, those that pairs connect put together.
fn fans(topology: &Topology, vertices: &[u32], pairs: &Pairs) -> Fans {
    let of_vertex = |&vertex: &u32| {
        let mut fans: Vec<Vec<u32>> = topology.fans(vertex).into_iter().map(|fan| fan.faces).collect();
        fans.iter_mut().for_each(|fan| fan.sort_unstable());
        let mut edges: Vec<u32> = Vec::new();
        if !pairs.is_empty() {
            let faces = topology.faces_of_vertex(vertex).iter();
            edges.extend(faces.flat_map(|&face| topology.edges_of_face(face)).filter(|edge| pairs.contains_key(edge)));
            edges.retain(|&edge| topology.edges()[edge as usize].vertices.contains(&vertex));
            edges.sort_unstable();
            edges.dedup();
        }
        for pair in edges.iter().flat_map(|edge| pairs[edge]) {
            let of = |face: u32, fans: &[Vec<u32>]| fans.iter().position(|fan| fan.binary_search(&face).is_ok());
            let (Some(one), Some(other)) = (of(pair[0], &fans), of(pair[1], &fans)) else { continue };
            if one != other {
                let moved = fans.swap_remove(one.max(other));
                fans[one.min(other)].extend(moved);
                fans[one.min(other)].sort_unstable();
            }
        }
        fans.sort_unstable();
        (vertex, fans)
    };
    vertices.iter().map(of_vertex).collect()
}

/// Gives each fan a vertex of its own. Returns whether a face changed.
fn part(draft: &mut Draft<'_>, fans: &Fans, report: &mut CleanReport) -> bool {
    let mut changed = false;
    // Fans are those of the faces before any of them is changed, so that corners are found by the old vertex.
    let old = draft.faces.clone();
    for (vertex, fans) in fans.iter().filter(|(_, fans)| fans.len() > 1) {
        let corner = |face: u32| old[face as usize].iter().position(|corner| corner == vertex).unwrap_or(0);
        let mut group = Vec::new();
        let mut is_new = false;
        for fan in fans {
            let mut named: Vec<u32> = fan.iter().map(|&face| draft.before[face as usize][corner(face)]).collect();
            named.sort_unstable();
            let free = named.iter().copied().find(|candidate| !group.contains(candidate));
            let own = free.unwrap_or_else(|| {
                report.added_vertices += 1;
                draft.copy_of(named.first().copied().unwrap_or(*vertex))
            });
            group.push(own);
            for &face in fan {
                let k = corner(face);
                draft.faces[face as usize][k] = own;
                is_new |= draft.before[face as usize][k] != own;
            }
        }
        if is_new {
            report.non_manifold_vertices.add(draft.origin[*vertex as usize]);
        }
        changed |= is_new;
        draft.twins.push(group);
    }
    changed
}
