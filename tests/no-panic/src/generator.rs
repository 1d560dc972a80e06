//! `generator` of the kernel, every kind and storage: evaluation by ranges, derivatives, prepared forms.

use crate::memory::{Input, Output, status};
use core::ops::Range;
use habitus_core::Error;
use habitus_core::format::{Mode, Model};
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::prepared::{Prepared, prepared_req};
use habitus_core::generator::skinned::Blend;
use habitus_core::generator::wavelet::{with_fixed, with_fixed_req};
use habitus_core::generator::{At, Block, Generator, NUMBERS, Weights};
use habitus_core::quantise::{F16, F32, I8, Storage};
use habitus_core::skeleton::JointMode;

/// What the calls take; each uses what it needs.
#[repr(C)]
struct Call {
    bytes: Input<u8>,
    identity: Input<f32>,
    pose: Input<f32>,
    from: usize,
    to: usize,
    at: usize,
    /// Fixes the identity, or the pose; blends dual quaternions; leaves the joints in the mean.
    choices: [bool; 3],
    filled: Input<f32>,
    state: Output<f32>,
    values: Output<f32>,
    jacobian: Output<f32>,
    workspace: Output<f32>,
}

/// The same with slices.
struct Slices<'a> {
    bytes: &'a [u8],
    weights: Weights<'a>,
    range: Range<usize>,
    at: usize,
    choices: [bool; 3],
    filled: &'a [f32],
    state: &'a mut [f32],
    values: &'a mut [f32],
    jacobian: &'a mut [f32],
    workspace: &'a mut [f32],
}

impl Call {
    /// # Safety
    /// As for each of the pieces.
    unsafe fn slices<'a>(&self) -> Slices<'a> {
        // SAFETY: the caller's promise.
        let (bytes, identity, pose) = unsafe { (self.bytes.slice(), self.identity.slice(), self.pose.slice()) };
        // SAFETY: the caller's promise.
        let (filled, state) = unsafe { (self.filled.slice(), self.state.slice()) };
        // SAFETY: the caller's promise.
        let (values, jacobian) = unsafe { (self.values.slice(), self.jacobian.slice()) };
        // SAFETY: the caller's promise.
        let workspace = unsafe { self.workspace.slice() };
        let weights = Weights { identity, pose };
        let (range, at, choices) = (self.from..self.to, self.at, self.choices);
        Slices { bytes, weights, range, at, choices, filled, state, values, jacobian, workspace }
    }
}

fn mode(fix_identity: bool) -> Mode {
    if fix_identity { Mode::Identity } else { Mode::Pose }
}

/// The second step by ranges of vertices and of blocks, and every method that trusts its caller. One copy for each generator: inlined everywhere, the
/// kernels would take minutes to compile.
#[inline(never)]
fn used(generator: &impl Generator, call: &mut Slices<'_>) -> Result<(), Error> {
    let at = generator.begin(call.weights, call.choices[0], call.state)?;
    generator.evaluate_at(at, call.range.clone(), call.values)?;
    generator.evaluate_batch_at(&[at, at], call.range.clone(), call.values)?;
    if generator.gradient_req().check(call.workspace.len()).is_ok() {
        generator.gradient_at(at, call.filled, call.jacobian, call.workspace)?;
    }
    generator.linearise_at(at, call.range.clone(), call.values, call.jacobian)?;
    unchecked(generator, at, call.at, call.jacobian, call.values);
    Ok(())
}

fn unchecked(generator: &impl Generator, at: At<'_>, index: usize, jacobian: &mut [f32], numbers: &mut [f32]) {
    let columns = jacobian.as_chunks_mut::<NUMBERS>().0;
    let mut sum = generator.block_unchecked(at, index).unwrap_or(Block::ZERO).lane(index);
    let linearised = generator.linearised_block_unchecked(at, index, columns).unwrap_or(Block::ZERO);
    if let Some(column) = columns.first_mut() {
        linearised.store(column);
    }
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

/// State, weights and range of one model, handed to the generator of another.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_state_of_another(call: Call, other: Input<u8>) -> i32 {
    // SAFETY: the caller's promise.
    let (call, other) = unsafe { (call.slices(), other.slice()) };
    let run = || {
        let (one, other) = (Model::open(call.bytes)?.generator()?, Model::open(other)?.generator()?);
        let at = one.begin(call.weights, call.choices[0], call.state)?;
        unchecked(&other, at, call.at, call.jacobian, call.values);
        other.evaluate_at(at, call.range.clone(), call.values)?;
        other.linearise_at(at, call.range, call.values, call.jacobian)
    };
    status(run())
}

/// A generator of whatever kind the file has.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_any(call: Call) -> i32 {
    // SAFETY: the caller's promise.
    let mut call = unsafe { call.slices() };
    let mut run = || {
        let mut generator = Model::open(call.bytes)?.generator()?;
        if generator.blend().is_some() {
            generator.set_blend(if call.choices[1] { Blend::DualQuaternion } else { Blend::Linear })?;
            generator.set_joints(if call.choices[2] { JointMode::Mean } else { JointMode::Regressed })?;
        }
        generator.evaluate(call.weights, call.range.clone(), call.values)?;
        generator.linearise(call.weights, call.range.clone(), call.values, call.jacobian)?;
        used(&generator, &mut call)
    };
    status(run())
}

/// The same with one group fixed.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_any_prepared(call: Call) -> i32 {
    // SAFETY: the caller's promise.
    status(any_prepared(unsafe { call.slices() }))
}

fn any_prepared(mut call: Slices<'_>) -> Result<(), Error> {
    let generator: AnyGenerator<'_> = Model::open(call.bytes)?.generator()?;
    let fixed = mode(call.choices[0]);
    let workspace = core::mem::take(&mut call.workspace);
    generator.prepared_req(fixed, &call.range)?.check(workspace.len())?;
    let form = generator.prepared(fixed, call.filled, call.range.clone(), workspace)?;
    let Weights { identity, pose } = call.weights;
    call.weights = match form.free() {
        Mode::Identity => Weights { identity, pose: &[] },
        Mode::Pose => Weights { identity: &[], pose },
    };
    if !form.reads_file() {
        call.at = 0;
    }
    used(&form, &mut call)
}

fn bilinear<'a, S: Storage<'a>>(mut call: Slices<'a>) -> Result<(), Error> {
    let generator = Model::open(call.bytes)?.bilinear_in::<S>()?;
    used(&generator, &mut call)?;
    // Over memory that another call has filled, with whatever is in it.
    let mode = mode(call.choices[0]);
    prepared_req(&generator, mode, &call.range).check(call.filled.len())?;
    used(&Prepared::of_numbers(&generator, mode, call.range.clone(), call.filled)?, &mut call)
}

fn linear<'a, S: Storage<'a>>(mut call: Slices<'a>) -> Result<(), Error> {
    used(&Model::open(call.bytes)?.linear::<S>()?, &mut call)
}

fn skinned<'a, S: Storage<'a>>(mut call: Slices<'a>) -> Result<(), Error> {
    let [fix_identity, dual, still] = call.choices;
    let mut body = Model::open(call.bytes)?.skinned::<S>()?;
    body = body.with_blend(if dual { Blend::DualQuaternion } else { Blend::Linear });
    body = body.with_joints(if still { JointMode::Mean } else { JointMode::Regressed });
    used(&body, &mut call)?;
    let at = body.begin(call.weights, false, call.state)?;
    let mut place = body.joint_position(at, call.at).unwrap_or_default();
    if let Some(joint) = body.skeleton().joint(call.at) {
        place[0] += joint.position[0] + joint.dim() as f32 + joint.parent.unwrap_or(0) as f32;
    }
    let angles: usize = body.skeleton().angles().map(|angles| angles.end).sum();
    place[1] += (angles + body.influences().len() + body.skeleton().n_joints()) as f32;
    if body.influences().is_empty() || body.skeleton().is_regressed() || body.blend() == Blend::Linear {
        place[2] += body.rest().vertex_count() as f32;
    }
    for (to, value) in call.values.iter_mut().zip(place) {
        *to = value;
    }
    let workspace = core::mem::take(&mut call.workspace);
    if fix_identity {
        body.with_identity_req(&call.range).check(workspace.len())?;
        used(&body.with_identity(call.filled, call.range.clone(), workspace)?, &mut call)
    } else {
        body.with_pose_req(&call.range).check(workspace.len())?;
        used(&body.with_pose(call.filled, call.range.clone(), workspace)?, &mut call)
    }
}

fn wavelet<'a, S: Storage<'a>>(mut call: Slices<'a>) -> Result<(), Error> {
    let whole = Model::open(call.bytes)?.wavelet::<S>()?;
    let (range, at) = (call.range.clone(), call.at);
    let generator = whole.with_levels(at % 16, range.start % 16)?.with_window(range.clone(), at..range.end)?;
    used(&generator, &mut call)?;
    let fixed = mode(call.choices[0]);
    let workspace = core::mem::take(&mut call.workspace);
    with_fixed_req(&generator, fixed).check(workspace.len())?;
    let form = with_fixed(&generator, fixed, call.filled, &range, workspace)?;
    let [column, row] = form.node(at).unwrap_or_default();
    if let Some(value) = call.values.first_mut() {
        *value += (column + row + form.detail() + form.grid().len() + form.whole_grid().len()) as f32;
    }
    used(&form, &mut call)
}

macro_rules! entries {
    ($($name:ident = $function:ident::<$storage:ident>;)*) => {$(
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $name(call: Call) -> i32 {
            // SAFETY: the caller's promise.
            status($function::<$storage<'_>>(unsafe { call.slices() }))
        }
    )*};
}

entries! {
    check_bilinear_f32 = bilinear::<F32>;
    check_bilinear_f16 = bilinear::<F16>;
    check_bilinear_i8 = bilinear::<I8>;
    check_linear_f32 = linear::<F32>;
    check_linear_f16 = linear::<F16>;
    check_linear_i8 = linear::<I8>;
    check_skinned_f32 = skinned::<F32>;
    check_skinned_f16 = skinned::<F16>;
    check_skinned_i8 = skinned::<I8>;
    check_wavelet_f32 = wavelet::<F32>;
    check_wavelet_f16 = wavelet::<F16>;
    check_wavelet_i8 = wavelet::<I8>;
}
