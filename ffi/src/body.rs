//! What skinned models have beside others: joints, and ways of moving with them.

use habitus_core::Error;
use habitus_core::format::SectionId;
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::skinned::Blend;
use habitus_core::skeleton::JointMode;

use crate::code::{Refusal, hab_code, hab_error_detail};
use crate::memory::{Arguments, call};
use crate::model::{Opened, hab_model, opened};
use crate::tagged::{put, taken};

/// The parent of a joint that has none.
pub const HAB_NO_PARENT: u32 = 0xffff_ffff;

/// How the motions of the joints that hold a vertex are blended; functions take it as a uint32_t.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum hab_blend {
    /// Their matrices: linear blend skinning.
    HAB_BLEND_LINEAR = 0,
    /// Their dual quaternions, which keep the volume of a twisted limb.
    HAB_BLEND_DUAL_QUATERNION = 1,
}

/// Whether joints follow the identity; functions take it as a uint32_t.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum hab_joints {
    /// They stand where the rest shape of the identity has them.
    HAB_JOINTS_REGRESSED = 0,
    /// They stand where the mean shape has them; then the model is bilinear in identity and bone transforms.
    HAB_JOINTS_MEAN = 1,
}

/// A joint of a skinned model. Set struct_bytes to sizeof(hab_joint) before the call.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct hab_joint {
    /// sizeof(hab_joint), so that later versions can add members.
    pub struct_bytes: u32,
    /// The joint that carries it, which has a smaller number; HAB_NO_PARENT for a root.
    pub parent: u32,
    /// Its first pose weight.
    pub first_weight: u32,
    /// Its pose weights, radians: 1, the angle about its axis; or 3, a rotation vector.
    pub n_weights: u32,
    /// Axis in the standard posture, of unit length; all zero for a joint that turns about all of them.
    pub axis: [f32; 3],
    /// Position in the mean shape, millimetres.
    pub position: [f32; 3],
}

/// Joint number `index`, from 0; its name is line `index` of HAB_SECTION_JOINT_NAMES, see hab_model_text.
///
/// Returns HAB_OK, HAB_UNSUPPORTED when the model has no joints, HAB_INDEX_OUT_OF_RANGE, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, or HAB_BAD_STRUCT when
/// joint->struct_bytes is not set.
///
/// # Safety
/// `model` was opened; `joint` can be read and written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_joint(
    model: *const hab_model,
    index: u32,
    joint: *mut hab_joint,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.out_object(3, joint);
        // SAFETY: the caller's promise.
        let opened = unsafe { opened(arguments, 1, model)? };
        // SAFETY: the caller's promise.
        let struct_bytes = unsafe { (&raw const (*out.pointer()).struct_bytes).read() };
        if struct_bytes as usize != size_of::<hab_joint>() {
            return Err(Refusal::BadStruct { argument: 3, bytes: struct_bytes });
        }
        let absent = Error::Unsupported { section: SectionId::JointParents as u32 };
        let skeleton = opened.generator.skeleton().ok_or(absent)?;
        let beyond = Error::IndexOutOfRange { index, limit: skeleton.n_joints() as u32 };
        let joint = skeleton.joint(index as usize).ok_or(beyond)?;
        let weights = skeleton.angles().nth(index as usize).ok_or(beyond)?;
        let joint = hab_joint {
            struct_bytes,
            parent: joint.parent.and_then(|parent| u32::try_from(parent).ok()).unwrap_or(HAB_NO_PARENT),
            first_weight: weights.start as u32,
            n_weights: joint.dim() as u32,
            axis: joint.axis.unwrap_or_default(),
            position: joint.position,
        };
        // SAFETY: the caller's promise.
        unsafe { out.set(joint) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 4, body) }
}

/// Blends motions in another way than the file says, see hab_blend, from the next hab_evaluation_init, hab_prepared_init or fit on; what was made before stays as it
/// is. Copies of the hab_model keep their own way. No other thread may use the hab_model meanwhile.
///
/// Returns HAB_OK, HAB_BAD_OPTION (2) for an unknown blend, HAB_WRONG_KIND when the model is not skinned, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED,
/// HAB_OVERLAP.
///
/// # Safety
/// `model` was opened and can be written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_set_blend(
    model: *mut hab_model,
    blend: u32,
    detail: *mut hab_error_detail,
) -> hab_code {
    let set = |generator: &mut AnyGenerator<'static>| {
        generator.set_blend(match blend {
            0 => Blend::Linear,
            1 => Blend::DualQuaternion,
            _ => return Err(Error::BadOption { option: 2 }),
        })
    };
    // SAFETY: the caller's promise.
    unsafe { altered(model, 3, set, detail) }
}

/// Lets joints follow the identity or stay, see hab_joints; else as hab_model_set_blend. A model that is opened follows the identity where its file knows how.
///
/// Returns HAB_OK, HAB_BAD_OPTION (2) for an unknown choice, HAB_WRONG_KIND when the model is not skinned, HAB_UNSUPPORTED when the file does not know how joints follow
/// the identity, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP.
///
/// # Safety
/// As hab_model_set_blend.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_set_joints(
    model: *mut hab_model,
    joints: u32,
    detail: *mut hab_error_detail,
) -> hab_code {
    let set = |generator: &mut AnyGenerator<'static>| {
        generator.set_joints(match joints {
            0 => JointMode::Regressed,
            1 => JointMode::Mean,
            _ => return Err(Error::BadOption { option: 2 }),
        })
    };
    // SAFETY: the caller's promise.
    unsafe { altered(model, 3, set, detail) }
}

/// Sets the generator of a model anew; `position` is that of the detail.
///
/// # Safety
/// As hab_model_set_blend.
pub(crate) unsafe fn altered(
    model: *mut hab_model,
    position: u32,
    set: impl FnOnce(&mut AnyGenerator<'static>) -> Result<(), Error>,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        // SAFETY: the caller's promise.
        let (mut opened, out) = unsafe { taken::<Opened>(arguments, 1, model)? };
        set(&mut opened.generator)?;
        // SAFETY: the caller's promise.
        unsafe { put(&out, opened) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, position, body) }
}

/// C's number of a blend.
pub(crate) fn blend_number(blend: Blend) -> u32 {
    match blend {
        Blend::Linear => hab_blend::HAB_BLEND_LINEAR as u32,
        Blend::DualQuaternion => hab_blend::HAB_BLEND_DUAL_QUATERNION as u32,
    }
}

/// C's number of a choice of joints.
pub(crate) fn joints_number(joints: JointMode) -> u32 {
    match joints {
        JointMode::Regressed => hab_joints::HAB_JOINTS_REGRESSED as u32,
        JointMode::Mean => hab_joints::HAB_JOINTS_MEAN as u32,
    }
}
