//! Rigid and similarity alignment of two sets of corresponding points (orthogonal Procrustes, ch. 12 `[100]`).
//!
//! The rotation that best carries the centred source onto the centred target is `V D U^T`, with `U S V^T` the singular
//! value decomposition of their 3 x 3 cross covariance and `D` correcting a reflection in the weakest direction.

use crate::error::Error;
use nalgebra::{Matrix3, SVD, SymmetricEigen, Vector3};

/// Second over first singular value of a centred point set below which the points count as lying on a line.
const COLLINEAR: f64 = 1e-6;
/// Limit of the iterations of the 3 x 3 decompositions; a handful is usual.
const ITERATIONS: usize = 1000;

/// `x -> scale rotation x + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Size ratio, 1 for a rigid motion.
    pub scale: f64,
    /// Rotation matrix, row by row.
    pub rotation: [[f64; 3]; 3],
    /// Translation, mm.
    pub translation: [f64; 3],
}

impl Similarity {
    /// The motion that moves nothing.
    pub const IDENTITY: Self =
        Similarity { scale: 1.0, rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// The image of one point.
    pub fn point(&self, x: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|row| {
            let r = &self.rotation[row];
            self.scale * (r[0] * x[0] + r[1] * x[1] + r[2] * x[2]) + self.translation[row]
        })
    }

    /// The point of which `y` is the image.
    pub fn inverse_point(&self, y: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            (0..3).map(|row| self.rotation[row][axis] * (y[row] - self.translation[row])).sum::<f64>() / self.scale
        })
    }

    /// Moves every point of `shape` (xyz after xyz).
    pub fn apply_in_place(&self, shape: &mut [f64]) {
        for x in shape.as_chunks_mut::<3>().0 {
            *x = self.point(*x);
        }
    }
}

/// The motion of least squares that carries `source` onto `target`, with a scale when `with_scale`.
///
/// `source` and `target` hold corresponding points (xyz after xyz, mm); `weights` holds one value >= 0 per point, or
/// nothing for 1 everywhere. Minimises `sum_v weight_v |s R source_v + t - target_v|^2`.
///
/// Errors: lengths that differ, a negative or non-finite weight, fewer than three points of positive weight, points on a line.
pub fn alignment(
    source: &[f64],
    target: &[f64],
    weights: Option<&[f64]>,
    with_scale: bool,
) -> Result<Similarity, Error> {
    let (p, q) = (source.as_chunks::<3>().0, target.as_chunks::<3>().0);
    if source.len() != target.len() || !source.len().is_multiple_of(3) {
        return Err(Error::input(format!(
            "the point sets to be aligned have {} and {} coordinates; they must have the same number of points",
            source.len(),
            target.len()
        )));
    }
    let weight = |v: usize| weights.map_or(1.0, |w| w[v]);
    if let Some(w) = weights {
        if w.len() != p.len() {
            return Err(Error::input(format!("{} weights were given for {} points; give one each", w.len(), p.len())));
        }
        if let Some(v) = w.iter().position(|&w| !(w.is_finite() && w >= 0.0)) {
            return Err(Error::input(format!("weight {v} is {}; weights must be finite and not negative", w[v])));
        }
    }
    let n_used = (0..p.len()).filter(|&v| weight(v) > 0.0).count();
    if n_used < 3 {
        return Err(Error::input(format!("{n_used} points do not determine a placement; give at least three")));
    }
    let total: f64 = (0..p.len()).map(weight).sum();
    let (mut mean_p, mut mean_q) = (Vector3::zeros(), Vector3::zeros());
    for (v, (p, q)) in p.iter().zip(q).enumerate() {
        mean_p += weight(v) * Vector3::from(*p);
        mean_q += weight(v) * Vector3::from(*q);
    }
    mean_p /= total;
    mean_q /= total;
    let (mut cross, mut spread_p, mut spread_q) = (Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros());
    for (v, (p, q)) in p.iter().zip(q).enumerate() {
        let (p, q) = (Vector3::from(*p) - mean_p, Vector3::from(*q) - mean_q);
        cross += weight(v) * p * q.transpose();
        spread_p += weight(v) * p * p.transpose();
        spread_q += weight(v) * q * q.transpose();
    }
    for (spread, name) in [(spread_p, "source"), (spread_q, "target")] {
        if !spread.iter().all(|x| x.is_finite()) {
            return Err(Error::input(format!("the {name} points of an alignment are not all finite")));
        }
        if lies_on_a_line(spread)? {
            return Err(Error::input(format!(
                "the {name} points of an alignment lie on a line, so its rotation is undetermined; add a point off the line"
            )));
        }
    }
    let svd = SVD::try_new(cross, true, true, f64::EPSILON, ITERATIONS).ok_or_else(|| diverged("singular value"))?;
    let (u, v_t) =
        (svd.u.ok_or_else(|| diverged("singular value"))?, svd.v_t.ok_or_else(|| diverged("singular value"))?);
    let sign = if (v_t.transpose() * u.transpose()).determinant() < 0.0 { -1.0 } else { 1.0 };
    let d = Vector3::new(1.0, 1.0, sign);
    let rotation = v_t.transpose() * Matrix3::from_diagonal(&d) * u.transpose();
    let scale = if with_scale { svd.singular_values.dot(&d) / spread_p.trace() } else { 1.0 };
    let translation = mean_q - scale * rotation * mean_p;
    Ok(Similarity {
        scale,
        rotation: std::array::from_fn(|row| std::array::from_fn(|column| rotation[(row, column)])),
        translation: translation.into(),
    })
}

fn lies_on_a_line(spread: Matrix3<f64>) -> Result<bool, Error> {
    let eigen = SymmetricEigen::try_new(spread, f64::EPSILON, ITERATIONS).ok_or_else(|| diverged("eigenvalue"))?;
    let mut values: [f64; 3] = eigen.eigenvalues.into();
    values.sort_by(|a, b| b.total_cmp(a));
    // `spread` holds squares: its eigenvalues are squared singular values of the point set.
    Ok(values[1] <= COLLINEAR * COLLINEAR * values[0])
}

fn diverged(what: &str) -> Error {
    Error::Internal(format!("a 3 x 3 {what} decomposition did not converge in {ITERATIONS} iterations"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    const POINTS: [f64; 15] = [0.0, 0.0, 0.0, 30.0, 1.0, 2.0, -5.0, 40.0, 3.0, 2.0, -6.0, 55.0, 17.0, 12.0, -9.0];

    #[test]
    fn known_similarity_is_recovered() {
        let r = Rotation3::from_euler_angles(0.4, -1.2, 2.5);
        let rotation = std::array::from_fn(|i| std::array::from_fn(|j| r[(i, j)]));
        let truth = Similarity { scale: 1.7, rotation, translation: [3.0, -200.0, 41.0] };
        let mut moved = POINTS.to_vec();
        truth.apply_in_place(&mut moved);
        let found = alignment(&POINTS, &moved, None, true).unwrap();
        assert!((found.scale - 1.7).abs() < 1e-13);
        for (x, y) in POINTS.as_chunks::<3>().0.iter().zip(moved.as_chunks::<3>().0) {
            let z = found.point(*x);
            assert!((0..3).all(|a| (z[a] - y[a]).abs() < 1e-12), "{z:?} {y:?}");
        }
    }

    #[test]
    fn mirrored_points_are_not_reflected() {
        let mirrored: Vec<f64> = POINTS.as_chunks::<3>().0.iter().flat_map(|&[x, y, z]| [-x, y, z]).collect();
        let found = alignment(&POINTS, &mirrored, None, false).unwrap();
        let r = found.rotation;
        assert!((Matrix3::from_fn(|i, j| r[i][j]).determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn weight_zero_removes_an_outlier() {
        let mut target = POINTS.to_vec();
        target[12] += 1000.0;
        let found = alignment(&POINTS, &target, Some(&[1.0, 1.0, 1.0, 1.0, 0.0]), false).unwrap();
        assert!(found.translation.iter().all(|t| t.abs() < 1e-12));
    }

    #[test]
    fn degenerate_input_is_a_sentence() {
        let line: Vec<f64> = (0..4).flat_map(|i| [f64::from(i), 2.0 * f64::from(i), 1.0]).collect();
        let said = |result: Result<Similarity, Error>| result.unwrap_err().to_string();
        assert!(
            said(alignment(&line, &POINTS[..12], None, false)).contains("source points of an alignment lie on a line")
        );
        assert!(
            said(alignment(&POINTS[..12], &line, None, false)).contains("target points of an alignment lie on a line")
        );
        assert!(said(alignment(&POINTS[..6], &POINTS[..6], None, false)).contains("at least three"));
        assert!(said(alignment(&POINTS, &POINTS[..12], None, false)).contains("same number of points"));
        assert!(
            said(alignment(&POINTS[..12], &POINTS[..12], Some(&[1.0, -1.0, 1.0, 1.0]), false))
                .contains("weight 1 is -1")
        );
    }
}
