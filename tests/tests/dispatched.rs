//! The golden vectors through `habitus::evaluate`: what hosts call, with the widest vectors of this processor and over threads.

use std::ops::Range;

use habitus::evaluate;
use habitus_core::Error;
use habitus_core::fit::{FitOptions, FitReport, Frame, Samples};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::any_prepared::AnyPrepared;
use habitus_core::generator::{At, Block, Generator, LANES, NUMBERS, Weights};
use habitus_core::rotation::similarity::Similarity;
use habitus_golden::{Backend, Memory, REQUIREMENT, VECTORS, run};
use habitus_tests::small_model;

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
    let summary = run(&VECTORS, &Host, &mut memory, &mut |result| {
        if !result.is_equal() {
            eprintln!("{result:?}");
        }
    });
    println!("habitus::evaluate ({:?}): {summary:?}", pulp::Arch::new());
    assert_eq!((summary.failed, summary.differing_bits), (0, 0));
    assert!(summary.cases >= 630);
}

/// Whole ranges, over threads, at any alignment of the model's bytes: the bits of the kernel called plainly.
#[test]
fn threads_and_alignment_do_not_change_bits() {
    let file = small_model::bytes();
    let weights = Weights { identity: &[1.0, -0.5, 0.0, 0.8], pose: &[0.3, -1.2, 0.6] };
    let generator = Model::open(&file).unwrap().bilinear().unwrap();
    let (n, blocks, dim) = (generator.vertex_count(), generator.block_count(), generator.dim());
    let mut expected = vec![0.0; 3 * n];
    generator.evaluate(weights, 0..n, &mut expected).unwrap();
    let mut values = vec![0.0; blocks * NUMBERS];
    let mut jacobian = vec![0.0; blocks * NUMBERS * dim];
    generator.linearise(weights, 0..blocks, &mut values, &mut jacobian).unwrap();
    for vertex in 0..n {
        let numbers = values[vertex / LANES * NUMBERS..][..NUMBERS].try_into().unwrap();
        assert_eq!(Block::load(numbers).lane(vertex % LANES), expected[3 * vertex..][..3]);
    }
    for shift in [0, 1, 2, 3, 5, 8] {
        let mut moved = vec![0; shift];
        moved.extend_from_slice(&file);
        let generator = Model::open(&moved[shift..]).unwrap().bilinear().unwrap();
        for threads in [1, 2, 3, 8] {
            let mut out = vec![0.0; 3 * n];
            evaluate::evaluate_parallel(&generator, weights, 0..n, &mut out, threads).unwrap();
            assert_eq!(out, expected, "shift {shift}, {threads} threads");
            let (mut v, mut j) = (vec![0.0; values.len()], vec![0.0; jacobian.len()]);
            evaluate::linearise_parallel(&generator, weights, 0..blocks, &mut v, &mut j, threads).unwrap();
            assert!(v == values && j == jacobian, "shift {shift}, {threads} threads");
        }
    }
}
