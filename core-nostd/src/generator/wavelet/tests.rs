//! Tests of the wavelet generator: against its definition, levels and windows, derivatives, prepared forms, files, refusals.

use std::vec::Vec;

use super::*;
use crate::format::{Checksums, ElementType, Mode, Model, forged};
use crate::generator::any::AnyGenerator;
use crate::generator::any_prepared::AnyPrepared;
use crate::quantise::{F16, F32, I8};
use crate::testing::{Stream, Waves};
use crate::wavelet::transform::{synthesis, synthesis_req};
use proptest::prelude::*;

const STORAGES: [ElementType; 3] = [ElementType::F32, ElementType::F16, ElementType::I8];

fn weights_of(generator: &impl Generator, seed: u32) -> [Vec<f32>; 2] {
    let mut stream = Stream::new(seed);
    [stream.take(Generator::identity_dim(generator)), stream.take(Generator::pose_dim(generator))]
}

/// Every number of the state counts, and what is in it does not.
fn begun<'a>(generator: &impl Generator, weights: Weights<'a>, derivatives: bool, state: &'a mut Vec<f32>) -> At<'a> {
    state.resize(generator.state_req(derivatives).numbers(), f32::NAN);
    generator.begin(weights, derivatives, state).unwrap()
}

fn evaluated(generator: &impl Generator, identity: &[f32], pose: &[f32]) -> Vec<f32> {
    let mut state = Vec::new();
    let at = begun(generator, Weights { identity, pose }, false, &mut state);
    let mut out = vec![f32::NAN; 3 * generator.vertex_count()];
    generator.evaluate_at(at, 0..generator.vertex_count(), &mut out).unwrap();
    out
}

fn opened(file: &[u8]) -> AnyGenerator<'_> {
    Model::open(file).unwrap().generator().unwrap()
}

/// Each kind of storage as its own type.
macro_rules! each_storage {
    ($any:expr, $generator:ident => $body:expr) => {
        match $any {
            AnyGenerator::WaveletF32($generator) => $body,
            AnyGenerator::WaveletF16($generator) => $body,
            AnyGenerator::WaveletI8($generator) => $body,
            _ => panic!("no wavelet model"),
        }
    };
}

/// The surface by the definition, in f64: explicit sums of each coefficient, then the synthesis.
fn defined<'a, S: Storage<'a>>(generator: &Multiscale<Stored<'a, S>>, identity: &[f32], pose: &[f32]) -> Vec<f64> {
    let (grid, [d, e]) = (generator.whole_grid(), [generator.locals.identity_dim(), generator.locals.pose_dim()]);
    let n = grid.len();
    let mut coefficients = vec![0.0; 3 * n];
    let mut core = vec![[0.0; 3]; d * e];
    for q in 0..n {
        let mean = generator.locals.one(q, &mut core).unwrap();
        for axis in 0..3 {
            let mut sum = f64::from(mean[axis]);
            for (k, term) in core.iter().enumerate() {
                let x = identity.get(q * d + k / e).copied().unwrap_or(0.0);
                let y = pose.get(q * e + k % e).copied().unwrap_or(0.0);
                sum += f64::from(x) * f64::from(y) * f64::from(term[axis]);
            }
            coefficients[axis * n + q] = sum;
        }
    }
    let level = generator.grid().levels();
    let mut planes = vec![0.0; 3 * grid.node_count(level)];
    let mut workspace = vec![0.0; synthesis_req(grid, level).numbers()];
    synthesis(grid, generator.wavelet(), level, &coefficients, &mut planes, &mut workspace).unwrap();
    let area = planes.len() / 3;
    (0..planes.len()).map(|k| planes[k % 3 * area + k / 3]).collect()
}

fn waves() -> impl Strategy<Value = Waves> {
    ((2u32..5, 2u32..5), 0u32..4, proptest::bool::ANY, (1u32..4, 1u32..4), 0usize..3).prop_map(
        |((width, height), levels, bilinear, (d, e), element)| Waves {
            base: [width, height],
            levels,
            bilinear,
            dims: [d, e],
            element: STORAGES[element],
        },
    )
}

/// Coefficients of the file, as they were written.
#[test]
fn coefficients_lie_where_the_format_says() {
    let waves = Waves::new([3, 2], 2);
    let (file, values, header) = (waves.file(5), waves.values(5), waves.header());
    let generator = Model::open(&file).unwrap().wavelet::<F32<'_>>().unwrap();
    let mut core = [[0.0; 3]; 6];
    for q in 0..generator.grid().len() {
        let number = |term: usize, axis: usize| values[((q / 16 * header.n_terms() + term) * 3 + axis) * 16 + q % 16];
        let mean = generator.locals.one(q, &mut core).unwrap();
        assert_eq!(mean, [number(0, 0), number(0, 1), number(0, 2)]);
        for (k, term) in core.iter().enumerate() {
            assert_eq!(*term, [number(k + 1, 0), number(k + 1, 1), number(k + 1, 2)]);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::testing::cases()))]

    #[test]
    fn surfaces_are_the_synthesis_of_local_sums(waves in waves(), seed in 1u32..1000) {
        let file = waves.file(seed);
        let any = opened(&file);
        let [identity, pose] = weights_of(&any, seed);
        let found = evaluated(&any, &identity, &pose);
        let expected = each_storage!(&any, generator => defined(generator, &identity, &pose));
        for (found, expected) in found.iter().zip(&expected) {
            prop_assert!((f64::from(*found) - expected).abs() < 5e-4, "{} {}", found, expected);
        }
    }

    #[test]
    fn levels_and_windows_have_the_bits_of_the_whole(
        waves in waves(), levels in proptest::array::uniform2(0usize..4), places in proptest::array::uniform4(0.0f64..1.0),
        seed in 1u32..1000,
    ) {
        let file = waves.file(seed);
        let [detail, resolution] = levels.map(|level| level.min(waves.levels as usize));
        {
            let whole = opened(&file);
            let coarse = whole.with_levels(detail, resolution).unwrap();
            let [identity, pose] = weights_of(&whole, seed);
            let (few, poses) = (&identity[..coarse.identity_dim()], &pose[..coarse.pose_dim()]);
            let surface = evaluated(&coarse, few, poses);
            // Finer weights of zero are the means.
            let padded = |weights: &[f32], dim| [weights, &vec![0.0; dim][weights.len()..]].concat();
            let all = whole.with_levels(waves.levels as usize, resolution).unwrap();
            let expected =
                evaluated(&all, &padded(few, whole.identity_dim()), &padded(poses, whole.pose_dim()));
            prop_assert_eq!(&surface, &expected);
            let grid = each_storage!(&coarse, generator => *generator.grid());
            let range = |size: usize, a: f64, b: f64| {
                let (a, b) = ((a * size as f64) as usize, (b * size as f64) as usize);
                a.min(b)..a.max(b) + 1
            };
            let columns = range(grid.width(resolution), places[0], places[1]);
            let rows = range(grid.height(resolution), places[2], places[3]);
            let window = coarse.with_window(columns.clone(), rows.clone()).unwrap();
            let found = evaluated(&window, few, poses);
            prop_assert_eq!(found.len(), 3 * columns.len() * rows.len());
            for (vertex, found) in found.as_chunks::<3>().0.iter().enumerate() {
                let [column, row] = each_storage!(&window, generator => generator.node(vertex)).unwrap();
                prop_assert!(columns.contains(&column) && rows.contains(&row));
                let node = row * grid.width(resolution) + column;
                prop_assert_eq!(&found[..], &surface[3 * node..3 * node + 3]);
            }
            // Ranges, and single vertices.
            let mut state = Vec::new();
            let at = begun(&window, Weights { identity: few, pose: poses }, false, &mut state);
            let (n, cut) = (window.vertex_count(), (places[0] * window.vertex_count() as f64) as usize);
            let mut out = vec![0.0; 3 * n];
            let (first, second) = out.split_at_mut(3 * cut);
            window.evaluate_at(at, 0..cut, first).unwrap();
            window.evaluate_at(at, cut..n, second).unwrap();
            prop_assert_eq!(&out, &found);
            prop_assert_eq!(&window.vertex_unchecked(at, cut).unwrap()[..], &out[3 * cut..3 * cut + 3]);
            prop_assert_eq!(window.vertex_unchecked(at, n), None);
        }
    }

    #[test]
    fn gradients_are_the_transposed_jacobian(waves in waves(), detail in 0usize..2, seed in 1u32..1000) {
        let waves = Waves { levels: waves.levels.min(2), ..waves };
        let (file, levels) = (waves.file(seed), waves.levels as usize);
        let whole = opened(&file);
        let generator = whole.with_levels(detail.min(levels), levels).unwrap();
        let [identity, pose] = weights_of(&generator, seed);
        let (blocks, dim) = (generator.block_count(), Generator::dim(&generator));
        let (mut values, mut jacobian) = (vec![0.0; 48 * blocks], vec![f32::NAN; 48 * blocks * dim]);
        let mut state = Vec::new();
        let at = begun(&generator, Weights { identity: &identity, pose: &pose }, true, &mut state);
        generator.linearise_at(at, 0..blocks, &mut values, &mut jacobian).unwrap();
        let g = Stream::new(seed + 1).take(3 * generator.vertex_count());
        let mut workspace = vec![f32::NAN; generator.gradient_req().numbers()];
        let mut gradient = vec![f32::NAN; dim];
        generator.gradient_at(at, &g, &mut gradient, &mut workspace).unwrap();
        for (k, found) in gradient.into_iter().enumerate() {
            let product = |c: usize| {
                f64::from(jacobian[(c / 48 * dim + k) * 48 + c % 3 * 16 + c / 3 % 16]) * f64::from(g[c])
            };
            let (sum, size) = (0..g.len()).map(product).fold((0.0, 0.0), |(sum, size), x| (sum + x, size + x.abs()));
            // As many roundings as there are terms, each of half a unit.
            let tolerance = g.len() as f64 * f64::from(f32::EPSILON) * size;
            prop_assert!((f64::from(found) - sum).abs() <= tolerance, "{} {} {}", k, found, sum);
        }
    }

    #[test]
    fn derivatives_match_central_differences(waves in waves(), detail in 0usize..2, seed in 1u32..1000) {
        let waves = Waves { levels: waves.levels.min(2), ..waves };
        let file = waves.file(seed);
        {
            let whole = opened(&file);
            let levels = waves.levels as usize;
            let generator = whole.with_levels(detail.min(levels), levels).unwrap();
            let [identity, pose] = weights_of(&generator, seed);
            let weights = Weights { identity: &identity, pose: &pose };
            let (blocks, dim) = (generator.block_count(), Generator::dim(&generator));
            let (mut values, mut jacobian) = (vec![0.0; 48 * blocks], vec![f32::NAN; 48 * blocks * dim]);
            let mut state = Vec::new();
            let at = begun(&generator, weights, true, &mut state);
            generator.linearise_at(at, 0..blocks, &mut values, &mut jacobian).unwrap();
            let positions = evaluated(&generator, &identity, &pose);
            let mut one = vec![[0.0; 3]; dim];
            for k in (0..dim).step_by(1 + dim / 20) {
                let moved = |step: f32| {
                    let (mut x, mut y) = (identity.clone(), pose.clone());
                    if k < x.len() { x[k] += step } else { y[k - identity.len()] += step }
                    evaluated(&generator, &x, &y)
                };
                let (above, below) = (moved(1.0), moved(-1.0));
                for vertex in 0..generator.vertex_count() {
                    if k == 0 {
                        let position = generator.linearised_vertex_unchecked(at, vertex, &mut one).unwrap();
                        prop_assert_eq!(&position[..], &positions[3 * vertex..3 * vertex + 3]);
                    }
                    for axis in 0..3 {
                        let place = axis * 16 + vertex % 16;
                        let column = jacobian[(vertex / 16 * dim + k) * 48 + place];
                        let difference = (above[3 * vertex + axis] - below[3 * vertex + axis]) / 2.0;
                        prop_assert!((difference - column).abs() < 1e-3, "{} {}", difference, column);
                        prop_assert_eq!(values[vertex / 16 * 48 + place], positions[3 * vertex + axis]);
                        if k == 0 {
                            prop_assert_eq!(one[0][axis], column);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn prepared_forms_agree_with_the_whole(waves in waves(), from in 0usize..4, count in 0usize..4, seed in 1u32..1000) {
        let file = waves.file(seed);
        let any = opened(&file);
        let [identity, pose] = weights_of(&any, seed);
        let whole = evaluated(&any, &identity, &pose);
        let last = any.block_count();
        let blocks = from.min(last)..(from + count).min(last);
        for (fixed, weights) in [(Mode::Identity, &identity), (Mode::Pose, &pose)] {
            let mut memory = vec![f32::NAN; any.prepared_req(fixed, &blocks).unwrap().numbers()];
            let form = any.prepared(fixed, weights, blocks.clone(), &mut memory).unwrap();
            let (free, out) = match fixed {
                Mode::Identity => (Mode::Pose, evaluated(&form, &[], &pose)),
                Mode::Pose => (Mode::Identity, evaluated(&form, &identity, &[])),
            };
            prop_assert_eq!(form.free(), free);
            let expected = &whole[(48 * blocks.start).min(whole.len())..(48 * blocks.end).min(whole.len())];
            prop_assert_eq!(out.len(), expected.len());
            for (a, b) in out.iter().zip(expected) {
                prop_assert!((a - b).abs() < 5e-4);
                prop_assert!(fixed == Mode::Identity || a == b);
            }
        }
    }
}

/// The derivatives of a prepared form are those of the whole by the weights that are left.
#[test]
fn prepared_forms_have_derivatives() {
    let file = Waves::new([2, 3], 1).file(3);
    let any = opened(&file);
    let [identity, pose] = weights_of(&any, 4);
    let n = any.vertex_count();
    let mut state = Vec::new();
    let at = begun(&any, Weights { identity: &identity, pose: &pose }, true, &mut state);
    let mut memory = vec![0.0; any.prepared_req(Mode::Pose, &(0..1)).unwrap().numbers()];
    let form = any.prepared(Mode::Pose, &pose, 0..any.block_count(), &mut memory).unwrap();
    let AnyPrepared::WaveletF32(form) = form else { panic!() };
    let mut own = Vec::new();
    let own = begun(&form, Weights { identity: &identity, pose: &[] }, true, &mut own);
    let (mut all, mut some) = (vec![[0.0; 3]; any.dim()], vec![[0.0; 3]; identity.len()]);
    for vertex in 0..n {
        any.linearised_vertex_unchecked(at, vertex, &mut all).unwrap();
        form.linearised_vertex_unchecked(own, vertex, &mut some).unwrap();
        assert_eq!(all[..identity.len()], some);
    }
}

#[test]
fn refusals() {
    let file = Waves::new([3, 2], 2).file(1);
    let model = Model::open(&file).unwrap();
    let generator = model.wavelet::<F32<'_>>().unwrap();
    let wrong = |expected: u32, found: u32| Some(Error::WrongKind { expected, found });
    assert_eq!(model.bilinear().err(), wrong(1, 4));
    assert_eq!(model.linear::<F32<'_>>().err(), wrong(2, 4));
    assert_eq!(model.wavelet::<F16<'_>>().err(), wrong(4, 3));
    assert_eq!(model.wavelet::<I8<'_>>().err(), wrong(5, 3));
    let bilinear = crate::testing::model_file(&crate::testing::header(20, 2, 2, false), 1);
    assert_eq!(Model::open(&bilinear).unwrap().wavelet::<F32<'_>>().err(), wrong(4, 1));
    let beyond = |index: u32, limit: u32| Some(Error::IndexOutOfRange { index, limit });
    assert_eq!(generator.with_levels(3, 0).err(), beyond(3, 3));
    assert_eq!(generator.with_levels(0, 3).err(), beyond(3, 3));
    assert_eq!(generator.with_window(0..10, 0..1).err(), beyond(10, 9));
    assert_eq!(generator.with_window(0..9, 3..6).err(), beyond(6, 5));
    #[allow(clippy::reversed_empty_ranges)]
    let reversed = generator.with_window(4..2, 0..1).err();
    assert_eq!(reversed, beyond(4, 9));
    assert_eq!(generator.with_window(2..2, 0..1).err(), Some(Error::Empty));
    let (identity, pose) = (vec![0.5; 3 * 45], vec![0.5; 2 * 45]);
    let mut state = vec![7.0; generator.state_req(true).numbers()];
    let needed = generator.state_req(false).numbers();
    let mut run = |identity: &[f32], pose: &[f32], len: usize| {
        generator.begin(Weights { identity, pose }, false, &mut state[..len]).err()
    };
    assert_eq!(run(&identity[1..], &pose, needed), Some(Error::DimensionMismatch { expected: 135, found: 134 }));
    assert_eq!(run(&identity, &pose[1..], needed), Some(Error::DimensionMismatch { expected: 90, found: 89 }));
    assert_eq!(run(&identity, &[&pose[1..], &[f32::NAN]].concat(), needed), Some(Error::NotFinite { index: 224 }));
    let short = Error::WorkspaceTooSmall { needed: needed as u32, given: needed as u32 - 1 };
    assert_eq!(run(&identity, &pose, needed - 1), Some(short));
    assert!(state.iter().all(|&value| value == 7.0));
    let at = generator.begin(Weights { identity: &identity, pose: &pose }, false, &mut state).unwrap();
    let (mut values, mut jacobian) = (vec![7.0; 48 * 3], vec![7.0; 48 * 3 * 225]);
    let refused = generator.linearise_at(At { state: &at.state[..needed], ..at }, 0..3, &mut values, &mut jacobian);
    assert!(matches!(refused, Err(Error::WorkspaceTooSmall { .. })));
    let mut out = [7.0; 3];
    let refused = generator.evaluate(Weights { identity: &identity, pose: &pose }, 0..1, &mut out);
    assert!(matches!(refused, Err(Error::WorkspaceTooSmall { .. })));
    assert_eq!((out, values[0], jacobian[0]), ([7.0; 3], 7.0, 7.0));

    let any = model.generator().unwrap();
    let needed = any.prepared_req(Mode::Identity, &(0..3)).unwrap().numbers();
    let mut memory = vec![7.0; needed];
    let mut run = |weights: &[f32], blocks: Range<usize>, len: usize| {
        any.prepared(Mode::Identity, weights, blocks, &mut memory[..len]).err()
    };
    assert_eq!(run(&identity[1..], 0..3, needed), Some(Error::DimensionMismatch { expected: 135, found: 134 }));
    assert_eq!(run(&[f32::INFINITY; 135], 0..3, needed), Some(Error::NotFinite { index: 0 }));
    assert_eq!(run(&identity, 0..4, needed), beyond(4, 3));
    let short = Error::WorkspaceTooSmall { needed: needed as u32, given: needed as u32 - 1 };
    assert_eq!(run(&identity, 0..3, needed - 1), Some(short));
    assert!(memory.iter().all(|&value| value == 7.0));
}

/// Behind repaired checksums: refused, or opened as a model that evaluates to numbers.
#[test]
fn every_forged_byte_is_refused_or_harmless() {
    let mut opened = 0;
    for element in STORAGES {
        let waves = Waves { dims: [1, 2], element, ..Waves::new([2, 3], 1) };
        let file = waves.file(2);
        for at in 0..file.len() {
            for flip in [0xff, 0x01, 0x80] {
                let mut damaged = file.clone();
                damaged[at] ^= flip;
                assert!(Model::open(&damaged).is_err(), "byte {at} ^ {flip:#x}");
                let forged = forged(&file, |file| file[at] ^= flip);
                let Ok(model) = Model::open_with(&forged, Checksums::Skip) else { continue };
                let any = model.generator().unwrap();
                let [identity, pose] = weights_of(&any, 3);
                assert!(evaluated(&any, &identity, &pose).iter().all(|value| value.is_finite()), "{at}");
                opened += 1;
            }
        }
    }
    assert!(opened > 1000, "numbers inside their limits are harmless: {opened}");
}

/// Numbers of the state of the published grid: all of it, its levels 0 and 1 on a coarse mesh, and one node.
#[test]
fn memory_of_the_published_grid() {
    let file = Waves { dims: [1, 1], ..Waves::new([5, 7], 5) }.file(1);
    let generator = Model::open(&file).unwrap().wavelet::<F32<'_>>().unwrap();
    let generators = [
        generator,
        generator.with_levels(1, 3).unwrap(),
        generator.with_window(32..96, 64..80).unwrap(),
        generator.with_window(64..65, 96..97).unwrap(),
    ];
    assert_eq!(generators.map(|generator| generator.state_req(false).numbers()), [106_901, 8_873, 8_990, 377]);
}

/// Time of one evaluation of 24 897 local models of 3 x 10 x 5.
#[test]
#[ignore = "a measurement"]
fn time_of_the_published_grid() {
    for element in STORAGES {
        let file = Waves { dims: [10, 5], element, ..Waves::new([5, 7], 5) }.file(1);
        {
            let generator = opened(&file);
            let [identity, pose] = weights_of(&generator, 3);
            let mut state = vec![0.0; generator.state_req(false).numbers()];
            let weights = Weights { identity: &identity, pose: &pose };
            let time = |run: &mut dyn FnMut()| {
                let times = (0..20).map(|_| {
                    let start = std::time::Instant::now();
                    run();
                    start.elapsed()
                });
                times.min().unwrap()
            };
            let whole = time(&mut || {
                generator.begin(weights, false, &mut state).unwrap();
            });
            let at = generator.begin(weights, false, &mut state).unwrap();
            let mut out = vec![0.0; 3 * 24_897];
            let copy = time(&mut || generator.evaluate_at(at, 0..24_897, &mut out).unwrap());
            let coarse = generator.with_levels(0, 5).unwrap();
            let weights = Weights { identity: &identity[..coarse.identity_dim()], pose: &pose[..coarse.pose_dim()] };
            let synthesis = time(&mut || {
                coarse.begin(weights, false, &mut state).unwrap();
            });
            let bytes = vec![1u8; file.len()];
            let words = bytes.as_chunks::<8>().0;
            let mut sum = 0u64;
            let read =
                time(&mut || sum = words.iter().fold(sum, |sum, word| sum.wrapping_add(u64::from_le_bytes(*word))));
            std::println!(
                "{element:?}: {} MB, begin {whole:?}, means alone {synthesis:?}, copy {copy:?}, read {read:?} {sum}",
                file.len() / 1_000_000
            );
        }
    }
}
