//! The golden vectors through `habitus::evaluate`: what hosts call, with the widest vectors of this processor.
//!
//! Only optimised builds inline the kernels into wrappers for wider vectors: `cargo test --release -p habitus-tests --test dispatched`.
#![cfg(not(debug_assertions))]

use std::ops::Range;

use habitus::evaluate;
use habitus_core::Error;
use habitus_core::fit::{FitOptions, FitReport, Frame, Samples};
use habitus_core::format::Mode;
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::any_prepared::AnyPrepared;
use habitus_core::generator::{At, Block, Generator, NUMBERS, Weights};
use habitus_core::rotation::similarity::Similarity;
use habitus_golden::{Backend, Memory, REQUIREMENT, VECTORS, run_with};

struct Host;

impl Backend for Host {
    fn evaluate<G: Generator>(
        &self,
        generator: &G,
        at: At<'_>,
        vertices: Range<usize>,
        out: &mut [f32],
    ) -> Result<(), Error> {
        evaluate::evaluate_at(generator, at, vertices, out)
    }

    fn evaluate_batch<G: Generator>(
        &self,
        generator: &G,
        ats: &[At<'_>],
        vertices: Range<usize>,
        out: &mut [f32],
    ) -> Result<(), Error> {
        evaluate::evaluate_batch_at(generator, ats, vertices, out)
    }

    fn linearised_block<G: Generator>(
        &self,
        generator: &G,
        at: At<'_>,
        block: usize,
        jacobian: &mut [[f32; NUMBERS]],
    ) -> Option<Block> {
        let mut values = [0.0; NUMBERS];
        let columns = jacobian.get_mut(..generator.dim())?.as_flattened_mut();
        evaluate::linearise_at(generator, at, block..block + 1, &mut values, columns).ok()?;
        Some(Block::load(&values))
    }

    fn prepared<'w>(
        &self,
        generator: &AnyGenerator<'w>,
        fixed: Mode,
        weights: &[f32],
        blocks: Range<usize>,
        workspace: &'w mut [f32],
    ) -> Result<AnyPrepared<'w, 'w>, Error> {
        evaluate::any_prepared(generator, fixed, weights, blocks, workspace)
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
        evaluate::normal_equations(generator, weights, samples, placement, frame, jtj, jtr, workspace)
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
        evaluate::fit_points(generator, samples, options, identity, pose, placement, workspace)
    }
}

#[test]
fn dispatched_kernels_give_the_golden_bits() {
    let mut memory = Memory {
        floats: &mut vec![0.0; REQUIREMENT.floats],
        doubles: &mut vec![0.0; REQUIREMENT.doubles],
        bytes: &mut vec![0; REQUIREMENT.bytes],
        indices: &mut vec![0; REQUIREMENT.indices],
    };
    let summary = run_with(&Host, &VECTORS, &mut memory, &mut |result| {
        if !result.is_equal() {
            eprintln!("{result:?}");
        }
    });
    println!("habitus::evaluate ({:?}): {summary:?}", pulp::Arch::new());
    assert_eq!((summary.failed, summary.differing_bits), (0, 0));
    assert!(summary.cases >= 630);
}
