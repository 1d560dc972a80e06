//! Fitting a model to landmarks.

use super::normal_equations::Frame;
use super::points::{FitOptions, FitReport, fit_points, fit_points_req};
use super::samples::{Sample, Samples, SurfacePoint};
use crate::Error;
use crate::format::{Indices, Model, SectionId};
use crate::generator::Generator;
use crate::rotation::similarity::Similarity;
use crate::workspace::{Requirement, check_len};

/// The landmarks of a model paired with measured positions; `None` where a landmark was not measured.
#[derive(Debug, Clone, Copy)]
pub struct LandmarkSamples<'a> {
    vertices: Indices<'a>,
    targets: &'a [Option<[f32; 3]>],
}

impl<'a> LandmarkSamples<'a> {
    /// Pairs the model's landmarks with as many positions, in the order of the file, in the model's unit (millimetres).
    ///
    /// Errors: `Unsupported` when the model has no landmarks, `DimensionMismatch`.
    pub fn new(model: &Model<'a>, targets: &'a [Option<[f32; 3]>]) -> Result<Self, Error> {
        let vertices = model.landmarks().ok_or(Error::Unsupported { section: SectionId::Landmarks as u32 })?;
        check_len(vertices.len(), targets.len())?;
        Ok(LandmarkSamples { vertices, targets })
    }
}

impl Samples for LandmarkSamples<'_> {
    fn len(&self) -> usize {
        self.targets.len()
    }

    fn get(&self, index: usize) -> Option<Sample> {
        let target = (*self.targets.get(index)?)?;
        let vertex = self.vertices.get(index)?;
        Some(Sample { point: SurfacePoint::vertex(vertex), target, normal: None, weight: 1.0 })
    }
}

/// Scratch of [`fit_landmarks`].
pub const fn fit_landmarks_req(identity_dim: usize, pose_dim: usize, frame: Frame) -> Requirement {
    fit_points_req(identity_dim, pose_dim, frame)
}

/// Finds weights and placement from the landmarks alone; see [`fit_points`] for the arguments. 13 landmarks do not determine dozens of weights: use
/// the Gaussian prior of the model.
///
/// Errors: as [`fit_points`], and `Unsupported` when the model has no landmarks. Panics: never.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
#[allow(clippy::too_many_arguments)]
pub fn fit_landmarks<G: Generator + ?Sized>(
    model: &Model<'_>,
    generator: &G,
    targets: &[Option<[f32; 3]>],
    options: &FitOptions<'_>,
    identity: &mut [f32],
    pose: &mut [f32],
    placement: &mut Similarity<f32>,
    workspace: &mut [f32],
) -> Result<FitReport, Error> {
    let samples = LandmarkSamples::new(model, targets)?;
    fit_points(generator, &samples, options, identity, pose, placement, workspace)
}
