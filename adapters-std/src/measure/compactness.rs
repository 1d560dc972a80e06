//! Compactness: how few weights hold how much of the variation of a mode.

use crate::face::multilinear::{Mode, MultilinearModel};

/// Added to every eigenvalue before the logarithm, mm^2 summed over the vertices.
const DELTA: f64 = 0.01;

/// Compactness of one mode.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeCompactness {
    /// `100 (L_1 + .. + L_k) / (L_1 + .. + L_d)` for `k = 1 ..= d`, percent.
    pub percent: Vec<f64>,
    /// Sum of the eigenvalues, mm^2 summed over the vertices.
    ///
    /// A larger percentage of a larger trace is not an improvement.
    pub trace: f64,
    /// `trace / d`: the variance per shape, equal for both modes.
    pub variance_per_shape: f64,
}

/// Compactness of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Compactness {
    /// Of the identity mode.
    pub identity: ModeCompactness,
    /// Of the expression mode.
    pub expression: ModeCompactness,
    /// `(1/d2) sum_a ln(L2_a + 0.01) + (1/d3) sum_a ln(L3_a + 0.01)` over all eigenvalues: the groupwise energy of ch. 13.
    pub energy: f64,
}

/// Compactness of both modes, from all eigenvalues of the training set.
pub fn compactness(model: &MultilinearModel) -> Compactness {
    Compactness {
        identity: mode_compactness(&model.identity),
        expression: mode_compactness(&model.expression),
        energy: mode_energy(&model.identity) + mode_energy(&model.expression),
    }
}

fn mode_compactness(mode: &Mode) -> ModeCompactness {
    let trace: f64 = mode.eigenvalues.iter().sum();
    let mut sum = 0.0;
    let percent = mode
        .eigenvalues
        .iter()
        .map(|value| {
            sum += value;
            100.0 * sum / trace
        })
        .collect();
    ModeCompactness { percent, trace, variance_per_shape: trace / mode.count as f64 }
}

fn mode_energy(mode: &Mode) -> f64 {
    mode.eigenvalues.iter().map(|value| (value + DELTA).ln()).sum::<f64>() / mode.count as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::hosvd::{HosvdOptions, hosvd};
    use crate::face::tensor::ShapeTensor;

    #[test]
    fn traces_agree_and_percentages_rise_to_one_hundred() {
        let (d2, d3, n) = (8, 5, 30);
        let data = (0..d2 * d3 * n * 3).map(|x| ((x * x % 7919) as f64).sin() * 9.0).collect();
        let tensor = ShapeTensor::from_shapes(d2, d3, n, data).unwrap();
        let model = hosvd(&tensor, &HosvdOptions::default()).unwrap().model;
        let found = compactness(&model);
        let (a, b) = (found.identity.variance_per_shape, found.expression.variance_per_shape);
        assert!((a - b).abs() < 1e-12 * a, "{a} {b}");
        let variance: f64 = (0..d2 * d3)
            .map(|k| tensor.shape(k % d2, k / d2).iter().zip(&model.mean).map(|(x, m)| (x - m) * (x - m)).sum::<f64>())
            .sum::<f64>()
            / (d2 * d3) as f64;
        assert!((a - variance).abs() < 1e-12 * a, "{a} {variance}");
        for mode in [&found.identity, &found.expression] {
            assert!(mode.percent.windows(2).all(|w| w[0] <= w[1]));
            assert!((mode.percent.last().unwrap() - 100.0).abs() < 1e-10);
        }
        let by_hand: f64 = model.identity.eigenvalues.iter().map(|l| (l + 0.01).ln() / 8.0).sum::<f64>()
            + model.expression.eigenvalues.iter().map(|l| (l + 0.01).ln() / 5.0).sum::<f64>();
        assert!((found.energy - by_hand).abs() < 1e-12);
    }
}
