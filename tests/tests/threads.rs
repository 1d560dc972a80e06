//! What hosts call over threads and at any alignment of a model's bytes has the bits of the kernel called plainly.

use habitus::evaluate;
use habitus_core::format::Model;
use habitus_core::generator::{Block, Generator, LANES, NUMBERS, Weights};
use habitus_tests::small_model;

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
