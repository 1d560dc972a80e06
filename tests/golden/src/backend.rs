//! How a kernel is called: directly, or by functions that choose the width of the vectors.

use core::ops::Range;

use habitus_core::Error;
use habitus_core::fit::{FitOptions, FitReport, Frame, Samples, fit_points, normal_equations};
use habitus_core::format::Mode;
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::any_prepared::AnyPrepared;
use habitus_core::generator::{At, Block, Generator, NUMBERS, Weights};
use habitus_core::rotation::similarity::Similarity;

/// A way to call the kernels: by default the core itself. Override what is to be called otherwise.
#[allow(clippy::too_many_arguments, missing_docs)]
pub trait Backend {
    fn evaluate<G: Generator>(
        &self,
        generator: &G,
        at: At<'_>,
        vertices: Range<usize>,
        out: &mut [f32],
    ) -> Result<(), Error> {
        generator.evaluate_at(at, vertices, out)
    }

    fn evaluate_batch<G: Generator>(
        &self,
        generator: &G,
        ats: &[At<'_>],
        vertices: Range<usize>,
        out: &mut [f32],
    ) -> Result<(), Error> {
        generator.evaluate_batch_at(ats, vertices, out)
    }

    fn linearised_block<G: Generator>(
        &self,
        generator: &G,
        at: At<'_>,
        block: usize,
        jacobian: &mut [[f32; NUMBERS]],
    ) -> Option<Block> {
        generator.linearised_block_unchecked(at, block, jacobian)
    }

    fn prepared<'w>(
        &self,
        generator: &AnyGenerator<'w>,
        fixed: Mode,
        weights: &[f32],
        blocks: Range<usize>,
        workspace: &'w mut [f32],
    ) -> Result<AnyPrepared<'w, 'w>, Error> {
        generator.prepared(fixed, weights, blocks, workspace)
    }

    fn normal_equations<G: Generator, S: Samples>(
        &self,
        generator: &G,
        weights: Weights<'_>,
        samples: &S,
        placement: &Similarity<f32>,
        frame: Frame,
        jtj: &mut [f32],
        jtr: &mut [f32],
        workspace: &mut [f32],
    ) -> Result<f32, Error> {
        normal_equations(generator, weights, samples, placement, frame, jtj, jtr, workspace)
    }

    fn fit_points<G: Generator, S: Samples>(
        &self,
        generator: &G,
        samples: &S,
        options: &FitOptions<'_>,
        identity: &mut [f32],
        pose: &mut [f32],
        placement: &mut Similarity<f32>,
        workspace: &mut [f32],
    ) -> Result<FitReport, Error> {
        fit_points(generator, samples, options, identity, pose, placement, workspace)
    }
}

/// Plain calls.
#[derive(Debug, Clone, Copy, Default)]
pub struct Plain;

impl Backend for Plain {}
