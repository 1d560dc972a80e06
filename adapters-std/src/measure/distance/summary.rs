//! Figures of many distances.

use super::PointDistance;

/// Figures of many distances, in their unit. Quantiles are nearest-rank: the smallest distance that at least this share of the
/// weight does not exceed.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceSummary {
    /// Points.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Half of the weight is within this distance.
    pub median: f64,
    /// 90 % of the weight is within this distance.
    pub quantile_90: f64,
    /// 95 % of the weight is within this distance.
    pub quantile_95: f64,
    /// 99 % of the weight is within this distance.
    pub quantile_99: f64,
    /// Largest: the one-sided Hausdorff distance of these points.
    pub largest: f64,
    /// Mean of the signed distances; none where there are no sides.
    pub signed_mean: Option<f64>,
    /// Threshold and the share of the weight within it, 0 to 1.
    pub within: Vec<(f64, f64)>,
}

impl DistanceSummary {
    /// Of distances and their weights, which are positive. `None` when there are none.
    pub fn of(points: &[(PointDistance, f64)], thresholds: &[f64]) -> Option<Self> {
        let weight: f64 = points.iter().map(|(_, weight)| weight).sum();
        if points.is_empty() || !(weight > 0.0) {
            return None;
        }
        let mean_of = |value: &dyn Fn(&PointDistance) -> f64| {
            points.iter().map(|(point, weight)| weight * value(point)).sum::<f64>() / weight
        };
        let mut sorted: Vec<(f64, f64)> = points.iter().map(|(point, weight)| (point.distance, *weight)).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let quantile = |share: f64| {
            // What rounding may add to the running sum does not push a quantile one point further.
            let wanted = share * weight * (1.0 - 1e-12);
            let mut sum = 0.0;
            let reached = sorted.iter().find(|(_, weight)| {
                sum += weight;
                sum >= wanted
            });
            reached.or(sorted.last()).map_or(0.0, |(distance, _)| *distance)
        };
        let share_within = |limit: f64| mean_of(&|point| f64::from(u8::from(point.distance <= limit)));
        Some(DistanceSummary {
            count: points.len(),
            mean: mean_of(&|point| point.distance),
            rms: mean_of(&|point| point.distance * point.distance).sqrt(),
            median: quantile(0.5),
            quantile_90: quantile(0.9),
            quantile_95: quantile(0.95),
            quantile_99: quantile(0.99),
            largest: sorted.last().map_or(0.0, |(distance, _)| *distance),
            signed_mean: points
                .iter()
                .all(|(point, _)| point.signed.is_some())
                .then(|| mean_of(&|point| point.signed.unwrap_or(0.0))),
            within: thresholds.iter().map(|&limit| (limit, share_within(limit))).collect(),
        })
    }
}
