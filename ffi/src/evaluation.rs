//! Evaluations of any kind of model: what all vertices share is written once, then positions and derivatives come from it by ranges.

use core::mem::MaybeUninit;

use habitus_core::Error;
use habitus_core::format::SectionId;
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::any_prepared::AnyPrepared;
use habitus_core::generator::{At, Generator, Weights};
use habitus_core::workspace::{Requirement, Workspace};
use habitus_dispatch as kernel;

use crate::code::{Refusal, hab_code, hab_error_detail, length};
use crate::evaluate::{block_lengths, range};
use crate::memory::{Arguments, call};
use crate::model::{hab_model, opened};
use crate::prepared::{formed, hab_prepared};
use crate::tagged::{Content, put, tagged};

/// A model of any kind, or a prepared form of one, at some weights; of fixed size: put it on the stack, copy it, forget it. It refers to its workspace, to the bytes of the model file
/// and to the workspace of the form, which must stay where they are, unchanged, as long as it is used; hab_model, hab_prepared and the weights are no longer needed. Several threads may
/// use one evaluation at the same time. For the next weights call hab_evaluation_init again, over the same workspace if you like.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct hab_evaluation {
    /// Of this library alone.
    pub opaque: [MaybeUninit<u64>; 88],
}

/// What is evaluated.
#[derive(Clone, Copy)]
enum Of {
    Model(AnyGenerator<'static>),
    Form(AnyPrepared<'static, 'static>),
}

/// What [`hab_evaluation`] holds.
#[derive(Clone, Copy)]
struct Begun {
    of: Of,
    at: At<'static>,
    derivatives: bool,
    numbers: &'static [f32],
    /// The workspace of the form.
    of_form: &'static [f32],
    bytes: &'static [u8],
}

impl Content for Begun {
    type Struct = hab_evaluation;
    const TAG: u64 = 0x6576_616c_7561_4841;

    fn also_read(&self, arguments: &mut Arguments, argument: u32) {
        arguments.also_read(argument, self.numbers);
        arguments.also_read(argument, self.of_form);
        arguments.also_read(argument, self.bytes);
    }
}

const _: () = Begun::FITS;

/// Calls methods of the model or the form.
macro_rules! either {
    ($of:expr, $generator:ident => $call:expr) => {
        match $of {
            Of::Model($generator) => $call,
            Of::Form($generator) => $call,
        }
    };
}

impl Of {
    /// Of the arguments 1 and 2, with the memory that it reads: the workspace of the form, the bytes of the file.
    ///
    /// # Safety
    /// As [`opened`] and [`formed`].
    unsafe fn given(
        arguments: &mut Arguments,
        model: *const hab_model,
        prepared: *const hab_prepared,
    ) -> Result<(Self, &'static [f32], &'static [u8]), Refusal> {
        if prepared.is_null() {
            // SAFETY: the caller's promise.
            let opened = unsafe { opened(arguments, 1, model)? };
            return Ok((Of::Model(opened.generator), &[], opened.bytes));
        }
        // SAFETY: the caller's promise.
        let form = unsafe { formed(arguments, 2, prepared)? };
        Ok((Of::Form(form.form), form.numbers, form.bytes))
    }

    /// Numbers of identity and of pose weights.
    fn dims(&self) -> [usize; 2] {
        either!(self, generator => [generator.identity_dim(), generator.pose_dim()])
    }

    /// The weights and the state.
    fn workspace(&self, derivatives: bool) -> Requirement {
        let [identity, pose] = self.dims();
        Requirement::of(identity).and(Requirement::of(pose)).and(either!(self, of => of.state_req(derivatives)))
    }

    fn n_joints(&self) -> usize {
        match self {
            Of::Model(generator) => generator.skeleton().map_or(0, |skeleton| skeleton.n_joints()),
            Of::Form(form) => form.n_joints(),
        }
    }
}

/// Whether derivatives are wanted; `option` is the argument's position.
fn wanted(derivatives: u32, option: u32) -> Result<bool, Refusal> {
    match derivatives {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Refusal::Kernel(Error::BadOption { option })),
    }
}

/// Bytes of workspace that hab_evaluation_init needs for a model, or for a form of one when prepared is not null; then the model is not looked at and may be null. derivatives is 1 when
/// hab_evaluation_linearise will be called, else 0.
///
/// Returns HAB_OK, HAB_BAD_OPTION (3) for another number of derivatives, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP.
///
/// # Safety
/// `model` was opened or is not looked at, `prepared` is null or was made by hab_prepared_init; `workspace_bytes` can be written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_evaluation_workspace_bytes(
    model: *const hab_model,
    prepared: *const hab_prepared,
    derivatives: u32,
    workspace_bytes: *mut usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.out_object(4, workspace_bytes);
        // SAFETY: the caller's promise.
        let (of, ..) = unsafe { Of::given(arguments, model, prepared)? };
        let bytes = of.workspace(wanted(derivatives, 3)?).f32_bytes();
        // SAFETY: the caller's promise.
        unsafe { out.set(bytes) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 5, body) }
}

/// Begins an evaluation: checks the weights, copies them into the workspace, and writes there what all vertices share (the motions of the joints of a skinned model).
///
/// prepared is null, or a form of the model, of all or of some blocks: then the model is not looked at and may be null, and the fixed mode has no weights here (length 0). The bits are those of
/// hab_model_evaluate and hab_prepared_evaluate, where these do.
///
/// Returns HAB_OK, HAB_DIMENSION_MISMATCH (number of weights), HAB_NOT_FINITE (a weight that is not finite or beyond 1e9, counted over identity, then pose), HAB_BAD_OPTION (7) for
/// derivatives other than 0 and 1, HAB_WORKSPACE_TOO_SMALL, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH. On an error the workspace is untouched, too.
///
/// # Safety
/// `model` was opened or is not looked at, `prepared` is null or was made by hab_prepared_init; `identity` and `pose` point to as many elements as are said; `workspace`, aligned as a
/// float, to `workspace_bytes` bytes that stay unchanged while the evaluation is used; `evaluation` can be written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_evaluation_init(
    model: *const hab_model,
    prepared: *const hab_prepared,
    identity: *const f32,
    identity_len: usize,
    pose: *const f32,
    pose_len: usize,
    derivatives: u32,
    workspace: *mut core::ffi::c_void,
    workspace_bytes: usize,
    evaluation: *mut hab_evaluation,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let (identity, pose) = (arguments.input(3, identity, identity_len), arguments.input(5, pose, pose_len));
        let memory = arguments.workspace(8, workspace.cast(), workspace_bytes);
        let out = arguments.out_object(10, evaluation);
        // SAFETY: the caller's promise.
        let (of, of_form, bytes) = unsafe { Of::given(arguments, model, prepared)? };
        let derivatives = wanted(derivatives, 7)?;
        let [identity_dim, pose_dim] = of.dims();
        length(3, identity_dim, identity_len)?;
        length(5, pose_dim, pose_len)?;
        // SAFETY: the caller's promise; the evaluation reads the memory as long as C uses it, and nobody writes it any more.
        let (identity, pose, memory): (_, _, &'static mut [f32]) =
            unsafe { (identity.slice(), pose.slice(), memory.slice()) };
        Weights { identity, pose }.check(identity_dim, pose_dim)?;
        let needed = of.workspace(derivatives);
        needed.check(memory.len())?;
        let mut pieces = Workspace::new(memory);
        let weights = Weights { identity: kept(&mut pieces, identity)?, pose: kept(&mut pieces, pose)? };
        let at = either!(&of, generator => generator.begin(weights, derivatives, pieces.rest()))?;
        let numbers = if needed == Requirement::NONE {
            &[][..]
        } else {
            // SAFETY: so many numbers were found to be there; from now on they are only read.
            unsafe { core::slice::from_raw_parts(workspace.cast::<f32>().cast_const(), needed.numbers()) }
        };
        // SAFETY: the caller's promise.
        unsafe { put(&out, Begun { of, at, derivatives, numbers, of_form, bytes }) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 11, body) }
}

/// A copy of weights in the workspace.
fn kept(pieces: &mut Workspace<'static, f32>, weights: &[f32]) -> Result<&'static [f32], Error> {
    let copy = pieces.take(weights.len())?;
    for (to, &from) in copy.iter_mut().zip(weights) {
        *to = from;
    }
    Ok(copy)
}

/// Positions of n_vertices vertices from first_vertex on, millimetres, xyz after xyz. Any split into ranges gives the same bits. Vertex v of a form is vertex
/// HAB_BLOCK_VERTICES * first_block + v of the model.
///
/// Returns HAB_OK, HAB_DIMENSION_MISMATCH (positions_len other than 3 * n_vertices), HAB_INDEX_OUT_OF_RANGE, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH.
///
/// # Safety
/// `evaluation` was made by hab_evaluation_init; `positions` points to as many elements as are said; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_evaluation_positions(
    evaluation: *const hab_evaluation,
    first_vertex: u32,
    n_vertices: u32,
    positions: *mut f32,
    positions_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let positions = arguments.output(4, positions, positions_len);
        // SAFETY: the caller's promise.
        let Begun { of, at, .. } = unsafe { tagged(arguments, 1, evaluation)? };
        let range = range(first_vertex, n_vertices, either!(of, generator => generator.vertex_count()))?;
        length(4, range.len().saturating_mul(3), positions_len)?;
        // SAFETY: the caller's promise.
        let positions = unsafe { positions.slice() };
        Ok(either!(of, generator => kernel::evaluate_at(generator, *at, range, positions))?)
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 6, body) }
}

/// Positions of n_blocks blocks from first_block on and their derivatives by every free weight, laid out as those of hab_model_linearise, with D the number of weights
/// that the evaluation was begun with.
///
/// Returns as hab_evaluation_positions, and HAB_BAD_OPTION (7) when the evaluation was begun with derivatives of 0.
///
/// # Safety
/// As hab_evaluation_positions; `values` and `jacobian` point to as many elements as are said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_evaluation_linearise(
    evaluation: *const hab_evaluation,
    first_block: u32,
    n_blocks: u32,
    values: *mut f32,
    values_len: usize,
    jacobian: *mut f32,
    jacobian_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let values = arguments.output(4, values, values_len);
        let jacobian = arguments.output(6, jacobian, jacobian_len);
        // SAFETY: the caller's promise.
        let Begun { of, at, derivatives, .. } = unsafe { tagged(arguments, 1, evaluation)? };
        if !derivatives {
            return Err(Refusal::Kernel(Error::BadOption { option: 7 }));
        }
        let (blocks, dim) = either!(of, generator => (generator.block_count(), generator.dim()));
        let range = range(first_block, n_blocks, blocks)?;
        block_lengths([4, 6], range.len(), dim, [values_len, jacobian_len])?;
        // SAFETY: the caller's promise.
        let (values, jacobian) = unsafe { (values.slice(), jacobian.slice()) };
        Ok(either!(of, generator => kernel::Blockwise(generator).linearise_at(*at, range, values, jacobian))?)
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 8, body) }
}

/// Where n_joints joints from first_joint on stand in the pose, millimetres, xyz after xyz.
///
/// Returns HAB_OK, HAB_UNSUPPORTED when there are no joints (another kind of model, or a form whose pose is fixed), HAB_DIMENSION_MISMATCH (positions_len other than 3 * n_joints),
/// HAB_INDEX_OUT_OF_RANGE, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH.
///
/// # Safety
/// As hab_evaluation_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_evaluation_joint_positions(
    evaluation: *const hab_evaluation,
    first_joint: u32,
    n_joints: u32,
    positions: *mut f32,
    positions_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let positions = arguments.output(4, positions, positions_len);
        // SAFETY: the caller's promise.
        let Begun { of, at, .. } = unsafe { tagged(arguments, 1, evaluation)? };
        let limit = of.n_joints();
        if limit == 0 {
            return Err(Refusal::Kernel(Error::Unsupported { section: SectionId::JointParents as u32 }));
        }
        let range = range(first_joint, n_joints, limit)?;
        length(4, range.len().saturating_mul(3), positions_len)?;
        // SAFETY: the caller's promise.
        let positions = unsafe { positions.slice() };
        for (joint, to) in range.zip(positions.as_chunks_mut::<3>().0) {
            *to = either!(of, generator => generator.joint_position(*at, joint)).unwrap_or_default();
        }
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 6, body) }
}
