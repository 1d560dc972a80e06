//! Forms of a model with the identity or the pose fixed: tracking fixes the identity once, then pays only for the pose.

use core::mem::MaybeUninit;

use habitus_core::format::Mode;
use habitus_core::generator::any_prepared::AnyPrepared;
use habitus_core::generator::{Generator, Weights};
use habitus_dispatch as kernel;

use crate::code::{Refusal, hab_code, hab_error_detail, length};
use crate::evaluate::{block_lengths, range, stateless};
use crate::memory::{Arguments, call};
use crate::model::{Opened, hab_model, mode_of, opened};
use crate::tagged::{Content, put, tagged};

/// A prepared form, of fixed size: put it on the stack, copy it, forget it. It refers to the workspace that it was prepared in, and that of a skinned model
/// with the identity fixed also to the bytes of the model file; they must stay where they are, unchanged, as long as it is used. The hab_model is no longer needed.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct hab_prepared {
    /// Of this library alone.
    pub opaque: [MaybeUninit<u64>; 64],
}

/// What [`hab_prepared`] holds.
#[derive(Clone, Copy)]
pub(crate) struct Form {
    pub(crate) form: AnyPrepared<'static, 'static>,
    pub(crate) numbers: &'static [f32],
    /// The model file, where the form reads it.
    pub(crate) bytes: &'static [u8],
}

impl Content for Form {
    type Struct = hab_prepared;
    const TAG: u64 = 0x7072_6570_6120_4841;

    fn also_read(&self, arguments: &mut Arguments, argument: u32) {
        arguments.also_read(argument, self.numbers);
        arguments.also_read(argument, self.bytes);
    }
}

const _: () = Form::FITS;

/// Bytes of workspace that hab_prepared_init needs for n_blocks blocks of HAB_BLOCK_VERTICES vertices.
///
/// Returns HAB_OK, HAB_BAD_OPTION (2) for an unknown mode, HAB_WRONG_KIND for a model with one mode alone (linear), HAB_INDEX_OUT_OF_RANGE, HAB_NULL_POINTER,
/// HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP.
///
/// # Safety
/// `model` was opened; `workspace_bytes` can be written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_prepared_workspace_bytes(
    model: *const hab_model,
    fixed_mode: u32,
    first_block: u32,
    n_blocks: u32,
    workspace_bytes: *mut usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.out_object(5, workspace_bytes);
        // SAFETY: the caller's promise.
        let generator = unsafe { opened(arguments, 1, model)? }.generator;
        let blocks = range(first_block, n_blocks, generator.block_count())?;
        let bytes = generator.prepared_req(mode_of(fixed_mode, 2)?, &blocks)?.f32_bytes();
        // SAFETY: the caller's promise.
        unsafe { out.set(bytes) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 6, body) }
}

/// Fixes the weights of one mode for n_blocks blocks of vertices from first_block on. Vertex v of the form is vertex HAB_BLOCK_VERTICES * first_block + v of the model.
///
/// With the pose fixed, the form of a bilinear model gives the bits of the model. With the identity fixed, its sums have another order, so that the last bits may differ from the
/// model's; of a skinned model it is the other way round, but for corrective terms. The bits are the same on every machine.
///
/// The form of a skinned model with the identity fixed needs a hab_evaluation, as the model does.
///
/// Returns HAB_OK, HAB_BAD_OPTION (2) for an unknown mode, HAB_WRONG_KIND for a model with one mode alone (linear), HAB_DIMENSION_MISMATCH, HAB_NOT_FINITE,
/// HAB_INDEX_OUT_OF_RANGE, HAB_WORKSPACE_TOO_SMALL, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH. On an error the workspace is untouched, too.
///
/// # Safety
/// `model` was opened; `weights` points to `weights_len` elements; `workspace`, aligned as a float, to `workspace_bytes` bytes that stay unchanged while the form is
/// used; `prepared` can be written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_prepared_init(
    model: *const hab_model,
    fixed_mode: u32,
    weights: *const f32,
    weights_len: usize,
    first_block: u32,
    n_blocks: u32,
    workspace: *mut core::ffi::c_void,
    workspace_bytes: usize,
    prepared: *mut hab_prepared,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let weights = arguments.input(3, weights, weights_len);
        let workspace = arguments.workspace(7, workspace.cast(), workspace_bytes);
        let out = arguments.out_object(9, prepared);
        // SAFETY: the caller's promise.
        let Opened { generator, bytes, .. } = *unsafe { opened(arguments, 1, model)? };
        let (fixed, blocks) = (mode_of(fixed_mode, 2)?, range(first_block, n_blocks, generator.block_count())?);
        let dim = if fixed == Mode::Identity { generator.identity_dim() } else { generator.pose_dim() };
        length(3, dim, weights_len)?;
        // SAFETY: the caller's promise.
        let (weights, workspace) = unsafe { (weights.slice(), workspace.slice()) };
        let memory = workspace.as_ptr();
        let needed = generator.prepared_req(fixed, &blocks)?.numbers();
        let form = kernel::any_prepared(&generator, fixed, weights, blocks, workspace)?;
        // SAFETY: the form has been made, so the workspace holds at least what it needs; the form reads it and nobody writes it any more.
        let numbers: &'static [f32] = unsafe { core::slice::from_raw_parts(memory, needed) };
        let bytes = if form.reads_file() { bytes } else { &[] };
        // SAFETY: the caller's promise.
        unsafe { put(&out, Form { form, numbers, bytes }) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 10, body) }
}

/// The form that an argument points to, see [`tagged`].
///
/// # Safety
/// As [`tagged`].
pub(crate) unsafe fn formed<'a>(
    arguments: &mut Arguments,
    argument: u32,
    prepared: *const hab_prepared,
) -> Result<&'a Form, Refusal> {
    // SAFETY: the caller's promise.
    unsafe { tagged(arguments, argument, prepared) }
}

/// The free weights of a form as weights of a generator.
pub(crate) fn free_weights<'a>(form: &AnyPrepared<'_, '_>, weights: &'a [f32]) -> Weights<'a> {
    match form.free() {
        Mode::Identity => Weights { identity: weights, pose: &[] },
        Mode::Pose => Weights { identity: &[], pose: weights },
    }
}

/// Positions of n_vertices vertices of a form from first_vertex on, millimetres, xyz after xyz; weights are those of the mode that is not fixed.
///
/// Returns HAB_OK, HAB_NEEDS_EVALUATION for a form whose vertices share a state (skinned, the identity fixed), HAB_DIMENSION_MISMATCH, HAB_NOT_FINITE, HAB_INDEX_OUT_OF_RANGE, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH.
///
/// # Safety
/// `prepared` was made by hab_prepared_init; the others point to as many elements as are said; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_prepared_evaluate(
    prepared: *const hab_prepared,
    weights: *const f32,
    weights_len: usize,
    first_vertex: u32,
    n_vertices: u32,
    positions: *mut f32,
    positions_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let weights = arguments.input(2, weights, weights_len);
        let positions = arguments.output(6, positions, positions_len);
        // SAFETY: the caller's promise.
        let form = &unsafe { formed(arguments, 1, prepared)? }.form;
        stateless(form)?;
        length(2, form.dim(), weights_len)?;
        let range = range(first_vertex, n_vertices, form.vertex_count())?;
        length(6, 3 * range.len(), positions_len)?;
        // SAFETY: the caller's promise.
        let (weights, positions) = unsafe { (weights.slice(), positions.slice()) };
        let at = form.begin(free_weights(form, weights), false, &mut [])?;
        Ok(kernel::evaluate_at(form, at, range, positions)?)
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 8, body) }
}

/// Positions of n_blocks blocks of a form from first_block on and their derivatives by the free weights, laid out as those of hab_model_linearise,
/// with D the number of free weights.
///
/// Returns as hab_prepared_evaluate.
///
/// # Safety
/// As hab_prepared_evaluate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_prepared_linearise(
    prepared: *const hab_prepared,
    weights: *const f32,
    weights_len: usize,
    first_block: u32,
    n_blocks: u32,
    values: *mut f32,
    values_len: usize,
    jacobian: *mut f32,
    jacobian_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let weights = arguments.input(2, weights, weights_len);
        let values = arguments.output(6, values, values_len);
        let jacobian = arguments.output(8, jacobian, jacobian_len);
        // SAFETY: the caller's promise.
        let form = &unsafe { formed(arguments, 1, prepared)? }.form;
        stateless(form)?;
        length(2, form.dim(), weights_len)?;
        let range = range(first_block, n_blocks, form.block_count())?;
        block_lengths([6, 8], range.len(), form.dim(), [values_len, jacobian_len])?;
        // SAFETY: the caller's promise.
        let (weights, values, jacobian) = unsafe { (weights.slice(), values.slice(), jacobian.slice()) };
        let at = form.begin(free_weights(form, weights), true, &mut [])?;
        Ok(kernel::Blockwise(form).linearise_at(at, range, values, jacobian)?)
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 10, body) }
}
