//! What the faces of a scan tell, however they are stored: borders, normals, and which side of them is the outer one.
//!
//! Files divide surfaces: each triangle with corners of its own, one vertex for each corner of a texture, both sides of a sheet, pieces that
//! look inwards. The borders and normals of a fit must not depend on that.

use std::collections::{HashMap, HashSet};

use glam::DVec3;
use rayon::prelude::*;

use super::target::Region;
use crate::mesh::topology::EdgeClass;
use crate::mesh::{Mesh, Topology};

/// A patch with less than this share of the points is not judged by itself.
const LEAST_SHARE: f64 = 0.02;
/// Mean cosine between normals and the directions out of the head from which on it is clear what is outside; 0.8 is usual.
const CLEAR: f64 = 0.3;
/// The same of a cloud's own normals, of which each may have its own side.
const CLEAR_CLOUD: f64 = 0.5;
/// How far behind the middle of the landmarks the directions begin, in radii of the region.
const BEHIND: f64 = 0.5;

/// Normals and borders of a scan with faces.
pub(super) struct ScanSurface {
    /// Twice the sum of the area vectors of the faces of each vertex.
    pub area_vectors: Vec<[f64; 3]>,
    /// Whether each vertex lies on an edge of one face only.
    pub at_boundary: Vec<bool>,
    /// The number of the connected patch of each vertex, within which sides agree; none without faces.
    pub patches: Vec<Option<u32>>,
}

impl ScanSurface {
    /// Of a mesh with faces. Vertices at equal positions count as one, faces on equal vertices too, and within a patch all are turned as most are.
    pub(super) fn new(scan: &Mesh) -> Self {
        let n = scan.positions.len();
        let first = first_at_place(&scan.positions);
        let mut faces: Vec<[u32; 3]> = scan.faces.iter().map(|face| face.map(|v| first[v as usize])).collect();
        let mut topology = Topology::new(n, &faces);
        if topology.count(EdgeClass::NonManifold) > 0 {
            let mut seen = HashSet::with_capacity(faces.len());
            faces.retain(|&face| {
                let mut corners = face;
                corners.sort_unstable();
                seen.insert(corners)
            });
            topology = Topology::new(n, &faces);
        }
        let patches = topology.patches();
        if topology.count(EdgeClass::Inconsistent) > 0 {
            // Faces that agree with the first of the patch, less those that do not.
            let mut balance = vec![0i64; patches.is_orientable.len()];
            let of_face = || patches.of_face.iter().zip(&patches.is_turned);
            for (&patch, &is_turned) in of_face() {
                if let Some(balance) = balance.get_mut(patch as usize) {
                    *balance += if is_turned { -1 } else { 1 };
                }
            }
            for (face, (&patch, &is_turned)) in faces.iter_mut().zip(of_face()) {
                let known = balance.get(patch as usize).zip(patches.is_orientable.get(patch as usize));
                if known.is_some_and(|(&balance, &orientable)| orientable && is_turned == (balance >= 0)) {
                    face.swap(1, 2);
                }
            }
        }
        let mut patch_of = vec![None; n];
        for (face, &patch) in faces.iter().zip(&patches.of_face) {
            if (patch as usize) < patches.is_orientable.len() {
                face.iter().for_each(|&vertex| patch_of[vertex as usize] = Some(patch));
            }
        }
        let at_boundary = on_borders(n, &topology);
        let mesh = Mesh { positions: scan.positions.clone(), faces, ..Mesh::default() };
        let area_vectors = mesh.area_vectors();
        let own = |v: &u32| *v as usize;
        ScanSurface {
            area_vectors: first.iter().map(|v| area_vectors[own(v)]).collect(),
            at_boundary: first.iter().map(|v| at_boundary[own(v)]).collect(),
            patches: first.iter().map(|v| patch_of[own(v)]).collect(),
        }
    }
}

/// The first vertex at the position of each.
fn first_at_place(positions: &[[f64; 3]]) -> Vec<u32> {
    // Plus zero: 0 and -0 are one place.
    let place = |(vertex, p): (usize, &[f64; 3])| (p.map(|x| (x + 0.0).to_bits()), vertex as u32);
    let mut places: Vec<([u64; 3], u32)> = positions.iter().enumerate().map(place).collect();
    places.par_sort_unstable();
    let mut first = vec![0; positions.len()];
    for same in places.chunk_by(|a, b| a.0 == b.0) {
        same.iter().for_each(|&(_, vertex)| first[vertex as usize] = same[0].1);
    }
    first
}

/// Whether each vertex lies on an edge of one face only; nothing for a cloud.
pub(super) fn boundary_vertices(mesh: &Mesh) -> Vec<bool> {
    if mesh.faces.is_empty() {
        return Vec::new();
    }
    on_borders(mesh.positions.len(), &Topology::new(mesh.positions.len(), &mesh.faces))
}

fn on_borders(n_vertices: usize, topology: &Topology) -> Vec<bool> {
    let mut at_boundary = vec![false; n_vertices];
    for edge in topology.edges() {
        if edge.faces.len() == 1 {
            edge.vertices.iter().for_each(|&vertex| at_boundary[vertex as usize] = true);
        }
    }
    at_boundary
}

/// Cosine of the angle between a normal and the direction out of the head; `point` is in mm about the centre of the region.
fn outwardness(point: &[f64; 3], normal: &[f64; 3], region: &Region) -> f64 {
    let out = DVec3::from_array(*point) + BEHIND * region.radius * DVec3::from_array(region.front);
    out.normalize_or_zero().dot(DVec3::from_array(*normal))
}

/// Turns the normals of those patches that clearly look inwards; small ones as most of the others.
pub(super) fn turn_outwards(points: &[[f64; 3]], normals: &mut [[f64; 3]], patches: &[Option<u32>], region: &Region) {
    let mut sums: HashMap<u32, (f64, usize)> = HashMap::new();
    for ((point, normal), patch) in points.iter().zip(&*normals).zip(patches) {
        if let Some(patch) = patch {
            let (sum, n) = sums.entry(*patch).or_default();
            *sum += outwardness(point, normal, region);
            *n += 1;
        }
    }
    let least = LEAST_SHARE * points.len() as f64;
    let is_small = |n: usize| (n as f64) < least;
    let looks_inwards = |(sum, n): (f64, usize)| sum < -CLEAR * n as f64;
    let large = || sums.values().filter(|(_, n)| !is_small(*n));
    let n_inwards: usize = large().filter(|patch| looks_inwards(**patch)).map(|(_, n)| n).sum();
    let most_look_inwards = 2 * n_inwards > large().map(|(_, n)| n).sum();
    let is_turned = |patch: &u32| match sums.get(patch) {
        Some(&(_, n)) if is_small(n) => most_look_inwards,
        Some(&patch) => looks_inwards(patch),
        None => false,
    };
    for (normal, patch) in normals.iter_mut().zip(patches) {
        if patch.as_ref().is_some_and(is_turned) {
            *normal = normal.map(|x| -x);
        }
    }
}

/// The normals that a cloud came with, turned outwards as a whole; none when they do not agree about the outside, or are zero.
pub(super) fn agreeing(points: &[[f64; 3]], normals: Vec<[f64; 3]>, region: &Region) -> Option<Vec<[f64; 3]>> {
    let sum: f64 = points.iter().zip(&normals).map(|(point, normal)| outwardness(point, normal, region)).sum();
    let mean = sum / points.len().max(1) as f64;
    if mean >= CLEAR_CLOUD {
        Some(normals)
    } else if mean <= -CLEAR_CLOUD {
        Some(normals.into_iter().map(|normal| normal.map(|x| -x)).collect())
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{face, region};
    use super::*;

    fn turned(scan: &Mesh) -> Vec<[f64; 3]> {
        let surface = ScanSurface::new(scan);
        let mut normals: Vec<[f64; 3]> = surface.area_vectors.into_iter().map(crate::mesh::unit).collect();
        turn_outwards(&scan.positions, &mut normals, &surface.patches, &region());
        normals
    }

    /// Largest distance of normals.
    fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
        let distance = |(p, q): (&[f64; 3], &[f64; 3])| DVec3::from_array(*p).distance(DVec3::from_array(*q));
        a.iter().zip(b).map(distance).fold(0.0, f64::max)
    }

    #[test]
    fn sound_scans_keep_their_normals_and_borders() {
        let scan = face(&[], &[]);
        assert_eq!(turned(&scan), scan.vertex_normals());
        assert_eq!(ScanSurface::new(&scan).at_boundary, boundary_vertices(&scan));
    }

    #[test]
    fn surfaces_do_not_depend_on_how_they_are_stored() {
        let scan = face(&[], &[]);
        let expected = scan.vertex_normals();
        let mut inwards = scan.clone();
        inwards.faces.iter_mut().for_each(|face| face.swap(0, 1));
        assert!(apart(&turned(&inwards), &expected) < 1e-9);
        let mut mixed = scan.clone();
        mixed.faces.iter_mut().skip(1).step_by(2).for_each(|face| face.swap(0, 1));
        assert!(apart(&turned(&mixed), &expected) < 1e-9);
        let mut two_sided = scan.clone();
        two_sided.faces.extend(scan.faces.iter().map(|&[a, b, c]| [b, a, c]));
        assert!(apart(&turned(&two_sided), &expected) < 1e-9);
        // Each triangle with corners of its own.
        let corners: Vec<u32> = scan.faces.iter().flatten().copied().collect();
        let loose = Mesh {
            positions: corners.iter().map(|&v| scan.positions[v as usize]).collect(),
            faces: (0..scan.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect(),
            ..Mesh::default()
        };
        let (of_loose, border) = (ScanSurface::new(&loose), boundary_vertices(&scan));
        assert!(boundary_vertices(&loose).iter().all(|at_boundary| *at_boundary));
        for (k, &v) in corners.iter().enumerate() {
            assert_eq!(of_loose.at_boundary[k], border[v as usize]);
            assert!(apart(&[crate::mesh::unit(of_loose.area_vectors[k])], &expected[v as usize..=v as usize]) < 1e-9);
        }
    }

    /// Pieces are turned one by one, scraps as most are, and what has no clear side stays.
    #[test]
    fn pieces_are_turned_one_by_one() {
        let scan = face(&[], &[]);
        let expected = scan.vertex_normals();
        let left = |v: usize| scan.positions[v][0] > 0.0;
        let mut normals = expected.clone();
        let patches: Vec<Option<u32>> =
            (0..normals.len()).map(|v| Some(if v < 5 { 2 } else { u32::from(left(v)) })).collect();
        normals.iter_mut().enumerate().filter(|(v, _)| left(*v) && *v >= 5).for_each(|(_, n)| *n = n.map(|x| -x));
        turn_outwards(&scan.positions, &mut normals, &patches, &region());
        assert_eq!(normals[5..], expected[5..]);
        let mut inwards: Vec<[f64; 3]> = expected.iter().map(|n| n.map(|x| -x)).collect();
        turn_outwards(&scan.positions, &mut inwards, &patches, &region());
        assert_eq!(inwards, expected);
        let aside: Vec<[f64; 3]> =
            expected.iter().enumerate().map(|(v, n)| if v.is_multiple_of(2) { *n } else { n.map(|x| -x) }).collect();
        let mut same = aside.clone();
        turn_outwards(&scan.positions, &mut same, &vec![Some(0); aside.len()], &region());
        assert_eq!(same, aside);
    }

    #[test]
    fn own_normals_of_a_cloud_count_when_they_agree() {
        let scan = face(&[], &[]);
        let own = scan.vertex_normals();
        let negated: Vec<[f64; 3]> = own.iter().map(|n| n.map(|x| -x)).collect();
        let mixed = own.iter().zip(&negated).enumerate().map(|(k, (a, b))| if k % 3 == 0 { *b } else { *a }).collect();
        let of = |normals| agreeing(&scan.positions, normals, &region());
        assert_eq!(of(own.clone()), Some(own.clone()));
        assert_eq!(of(negated), Some(own.clone()));
        assert_eq!(of(mixed), None);
        assert_eq!(of(vec![[0.0; 3]; own.len()]), None);
    }
}
