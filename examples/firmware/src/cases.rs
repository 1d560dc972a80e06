//! What the measured programs calculate: this file is compiled into the firmware and into tests of the host, so that both
//! speak of the same numbers.

use habitus_core::Error;
use habitus_core::fit::{
    FitOptions, FitReport, Frame, LandmarkSamples, WaveletOptions, WaveletReport, fit_landmarks, fit_wavelet,
    fit_wavelet_req,
};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::wavelet::{Multiscale, Stored};
use habitus_core::generator::{At, Generator, Weights};
use habitus_core::prior::Prior;
use habitus_core::quantise::Storage;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::Limits;
use habitus_core::workspace::Workspace;

/// Landmarks of a model, at most.
pub const LANDMARKS: usize = 26;
/// Vertices of a range.
pub const RANGE: usize = 64;

/// Weights of a person and a pose, repeated where a model has more.
const WEIGHTS: [f32; 7] = [0.7, -1.3, 0.25, 2.1, -0.4, 1.1, 0.9];

/// Such a part of the weights, and the state of the evaluation of a model at them, in `memory`; then what is left of it.
pub fn begun<'m>(
    generator: &impl Generator,
    part: f32,
    derivatives: bool,
    memory: &'m mut [f32],
) -> Result<(At<'m>, &'m mut [f32]), Error> {
    let mut pieces = Workspace::new(memory);
    let identity = pieces.take(generator.identity_dim())?;
    let pose = pieces.take(generator.pose_dim())?;
    let state = pieces.take(generator.state_req(derivatives).numbers())?;
    for (weights, first) in [(&mut *identity, 0), (&mut *pose, 4)] {
        for (to, from) in weights.iter_mut().zip(WEIGHTS.iter().cycle().skip(first)) {
            *to = part * from;
        }
    }
    Ok((generator.begin(Weights { identity, pose }, derivatives, state)?, pieces.rest()))
}

/// Mean over the vertices of x + y + z, from ranges of [`RANGE`] vertices: a number in which every output bit takes part.
pub fn mean_by_ranges(generator: &impl Generator, memory: &mut [f32]) -> Result<f32, Error> {
    let mut range = [0.0; 3 * RANGE];
    let (at, _) = begun(generator, 1.0, false, memory)?;
    let n = generator.vertex_count();
    let (mut sum, mut from) = (0.0, 0);
    while from < n {
        let count = RANGE.min(n - from);
        let out = range.get_mut(..3 * count).ok_or(Error::Empty)?;
        generator.evaluate_at(at, from..from + count, out)?;
        sum += out.iter().sum::<f32>();
        from += count;
    }
    Ok(sum / n as f32)
}

/// The landmarks of a shape at a quarter of the weights (angles of a body stay within its limits), moved and turned;
/// the first `missing` were not measured.
pub fn targets(
    model: &Model<'_>,
    generator: &impl Generator,
    missing: usize,
    memory: &mut [f32],
) -> Result<[Option<[f32; 3]>; LANDMARKS], Error> {
    let placement = Similarity::IDENTITY.moved([0.2, -0.3, 0.1], [30.0, -12.0, 400.0], 0.0);
    let (at, _) = begun(generator, 0.25, false, memory)?;
    let mut targets = [None; LANDMARKS];
    for (target, vertex) in
        targets.iter_mut().zip(model.landmarks().iter().flat_map(|indices| indices.iter())).skip(missing)
    {
        *target = generator.vertex_unchecked(at, vertex as usize).map(|point| placement.applied(point));
    }
    Ok(targets)
}

/// How landmarks are fitted: the Gaussian priors of the model, or the limits of a body's angles; 0.5 mm of noise.
pub fn fit_options<'a>(model: &Model<'a>) -> FitOptions<'a> {
    let prior = |mode| model.gaussian(mode).map_or(Prior::None, |gaussian| Prior::Gaussian(gaussian, 1.0));
    let angles = model.pose_bounds().map(|(lower, upper)| Prior::Bounds(lower, upper));
    FitOptions {
        frame: Frame::Rigid,
        place: true,
        identity_prior: prior(Mode::Identity),
        pose_prior: angles.unwrap_or_else(|| prior(Mode::Pose)),
        noise: 0.5,
        limits: Limits::default(),
    }
}

/// Fits the landmarks `targets` of a model, from the weights 0; all of it in `memory`.
pub fn fitted(
    model: &Model<'_>,
    generator: &impl Generator,
    targets: &[Option<[f32; 3]>; LANDMARKS],
    memory: &mut [f32],
) -> Result<FitReport, Error> {
    let count = model.landmarks().map_or(0, |landmarks| landmarks.len());
    let mut pieces = Workspace::new(memory);
    let identity = pieces.take(generator.identity_dim())?;
    let pose = pieces.take(generator.pose_dim())?;
    identity.fill(0.0);
    pose.fill(0.0);
    let mut placement = Similarity::IDENTITY;
    let targets = targets.get(..count).ok_or(Error::Empty)?;
    let options = fit_options(model);
    fit_landmarks(model, generator, targets, &options, identity, pose, &mut placement, pieces.rest())
}

/// Landmarks of a file: three numbers each, none for one that was not measured.
pub fn measured(bytes: &[u8]) -> [Option<[f32; 3]>; LANDMARKS] {
    let mut targets = [None; LANDMARKS];
    for (target, bytes) in targets.iter_mut().zip(bytes.as_chunks::<12>().0) {
        let [x, y, z] =
            [0, 4, 8].map(|at| bytes.get(at..).and_then(|rest| rest.first_chunk().copied()).unwrap_or_default());
        *target = Some([x, y, z].map(f32::from_le_bytes)).filter(|point| point.iter().all(|number| number.is_finite()));
    }
    targets
}

/// Numbers that [`wavelet_fitted`] wants: the weights, and the scratch of the fit.
pub fn wavelet_need<'a, S: Storage<'a>>(
    generator: &Multiscale<Stored<'a, S>>,
    landmarks: usize,
    levels: usize,
) -> Result<usize, Error> {
    let generator = generator.with_levels(levels.saturating_sub(1), generator.whole_grid().levels())?;
    Ok(generator.dim() + fit_wavelet_req(&generator, landmarks, &(0..levels)).numbers())
}

/// Fits so many levels of a wavelet model to the landmarks `targets`, from the means, two passes a level; all of it in `memory`.
pub fn wavelet_fitted<'a, S: Storage<'a>>(
    model: &Model<'a>,
    generator: &Multiscale<Stored<'a, S>>,
    targets: &[Option<[f32; 3]>; LANDMARKS],
    levels: usize,
    memory: &mut [f32],
) -> Result<WaveletReport, Error> {
    let count = model.landmarks().map_or(0, |landmarks| landmarks.len());
    let samples = LandmarkSamples::new(model, targets.get(..count).ok_or(Error::Empty)?)?;
    let generator = generator.with_levels(levels.saturating_sub(1), generator.whole_grid().levels())?;
    let mut pieces = Workspace::new(memory);
    let identity = pieces.take(generator.identity_dim())?;
    let pose = pieces.take(generator.pose_dim())?;
    let options = WaveletOptions {
        frame: Frame::Rigid,
        identity: model.spread(Mode::Identity),
        pose: model.spread(Mode::Pose),
        kappa: 1.0,
        omega: 0.01,
        levels: 0..levels,
        passes: 2,
    };
    for (weights, spread) in [(&mut *identity, options.identity), (&mut *pose, options.pose)] {
        for (to, from) in weights.iter_mut().zip(spread.iter().flat_map(|spread| spread.mean.iter())) {
            *to = from;
        }
    }
    let mut placement = Similarity::IDENTITY;
    fit_wavelet(&generator, &samples, &options, identity, pose, &mut placement, pieces.rest())
}
