//! How a model is fitted to a scan: strengths, gates and the schedule from coarse to fine.

use super::correspondences::Gates;
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
    /// Standard deviation of what the model cannot express, mm along the normal; 0: the model expresses everything, and its remainder is not looked at either.
    pub displacement: f64,
    /// Distance over which that is alike, mm.
    pub correlation: f64,
    /// As `independent_area` in the last rounds, where that is regarded.
    pub point_area: f64,
    /// Rounds with displacement.
    pub n_fine: usize,
    /// Factor of the prior of the identity weights.
    pub identity_prior: f64,
    /// Factor of the prior of the pose weights.
    pub pose_prior: f64,
    /// Largest angle between the normals of a pair, degrees.
    pub max_angle: f64,
    /// Farthest pairs of the last rounds, mm.
    pub last_distance: f64,
    /// Shortest mean of the unit normals about a point of the scan that counts: in hair they do not agree.
    pub coherence: f64,
    /// Side of the cells of which each keeps one point of the scan, mm.
    pub cell: f64,
    /// Most points of the scan that take part; larger cells keep fewer.
    pub max_points: usize,
    /// Rounds of the schedule.
    pub n_rounds: usize,
    /// Last value of the robust limit, in standard deviations.
    pub robust: f64,
    /// Refuse what does not look like a shape of the model's kind after the fit.
    pub refuse: bool,
}

impl Default for ScanFitOptions {
    /// Chosen on simulated scans of faces that no reported figure is of (`simulated_scans_are_fitted` in `tests/tests/face_fit.rs`).
    fn default() -> Self {
        ScanFitOptions {
            unit: None,
            landmark_sigma: 1.5,
            sigma: 0.4,
            independent_area: 200.0,
            displacement: 0.4,
            correlation: 14.0,
            point_area: 10.0,
            n_fine: 3,
            identity_prior: 1.0,
            pose_prior: 1.0,
            max_angle: 45.0,
            last_distance: 6.0,
            coherence: 0.9,
            cell: 2.5,
            max_points: 6_000,
            n_rounds: 12,
            robust: 2.0,
            refuse: true,
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
    /// Whether the displacement is regarded.
    pub displaced: bool,
}

impl ScanFitOptions {
    /// The gates of a round.
    pub(super) fn gates(&self, round: &Round) -> Gates {
        Gates {
            distance: round.distance,
            cosine: self.max_angle.to_radians().cos(),
            robust: round.robust,
            sigma: [self.sigma, round.max_sigma],
            independent_area: if round.displaced { self.point_area } else { self.independent_area },
        }
    }

    /// Those by which the result is judged.
    pub(super) fn last_gates(&self) -> Gates {
        let round = Round { identity_dim: 0, distance: 6.0, robust: self.robust, max_sigma: 6.0, displaced: true };
        self.gates(&round)
    }

    /// Rounds from coarse to fine: gates close, the loss becomes stricter, weights are freed.
    pub(super) fn rounds(&self, identity_dim: usize) -> impl Iterator<Item = Round> + use<> {
        let (n, robust) = (self.n_rounds, self.robust);
        let last = self.last_distance;
        let n_fine = if self.displacement > 0.0 { self.n_fine } else { 0 };
        (0..n + n_fine).map(move |k| {
            // From 0 to 1 over the first two thirds of the rounds.
            let t = (1.5 * k as f64 / n.max(2) as f64).min(1.0);
            let mix = |from: f64, to: f64| from * (to / from).powf(t);
            let free = if t >= 1.0 { identity_dim } else { (5.0 + t * identity_dim as f64) as usize };
            Round {
                identity_dim: free.min(identity_dim),
                distance: mix(20.0, last),
                robust: mix(2.0 * robust, robust),
                max_sigma: mix(2.0, 1.5),
                displaced: k >= n,
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_go_from_coarse_to_fine() {
        let options = ScanFitOptions::default();
        let rounds: Vec<Round> = options.rounds(59).collect();
        assert_eq!(rounds.len(), options.n_rounds + options.n_fine);
        assert_eq!((rounds[0].identity_dim, rounds[0].distance, rounds[0].robust), (5, 20.0, 2.0 * options.robust));
        for pair in rounds.windows(2) {
            assert!(pair[1].identity_dim >= pair[0].identity_dim);
            assert!(pair[1].distance <= pair[0].distance && pair[1].robust <= pair[0].robust);
            assert!(pair[1].max_sigma <= pair[0].max_sigma);
        }
        // The last third has everything free, and the last rounds the displacement.
        for (k, round) in rounds.iter().enumerate() {
            if 3 * k >= 2 * options.n_rounds {
                assert_eq!(round.identity_dim, 59);
                assert!((round.distance - options.last_distance).abs() < 1e-12);
            }
            assert_eq!(round.displaced, k >= options.n_rounds);
        }
    }

    #[test]
    fn small_models_and_odd_options_have_rounds_too() {
        assert!(ScanFitOptions::default().rounds(3).all(|round| round.identity_dim == 3));
        let plain = ScanFitOptions { displacement: 0.0, ..ScanFitOptions::default() };
        assert!(plain.rounds(20).all(|round| !round.displaced));
        assert_eq!(plain.rounds(20).count(), plain.n_rounds);
        let one = ScanFitOptions { n_rounds: 1, n_fine: 0, ..ScanFitOptions::default() };
        assert!(one.rounds(20).all(|round| round.distance.is_finite()));
        let none = ScanFitOptions { n_rounds: 0, n_fine: 1, ..ScanFitOptions::default() };
        assert_eq!(none.rounds(20).map(|round| round.distance.is_finite()).collect::<Vec<_>>(), [true]);
    }

    #[test]
    fn points_count_as_one_observation_unless_the_displacement_is_regarded() {
        let options = ScanFitOptions::default();
        let rounds: Vec<Round> = options.rounds(20).collect();
        let (first, last) = (options.gates(&rounds[0]), options.gates(&rounds[14]));
        assert_eq!((first.independent_area, last.independent_area), (options.independent_area, options.point_area));
        assert!((first.cosine - 0.5f64.sqrt()).abs() < 1e-12);
        assert_eq!(last.sigma, [options.sigma, 1.5]);
        assert_eq!(options.last_gates().distance, 6.0);
    }
}
