//! The generalised winding number: how often a surface goes round a position, also when it is open, noisy or only points.

use glam::DVec3;

use crate::Error;

/// A search structure for winding numbers.
#[derive(Debug)]
pub struct WindingTree {
    triangles: Vec<[DVec3; 3]>,
}

impl WindingTree {
    /// The structure over the triangles of a mesh.
    ///
    /// # Errors
    /// [`Error::Input`] without faces, for a vertex that does not exist or is not finite.
    pub fn of_mesh(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<Self, Error> {
        if faces.is_empty() {
            return Err(Error::input(
                "no triangle to wind around: give at least one, or points with normals and areas",
            ));
        }
        let triangles = faces.iter().map(|face| face.map(|v| DVec3::from_array(positions[v as usize]))).collect();
        Ok(WindingTree { triangles })
    }

    /// The winding number of the surface around the position: about 1 inside a closed surface, about 0 outside.
    pub fn at(&self, position: [f64; 3]) -> f64 {
        let p = DVec3::from_array(position);
        let solid_angle = |&[a, b, c]: &[DVec3; 3]| {
            let (a, b, c) = (a - p, b - p, c - p);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            2.0 * a.dot(b.cross(c)).atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
        };
        self.triangles.iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
    }

    /// [`Self::at`] each position, over all threads.
    pub fn at_all(&self, positions: &[[f64; 3]]) -> Vec<f64> {
        use rayon::prelude::*;
        positions.par_iter().map(|&position| self.at(position)).collect()
    }
}
