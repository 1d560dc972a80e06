//! What the measured programs calculate: this file is compiled into the firmware and into a test of the host, so that both
//! speak of the same numbers.

use habitus_core::Error;
use habitus_core::fit::{FitOptions, Frame};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::bilinear::Bilinear;
use habitus_core::generator::{Generator, Weights};
use habitus_core::prior::Prior;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::Limits;

/// Landmarks of the small model.
pub const LANDMARKS: usize = 13;
/// Weights of the small model.
pub const IDENTITY: [f32; 4] = [0.7, -1.3, 0.25, 2.1];
/// As above.
pub const POSE: [f32; 3] = [-0.4, 1.1, 0.9];

/// Mean over the vertices of x + y + z, from ranges of as many vertices as `range` holds: a number in which every output bit
/// takes part.
pub fn mean_by_ranges(generator: &Bilinear<'_>, range: &mut [f32]) -> Result<f32, Error> {
    let weights = Weights { identity: &IDENTITY, pose: &POSE };
    let (n, most) = (generator.vertex_count(), range.len() / 3);
    let (mut sum, mut from) = (0.0, 0);
    while from < n {
        let count = most.min(n - from);
        let out = range.get_mut(..3 * count).filter(|out| !out.is_empty()).ok_or(Error::Empty)?;
        generator.evaluate(weights, from..from + count, out)?;
        sum += out.iter().sum::<f32>();
        from += count;
    }
    Ok(sum / n as f32)
}

/// The landmarks of a known face, moved and turned; the first is missing.
pub fn targets(model: &Model<'_>, generator: &Bilinear<'_>) -> [Option<[f32; 3]>; LANDMARKS] {
    let placement = Similarity::IDENTITY.moved([0.2, -0.3, 0.1], [30.0, -12.0, 400.0], 0.0);
    let weights = Weights { identity: &IDENTITY, pose: &POSE };
    let mut targets = [None; LANDMARKS];
    let Ok(at) = generator.begin(weights, false, &mut []) else { return targets };
    for (target, vertex) in targets.iter_mut().zip(model.landmarks().iter().flat_map(|indices| indices.iter())).skip(1)
    {
        *target = generator.vertex_unchecked(at, vertex as usize).map(|point| placement.applied(point));
    }
    targets
}

/// How the landmarks are fitted: the Gaussian priors of the model, 0.5 mm of noise.
pub fn fit_options<'a>(model: &Model<'a>) -> FitOptions<'a> {
    let prior = |mode| model.gaussian(mode).map_or(Prior::None, |gaussian| Prior::Gaussian(gaussian, 1.0));
    FitOptions {
        frame: Frame::Rigid,
        place: true,
        identity_prior: prior(Mode::Identity),
        pose_prior: prior(Mode::Pose),
        noise: 0.5,
        limits: Limits::default(),
    }
}
