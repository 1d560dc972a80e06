//! How far a scan is from what was fitted to it: from each point of the scan to the surface of the fit, so that the spacing of the points does not
//! show and a cloud has the figures of the mesh that it was.

use crate::Error;
use crate::mesh::Mesh;
use crate::spatial::TriangleTree;

/// Points of a scan that are farther from the fit than this show something else, mm: it is where the first pairs of a fit end.
pub const FARTHEST: f64 = 20.0;

/// The distances of the points of a scan from a fit, mm. A point counts when its closest point is not on the boundary of the fit, beyond which the
/// scan shows what the model does not have, and not farther than [`FARTHEST`].
#[derive(Debug, Clone, PartialEq)]
pub struct ScanDistance {
    /// Of each point that counts, in the order of the scan.
    pub distances: Vec<f64>,
    /// The closest point of the fit of each of these.
    pub feet: Vec<[f64; 3]>,
    /// The distances from the smallest.
    pub sorted: Vec<f64>,
}

impl ScanDistance {
    /// Of a scan and the fit, both in mm and in one frame. Vertices that no face of a mesh uses are no points of it.
    ///
    /// Determinism: the same bits for any number of threads.
    ///
    /// # Errors
    /// [`Error::Input`] for a scan that fails [`Mesh::check`], and for a fit without triangles.
    pub fn new(scan: &Mesh, fitted: &Mesh) -> Result<Self, Error> {
        scan.check()?;
        let tree = TriangleTree::new(&fitted.positions, &fitted.faces)?;
        let Some((low, high)) = fitted.bounding_box() else { return Err(Error::input("the fit has no vertex")) };
        let mut counts = vec![scan.faces.is_empty(); scan.positions.len()];
        for &vertex in scan.faces.iter().flatten() {
            counts[vertex as usize] = true;
        }
        // Most points of a scan of a whole body are nowhere near.
        let is_near =
            |p: &[f64; 3]| (0..3).all(|axis| p[axis] >= low[axis] - FARTHEST && p[axis] <= high[axis] + FARTHEST);
        let counted = scan.positions.iter().zip(&counts).filter(|(p, counts)| **counts && is_near(p));
        let points: Vec<[f64; 3]> = counted.map(|(p, _)| *p).collect();
        let on_fit = tree.closest_all(&points).into_iter().filter(|at| !at.on_boundary && at.distance <= FARTHEST);
        let (distances, feet): (Vec<f64>, Vec<[f64; 3]>) = on_fit.map(|at| (at.distance, at.point)).unzip();
        let mut sorted = distances.clone();
        sorted.sort_by(f64::total_cmp);
        Ok(ScanDistance { distances, feet, sorted })
    }

    /// Half of the points are within this distance, mm; none: no point counts.
    pub fn median(&self) -> Option<f64> {
        self.quantile(0.5)
    }

    /// The distance within which this share (0 to 1) of the points is, mm.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let rank = (share * self.sorted.len() as f64).ceil() as usize;
        self.sorted.get(rank.saturating_sub(1)).copied()
    }

    /// The mean, mm.
    pub fn mean(&self) -> Option<f64> {
        let n = self.sorted.len();
        (n > 0).then(|| self.sorted.iter().sum::<f64>() / n as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of 100 mm in steps of 10.
    fn sheet(z: f64) -> Mesh {
        let vertex = |k: u32| [f64::from(k % 11) * 10.0, f64::from(k / 11) * 10.0, z];
        let squares = (0..100).map(|k| 11 * (k / 10) + k % 10);
        let faces = squares.flat_map(|v| [[v, v + 1, v + 12], [v, v + 12, v + 11]]).collect();
        Mesh { positions: (0..121).map(vertex).collect(), faces, ..Mesh::default() }
    }

    #[test]
    fn a_cloud_has_the_figures_of_its_mesh_and_its_spacing_does_not_show() {
        let fit = sheet(0.0);
        let mut scan = sheet(2.0);
        // Aside of the fit, too far from it, and a vertex that no face uses.
        scan.positions[0] = [-5.0, -5.0, 2.0];
        scan.positions[60] = [50.0, 50.0, 30.0];
        let found = ScanDistance::new(&scan, &fit).expect("distances");
        // The boundary of the fit is where its outermost vertices are.
        assert_eq!(
            (found.sorted.len(), found.median(), found.quantile(0.95), found.mean()),
            (80, Some(2.0), Some(2.0), Some(2.0))
        );
        let cloud = Mesh { faces: Vec::new(), ..scan.clone() };
        assert_eq!(ScanDistance::new(&cloud, &fit).expect("distances"), found);
        scan.positions.push([45.0, 45.0, 9.0]);
        assert_eq!(ScanDistance::new(&scan, &fit).expect("distances"), found);
        let nothing = ScanDistance::new(&sheet(90.0), &fit).expect("distances");
        assert_eq!((nothing.median(), nothing.mean()), (None, None));
        assert!(ScanDistance::new(&scan, &cloud).is_err() && ScanDistance::new(&Mesh::default(), &fit).is_err());
    }
}
