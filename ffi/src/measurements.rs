//! What C has measured, as samples of a fit.

use habitus_core::Error;
use habitus_core::fit::{Sample, Samples, SurfacePoint};
use habitus_core::format::{Indices, SectionId};

use crate::code::{Refusal, length};
use crate::fit::hab_sample;
use crate::model::Opened;

/// C's landmarks as samples.
pub(crate) struct Landmarks<'a> {
    vertices: Indices<'a>,
    targets: &'a [[f32; 3]],
    measured: &'a [u8],
}

impl<'a> Landmarks<'a> {
    pub(crate) fn new(opened: &Opened, targets: &'a [f32], measured: &'a [u8]) -> Result<Self, Refusal> {
        let unsupported = Error::Unsupported { section: SectionId::Landmarks as u32 };
        let vertices = opened.model.landmarks().ok_or(unsupported)?;
        if !opened.is_whole() {
            return Err(Refusal::Kernel(Error::Empty));
        }
        length(4, 3 * vertices.len(), targets.len())?;
        if !measured.is_empty() {
            length(6, vertices.len(), measured.len())?;
        }
        Ok(Landmarks { vertices, targets: targets.as_chunks().0, measured })
    }
}

/// What was measured. One type for both entries: the solver is compiled once for every vector width, 40 KB each.
pub(crate) enum Measurements<'a> {
    Landmarks(Landmarks<'a>),
    Points(&'a [hab_sample]),
}

impl Samples for Measurements<'_> {
    fn len(&self) -> usize {
        match self {
            Measurements::Landmarks(landmarks) => landmarks.targets.len(),
            Measurements::Points(points) => points.len(),
        }
    }

    #[inline(always)]
    fn get(&self, index: usize) -> Option<Sample> {
        match self {
            Measurements::Landmarks(landmarks) => {
                if landmarks.measured.get(index) == Some(&0) {
                    return None;
                }
                let point = SurfacePoint::vertex(landmarks.vertices.get(index)?);
                Some(Sample { point, target: *landmarks.targets.get(index)?, normal: None, weight: 1.0 })
            }
            Measurements::Points(points) => {
                let sample = points.get(index)?;
                let point = SurfacePoint { vertices: sample.vertices, barycentric: sample.barycentric };
                let normal = (sample.normal != [0.0; 3]).then_some(sample.normal);
                Some(Sample { point, target: sample.target, normal, weight: sample.weight })
            }
        }
    }
}
