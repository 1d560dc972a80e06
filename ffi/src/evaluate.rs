//! Vertex positions and their derivatives: whole, or by ranges.

use habitus_core::Error;
use habitus_core::generator::{Generator, NUMBERS, Weights};
use habitus_core::workspace::Requirement;
use habitus_dispatch as kernel;

use crate::code::{Refusal, hab_code, hab_error_detail, length};
use crate::memory::{Arguments, call};
use crate::model::{hab_model, opened};

/// Vertices of a block: ranges that begin and end at multiples of it cost no double work, and derivatives come in such blocks.
pub const HAB_BLOCK_VERTICES: u32 = 16;

const _: () = assert!(HAB_BLOCK_VERTICES as usize == habitus_core::generator::LANES);

/// Positions of all vertices, millimetres, xyz after xyz, without a workspace: for models whose vertices share no state (hab_counts.needs_evaluation is 0: bilinear and linear
/// ones). A hab_evaluation does the same for every kind of model.
///
/// Returns HAB_OK, HAB_NEEDS_EVALUATION for models with a state, HAB_DIMENSION_MISMATCH (number of weights, or positions_len other than 3 * n_vertices), HAB_NOT_FINITE (a weight that is not finite or beyond 1e9,
/// counted over identity, then pose), HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH.
///
/// # Safety
/// `model` was opened; the others point to as many elements as are said; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_evaluate(
    model: *const hab_model,
    identity: *const f32,
    identity_len: usize,
    pose: *const f32,
    pose_len: usize,
    positions: *mut f32,
    positions_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let (identity, pose) = (arguments.input(2, identity, identity_len), arguments.input(4, pose, pose_len));
        let positions = arguments.output(6, positions, positions_len);
        // SAFETY: the caller's promise.
        let generator = unsafe { opened(arguments, 1, model)? }.generator;
        stateless(&generator)?;
        weights_fit(&generator, identity_len, pose_len)?;
        length(6, 3 * generator.vertex_count(), positions_len)?;
        // SAFETY: the caller's promise.
        let (identity, pose, positions) = unsafe { (identity.slice(), pose.slice(), positions.slice()) };
        let all = 0..generator.vertex_count();
        let at = generator.begin(Weights { identity, pose }, false, &mut [])?;
        Ok(kernel::evaluate_at(&generator, at, all, positions)?)
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 8, body) }
}

/// Positions of n_vertices vertices from first_vertex on, millimetres, xyz after xyz. Any split into ranges gives the same bits, so several threads can share the
/// work, and a small memory can take the mesh piece by piece.
///
/// Returns as hab_model_evaluate, and HAB_INDEX_OUT_OF_RANGE; positions_len is 3 * n_vertices.
///
/// # Safety
/// As hab_model_evaluate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_evaluate_range(
    model: *const hab_model,
    identity: *const f32,
    identity_len: usize,
    pose: *const f32,
    pose_len: usize,
    first_vertex: u32,
    n_vertices: u32,
    positions: *mut f32,
    positions_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let (identity, pose) = (arguments.input(2, identity, identity_len), arguments.input(4, pose, pose_len));
        let positions = arguments.output(8, positions, positions_len);
        // SAFETY: the caller's promise.
        let generator = unsafe { opened(arguments, 1, model)? }.generator;
        stateless(&generator)?;
        weights_fit(&generator, identity_len, pose_len)?;
        let range = range(first_vertex, n_vertices, generator.vertex_count())?;
        length(8, 3 * range.len(), positions_len)?;
        // SAFETY: the caller's promise.
        let (identity, pose, positions) = unsafe { (identity.slice(), pose.slice(), positions.slice()) };
        let at = generator.begin(Weights { identity, pose }, false, &mut [])?;
        Ok(kernel::evaluate_at(&generator, at, range, positions)?)
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 10, body) }
}

/// Positions of n_blocks blocks from first_block on and their derivatives by every weight, in one pass over the model: for fitting programs of your own.
///
/// With B = HAB_BLOCK_VERTICES, D = identity_dim + pose_dim, and block counted from first_block, the coordinate `axis` (0 to 2) of vertex B * (first_block + block) + lane is
/// values[(block * 3 + axis) * B + lane], millimetres, and its derivative by weight k (the identity weights first) is jacobian[((block * D + k) * 3 + axis) * B + lane], millimetres per
/// weight. Lanes behind the last vertex are zero in files of this project.
///
/// Returns as hab_model_evaluate, and HAB_INDEX_OUT_OF_RANGE.
///
/// # Safety
/// As hab_model_evaluate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_linearise(
    model: *const hab_model,
    identity: *const f32,
    identity_len: usize,
    pose: *const f32,
    pose_len: usize,
    first_block: u32,
    n_blocks: u32,
    values: *mut f32,
    values_len: usize,
    jacobian: *mut f32,
    jacobian_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let (identity, pose) = (arguments.input(2, identity, identity_len), arguments.input(4, pose, pose_len));
        let values = arguments.output(8, values, values_len);
        let jacobian = arguments.output(10, jacobian, jacobian_len);
        // SAFETY: the caller's promise.
        let generator = unsafe { opened(arguments, 1, model)? }.generator;
        stateless(&generator)?;
        weights_fit(&generator, identity_len, pose_len)?;
        let range = range(first_block, n_blocks, generator.block_count())?;
        block_lengths([8, 10], range.len(), generator.dim(), [values_len, jacobian_len])?;
        // SAFETY: the caller's promise.
        let (identity, pose, values, jacobian) =
            unsafe { (identity.slice(), pose.slice(), values.slice(), jacobian.slice()) };
        let at = generator.begin(Weights { identity, pose }, true, &mut [])?;
        Ok(kernel::Blockwise(&generator).linearise_at(at, range, values, jacobian)?)
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 12, body) }
}

/// `Ok` when vertices share nothing that a workspace would have to hold.
pub(crate) fn stateless(generator: &impl Generator) -> Result<(), Refusal> {
    let needed = generator.state_req(true);
    if needed == Requirement::NONE { Ok(()) } else { Err(Refusal::NeedsEvaluation { floats: needed.numbers() }) }
}

/// Numbers of weights, in the arguments 2 and 4.
fn weights_fit(generator: &impl Generator, identity_len: usize, pose_len: usize) -> Result<(), Refusal> {
    length(2, generator.identity_dim(), identity_len)?;
    length(4, generator.pose_dim(), pose_len)
}

/// Values and derivatives of so many blocks, in these two arguments.
pub(crate) fn block_lengths(
    [values, jacobian]: [u32; 2],
    blocks: usize,
    dim: usize,
    [values_len, jacobian_len]: [usize; 2],
) -> Result<(), Refusal> {
    let numbers = blocks.saturating_mul(NUMBERS);
    length(values, numbers, values_len)?;
    length(jacobian, numbers.saturating_mul(dim), jacobian_len)
}

/// `count` things from `first` on, all below `limit`.
pub(crate) fn range(first: u32, count: u32, limit: usize) -> Result<core::ops::Range<usize>, Refusal> {
    let end = u64::from(first) + u64::from(count);
    match usize::try_from(end) {
        Ok(end) if end <= limit => Ok(first as usize..end),
        _ => Err(Refusal::Kernel(Error::IndexOutOfRange {
            index: u32::try_from(end).unwrap_or(u32::MAX),
            limit: u32::try_from(limit).unwrap_or(u32::MAX),
        })),
    }
}
