//! The C functions called from Rust: the bits and the errors of the kernel, names and sentences of the codes, workspace sizes.

use std::ffi::CStr;
use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use habitus_core::fit::{Frame, fit_points_req};
use habitus_core::format::Model;
use habitus_core::generator::{Generator, Weights};
use habitus_ffi::code::*;
use habitus_ffi::evaluate::*;
use habitus_ffi::fit::*;
use habitus_ffi::model::*;
use habitus_ffi::prepared::*;
use habitus_ffi::sections::*;

/// A trained face of 1617 vertices, 6 + 4 weights, 13 landmarks.
const FACE: &[u8] = include_bytes!("../../examples/firmware/models/face.hab");
const IDENTITY: [f32; 6] = [0.20, -0.13, 0.05, 0.08, -0.04, 0.10];
const POSE: [f32; 4] = [0.35, -0.30, 0.20, 0.10];
const NO_DETAIL: hab_error_detail = hab_error_detail { code: 0, first: 0, second: 0, argument: 0 };

fn opened() -> hab_model {
    let mut model = hab_model { opaque: [MaybeUninit::zeroed(); 80] };
    // SAFETY: every pointer is that of a Rust object of the length given.
    let code = unsafe { hab_model_open(FACE.as_ptr(), FACE.len(), &mut model, null_mut()) };
    assert_eq!(code, hab_code::HAB_OK);
    model
}

fn evaluated(model: &hab_model) -> Vec<f32> {
    let mut out = vec![0.0; 3 * 1617];
    let (identity, pose) = (IDENTITY.as_ptr(), POSE.as_ptr());
    // SAFETY: as above.
    let code = unsafe { hab_model_evaluate(model, identity, 6, pose, 4, out.as_mut_ptr(), out.len(), null_mut()) };
    assert_eq!(code, hab_code::HAB_OK);
    out
}

#[test]
fn a_whole_evaluation_has_the_bits_of_the_kernel() {
    let generator = Model::open(FACE).unwrap().bilinear().unwrap();
    let mut expected = vec![0.0; 3 * 1617];
    generator.evaluate(Weights { identity: &IDENTITY, pose: &POSE }, 0..1617, &mut expected).unwrap();
    let found = evaluated(&opened());
    assert!(found.iter().zip(&expected).all(|(a, b)| a.to_bits() == b.to_bits()));
}

#[test]
fn counts_sections_and_names_are_those_of_the_file() {
    let model = opened();
    let file = Model::open(FACE).unwrap();
    // SAFETY: numbers alone; zero is one.
    let mut counts: hab_counts = unsafe { MaybeUninit::zeroed().assume_init() };
    counts.struct_bytes = size_of::<hab_counts>() as u32;
    // SAFETY: as above.
    assert_eq!(unsafe { hab_model_counts(&model, &mut counts, null_mut()) }, hab_code::HAB_OK);
    let all = [counts.n_vertices, counts.identity_dim, counts.pose_dim, counts.n_landmarks, counts.n_blocks];
    assert_eq!(all, [1617, 6, 4, 13, 102]);
    let mut faces = vec![0; 3 * counts.n_faces as usize];
    let id = hab_section_id::HAB_SECTION_FACES as u32;
    // SAFETY: as above.
    let code = unsafe { hab_model_read_u32(&model, id, 0, faces.as_mut_ptr(), faces.len(), null_mut()) };
    assert_eq!(code, hab_code::HAB_OK);
    assert!(file.faces().unwrap().iter().flatten().eq(faces));
    let names = file.landmark_names().unwrap();
    for (line, expected) in names.iter().enumerate() {
        let (mut text, mut bytes) = (null(), 0);
        let id = hab_section_id::HAB_SECTION_LANDMARK_NAMES as u32;
        // SAFETY: as above; the text lies in the file, which lives on.
        let found = unsafe {
            assert_eq!(hab_model_text(&model, id, line as u32, &mut text, &mut bytes, null_mut()), hab_code::HAB_OK);
            std::slice::from_raw_parts(text.cast::<u8>(), bytes)
        };
        assert_eq!(found, expected.as_bytes());
    }
}

/// The landmarks of a known face are found again, through the whole model and, much faster, through a form with the identity fixed.
#[test]
fn landmarks_are_fitted_through_the_model_and_through_a_form() {
    let model = opened();
    let shape = evaluated(&model);
    let targets: Vec<f32> = (Model::open(FACE).unwrap().landmarks().unwrap().iter())
        .flat_map(|vertex| shape[3 * vertex as usize..][..3].to_vec())
        .collect();
    // SAFETY: numbers alone; zero is one.
    let (mut options, mut report): (hab_fit_options, hab_fit_report) =
        unsafe { (MaybeUninit::zeroed().assume_init(), MaybeUninit::zeroed().assume_init()) };
    // SAFETY: as above.
    assert_eq!(unsafe { hab_fit_options_init(&mut options, size_of::<hab_fit_options>()) }, hab_code::HAB_OK);
    options.noise = 0.1;
    let frame = hab_frame::HAB_FRAME_RIGID as u32;
    let mut workspace = vec![0f32; hab_fit_workspace_bytes(6, 4, frame) / 4];
    let bytes = 4 * workspace.len();
    let mut run = |form: *const hab_prepared, prior: hab_prior, identity: &mut [f32], pose: &mut [f32]| {
        options.pose_prior = prior as u32;
        let mut placement = hab_placement { scale: 1.0, rotation: [0.0; 9], translation: [0.0; 3] };
        // SAFETY: as above.
        let code = unsafe {
            hab_fit_landmarks(
                &model,
                form,
                &options,
                targets.as_ptr(),
                targets.len(),
                null(),
                0,
                identity.as_mut_ptr(),
                identity.len(),
                pose.as_mut_ptr(),
                pose.len(),
                &mut placement,
                workspace.as_mut_ptr().cast(),
                bytes,
                &mut report,
                null_mut(),
            )
        };
        assert_eq!(code, hab_code::HAB_OK);
        (report, placement)
    };
    let (whole, placement) = run(null(), hab_prior::HAB_PRIOR_GAUSSIAN, &mut [0.0; 6], &mut [0.0; 4]);
    assert!(whole.rms < 0.5 && whole.energy < whole.start_energy, "{whole:?}");
    assert!((placement.rotation[0] - 1.0).abs() < 0.05 && placement.scale == 1.0, "{placement:?}");

    let (mut needed, mut form) = (0, hab_prepared { opaque: [MaybeUninit::zeroed(); 64] });
    let mode = hab_mode::HAB_MODE_IDENTITY as u32;
    // SAFETY: as above.
    unsafe { hab_prepared_workspace_bytes(&model, mode, 0, 102, &mut needed, null_mut()) };
    let mut numbers = vec![0f32; needed / 4];
    let pointer = numbers.as_mut_ptr().cast();
    // SAFETY: as above; the numbers stay as they are while the form is used.
    let code = unsafe {
        hab_prepared_init(&model, mode, IDENTITY.as_ptr(), 6, 0, 102, pointer, needed, &mut form, null_mut())
    };
    assert_eq!(code, hab_code::HAB_OK);
    let mut pose = [0.0; 4];
    // Four weights and a placement are determined by 39 numbers alone.
    let (tracked, _) = run(&form, hab_prior::HAB_PRIOR_NONE, &mut [], &mut pose);
    assert!(tracked.rms < 1e-3, "{tracked:?}");
    assert!(pose.iter().zip(POSE).all(|(found, truth)| (found - truth).abs() < 1e-3), "{pose:?}");
}

#[test]
fn refusals_say_why_and_leave_outputs_alone() {
    let model = opened();
    let mut out = [7.0; 3];
    let mut detail = NO_DETAIL;
    let weight = [f32::NAN; 6];
    // SAFETY: as above.
    let code = unsafe {
        let (identity, pose) = (weight.as_ptr(), POSE.as_ptr());
        hab_model_evaluate_range(&model, identity, 6, pose, 4, 5, 1, out.as_mut_ptr(), 3, &mut detail)
    };
    assert_eq!((code, detail.code, detail.first), (hab_code::HAB_NOT_FINITE, 103, 0));
    let aliased: *mut f32 = out.as_mut_ptr();
    // SAFETY: the overlap is what is refused before anything is read or written.
    let code =
        unsafe { hab_model_evaluate_range(&model, IDENTITY.as_ptr(), 6, aliased, 3, 5, 1, aliased, 3, &mut detail) };
    assert_eq!((code, detail.first, detail.second), (hab_code::HAB_OVERLAP, 4, 8));
    let closed = hab_model { opaque: [MaybeUninit::zeroed(); 80] };
    // SAFETY: as above.
    let code = unsafe { hab_model_evaluate(&closed, null(), 0, null(), 0, aliased, 3, &mut detail) };
    assert_eq!((code, detail.first, out), (hab_code::HAB_NOT_OPENED, 1, [7.0; 3]));
}

/// Every code of the kernel is C's with the same number, and every sentence fits the line that the header promises.
#[test]
fn codes_have_numbers_names_and_sentences() {
    for (position, (code, name, meaning)) in CODES.iter().enumerate() {
        assert!(CODES[..position].iter().all(|(other, ..)| (*other as i32) < *code as i32), "{name:?}");
        assert!(meaning.to_str().unwrap().ends_with('.'), "{meaning:?}");
        let detail = hab_error_detail { code: *code as i32, first: u32::MAX, second: u32::MAX, argument: u32::MAX };
        let mut text = [1; 160];
        // SAFETY: as above.
        let line = unsafe {
            assert_eq!(hab_error_format(&detail, text.as_mut_ptr(), text.len()), hab_code::HAB_OK);
            CStr::from_ptr(text.as_ptr()).to_str().unwrap()
        };
        assert!(line.ends_with('.') && line.starts_with(name.to_str().unwrap()), "{line}");
        assert!(!line.contains('{') && line.len() < 160, "{line}");
        assert_eq!(line.contains("4294967295"), meaning.to_str().unwrap().contains('{'), "{line}");
        // SAFETY: the texts are static.
        unsafe {
            assert_eq!(CStr::from_ptr(hab_error_name(*code as i32)), *name);
            assert_eq!(CStr::from_ptr(hab_error_message(*code as i32)), *meaning);
        }
    }
    let short = &mut [1; 8];
    let detail = hab_error_detail { code: 103, first: 4, second: 0, argument: 0 };
    // SAFETY: as above.
    unsafe { hab_error_format(&detail, short.as_mut_ptr(), short.len()) };
    assert_eq!(short.map(|byte| byte as u8), *b"HAB_NOT\0");
}

#[test]
fn workspace_sizes_are_those_of_the_kernel() {
    for (number, frame) in [Frame::Fixed, Frame::Rigid, Frame::Similarity].into_iter().enumerate() {
        for (identity, pose) in [(1, 1), (4, 3), (30, 7), (1024, 1024)] {
            let expected = fit_points_req(identity, pose, frame).f32_bytes();
            assert_eq!(hab_fit_workspace_bytes(identity as u32, pose as u32, number as u32), expected);
        }
    }
    assert_eq!(hab_fit_workspace_bytes(4, 3, 3), 0);
}
