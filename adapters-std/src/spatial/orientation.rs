//! Faces that look inwards, found by what rays from them meet (Part II, 7.4; Takayama, Jacobson, Kavan, Sorkine-Hornung, A simple
//! method for correcting facet orientations in polygon meshes based on ray casting, JCGT 2014).

use glam::DVec3;
use rayon::prelude::*;

use super::triangles::TriangleTree;
use crate::mesh::Topology;
use crate::mesh::topology::Patches;

/// Stands for "no patch".
const NONE: u32 = u32::MAX;

/// Places on a patch from which rays go to both sides: as many as it has faces, within these limits.
const FEWEST: usize = 8;
const MOST: usize = 64;

/// How far rays lean from the normal: the tangent of the largest angle.
const LEAN: f64 = 0.5;

/// More than the rounding errors of places where rays meet faces, in the largest coordinate.
const ROUNDING: f64 = 1e-12;

/// The faces that look inwards or do not agree with the most of their patch, in ascending order. A patch is what hangs together over
/// edges with two faces; its faces can be made to agree. A closed patch then looks outwards when its volume is positive. An open one
/// is asked by rays from places on it to both sides:
///
/// - in front, an even number of layers speaks for a face that looks outwards; behind, an odd one;
/// - so does a side that is free in front, and one behind against it.
///
/// Where rays are undecided the more of its area is right. Hits at most `layer` apart along a ray are one layer, those at most so far
/// from the place none. Patches that cannot be oriented have no such faces.
pub(super) fn inward_faces(tree: &TriangleTree, topology: &Topology, positions: &[[f64; 3]], layer: f64) -> Vec<u32> {
    let Patches { of_face, is_turned, is_orientable } = topology.patches();
    // The faces of each patch, one patch after the other.
    let mut order: Vec<u32> = (0..of_face.len() as u32).filter(|&face| of_face[face as usize] != NONE).collect();
    order.sort_by_key(|&face| of_face[face as usize]);
    let patches: Vec<&[u32]> = order.chunk_by(|&a, &b| of_face[a as usize] == of_face[b as usize]).collect();
    let at = |vertex: u32| DVec3::from_array(positions[vertex as usize]);
    let corners = |face: u32| topology.corners(face).map(at);
    // Faces that lie in one another are one layer, whatever rounding does.
    let largest = order.iter().flat_map(|&face| corners(face)).map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let layer = layer.max(ROUNDING * largest);
    let in_order = |face: u32| {
        let mut vertices = topology.corners(face);
        vertices.sort_unstable();
        vertices.map(at)
    };

    let turns_all: Vec<Option<bool>> = patches
        .par_iter()
        .map(|faces| {
            let number = of_face[faces[0] as usize] as usize;
            if !is_orientable[number] {
                return None;
            }
            let of_border = |&edge: &u32| topology.edges()[edge as usize].faces.len() != 2;
            let is_open = faces.iter().any(|&face| topology.edges_of_face(face).iter().any(of_border));
            let origin = corners(faces[0])[0];
            // Twice the areas with their normals as the patch would have them, and six times its volume.
            let (mut areas, mut volume, mut balance) = (Vec::with_capacity(faces.len()), 0.0, 0.0);
            for &face in *faces {
                let area = area_vector(corners(face));
                let a = corners(face)[0];
                let sign = if is_turned[face as usize] { -1.0 } else { 1.0 };
                areas.push(area * sign);
                volume += (a - origin).dot(area) * sign;
                balance += area.length() * sign;
            }
            if !is_open && volume != 0.0 {
                return Some(volume < 0.0);
            }
            let votes = votes(tree, faces, &areas, in_order, layer);
            Some(if votes == 0 { balance < 0.0 } else { votes < 0 })
        })
        .collect();

    let mut inward: Vec<u32> = Vec::new();
    for (faces, all) in patches.iter().zip(turns_all) {
        let Some(all) = all else { continue };
        inward.extend(faces.iter().filter(|&&face| is_turned[face as usize] != all));
    }
    inward.sort_unstable();
    inward
}

/// What rays say for the side to which the area vectors of the faces point, less what they say against it. `corners` come in an order
/// that does not depend on how a face is turned.
fn votes(tree: &TriangleTree, faces: &[u32], areas: &[DVec3], corners: impl Fn(u32) -> [DVec3; 3], layer: f64) -> i64 {
    let mut sum = 0.0;
    let sums: Vec<f64> = areas
        .iter()
        .map(|area| {
            sum += area.length();
            sum
        })
        .collect();
    let n = faces.len().clamp(FEWEST, MOST);
    (0..n)
        .map(|k| {
            // Places are spread evenly by area, in the triangle and in direction along the R4 sequence (Roberts 2018).
            let at = sums.partition_point(|&s| s <= sum * (k as f64 + 0.5) / n as f64).min(faces.len() - 1);
            let [u, v, along, across] = [0.856_674_883_9, 0.733_891_856_6, 0.628_706_721_0, 0.538_596_890_5]
                .map(|step: f64| ((k + 1) as f64 * step).fract());
            // The same rays, whichever way the face is turned.
            let [a, b, c] = corners(faces[at]);
            let Some(normal) = area_vector([a, b, c]).try_normalize() else { return 0 };
            let root = u.sqrt();
            let place = a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v);
            let (one, other) = normal.any_orthonormal_pair();
            let direction = normal + (one * (2.0 * along - 1.0) + other * (2.0 * across - 1.0)) * LEAN;
            let n_layers = |direction| n_layers(tree, faces[at], place, direction, layer);
            let (front, behind) = (n_layers(direction), n_layers(-direction));
            let parity = |n: usize| if n.is_multiple_of(2) { 1 } else { -1 };
            let vote = parity(front) - parity(behind) + i64::from(front == 0) - i64::from(behind == 0);
            if normal.dot(areas[at]) < 0.0 { -vote } else { vote }
        })
        .sum()
}

/// Twice the area with the normal; zero for a face whose area is a rounding error, and whose normal therefore means nothing.
fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    let area = (b - a).cross(c - a);
    let is_sound = area.length() > ROUNDING * (b - a).length() * (c - a).length();
    if is_sound { area } else { DVec3::ZERO }
}

/// The number of layers that a ray from a place on a face meets.
fn n_layers(tree: &TriangleTree, face: u32, origin: DVec3, direction: DVec3, layer: f64) -> usize {
    let step = layer / direction.length();
    let mut last = 0.0;
    let new = |hit: &&super::RayHit| {
        let is_new = hit.face != face && hit.t - last > step;
        if is_new {
            last = hit.t;
        }
        is_new
    };
    tree.hits(origin.to_array(), direction.to_array()).iter().filter(new).count()
}
