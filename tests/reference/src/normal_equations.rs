//! Normal equations from the whole Jacobian, row by row.

use super::generator::Generator;
use super::levenberg_marquardt::Equations;
use super::placement::Placement;

/// A sample as the core takes it.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Sample {
    pub corners: [u32; 3],
    pub barycentric: [f32; 3],
    pub target: [f32; 3],
    pub normal: Option<[f32; 3]>,
    pub weight: f32,
}

/// Motions that are variables: none, rotation and translation, with scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Frame {
    Fixed,
    Rigid,
    Similarity,
}

impl Frame {
    /// Number of variables.
    pub fn dim(self) -> usize {
        [0, 6, 7][self as usize]
    }
}

/// Position and derivatives of a sample's point.
pub fn linearised(model: &dyn Generator, x: &[f32], y: &[f32], sample: &Sample) -> ([f32; 3], Vec<[f32; 3]>) {
    let mut position = [0.0f32; 3];
    let mut derivatives = vec![[0.0f32; 3]; x.len() + y.len()];
    for (&corner, &part) in sample.corners.iter().zip(&sample.barycentric) {
        if part == 0.0 {
            continue;
        }
        let vertex = model.linearised(x, y, corner as usize);
        for k in 0..3 {
            position[k] += part * vertex.value[k];
            for (sum, derivative) in derivatives.iter_mut().zip(&vertex.derivatives) {
                sum[k] += part * derivative[k];
            }
        }
    }
    (position, derivatives)
}

/// Energy, `J^T J`, `J^T r` of the samples; `None` stands for a sample that is left out.
pub fn equations(
    model: &dyn Generator,
    x: &[f32],
    y: &[f32],
    samples: &[Option<Sample>],
    placement: &Placement<f32>,
    frame: Frame,
) -> Equations<f32> {
    let mut rows: Vec<Vec<f32>> = Vec::new();
    for sample in samples.iter().flatten().filter(|sample| sample.weight > 0.0) {
        let (p, derivatives) = linearised(model, x, y, sample);
        let target = placement.inverse_applied(sample.target);
        let difference = [0, 1, 2].map(|k| p[k] - target[k]);
        let factor = placement.scale * libm::sqrtf(sample.weight);
        let directions = match sample.normal {
            Some(normal) => vec![placement.inverse_rotated(normal).map(|value| factor * value)],
            None => vec![[factor, 0.0, 0.0], [0.0, factor, 0.0], [0.0, 0.0, factor]],
        };
        for d in directions {
            let along = |v: [f32; 3]| d[0] * v[0] + d[1] * v[1] + d[2] * v[2];
            let mut row: Vec<f32> = derivatives.iter().map(|&derivative| along(derivative)).collect();
            // p x d, d, d . p.
            let motions = [
                p[1] * d[2] - p[2] * d[1],
                p[2] * d[0] - p[0] * d[2],
                p[0] * d[1] - p[1] * d[0],
                d[0],
                d[1],
                d[2],
                along(p),
            ];
            row.extend(&motions[..frame.dim()]);
            row.push(along(difference));
            rows.push(row);
        }
    }
    let m = x.len() + y.len() + frame.dim();
    // Rows are summed in groups of 24, then the groups.
    let sum = |p: usize, q: usize| {
        let mut total = 0.0f32;
        for group in rows.chunks(24) {
            let mut sum = 0.0f32;
            for row in group {
                sum += row[p] * row[q];
            }
            total += sum;
        }
        total
    };
    let jtj = (0..m).map(|p| (0..m).map(|q| sum(p, q)).collect()).collect();
    (sum(m, m), jtj, (0..m).map(|p| sum(p, m)).collect())
}
