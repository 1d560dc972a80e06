//! Sizes, offsets and constants as Rust has them on the target at hand, for a C program that compares them with the header's
//! (tests/hosts/layout.c). Only with the feature `layout`, which no shipped library has.
//!
//! The list is complete by construction: a pattern that names each member, or each case, does not compile when one is missing.

use core::ffi::{CStr, c_char};
use core::mem::{align_of, offset_of, size_of};

use crate::body::{hab_blend, hab_joint, hab_joints};
use crate::code::{CODES, hab_error_detail};
use crate::evaluation::hab_evaluation;
use crate::fit::{hab_fit_options, hab_fit_report, hab_frame, hab_placement, hab_prior, hab_sample, hab_status};
use crate::model::{hab_counts, hab_kind, hab_mode, hab_model};
use crate::prepared::hab_prepared;
use crate::sections::{hab_element, hab_section, hab_section_id};
use crate::wavelet::{hab_grid, hab_level_options, hab_level_report, hab_wavelet};

/// A name of the header and its value: a constant, the size or the alignment of a struct, a member's offset or size.
type Entry = (&'static CStr, u64);

/// The bytes of a name and the zero behind them.
const fn name(text: &'static str) -> &'static CStr {
    match CStr::from_bytes_with_nul(text.as_bytes()) {
        Ok(text) => text,
        Err(_) => c"",
    }
}

/// Bytes of the member that a function returns; never called.
const fn member_bytes<S, M>(_: fn(S) -> M) -> u64 {
    size_of::<M>() as u64
}

macro_rules! structs {
    ($list:ident: $($type:ident { $($member:ident),* $(,)? })*) => {
        const $list: &[Entry] = &[$(
            (name(concat!("sizeof ", stringify!($type), "\0")), size_of::<$type>() as u64),
            (name(concat!("alignof ", stringify!($type), "\0")), align_of::<$type>() as u64),
            $(
                (name(concat!("offsetof ", stringify!($type), ".", stringify!($member), "\0")), offset_of!($type, $member) as u64),
                (
                    name(concat!("sizeof ", stringify!($type), ".", stringify!($member), "\0")),
                    member_bytes(|all: $type| all.$member),
                ),
            )*
        )*];
        // No `..`: each member is named.
        $(const _: fn($type) = |$type { $($member: _),* }| ();)*
    };
}

macro_rules! enums {
    ($list:ident: $($type:ident { $($case:ident),* $(,)? })*) => {
        const $list: &[Entry] = &[$($((name(concat!(stringify!($case), "\0")), $type::$case as u64),)*)*];
        // No `_`: each case is named.
        $(const _: fn($type) = |case| match case { $($type::$case => (),)* };)*
    };
}

structs! { STRUCTS:
    hab_error_detail { code, first, second, argument }
    hab_model { opaque }
    hab_fit_options {
        struct_bytes, frame, place, identity_prior, pose_prior, identity_factor, pose_factor, noise, max_iterations,
        relative_decrease, damping
    }
    hab_prepared { opaque }
    hab_evaluation { opaque }
    hab_joint { struct_bytes, parent, first_weight, n_weights, axis, position }
    hab_placement { scale, rotation, translation }
    hab_fit_report { rms, energy, start_energy, iterations, status }
    hab_sample { vertices, barycentric, target, normal, weight }
    hab_counts {
        struct_bytes, kind, n_vertices, identity_dim, pose_dim, n_faces, n_landmarks, n_poses, n_sections, n_blocks,
        element, needs_evaluation, n_joints, blend, joints
    }
    hab_grid {
        struct_bytes, base_width, base_height, levels, wavelet, detail, resolution, width, height, n_coefficients,
        first_column, n_columns, first_row, n_rows
    }
    hab_level_options { struct_bytes, frame, identity, pose, kappa, omega, first_level, n_levels, passes }
    hab_level_report { rms, start_rms, passes, reached }
    hab_section { struct_bytes, id, element, rank, shape, data, data_bytes }
}

enums! { CASES:
    hab_mode { HAB_MODE_IDENTITY, HAB_MODE_POSE }
    hab_kind { HAB_KIND_BILINEAR, HAB_KIND_LINEAR, HAB_KIND_SKINNED, HAB_KIND_WAVELET }
    hab_blend { HAB_BLEND_LINEAR, HAB_BLEND_DUAL_QUATERNION }
    hab_joints { HAB_JOINTS_REGRESSED, HAB_JOINTS_MEAN }
    hab_section_id {
        HAB_SECTION_COEFFICIENTS, HAB_SECTION_FACES, HAB_SECTION_LANDMARKS, HAB_SECTION_LANDMARK_NAMES, HAB_SECTION_MIRROR,
        HAB_SECTION_IDENTITY_MEAN, HAB_SECTION_IDENTITY_SCALE, HAB_SECTION_IDENTITY_PRECISION, HAB_SECTION_POSE_MEAN,
        HAB_SECTION_POSE_SCALE, HAB_SECTION_POSE_PRECISION, HAB_SECTION_POSE_STARTS, HAB_SECTION_POSE_NAMES,
        HAB_SECTION_IDENTITY_SPECTRUM, HAB_SECTION_POSE_SPECTRUM, HAB_SECTION_PROVENANCE,
        HAB_SECTION_REMAINDER, HAB_SECTION_OFFSETS, HAB_SECTION_RANGES, HAB_SECTION_QUANTISATION_ERROR, HAB_SECTION_JOINT_PARENTS,
        HAB_SECTION_JOINT_AXES, HAB_SECTION_JOINT_POSITIONS, HAB_SECTION_JOINT_BASIS, HAB_SECTION_JOINT_NAMES,
        HAB_SECTION_SKIN_STARTS, HAB_SECTION_SKIN_JOINTS, HAB_SECTION_SKIN_WEIGHTS, HAB_SECTION_POSE_LOWER,
        HAB_SECTION_POSE_UPPER, HAB_SECTION_GRID
    }
    hab_element { HAB_ELEMENT_U8, HAB_ELEMENT_U32, HAB_ELEMENT_F32, HAB_ELEMENT_F16, HAB_ELEMENT_I8 }
    hab_frame { HAB_FRAME_FIXED, HAB_FRAME_RIGID, HAB_FRAME_SIMILARITY }
    hab_prior { HAB_PRIOR_NONE, HAB_PRIOR_GAUSSIAN, HAB_PRIOR_BOX, HAB_PRIOR_BOUNDS }
    hab_wavelet { HAB_WAVELET_CUBIC, HAB_WAVELET_BILINEAR }
    hab_status { HAB_STATUS_CONVERGED, HAB_STATUS_ITERATION_LIMIT, HAB_STATUS_STALLED }
}

const OTHERS: &[Entry] = &[
    (c"HAB_ABI_VERSION", crate::HAB_ABI_VERSION as u64),
    (c"HAB_BLOCK_VERTICES", crate::evaluate::HAB_BLOCK_VERTICES as u64),
    (c"HAB_NO_PARENT", crate::body::HAB_NO_PARENT as u64),
    (c"sizeof hab_code", size_of::<crate::code::hab_code>() as u64),
];

/// Writes entry `index` of the list; 0 behind its end.
///
/// # Safety
/// `name` and `value` can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_layout(index: u32, name: *mut *const c_char, value: *mut u64) -> i32 {
    let codes = CODES.iter().map(|(code, name, _)| (*name, *code as u64));
    let mut all = STRUCTS.iter().chain(CASES).chain(OTHERS).copied().chain(codes);
    let Some((text, number)) = all.nth(index as usize) else { return 0 };
    // SAFETY: the caller's promise.
    unsafe {
        name.write(text.as_ptr());
        value.write(number);
    }
    1
}
