//! A fit beside its scan, ready for pictures: both upright and in millimetres, with the distance of every vertex.

use super::{ColourBar, ColourScale, rounded_up};
use crate::Error;
use crate::measure::distance::Target;
use crate::mesh::Mesh;
use crate::register::scan_fit::ScanFit;

/// A fit and its scan in the frame of the model, so that faces look at the viewer.
#[derive(Debug, Clone, PartialEq)]
pub struct FitShown {
    /// The scan.
    pub scan: Mesh,
    /// The fitted model.
    pub fitted: Mesh,
    /// Distance of each vertex of the fit from the scan, mm; NaN where its closest point is on the boundary of the scan, so that it has none there.
    pub distances: Vec<f64>,
    /// The numbers among them, from the smallest.
    pub sorted: Vec<f64>,
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
        let found = Target::new(&scan)?.distances(&fitted.positions);
        let distances: Vec<f64> = found.iter().map(|d| if d.at_boundary { f64::NAN } else { d.distance }).collect();
        let mut sorted: Vec<f64> = distances.iter().copied().filter(|d| d.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let limit = rounded_up(sorted.get(sorted.len() * 9 / 10).copied().unwrap_or(1.0).max(1e-3));
        Ok(FitShown { scan, fitted, distances, sorted, scale: ColourScale::sequential(0.0, limit) })
    }

    /// The distance within which this share of the vertices is that have one; 0 without any.
    pub fn quantile(&self, share: f64) -> f64 {
        let place = (share * self.sorted.len() as f64) as usize;
        self.sorted.get(place.min(self.sorted.len().saturating_sub(1))).copied().unwrap_or(0.0)
    }

    /// The colour of every vertex of the fit.
    pub fn colours(&self) -> Vec<[u8; 3]> {
        self.scale.colours(&self.distances)
    }

    /// The legend of these colours.
    pub fn bar(&self, title: &str) -> ColourBar {
        let mut bar = ColourBar::of(self.scale, title, &self.distances);
        bar.missing_label = "beyond the scan".into();
        bar
    }
}
