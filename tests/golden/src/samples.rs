//! Samples of a fit as the vectors hold them.

use habitus_core::fit::{Sample, Samples, SurfacePoint};

use crate::memory::Pieces;
use crate::result::Problem;
use crate::text::Case;

/// Samples from the fields `kinds` (0 left out, 1 point, 2 point to plane), `corners` (3 a sample), `barycentric` (3), `targets` (3), `normals` (3)
/// and `sample_weights`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TextSamples<'m> {
    kinds: &'m [u32],
    corners: &'m [[u32; 3]],
    barycentric: &'m [[f32; 3]],
    targets: &'m [[f32; 3]],
    normals: &'m [[f32; 3]],
    weights: &'m [f32],
}

impl<'m> TextSamples<'m> {
    pub fn new(case: &Case<'_>, pieces: &mut Pieces<'m>) -> Result<Self, Problem> {
        let samples = TextSamples {
            kinds: pieces.integers(case, "kinds")?,
            corners: pieces.integers(case, "corners")?.as_chunks().0,
            barycentric: pieces.numbers(case, "barycentric")?.as_chunks().0,
            targets: pieces.numbers(case, "targets")?.as_chunks().0,
            normals: pieces.numbers(case, "normals")?.as_chunks().0,
            weights: pieces.numbers(case, "sample_weights")?,
        };
        let n = samples.kinds.len();
        let lengths = [
            samples.corners.len(),
            samples.barycentric.len(),
            samples.targets.len(),
            samples.normals.len(),
            samples.weights.len(),
        ];
        if lengths.into_iter().any(|length| length != n) { Err(Problem::Text("kinds")) } else { Ok(samples) }
    }
}

impl Samples for TextSamples<'_> {
    fn len(&self) -> usize {
        self.kinds.len()
    }

    fn get(&self, index: usize) -> Option<Sample> {
        let kind = *self.kinds.get(index)?;
        let normal = *self.normals.get(index)?;
        let point = SurfacePoint { vertices: *self.corners.get(index)?, barycentric: *self.barycentric.get(index)? };
        (kind > 0).then_some(Sample {
            point,
            target: *self.targets.get(index)?,
            normal: (kind == 2).then_some(normal),
            weight: *self.weights.get(index)?,
        })
    }
}
