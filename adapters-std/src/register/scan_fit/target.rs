//! A scan as the target of a fit: the points near the face, in millimetres about their landmarks, thinned, with normals.

use glam::DVec3;
use rayon::prelude::*;

use super::sides::{ScanSurface, agreeing, turn_outwards};
use super::suspects::figure;
use crate::Error;
use crate::mesh::Mesh;
use crate::mesh::sampling::VoxelCells;
use crate::spatial::{CloudNormalOptions, Outside, PointTree, cloud_normals};

/// What remains of a scan.
pub(super) struct Target {
    /// Points, mm, about the centre.
    pub points: Vec<[f64; 3]>,
    /// Unit normals, smoothed over the neighbours; zero where these do not agree, as in hair.
    pub normals: Vec<[f64; 3]>,
    /// Whether the surface of the scan ends at the point.
    pub at_boundary: Vec<bool>,
    /// Search among the points.
    pub tree: PointTree,
    /// Side of the cells of which each has one point, mm.
    pub cell: f64,
}

/// Which part of a scan is looked at, in its own unit and frame.
pub(super) struct Region {
    /// Length of the scan's unit, mm.
    pub unit_mm: f64,
    /// Middle of the landmarks.
    pub centre: [f64; 3],
    /// Farthest points, mm from the centre.
    pub radius: f64,
    /// Direction in which the face looks.
    pub front: [f64; 3],
}

/// Distance of the position towards which normals of clouds are turned, in radii of the region.
const VIEWPOINT: f64 = 10.0;
/// Points that a fit needs.
const FEWEST_POINTS: usize = 100;
/// Radius over which normals are smoothed, in cells.
const NEIGHBOURHOOD: f64 = 2.0;
/// Least share of the cells where the normals of a mesh must agree. Where its noise is as large as its triangles they agree nowhere, though its points
/// have a surface: then it is taken for a cloud. Shares: the shared scans without hair 0.92 to 0.97, with hair 0.65, simulated hair from 0.52, noise of
/// 1.5 mm on each axis of scan 00 0.46, of 2 mm 0.04.
const LEAST_COHERENT: f64 = 0.3;

impl Target {
    /// The part of `scan` in `region`: the mean point of each cell of side `cell` mm, of larger cells when there are more than `most`.
    ///
    /// Normals are those of the faces about the cell, unless these agree almost nowhere; a cloud keeps its own when they agree about the outside, else it gets those of its
    /// neighbourhoods, turned to where the face looks.
    ///
    /// # Errors
    /// [`Error::Input`] when no point lies in the region, or too few.
    pub(super) fn new(scan: &Mesh, region: &Region, cell: f64, most: usize, coherence: f64) -> Result<Self, Error> {
        let centre = DVec3::from_array(region.centre);
        let placed = |p: &[f64; 3]| ((DVec3::from_array(*p) - centre) * region.unit_mm).to_array();
        let inside: Vec<u32> = (0..scan.positions.len() as u32)
            .filter(|&v| DVec3::from_array(placed(&scan.positions[v as usize])).length() <= region.radius)
            .collect();
        if inside.is_empty() {
            return Err(Error::input(format!(
                "no point of the scan lies within {} mm of its landmarks: are the landmarks in the frame and unit of the scan?",
                figure(region.radius, 0)
            )));
        }
        if inside.len() < FEWEST_POINTS {
            return Err(Error::input(format!(
                "{} points of the scan lie within {:.0} mm of its landmarks, too few for a fit: give a scan with at least {FEWEST_POINTS} there",
                inside.len(),
                region.radius
            )));
        }
        let positions: Vec<[f64; 3]> = inside.iter().map(|&v| placed(&scan.positions[v as usize])).collect();
        let mut cell = cell;
        let mut cells = VoxelCells::new(&positions, cell)?;
        let mut n_cells = cells.iter().count();
        while n_cells > most {
            cell *= 1.05 * (n_cells as f64 / most as f64).sqrt();
            cells = VoxelCells::new(&positions, cell)?;
            n_cells = cells.iter().count();
        }
        let surface = (!scan.faces.is_empty()).then(|| ScanSurface::new(scan));
        let mut points = Vec::with_capacity(n_cells);
        let mut at_boundary = Vec::with_capacity(n_cells);
        let mut pieces: Vec<Piece> = Vec::with_capacity(n_cells);
        for (cell, members) in cells.iter().enumerate() {
            let (mut n, mut sum, mut n_border, start) = (0, DVec3::ZERO, 0, pieces.len());
            for member in members {
                let vertex = inside[member as usize] as usize;
                n += 1;
                sum += DVec3::from_array(positions[member as usize]);
                let (patch, normal, is_border) = match &surface {
                    Some(surface) => {
                        (surface.patches[vertex], surface.area_vectors[vertex], surface.at_boundary[vertex])
                    }
                    None => (None, scan.normals.get(vertex).copied().map(crate::mesh::unit).unwrap_or_default(), false),
                };
                n_border += usize::from(is_border);
                let normal = DVec3::from_array(normal);
                match pieces[start..].iter_mut().find(|piece| piece.patch == patch) {
                    Some(piece) => piece.normal += normal,
                    None => pieces.push(Piece { cell, patch, normal }),
                }
            }
            points.push((sum / f64::from(n)).to_array());
            at_boundary.push(2 * n_border >= n as usize);
        }
        let of_neighbourhoods = || -> Result<Vec<[f64; 3]>, Error> {
            let viewpoint = DVec3::from_array(region.front) * VIEWPOINT * region.radius;
            let outside = Outside::Towards(viewpoint.to_array());
            Ok(cloud_normals(&points, &CloudNormalOptions { outside, ..CloudNormalOptions::default() })?.normals)
        };
        let tree = PointTree::new(&points)?;
        let smooth = |normals: &[[f64; 3]]| smoothed(&tree, &points, normals, NEIGHBOURHOOD * cell, coherence);
        let normals = if surface.is_some() {
            let of_faces = smooth(&normals_of_pieces(&pieces, &points, region));
            let n_coherent = of_faces.iter().filter(|normal| **normal != [0.0; 3]).count();
            if n_coherent as f64 >= LEAST_COHERENT * of_faces.len() as f64 {
                of_faces
            } else {
                at_boundary.fill(false);
                smooth(&of_neighbourhoods()?)
            }
        } else {
            let own = Some(&scan.normals).filter(|normals| !normals.is_empty());
            let picked = || pieces.iter().map(|piece| piece.normal.normalize_or_zero().to_array()).collect();
            let normals = match own.and_then(|_| agreeing(&points, picked(), region)) {
                Some(normals) => normals,
                None => of_neighbourhoods()?,
            };
            smooth(&normals)
        };
        Ok(Target { tree, points, normals, at_boundary, cell })
    }
}

/// What one connected patch of a scan contributes to a cell.
struct Piece {
    cell: usize,
    patch: Option<u32>,
    /// Sum of the area vectors of its vertices. Not made of unit vectors: over a patch of noisy faces the areas cancel what is noise.
    normal: DVec3,
}

/// The unit normal of each cell, its patches turned outwards.
fn normals_of_pieces(pieces: &[Piece], points: &[[f64; 3]], region: &Region) -> Vec<[f64; 3]> {
    let places: Vec<[f64; 3]> = pieces.iter().map(|piece| points[piece.cell]).collect();
    let patches: Vec<Option<u32>> = pieces.iter().map(|piece| piece.patch).collect();
    let mut turned: Vec<[f64; 3]> = pieces.iter().map(|piece| crate::mesh::unit(piece.normal.to_array())).collect();
    turn_outwards(&places, &mut turned, &patches, region);
    let mut sums = vec![DVec3::ZERO; points.len()];
    for (piece, turned) in pieces.iter().zip(turned) {
        sums[piece.cell] += DVec3::from_array(turned) * piece.normal.length();
    }
    sums.into_iter().map(|sum| crate::mesh::unit(sum.to_array())).collect()
}

/// Mean normals of the points within `radius` of each; zero where their mean is shorter than `coherence`.
fn smoothed(tree: &PointTree, points: &[[f64; 3]], normals: &[[f64; 3]], radius: f64, coherence: f64) -> Vec<[f64; 3]> {
    let mean = |point: &[f64; 3]| {
        let near = tree.within(*point, radius);
        let sum: DVec3 = near.iter().map(|near| DVec3::from_array(normals[near.index as usize])).sum();
        let mean = sum / near.len().max(1) as f64;
        if mean.length() >= coherence { mean.normalize_or_zero().to_array() } else { [0.0; 3] }
    };
    points.par_iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::super::samples::{face, region};
    use super::*;

    fn cloud() -> Mesh {
        Mesh { faces: Vec::new(), ..face(&[], &[]) }
    }

    fn made(scan: &Mesh, region: &Region, cell: f64, most: usize) -> Target {
        Target::new(scan, region, cell, most, 0.9).expect("a target")
    }

    #[test]
    fn points_are_thinned_to_cells_and_to_a_number() {
        let scan = cloud();
        let all = made(&scan, &region(), 1e-3, 10_000);
        assert_eq!((all.points.len(), all.cell), (scan.positions.len(), 1e-3));
        let fewer = made(&scan, &region(), 1e-3, 200);
        assert!(fewer.points.len() <= 200 && fewer.points.len() > 50 && fewer.cell > 5.0, "{}", fewer.points.len());
        let cells: std::collections::HashSet<[i64; 3]> = {
            let low: [f64; 3] = std::array::from_fn(|k| scan.positions.iter().map(|p| p[k]).fold(f64::MAX, f64::min));
            let cell = |p: &[f64; 3]| std::array::from_fn(|k| ((p[k] - low[k]) / fewer.cell).floor() as i64);
            fewer.points.iter().map(cell).collect()
        };
        assert_eq!(cells.len(), fewer.points.len());
    }

    #[test]
    fn only_the_region_counts_in_its_unit() {
        let mut scan = cloud();
        let n = made(&scan, &region(), 2.5, 6000).points.len();
        scan.positions.push([0.0, 0.0, 900.0]);
        assert_eq!(made(&scan, &region(), 2.5, 6000).points.len(), n);
        // The same in metres about a centre elsewhere.
        scan.positions.iter_mut().for_each(|p| *p = [p[0] / 1e3 + 5.0, p[1] / 1e3, p[2] / 1e3]);
        let metres = Region { unit_mm: 1e3, centre: [5.0, 0.0, 0.0], ..region() };
        let there = made(&scan, &metres, 2.5, 6000);
        assert!(there.points.len().abs_diff(n) < n / 50, "{} {n}", there.points.len());
        let elsewhere = Region { centre: [9.0, 0.0, 0.0], ..metres };
        let said = Target::new(&scan, &elsewhere, 2.5, 6000, 0.9).err().expect("refused").to_string();
        assert!(said.contains("no point of the scan lies within 200 mm") && said.contains("frame and unit"), "{said}");
    }

    #[test]
    fn clouds_get_normals_towards_the_front() {
        let scan = face(&[], &[]);
        let of_faces = scan.vertex_normals();
        let check = |target: &Target| {
            let tree = PointTree::new(&scan.positions).expect("points");
            let agrees = |(p, n): (&[f64; 3], &[f64; 3])| {
                let own = of_faces[tree.nearest(*p).index as usize];
                DVec3::from_array(own).dot(DVec3::from_array(*n)) > 0.7
            };
            let there: Vec<bool> =
                target.points.iter().zip(&target.normals).filter(|(_, n)| **n != [0.0; 3]).map(agrees).collect();
            let right = there.iter().filter(|right| **right).count();
            assert!(
                there.len() > target.points.len() / 2 && right > there.len() * 19 / 20,
                "{right} of {}",
                there.len()
            );
        };
        check(&made(&cloud(), &region(), 2.5, 6000));
        // A face that looks down -z, and its region with it.
        let back = |p: &[f64; 3]| [-p[0], p[1], -p[2]];
        let turned = Mesh { positions: cloud().positions.iter().map(back).collect(), ..Mesh::default() };
        let mut target = made(&turned, &Region { front: [0.0, 0.0, -1.0], ..region() }, 2.5, 6000);
        target.points.iter_mut().chain(&mut target.normals).for_each(|v| *v = back(v));
        check(&target);
    }

    #[test]
    fn a_mesh_whose_triangles_say_nothing_is_a_cloud() {
        let n = cloud().positions.len() as u32;
        let faces =
            (0..n).map(|v| [v, (v * 769 + 5) % n, (v * 1291 + 7) % n]).filter(|[a, b, c]| a != b && b != c && c != a);
        let tangled = made(&Mesh { faces: faces.collect(), ..cloud() }, &region(), 2.5, 6000);
        let of_cloud = made(&cloud(), &region(), 2.5, 6000);
        assert_eq!((tangled.normals, tangled.at_boundary), (of_cloud.normals, of_cloud.at_boundary));
        // Another mesh keeps its own.
        assert_ne!(made(&face(&[], &[]), &region(), 2.5, 6000).normals, made(&cloud(), &region(), 2.5, 6000).normals);
    }

    #[test]
    fn normals_that_do_not_agree_are_dropped() {
        let points: Vec<[f64; 3]> = (0..100).map(|k| [f64::from(k % 10), f64::from(k / 10), 0.0]).collect();
        let hairy = |k: usize| {
            if points[k][0] < 5.0 {
                [0.0, 0.0, 1.0]
            } else {
                [1.0, 0.0, 0.0].map(|x: f64| if k.is_multiple_of(2) { x } else { -x })
            }
        };
        let normals: Vec<[f64; 3]> = (0..100).map(hairy).collect();
        let smooth = smoothed(&PointTree::new(&points).expect("points"), &points, &normals, 2.0, 0.9);
        assert_eq!((smooth[52], smooth[58]), ([0.0, 0.0, 1.0], [0.0; 3]));
    }
}
