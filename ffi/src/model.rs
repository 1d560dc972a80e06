//! Opening a model file over the caller's bytes, and its counts.

use core::mem::MaybeUninit;

use habitus_core::format::{Checksums, Mode, Model};
use habitus_core::generator::Generator;
use habitus_core::generator::any::AnyGenerator;

use crate::body::{blend_number, joints_number};
use crate::code::{Refusal, hab_code, hab_error_detail};
use crate::memory::{Arguments, call};
use crate::tagged::{Content, put, tagged};

/// An opened model, of fixed size: put it on the stack or anywhere else, copy it, forget it; there is nothing to close. It refers to the bytes it was opened
/// over, which must stay where they are, unchanged, as long as it is used. Several threads may use one model at the same time.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct hab_model {
    /// Of this library alone.
    pub opaque: [MaybeUninit<u64>; 80],
}

/// What [`hab_model`] holds.
#[derive(Clone, Copy)]
pub(crate) struct Opened {
    pub(crate) model: Model<'static>,
    pub(crate) generator: AnyGenerator<'static>,
    pub(crate) bytes: &'static [u8],
}

impl Content for Opened {
    type Struct = hab_model;
    const TAG: u64 = 0x6d6f_6465_6c20_4841;

    fn also_read(&self, arguments: &mut Arguments, argument: u32) {
        arguments.also_read(argument, self.bytes);
    }
}

const _: () = Opened::FITS;

impl Opened {
    /// Whether the vertices are those that the file's triangles, landmarks and mirror speak of: not while a wavelet model is evaluated coarser or through a
    /// window, which has fewer.
    pub(crate) fn is_whole(&self) -> bool {
        self.generator.vertex_count() == self.model.header().n_vertices as usize
    }
}

/// One of the two groups of weights; functions take it as a uint32_t.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum hab_mode {
    /// Who it is.
    HAB_MODE_IDENTITY = 0,
    /// Expression of a face, posture of a body.
    HAB_MODE_POSE = 1,
}

/// Kind of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum hab_kind {
    /// Vertices are bilinear in identity and pose.
    HAB_KIND_BILINEAR = 1,
    /// Vertices are linear in the identity; there are no pose weights.
    HAB_KIND_LINEAR = 2,
    /// A rest shape linear in the identity, a skeleton whose angles are the pose, and skinning.
    HAB_KIND_SKINNED = 3,
    /// A wavelet transform on a grid, each coefficient bilinear in weights of its own.
    HAB_KIND_WAVELET = 4,
}

/// Counts of a model. Set struct_bytes to sizeof(hab_counts) before the call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct hab_counts {
    /// sizeof(hab_counts), so that later versions can add members.
    pub struct_bytes: u32,
    /// Kind of the model, see hab_kind.
    pub kind: u32,
    /// Vertices; positions have three numbers each.
    pub n_vertices: u32,
    /// Identity weights; of a wavelet model those of every coefficient that has weights, one coefficient after another.
    pub identity_dim: u32,
    /// Pose weights, likewise.
    pub pose_dim: u32,
    /// Triangles; 0 when the file has none, and while a wavelet model has fewer vertices than its file (hab_model_set_levels).
    pub n_faces: u32,
    /// Landmarks; 0 likewise.
    pub n_landmarks: u32,
    /// Poses of the training data (expressions of a face) that the file keeps as starting points; 0 when it has none.
    pub n_poses: u32,
    /// Sections of the file.
    pub n_sections: u32,
    /// Blocks of HAB_BLOCK_VERTICES vertices, the last one padded.
    pub n_blocks: u32,
    /// How the coefficients are stored, see hab_element.
    pub element: u32,
    /// 1 when vertices share a state, so that positions come from a hab_evaluation; 0 when hab_model_evaluate and the like do, too.
    pub needs_evaluation: u32,
    /// Joints of a skinned model; 0 in others.
    pub n_joints: u32,
    /// How a skinned model blends the motions of its joints, see hab_blend; 0 in others.
    pub blend: u32,
    /// Whether the joints of a skinned model follow the identity, see hab_joints; 0 in others.
    pub joints: u32,
}

/// Checks the bytes of a model file and opens it in place; nothing is copied. The bytes may have any alignment.
///
/// Returns HAB_OK, HAB_NULL_POINTER, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH, or a 3xx code for a file that is no sound model.
///
/// # Safety
/// `bytes` points to `bytes_len` bytes that stay unchanged while the model is used; `model` can be written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_open(
    bytes: *const u8,
    bytes_len: usize,
    model: *mut hab_model,
    detail: *mut hab_error_detail,
) -> hab_code {
    // SAFETY: the caller's promise.
    unsafe { open(bytes, bytes_len, Checksums::Verify, model, detail) }
}

/// As hab_model_open, without looking at the checksums of the sections: for slow devices whose storage is trusted. The header's checksum and all content
/// are checked nevertheless.
///
/// Returns as hab_model_open.
///
/// # Safety
/// As hab_model_open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_open_trusted(
    bytes: *const u8,
    bytes_len: usize,
    model: *mut hab_model,
    detail: *mut hab_error_detail,
) -> hab_code {
    // SAFETY: the caller's promise.
    unsafe { open(bytes, bytes_len, Checksums::Skip, model, detail) }
}

unsafe fn open(
    bytes: *const u8,
    bytes_len: usize,
    checksums: Checksums,
    model: *mut hab_model,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let bytes = arguments.input(1, bytes, bytes_len);
        let out = arguments.out_object(3, model);
        arguments.compared()?;
        // SAFETY: the caller's promise; what can be checked has been. The bytes live as long as the caller uses the model, so
        // the views in it are given no shorter a life.
        let bytes: &'static [u8] = unsafe { bytes.slice() };
        let model = Model::open_with(bytes, checksums)?;
        let generator = model.generator()?;
        // SAFETY: the caller's promise.
        unsafe { put(&out, Opened { model, generator, bytes }) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 4, body) }
}

/// The opened model that an argument points to, see [`tagged`].
///
/// # Safety
/// As [`tagged`].
pub(crate) unsafe fn opened<'a>(
    arguments: &mut Arguments,
    argument: u32,
    model: *const hab_model,
) -> Result<&'a Opened, Refusal> {
    // SAFETY: the caller's promise.
    unsafe { tagged(arguments, argument, model) }
}

/// Which group of weights a number of C means; `option` is its position in the documentation of the call.
pub(crate) fn mode_of(number: u32, option: u32) -> Result<Mode, Refusal> {
    match number {
        0 => Ok(Mode::Identity),
        1 => Ok(Mode::Pose),
        _ => Err(Refusal::Kernel(habitus_core::Error::BadOption { option })),
    }
}

/// Counts of a model.
///
/// Returns HAB_OK, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, or HAB_BAD_STRUCT when counts->struct_bytes is not set.
///
/// # Safety
/// `model` was opened; `counts` can be read and written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_counts(
    model: *const hab_model,
    counts: *mut hab_counts,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.out_object(2, counts);
        // SAFETY: the caller's promise.
        let of = unsafe { opened(arguments, 1, model)? };
        let Opened { model, generator, .. } = of;
        // SAFETY: the caller's promise.
        let struct_bytes = unsafe { (&raw const (*out.pointer()).struct_bytes).read() };
        if struct_bytes as usize != size_of::<hab_counts>() {
            return Err(Refusal::BadStruct { argument: 2, bytes: struct_bytes });
        }
        let header = model.header();
        let count = |len: usize| u32::try_from(len).unwrap_or(u32::MAX);
        let (faces, landmarks) = if of.is_whole() { (model.faces(), model.landmarks()) } else { (None, None) };
        let starts = model.pose_starts().map_or(0, |starts| starts.len());
        let counts = hab_counts {
            struct_bytes,
            kind: header.kind as u32,
            n_vertices: count(generator.vertex_count()),
            identity_dim: count(generator.identity_dim()),
            pose_dim: count(generator.pose_dim()),
            n_faces: count(faces.map_or(0, |faces| faces.len())),
            n_landmarks: count(landmarks.map_or(0, |landmarks| landmarks.len())),
            n_poses: count(starts.checked_div(header.pose_dim as usize).unwrap_or(0)),
            n_sections: count(model.sections().iter().count()),
            n_blocks: count(generator.block_count()),
            element: model.element() as u32,
            needs_evaluation: u32::from(generator.state_req(true).numbers() != 0),
            n_joints: count(generator.skeleton().map_or(0, |skeleton| skeleton.n_joints())),
            blend: generator.blend().map_or(0, blend_number),
            joints: generator.joints().map_or(0, joints_number),
        };
        // SAFETY: the caller's promise.
        unsafe { out.set(counts) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 3, body) }
}
