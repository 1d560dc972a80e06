//! A scan as the target of a fit: the points near the face, in millimetres about their landmarks, thinned, with normals.

use glam::DVec3;
use rayon::prelude::*;

use crate::Error;
use crate::mesh::Mesh;
use crate::mesh::Topology;
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
/// Radius over which normals are smoothed, in cells.
const NEIGHBOURHOOD: f64 = 2.0;

impl Target {
    /// The part of `scan` in `region`: the mean point of each cell of side `cell` mm, of larger cells when there are more than `most`.
    ///
    /// Normals are those of the faces about the cell; a cloud keeps its own, or gets those of its neighbourhoods, turned to where the face looks.
    ///
    /// # Errors
    /// [`Error::Input`] when no point lies in the region.
    pub(super) fn new(scan: &Mesh, region: &Region, cell: f64, most: usize, coherence: f64) -> Result<Self, Error> {
        let centre = DVec3::from_array(region.centre);
        let placed = |p: &[f64; 3]| ((DVec3::from_array(*p) - centre) * region.unit_mm).to_array();
        let inside: Vec<u32> = (0..scan.positions.len() as u32)
            .filter(|&v| DVec3::from_array(placed(&scan.positions[v as usize])).length() <= region.radius)
            .collect();
        if inside.is_empty() {
            return Err(Error::input(format!(
                "no point of the scan lies within {:.0} mm of its landmarks: are the landmarks in the frame and unit of the scan?",
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
        // Not made of unit vectors: over a patch of noisy faces their areas cancel what is noise.
        let of_scan = if scan.faces.is_empty() { scan.normals.clone() } else { scan.area_vectors() };
        let border = boundary_vertices(scan);
        let (mut points, mut normals, mut at_boundary) = (Vec::new(), Vec::new(), Vec::new());
        for members in cells.iter() {
            let (mut n, mut sum, mut normal, mut n_border) = (0, DVec3::ZERO, DVec3::ZERO, 0);
            for member in members {
                let vertex = inside[member as usize] as usize;
                n += 1;
                sum += DVec3::from_array(positions[member as usize]);
                normal += of_scan.get(vertex).copied().map_or(DVec3::ZERO, DVec3::from_array);
                n_border += usize::from(border.get(vertex).copied().unwrap_or(false));
            }
            points.push((sum / n as f64).to_array());
            normals.push(crate::mesh::unit(normal.to_array()));
            at_boundary.push(2 * n_border >= n);
        }
        if of_scan.is_empty() {
            let viewpoint = (DVec3::from_array(region.front) * VIEWPOINT * region.radius).to_array();
            let options = CloudNormalOptions { outside: Outside::Towards(viewpoint), ..CloudNormalOptions::default() };
            normals = cloud_normals(&points, &options)?.normals;
        }
        let tree = PointTree::new(&points)?;
        let normals = smoothed(&tree, &points, &normals, NEIGHBOURHOOD * cell, coherence);
        Ok(Target { tree, points, normals, at_boundary, cell })
    }
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

/// Whether each vertex lies on an edge of one face only; nothing for a cloud.
pub(super) fn boundary_vertices(mesh: &Mesh) -> Vec<bool> {
    if mesh.faces.is_empty() {
        return Vec::new();
    }
    let mut at_boundary = vec![false; mesh.positions.len()];
    for edge in Topology::new(mesh.positions.len(), &mesh.faces).edges() {
        if edge.faces.len() == 1 {
            edge.vertices.iter().for_each(|&vertex| at_boundary[vertex as usize] = true);
        }
    }
    at_boundary
}
