//! How a model is fitted to a scan: strengths, gates and the schedule from coarse to fine.

use crate::spatial::frame_recovery::Unit;

/// How a model is fitted to a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanFitOptions {
    /// Unit of the scan and its landmarks; none: told by the size of the landmarks.
    pub unit: Option<Unit>,
    /// Standard deviation of the landmarks, mm per axis.
    pub landmark_sigma: f64,
    /// Smallest standard deviation of the surface that is assumed, mm.
    pub sigma: f64,
    /// Area of surface whose points count as one observation, mm^2: what the model cannot express is alike over such distances.
    pub independent_area: f64,
    /// Factor of the priors.
    pub prior_factor: f64,
    /// Share of the pairs from scan to model in the weight of the surface; the rest is from model to scan.
    pub scan_share: f64,
    /// Largest angle between the normals of a pair, degrees.
    pub max_angle: f64,
    /// Side of the cells of which each keeps one point of the scan, mm.
    pub cell: f64,
    /// Most points of the scan that take part; larger cells keep fewer.
    pub max_points: usize,
    /// Rounds of the schedule.
    pub n_rounds: usize,
    /// Last value of the robust limit, in standard deviations.
    pub robust: f64,
}

impl Default for ScanFitOptions {
    fn default() -> Self {
        ScanFitOptions {
            unit: None,
            landmark_sigma: 2.0,
            sigma: 0.4,
            independent_area: 60.0,
            prior_factor: 1.0,
            scan_share: 0.5,
            max_angle: 60.0,
            cell: 2.0,
            max_points: 12_000,
            n_rounds: 20,
            robust: 3.0,
        }
    }
}

/// One round.
pub(super) struct Round {
    /// Free identity weights, the leading ones.
    pub identity_dim: usize,
    /// Farthest pairs, mm.
    pub distance: f64,
    /// Robust limit, in standard deviations.
    pub robust: f64,
    /// Largest standard deviation, mm.
    pub max_sigma: f64,
}

impl ScanFitOptions {
    /// Rounds from coarse to fine: gates close, the loss becomes stricter, weights are freed.
    pub(super) fn rounds(&self, identity_dim: usize) -> impl Iterator<Item = Round> + use<> {
        let (n, robust) = (self.n_rounds, self.robust);
        (0..n).map(move |k| {
            // From 0 to 1 over the first two thirds of the rounds.
            let t = (1.5 * k as f64 / n.max(2) as f64).min(1.0);
            let mix = |from: f64, to: f64| from * (to / from).powf(t);
            let free = if t >= 1.0 { identity_dim } else { (5.0 + t * identity_dim as f64) as usize };
            Round {
                identity_dim: free.min(identity_dim),
                distance: mix(20.0, 6.0),
                robust: mix(2.0 * robust, robust),
                max_sigma: mix(6.0, 1.5),
            }
        })
    }
}
