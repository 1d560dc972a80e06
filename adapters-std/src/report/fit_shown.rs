//! A fit beside its scan, ready for pictures: both upright and in millimetres, their distance, and its colours on the fit.

use super::cloud::point_radius;
use super::{ColourBar, ColourScale, rounded_up};
use crate::Error;
use crate::measure::distance::Target;
use crate::measure::scan_distance::{FARTHEST, ScanDistance};
use crate::mesh::Mesh;
use crate::register::scan_fit::ScanFit;
use crate::spatial::PointTree;

/// What the distance is called wherever it is told.
pub const DISTANCE: &str = "distance of the scan's points from the fit";

/// Points of a cloud tell of the fit around them as far as twice the spacing of the points, here over [`point_radius`], which is three quarters of it.
const REACH: f64 = 2.0 / 0.75;

/// A fit and its scan in the frame of the model, so that faces look at the viewer.
#[derive(Debug, Clone, PartialEq)]
pub struct FitShown {
    /// The scan.
    pub scan: Mesh,
    /// The fitted model.
    pub fitted: Mesh,
    /// The distances of the points of the scan from the fit.
    pub distance: ScanDistance,
}

/// The distance on the vertices of the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceMap {
    /// Of each vertex, mm; NaN where there is no scan.
    pub values: Vec<f64>,
    /// Their colours: nine tenths of the numbers are on the scale.
    pub scale: ColourScale,
}

impl FitShown {
    /// `scan` and the mesh of `fit` in the unit and frame of the scan.
    ///
    /// # Errors
    /// [`Error::Input`] for a scan that is not sound.
    pub fn new(fit: &ScanFit, scan: &Mesh, fitted: &Mesh) -> Result<Self, Error> {
        let r = &fit.placement.rotation;
        let turned = |n: &[f64; 3]| std::array::from_fn(|axis| (0..3).map(|row| r[row][axis] * n[row]).sum());
        let moved = |mesh: &Mesh| Mesh {
            positions: mesh.positions.iter().map(|p| fit.placement.inverse_point(*p)).collect(),
            normals: mesh.normals.iter().map(turned).collect(),
            ..mesh.clone()
        };
        let (scan, fitted) = (moved(scan), moved(fitted));
        Ok(FitShown { distance: ScanDistance::new(&scan, &fitted)?, scan, fitted })
    }

    /// The distance on the vertices of the fit: from the surface of a scan that has one; of a cloud, whose surface is not known, the mean of the
    /// distances of the points around, the nearer ones counting more.
    ///
    /// # Errors
    /// [`Error::Input`] for a scan that is not sound.
    pub fn map(&self) -> Result<DistanceMap, Error> {
        let values = if self.scan.faces.is_empty() { self.by_points()? } else { self.by_surface()? };
        let mut sorted: Vec<f64> = values.iter().copied().filter(|d| d.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let limit = rounded_up(sorted.get(sorted.len() * 9 / 10).copied().unwrap_or(1.0).max(1e-3));
        Ok(DistanceMap { values, scale: ColourScale::sequential(0.0, limit) })
    }

    /// Where the closest point is on the boundary of the scan there is none.
    fn by_surface(&self) -> Result<Vec<f64>, Error> {
        let found = Target::new(&self.scan)?.distances(&self.fitted.positions);
        let number = |at: &crate::measure::distance::PointDistance| {
            if at.at_boundary || at.distance > FARTHEST { f64::NAN } else { at.distance }
        };
        Ok(found.iter().map(number).collect())
    }

    fn by_points(&self) -> Result<Vec<f64>, Error> {
        let ScanDistance { distances, feet, .. } = &self.distance;
        if feet.is_empty() {
            return Ok(vec![f64::NAN; self.fitted.positions.len()]);
        }
        let (tree, reach) = (PointTree::new(feet)?, REACH * point_radius(feet));
        let mean = |vertex: &[f64; 3]| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for near in tree.within(*vertex, reach) {
                let weight = (1.0 - (near.distance / reach).powi(2)).max(1e-6);
                sum += weight * distances[near.index as usize];
                weights += weight;
            }
            // NaN without points.
            sum / weights
        };
        Ok(self.fitted.positions.iter().map(mean).collect())
    }

    /// The points of the scan that are not far aside of the fit: those of the head that the face is of, of a body without the body.
    pub fn scan_around(&self) -> impl Iterator<Item = [f64; 3]> + Clone + '_ {
        /// Over the distance of the farthest vertex of the fit from its middle.
        const AROUND: f64 = 1.5;
        let (low, high) = self.fitted.bounding_box().unwrap_or_default();
        let middle = glam::DVec3::from_array([0, 1, 2].map(|axis| low[axis] / 2.0 + high[axis] / 2.0));
        let away = move |p: &[f64; 3]| middle.distance(glam::DVec3::from_array(*p));
        let radius = AROUND * self.fitted.positions.iter().map(away).fold(0.0, f64::max);
        self.scan.positions.iter().copied().filter(move |p| away(p) <= radius)
    }
}

impl DistanceMap {
    /// The colour of every vertex of the fit.
    pub fn colours(&self) -> Vec<[u8; 3]> {
        self.scale.colours(&self.values)
    }

    /// The legend of these colours.
    pub fn bar(&self) -> ColourBar {
        ColourBar { missing_label: "no scan".into(), ..ColourBar::of(self.scale, "distance, mm", &self.values) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet of so many steps of 2 mm to the right and 20 up, at a height.
    fn sheet(columns: u32, z: f64) -> Mesh {
        let vertex = |k: u32| [f64::from(k % (columns + 1)) * 2.0, f64::from(k / (columns + 1)) * 2.0, z];
        let squares = (0..20 * columns).map(|k| (columns + 1) * (k / columns) + k % columns);
        let faces =
            squares.flat_map(|v| [[v, v + 1, v + columns + 2], [v, v + columns + 2, v + columns + 1]]).collect();
        Mesh { positions: (0..21 * (columns + 1)).map(vertex).collect(), faces, ..Mesh::default() }
    }

    /// Mesh and cloud: the same numbers where there is scan, none where there is not.
    #[test]
    fn what_the_scan_does_not_cover_has_no_number_of_meshes_and_of_clouds() {
        let fitted = sheet(20, 0.0);
        let mesh = sheet(10, 0.5);
        let cloud = Mesh { faces: Vec::new(), ..mesh.clone() };
        for scan in [mesh, cloud] {
            let shown = FitShown {
                distance: ScanDistance::new(&scan, &fitted).expect("distances"),
                scan,
                fitted: fitted.clone(),
            };
            let map = shown.map().expect("a map");
            for (p, value) in fitted.positions.iter().zip(&map.values) {
                let inside = p[1] > 1.0 && p[1] < 39.0 && p[0] > 1.0;
                assert!(!(inside && p[0] < 19.0) || (value - 0.5).abs() < 1e-9, "{p:?} {value}");
                assert!(p[0] < 25.0 || value.is_nan(), "{p:?} {value}");
            }
            assert!(map.bar().missing && map.bar().missing_label == "no scan");
            assert_eq!(shown.scan_around().count(), 21 * 11);
        }
    }
}
