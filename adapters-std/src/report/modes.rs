//! What single weights of a model do: the shapes at two standard deviations to either side of the mean.

use habitus_core::format::{Mode, Model};

use crate::Error;
use crate::generate::{mesh, positions, weights_from_deviations};
use crate::measure::vertex_error::length;
use crate::mesh::Mesh;

/// Standard deviations to either side.
pub const DEVIATIONS: f64 = 2.0;

/// What one weight does.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeShape {
    /// The weight, counted from 0.
    pub weight: usize,
    /// The shape two standard deviations below the mean.
    pub low: Mesh,
    /// The shape two standard deviations above the mean.
    pub high: Mesh,
    /// Half the distance between both of each vertex, mm: how far two standard deviations move it.
    pub motion: Vec<f64>,
    /// The mean of these.
    pub mean_motion: f64,
}

/// The model's mean shape: all weights at their means.
///
/// # Errors
/// Those of [`weights_from_deviations`].
pub fn mean_shape(model: &Model<'_>) -> Result<Mesh, Error> {
    shape(model, Mode::Identity, &[])
}

/// All weights of a mode in the order of how far they move the vertices, the farthest first.
///
/// The first weight of a mode is nearly the size of the mean shape in every training shape, so it hardly varies: size decides and not the number.
///
/// # Errors
/// Those of [`weights_from_deviations`].
pub fn sorted_modes(model: &Model<'_>, mode: Mode) -> Result<Vec<ModeShape>, Error> {
    let dim = match mode {
        Mode::Identity => model.header().identity_dim,
        Mode::Pose => model.header().pose_dim,
    };
    let of_weight = |weight: usize| -> Result<ModeShape, Error> {
        let at = |deviation: f64| {
            let mut deviations = vec![0.0; weight + 1];
            deviations[weight] = deviation;
            shape(model, mode, &deviations)
        };
        let (low, high) = (at(-DEVIATIONS)?, at(DEVIATIONS)?);
        let pairs = low.positions.iter().zip(&high.positions);
        let motion: Vec<f64> = pairs.map(|(a, b)| length([0, 1, 2].map(|x| b[x] - a[x])) / 2.0).collect();
        let mean_motion = motion.iter().sum::<f64>() / motion.len().max(1) as f64;
        Ok(ModeShape { weight, low, high, motion, mean_motion })
    };
    let mut all = (0..dim as usize).map(of_weight).collect::<Result<Vec<_>, _>>()?;
    all.sort_by(|a, b| b.mean_motion.total_cmp(&a.mean_motion).then(a.weight.cmp(&b.weight)));
    Ok(all)
}

fn shape(model: &Model<'_>, mode: Mode, deviations: &[f64]) -> Result<Mesh, Error> {
    let of = |which: Mode| weights_from_deviations(model, which, if which == mode { deviations } else { &[] });
    Ok(mesh(model, &positions(model, &of(Mode::Identity)?, &of(Mode::Pose)?)?))
}
