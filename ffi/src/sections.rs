//! What a model file holds beside its coefficients, by section: triangles, landmarks, names, statistics, provenance.

use core::ffi::c_char;

use habitus_core::Error;
use habitus_core::format::{ElementType, Section, SectionId};
use habitus_core::generator::Generator;

use crate::code::{Refusal, hab_code, hab_error_detail, length};
use crate::memory::{Arguments, call};
use crate::model::{Opened, hab_model, mode_of, opened};

/// Identifiers of the sections of a model file; functions take them as a uint32_t.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum hab_section_id {
    /// Coefficients of the generator: blocks, terms, 3, 16.
    HAB_SECTION_COEFFICIENTS = 1,
    /// Triangles: faces, 3; counter-clockwise from outside.
    HAB_SECTION_FACES = 2,
    /// Vertex of each landmark.
    HAB_SECTION_LANDMARKS = 3,
    /// Name of each landmark, a line each.
    HAB_SECTION_LANDMARK_NAMES = 4,
    /// Vertex of the other side, for each vertex.
    HAB_SECTION_MIRROR = 5,
    /// Mean of the identity weights over the training data.
    HAB_SECTION_IDENTITY_MEAN = 6,
    /// Unit in which the identity weights are measured: 1 / sqrt(d) for models that were trained on d identities, which is their root mean square over the
    /// training data, and their standard deviation where the mean is near zero; the first weight of a multilinear model varies much less around its mean.
    HAB_SECTION_IDENTITY_SCALE = 7,
    /// Inverse covariance of the identity weights: identity_dim, identity_dim.
    HAB_SECTION_IDENTITY_PRECISION = 8,
    /// Mean of the pose weights over the training data.
    HAB_SECTION_POSE_MEAN = 9,
    /// The same of the pose weights.
    HAB_SECTION_POSE_SCALE = 10,
    /// Inverse covariance of the pose weights: pose_dim, pose_dim.
    HAB_SECTION_POSE_PRECISION = 11,
    /// Pose weights of the poses of the training data: n_poses, pose_dim.
    HAB_SECTION_POSE_STARTS = 12,
    /// Name of each of these poses, a line each.
    HAB_SECTION_POSE_NAMES = 13,
    /// Variances of the identity mode before truncation, mm^2.
    HAB_SECTION_IDENTITY_SPECTRUM = 14,
    /// Variances of the pose mode before truncation, mm^2.
    HAB_SECTION_POSE_SPECTRUM = 15,
    /// Where the model comes from: text.
    HAB_SECTION_PROVENANCE = 16,
    /// What the model misses of shapes it was not trained on: principal components of its residuals, one standard deviation each, mm: components, vertices, 3.
    HAB_SECTION_REMAINDER = 17,
    /// The first term of each block, the mean shape, where the coefficients have 16 or 8 bits: blocks, 3, 16.
    HAB_SECTION_OFFSETS = 18,
    /// Scale and offset of the 8-bit codes of each term and axis of a block: blocks, terms, 3, 2.
    HAB_SECTION_RANGES = 19,
    /// How far a quantised model lies from the one it was made from, millimetres: mean, root of the mean square, and largest distance of a vertex.
    HAB_SECTION_QUANTISATION_ERROR = 20,
    /// The joint that carries each joint; HAB_NO_PARENT for a root.
    HAB_SECTION_JOINT_PARENTS = 21,
    /// Axis of each joint in the standard posture, all zero for one that turns about all of them: joints, 3.
    HAB_SECTION_JOINT_AXES = 22,
    /// Position of each joint in the mean shape, millimetres: joints, 3.
    HAB_SECTION_JOINT_POSITIONS = 23,
    /// How each joint follows the identity, millimetres per weight: joints, identity_dim, 3.
    HAB_SECTION_JOINT_BASIS = 24,
    /// Name of each joint, a line each.
    HAB_SECTION_JOINT_NAMES = 25,
    /// First entry of each block in the two following sections, and their number: blocks + 1.
    HAB_SECTION_SKIN_STARTS = 26,
    /// Joint of each entry.
    HAB_SECTION_SKIN_JOINTS = 27,
    /// Weight with which the entry's joint holds each vertex of the block: entries, 16.
    HAB_SECTION_SKIN_WEIGHTS = 28,
    /// Lower bound of each pose weight, radians.
    HAB_SECTION_POSE_LOWER = 29,
    /// Upper bound of each pose weight, radians.
    HAB_SECTION_POSE_UPPER = 30,
    /// Grid of a wavelet model: width and height of its base, levels, transform.
    HAB_SECTION_GRID = 31,
}

/// Type of a section's elements, little-endian in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum hab_element {
    /// Bytes, or UTF-8 text.
    HAB_ELEMENT_U8 = 1,
    /// 32-bit unsigned integers.
    HAB_ELEMENT_U32 = 2,
    /// 32-bit reals.
    HAB_ELEMENT_F32 = 3,
    /// 16-bit reals.
    HAB_ELEMENT_F16 = 4,
    /// 8-bit codes, which HAB_SECTION_RANGES gives a meaning.
    HAB_ELEMENT_I8 = 5,
}

/// A section of a model file. Set struct_bytes to sizeof(hab_section) before the call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct hab_section {
    /// sizeof(hab_section), so that later versions can add members.
    pub struct_bytes: u32,
    /// Identifier, see hab_section_id; others are of later versions.
    pub id: u32,
    /// Type of the elements, see hab_element.
    pub element: u32,
    /// Number of axes.
    pub rank: u32,
    /// Length of each axis, slowest first; 1 beyond the rank.
    pub shape: [u32; 4],
    /// Content, within the bytes that the model was opened over; any alignment, little-endian. hab_model_read_u32, hab_model_read_f32 and
    /// hab_model_text read it for you.
    pub data: *const u8,
    /// Bytes of the content.
    pub data_bytes: usize,
}

/// Section number `index` of the file, from 0.
///
/// Returns HAB_OK, HAB_INDEX_OUT_OF_RANGE, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, or HAB_BAD_STRUCT when section->struct_bytes is not set.
///
/// # Safety
/// `model` was opened; `section` can be read and written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_section(
    model: *const hab_model,
    index: u32,
    section: *mut hab_section,
    detail: *mut hab_error_detail,
) -> hab_code {
    let find = |opened: &Opened| {
        let sections = opened.model.sections();
        let limit = sections.iter().count() as u32;
        sections.iter().nth(index as usize).ok_or(Error::IndexOutOfRange { index, limit })
    };
    // SAFETY: the caller's promise.
    unsafe { write_section(model, find, section, detail) }
}

/// The section with this identifier.
///
/// Returns HAB_OK, HAB_UNSUPPORTED when the file has no such section, otherwise as hab_model_section.
///
/// # Safety
/// As hab_model_section.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_find_section(
    model: *const hab_model,
    section_id: u32,
    section: *mut hab_section,
    detail: *mut hab_error_detail,
) -> hab_code {
    let find = |opened: &Opened| found(opened, section_id);
    // SAFETY: the caller's promise.
    unsafe { write_section(model, find, section, detail) }
}

unsafe fn write_section(
    model: *const hab_model,
    find: impl FnOnce(&Opened) -> Result<Section<'static>, Error>,
    section: *mut hab_section,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.out_object(3, section);
        // SAFETY: the caller's promise.
        let opened = unsafe { opened(arguments, 1, model)? };
        // SAFETY: the caller's promise.
        let struct_bytes = unsafe { (&raw const (*out.pointer()).struct_bytes).read() };
        if struct_bytes as usize != size_of::<hab_section>() {
            return Err(Refusal::BadStruct { argument: 3, bytes: struct_bytes });
        }
        let found = find(opened)?;
        let section = hab_section {
            struct_bytes,
            id: found.id,
            element: found.element as u32,
            rank: found.rank as u32,
            shape: found.shape,
            data: found.bytes.as_ptr(),
            data_bytes: found.bytes.len(),
        };
        // SAFETY: the caller's promise.
        unsafe { out.set(section) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 4, body) }
}

fn found(opened: &Opened, section: u32) -> Result<Section<'static>, Error> {
    opened.model.sections().find(section).ok_or(Error::Unsupported { section })
}

/// Copies integers of a section in the byte order of this machine: triangles (three a face), landmark vertices, mirror vertices, parents of joints.
///
/// Triangles, landmarks and mirror speak of the vertices of the whole surface. While a wavelet model has fewer (hab_model_set_levels, hab_model_set_window) they have no elements here; a copy of the hab_model
/// from before still gives them, and hab_model_find_section their bytes.
///
/// Returns HAB_OK, HAB_UNSUPPORTED when the file has no such section, HAB_BAD_OPTION (2) when its elements are no integers, HAB_INDEX_OUT_OF_RANGE when
/// first + values_len exceeds its elements, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH.
///
/// # Safety
/// `model` was opened; `values` points to `values_len` writable elements; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_read_u32(
    model: *const hab_model,
    section_id: u32,
    first: usize,
    values: *mut u32,
    values_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    // SAFETY: the caller's promise.
    unsafe { read(model, section_id, ElementType::U32, first, values, values_len, u32::from_le_bytes, detail) }
}

/// Copies reals of a section in the byte order of this machine: means, scales, precisions, starting poses, spectra, bounds, joints.
///
/// Returns as hab_model_read_u32; HAB_BAD_OPTION (2) when the section's elements are no reals.
///
/// # Safety
/// As hab_model_read_u32.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_read_f32(
    model: *const hab_model,
    section_id: u32,
    first: usize,
    values: *mut f32,
    values_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    // SAFETY: the caller's promise.
    unsafe { read(model, section_id, ElementType::F32, first, values, values_len, f32::from_le_bytes, detail) }
}

#[allow(clippy::too_many_arguments)]
unsafe fn read<T>(
    model: *const hab_model,
    section_id: u32,
    element: ElementType,
    first: usize,
    values: *mut T,
    values_len: usize,
    of_bytes: fn([u8; 4]) -> T,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.output(4, values, values_len);
        // SAFETY: the caller's promise.
        let opened = unsafe { opened(arguments, 1, model)? };
        let section = found(opened, section_id)?;
        if section.element != element {
            return Err(Refusal::Kernel(Error::BadOption { option: 2 }));
        }
        let speaks_of_vertices = matches!(
            SectionId::from_u32(section_id),
            Some(SectionId::Faces | SectionId::Landmarks | SectionId::Mirror)
        );
        // Indices of vertices that are not there would be read beyond the positions.
        let bytes = if speaks_of_vertices && !opened.is_whole() { &[] } else { section.bytes };
        let (elements, _) = bytes.as_chunks::<4>();
        let part = first.checked_add(values_len).and_then(|end| elements.get(first..end));
        let limit = u32::try_from(elements.len()).unwrap_or(u32::MAX);
        let index = u32::try_from(first.saturating_add(values_len)).unwrap_or(u32::MAX);
        let part = part.ok_or(Error::IndexOutOfRange { index, limit })?;
        // SAFETY: the caller's promise.
        for (to, raw) in unsafe { out.slice() }.iter_mut().zip(part) {
            *to = of_bytes(*raw);
        }
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 6, body) }
}

/// One line of a text section, for instance the name of landmark `line`. The text lies within the model's bytes, is UTF-8 and does not end in a zero byte.
///
/// Returns HAB_OK, HAB_UNSUPPORTED when the file has no such section, HAB_BAD_OPTION (2) when it is no text, HAB_INDEX_OUT_OF_RANGE, HAB_NULL_POINTER,
/// HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP.
///
/// # Safety
/// `model` was opened; `text` and `text_bytes` can be written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_text(
    model: *const hab_model,
    section_id: u32,
    line: u32,
    text: *mut *const c_char,
    text_bytes: *mut usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let (text, text_bytes) = (arguments.out_object(4, text), arguments.out_object(5, text_bytes));
        // SAFETY: the caller's promise.
        let opened = unsafe { opened(arguments, 1, model)? };
        let model = &opened.model;
        let lines = match SectionId::from_u32(section_id) {
            Some(SectionId::LandmarkNames) => model.landmark_names(),
            Some(SectionId::PoseNames) => model.pose_names(),
            Some(SectionId::Provenance) => model.provenance_lines(),
            Some(SectionId::JointNames) => model.joint_names(),
            _ => {
                found(opened, section_id)?;
                return Err(Refusal::Kernel(Error::BadOption { option: 2 }));
            }
        };
        let lines = lines.ok_or(Error::Unsupported { section: section_id })?;
        let limit = lines.iter().count() as u32;
        let found = lines.get(line as usize).ok_or(Error::IndexOutOfRange { index: line, limit })?;
        // SAFETY: the caller's promise.
        unsafe {
            text.set(found.as_ptr().cast());
            text_bytes.set(found.len());
        }
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 6, body) }
}

/// Weights of a mode from standard deviations, in the unit of the sections ..._SCALE: mean + deviation * scale for each weight. Deviations of 0 give the mean of the training
/// data. The way back is (weight - mean) / scale, with hab_model_read_f32. A wavelet model has a deviation for each weight of its levels.
///
/// Returns HAB_OK, HAB_UNSUPPORTED when the file has no statistics, HAB_BAD_OPTION (2) for an unknown mode, HAB_DIMENSION_MISMATCH when a length is not that
/// of the mode, HAB_NOT_FINITE, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH.
///
/// # Safety
/// `model` was opened; `deviations` and `weights` point to as many elements as are said; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_weights(
    model: *const hab_model,
    mode: u32,
    deviations: *const f32,
    deviations_len: usize,
    weights: *mut f32,
    weights_len: usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let deviations = arguments.input(3, deviations, deviations_len);
        let weights = arguments.output(5, weights, weights_len);
        // SAFETY: the caller's promise.
        let opened = unsafe { opened(arguments, 1, model)? };
        let mode = mode_of(mode, 2)?;
        let section = match mode {
            habitus_core::format::Mode::Identity => SectionId::IdentityMean,
            habitus_core::format::Mode::Pose => SectionId::PoseMean,
        };
        let spread = opened.model.spread(mode).ok_or(Error::Unsupported { section: section as u32 })?;
        let dim = match mode {
            habitus_core::format::Mode::Identity => opened.generator.identity_dim(),
            habitus_core::format::Mode::Pose => opened.generator.pose_dim(),
        };
        length(3, dim, deviations_len)?;
        length(5, dim, weights_len)?;
        // SAFETY: the caller's promise.
        spread.weights_into(unsafe { deviations.slice() }, unsafe { weights.slice() })?;
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 7, body) }
}
