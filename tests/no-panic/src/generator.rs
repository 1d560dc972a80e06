//! `generator` of the kernel: evaluation by ranges, derivatives, prepared forms.

use crate::memory::{Input, Output, status};
use core::ops::Range;
use habitus_core::Error;
use habitus_core::format::{Mode, Model};
use habitus_core::generator::prepared::{Prepared, prepared_req};
use habitus_core::generator::{At, Block, Generator, NUMBERS, Weights};

#[unsafe(no_mangle)]
unsafe extern "C" fn check_evaluate(
    bytes: Input<u8>,
    identity: Input<f32>,
    pose: Input<f32>,
    from: usize,
    to: usize,
    out: Output<f32>,
) -> i32 {
    // SAFETY: the caller's promise.
    let (bytes, identity, pose, out) = unsafe { (bytes.slice(), identity.slice(), pose.slice(), out.slice()) };
    let weights = Weights { identity, pose };
    status(Model::open(bytes).and_then(|model| model.bilinear()?.evaluate(weights, from..to, out)))
}

#[unsafe(no_mangle)]
unsafe extern "C" fn check_linearise(
    bytes: Input<u8>,
    identity: Input<f32>,
    pose: Input<f32>,
    blocks: [usize; 2],
    values: Output<f32>,
    jacobian: Output<f32>,
) -> i32 {
    // SAFETY: the caller's promise.
    let (bytes, identity, pose) = unsafe { (bytes.slice(), identity.slice(), pose.slice()) };
    // SAFETY: the caller's promise.
    let (values, jacobian) = unsafe { (values.slice(), jacobian.slice()) };
    let ([from, to], weights) = (blocks, Weights { identity, pose });
    status(Model::open(bytes).and_then(|model| model.bilinear()?.linearise(weights, from..to, values, jacobian)))
}

/// A prepared form over memory that another call has filled, with whatever is in it.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_of_numbers(
    bytes: Input<u8>,
    fix_identity: bool,
    free: Input<f32>,
    blocks: [usize; 2],
    filled: Input<f32>,
    values: Output<f32>,
    jacobian: Output<f32>,
) -> i32 {
    // SAFETY: the caller's promise.
    let (bytes, free, filled) = unsafe { (bytes.slice(), free.slice(), filled.slice()) };
    // SAFETY: the caller's promise.
    let (values, jacobian) = unsafe { (values.slice(), jacobian.slice()) };
    let mut run = || {
        let generator = Model::open(bytes)?.bilinear()?;
        let [from, to] = blocks;
        if fix_identity {
            let form = Prepared::of_numbers(&generator, Mode::Identity, from..to, filled)?;
            form.linearise(Weights { identity: &[], pose: free }, from..to, values, jacobian)
        } else {
            let form = Prepared::of_numbers(&generator, Mode::Pose, from..to, filled)?;
            form.linearise(Weights { identity: free, pose: &[] }, from..to, values, jacobian)
        }
    };
    status(run())
}

/// Everything that trusts an evaluation to be the generator's own, with one that another model of any kind has begun.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_unchecked(
    bytes: Input<u8>,
    other: Input<u8>,
    identity: Input<f32>,
    pose: Input<f32>,
    derivatives: bool,
    index: usize,
    jacobian: Output<f32>,
    numbers: Output<f32>,
    state: Output<f32>,
) -> i32 {
    // SAFETY: the caller's promise.
    let (bytes, other, identity, pose) = unsafe { (bytes.slice(), other.slice(), identity.slice(), pose.slice()) };
    // SAFETY: the caller's promise.
    let (jacobian, numbers, state) = unsafe { (jacobian.slice(), numbers.slice(), state.slice()) };
    let mut run = || {
        let (generator, other) = (Model::open(bytes)?.generator()?, Model::open(other)?.generator()?);
        let at = other.begin(Weights { identity, pose }, derivatives, state)?;
        unchecked(&generator, at, index, jacobian, numbers);
        let joint = generator.joint_position(at, index).unwrap_or_default();
        for (to, value) in numbers.iter_mut().zip(joint) {
            *to += value;
        }
        Ok::<(), Error>(())
    };
    status(run())
}

/// The same through a form with one group fixed.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_prepared(
    bytes: Input<u8>,
    fix_identity: bool,
    fixed: Input<f32>,
    free: Input<f32>,
    blocks: [usize; 2],
    jacobian: Output<f32>,
    numbers: Output<f32>,
    workspace: Output<f32>,
) -> i32 {
    // SAFETY: the caller's promise.
    let (bytes, fixed, free) = unsafe { (bytes.slice(), fixed.slice(), free.slice()) };
    // SAFETY: the caller's promise.
    let (jacobian, numbers, workspace) = unsafe { (jacobian.slice(), numbers.slice(), workspace.slice()) };
    let [from, to] = blocks;
    status(prepared(bytes, fix_identity, fixed, free, from..to, jacobian, numbers, workspace))
}

#[allow(clippy::too_many_arguments)]
fn prepared(
    bytes: &[u8],
    fix_identity: bool,
    fixed: &[f32],
    free: &[f32],
    blocks: Range<usize>,
    jacobian: &mut [f32],
    numbers: &mut [f32],
    workspace: &mut [f32],
) -> Result<(), Error> {
    let generator = Model::open(bytes)?.bilinear()?;
    let mode = if fix_identity { Mode::Identity } else { Mode::Pose };
    prepared_req(&generator, mode, &blocks).check(workspace.len())?;
    let generator = Prepared::new(&generator, mode, fixed, blocks.clone(), workspace)?;
    let weights = match generator.free() {
        Mode::Identity => Weights { identity: free, pose: &[] },
        Mode::Pose => Weights { identity: &[], pose: free },
    };
    unchecked(&generator, generator.begin(weights, true, &mut [])?, blocks.end, jacobian, numbers);
    generator.evaluate(weights, blocks, numbers)
}

fn unchecked(generator: &impl Generator, at: At<'_>, index: usize, jacobian: &mut [f32], numbers: &mut [f32]) {
    let columns = jacobian.as_chunks_mut::<NUMBERS>().0;
    let mut sum = generator.block_unchecked(at, index).unwrap_or(Block::ZERO).lane(index);
    let linearised = generator.linearised_block_unchecked(at, index, columns).unwrap_or(Block::ZERO);
    let vertex = generator.vertex_unchecked(at, index).unwrap_or_default();
    let columns = jacobian.as_chunks_mut::<3>().0;
    let linearised_vertex = generator.linearised_vertex_unchecked(at, index, columns).unwrap_or_default();
    for values in [linearised.lane(index), vertex, linearised_vertex] {
        for (sum, value) in sum.iter_mut().zip(values) {
            *sum += value;
        }
    }
    for (to, value) in numbers.iter_mut().zip(sum) {
        *to = value;
    }
}
