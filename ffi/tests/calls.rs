//! The C functions called from Rust: the bits and the errors of the kernel, names and sentences of the codes, workspace sizes.

use std::ffi::CStr;
use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use habitus_core::fit::{Frame, fit_points_req};
use habitus_core::format::Model;
use habitus_core::generator::linear::Linear;
use habitus_core::generator::skinned::{Blend, Skinned};
use habitus_core::generator::{Generator, NUMBERS, Weights};
use habitus_core::quantise::F32;
use habitus_core::skeleton::JointMode;
use habitus_ffi::body::*;
use habitus_ffi::code::*;
use habitus_ffi::evaluate::*;
use habitus_ffi::evaluation::*;
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
    opened_from(FACE)
}

fn opened_from(bytes: &'static [u8]) -> hab_model {
    let mut model = hab_model { opaque: [MaybeUninit::zeroed(); 80] };
    // SAFETY: every pointer is that of a Rust object of the length given.
    let code = unsafe { hab_model_open(bytes.as_ptr(), bytes.len(), &mut model, null_mut()) };
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

/// A body of 50 vertices, 3 + 11 weights, 5 joints, 10 landmarks.
const BODY: &[u8] = include_bytes!("../../examples/firmware/models/body.hab");
const SHAPE: [f32; 3] = [1.0, -0.5, 2.0];
const ANGLES: [f32; 11] = [0.1, 0.4, -0.2, 0.3, 0.2, -0.4, 0.1, 0.5, -0.3, -1.1, 0.9];
const N: usize = 50;

/// An evaluation and the memory that it refers to.
struct Evaluated {
    evaluation: hab_evaluation,
    _workspace: Vec<f32>,
}

fn begun(
    model: *const hab_model,
    form: *const hab_prepared,
    identity: &[f32],
    pose: &[f32],
    derivatives: u32,
) -> Evaluated {
    let mut bytes = 0;
    let mut evaluation = hab_evaluation { opaque: [MaybeUninit::zeroed(); 88] };
    // SAFETY: as above.
    let code = unsafe { hab_evaluation_workspace_bytes(model, form, derivatives, &mut bytes, null_mut()) };
    assert_eq!(code, hab_code::HAB_OK);
    let mut workspace = vec![f32::NAN; bytes / 4];
    let memory = workspace.as_mut_ptr().cast();
    let (identity, ni, pose, np) = (identity.as_ptr(), identity.len(), pose.as_ptr(), pose.len());
    // SAFETY: as above; the workspace stays as it is while the evaluation is used.
    let code = unsafe {
        hab_evaluation_init(
            model,
            form,
            identity,
            ni,
            pose,
            np,
            derivatives,
            memory,
            bytes,
            &mut evaluation,
            null_mut(),
        )
    };
    assert_eq!(code, hab_code::HAB_OK);
    Evaluated { evaluation, _workspace: workspace }
}

impl Evaluated {
    fn positions(&self, first: u32, count: u32) -> Vec<f32> {
        let mut out = vec![f32::NAN; 3 * count as usize];
        // SAFETY: as above.
        let code = unsafe {
            hab_evaluation_positions(&self.evaluation, first, count, out.as_mut_ptr(), out.len(), null_mut())
        };
        assert_eq!(code, hab_code::HAB_OK);
        out
    }

    fn joints(&self, count: u32) -> (hab_code, Vec<f32>) {
        let mut out = vec![7.0; 3 * count as usize];
        // SAFETY: as above.
        let code = unsafe {
            hab_evaluation_joint_positions(&self.evaluation, 0, count, out.as_mut_ptr(), out.len(), null_mut())
        };
        (code, out)
    }

    fn linearised(&self, blocks: usize, dim: usize) -> (hab_code, Vec<f32>, Vec<f32>) {
        let (mut values, mut jacobian) = (vec![7.0; blocks * NUMBERS], vec![7.0; blocks * NUMBERS * dim]);
        let (v, nv, j, nj) = (values.as_mut_ptr(), values.len(), jacobian.as_mut_ptr(), jacobian.len());
        // SAFETY: as above.
        let code = unsafe { hab_evaluation_linearise(&self.evaluation, 0, blocks as u32, v, nv, j, nj, null_mut()) };
        (code, values, jacobian)
    }
}

fn same(a: &[f32], b: &[f32]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

fn body() -> Skinned<'static, Linear<'static, F32<'static>>> {
    Model::open(BODY).unwrap().skinned().unwrap()
}

/// Positions and derivatives of the kernel, and where its joints stand.
fn expected<'a>(generator: &Skinned<'_, Linear<'a, F32<'a>>>) -> (Vec<f32>, Vec<f32>, Vec<f32>) {
    let mut state = vec![0.0; Generator::state_req(generator, true).numbers()];
    let at = generator.begin(Weights { identity: &SHAPE, pose: &ANGLES }, true, &mut state).unwrap();
    let (mut positions, mut values, mut jacobian) =
        (vec![0.0; 3 * N], vec![0.0; 4 * NUMBERS], vec![0.0; 14 * 4 * NUMBERS]);
    generator.evaluate_at(at, 0..N, &mut positions).unwrap();
    generator.linearise_at(at, 0..4, &mut values, &mut jacobian).unwrap();
    let joints = (0..5).flat_map(|joint| generator.joint_position(at, joint).unwrap()).collect();
    (positions, jacobian, joints)
}

#[test]
fn an_evaluation_of_a_body_has_the_bits_of_the_kernel() {
    let (positions, jacobian, joints) = expected(&body());
    let model = opened_from(BODY);
    let without = begun(&model, null(), &SHAPE, &ANGLES, 0);
    assert!(same(&without.positions(0, N as u32), &positions) && same(&without.positions(17, 20), &positions[51..111]));
    let with = begun(&model, null(), &SHAPE, &ANGLES, 1);
    let (code, _, found) = with.linearised(4, 14);
    assert!(code == hab_code::HAB_OK && same(&found, &jacobian) && same(&with.positions(0, N as u32), &positions));
    assert!(with.joints(5) == (hab_code::HAB_OK, joints.clone()) && without.joints(5).1 == joints);
    // Copies do; the model is not needed.
    let copy = Evaluated { evaluation: with.evaluation, _workspace: Vec::new() };
    assert!(same(&copy.positions(0, 1), &positions[..3]));
}

#[test]
fn an_evaluation_of_a_face_is_that_of_one_call() {
    let model = opened();
    let whole = evaluated(&model);
    let both = begun(&model, null(), &IDENTITY, &POSE, 1);
    assert!(same(&both.positions(0, 1617), &whole));
    assert_eq!(both.linearised(1, 10).0, hab_code::HAB_OK);
    assert_eq!(both.joints(1), (hab_code::HAB_UNSUPPORTED, vec![7.0; 3]));
}

fn prepared(model: &hab_model, mode: hab_mode, weights: &[f32], blocks: [u32; 2]) -> (hab_prepared, Vec<f32>) {
    let (mut needed, mut form) = (0, hab_prepared { opaque: [MaybeUninit::zeroed(); 64] });
    let ([first, count], mode) = (blocks, mode as u32);
    // SAFETY: as above.
    let code = unsafe { hab_prepared_workspace_bytes(model, mode, first, count, &mut needed, null_mut()) };
    assert_eq!(code, hab_code::HAB_OK);
    let mut numbers = vec![0f32; needed / 4];
    let (weights, len, memory) = (weights.as_ptr(), weights.len(), numbers.as_mut_ptr().cast());
    // SAFETY: as above; the numbers are handed out with the form.
    let code =
        unsafe { hab_prepared_init(model, mode, weights, len, first, count, memory, needed, &mut form, null_mut()) };
    assert_eq!(code, hab_code::HAB_OK);
    (form, numbers)
}

#[test]
fn forms_of_a_body_are_evaluated_without_the_model() {
    let (positions, _, joints) = expected(&body());
    let model = opened_from(BODY);
    let (person, _person) = prepared(&model, hab_mode::HAB_MODE_IDENTITY, &SHAPE, [0, 4]);
    let posed = begun(null(), &person, &[], &ANGLES, 1);
    assert!(same(&posed.positions(0, N as u32), &positions) && posed.joints(5).1 == joints);
    assert_eq!(posed.linearised(4, 11).0, hab_code::HAB_OK);
    let (part, _part) = prepared(&model, hab_mode::HAB_MODE_IDENTITY, &SHAPE, [1, 2]);
    assert!(same(&begun(null(), &part, &[], &ANGLES, 0).positions(0, 32), &positions[48..144]));
    let (posture, _posture) = prepared(&model, hab_mode::HAB_MODE_POSE, &ANGLES, [0, 4]);
    let shaped = begun(null(), &posture, &SHAPE, &[], 0);
    assert!(shaped.positions(0, N as u32).iter().zip(&positions).all(|(a, b)| (a - b).abs() < 1e-2));
    assert_eq!(shaped.joints(1).0, hab_code::HAB_UNSUPPORTED);
    let mut out = [7.0; 3];
    let mut detail = NO_DETAIL;
    // SAFETY: as above.
    let code = unsafe { hab_prepared_evaluate(&person, ANGLES.as_ptr(), 11, 0, 1, out.as_mut_ptr(), 3, &mut detail) };
    assert_eq!((code, detail.argument, out), (hab_code::HAB_NEEDS_EVALUATION, 0, [7.0; 3]));
    // SAFETY: as above.
    let code = unsafe { hab_prepared_evaluate(&posture, SHAPE.as_ptr(), 3, 0, 1, out.as_mut_ptr(), 3, &mut detail) };
    assert_eq!(code, hab_code::HAB_OK);
}

#[test]
fn a_body_is_refused_where_a_state_is_missing() {
    let model = opened_from(BODY);
    let mut out = [7.0; 3 * N];
    let mut detail = NO_DETAIL;
    let needed = Generator::state_req(&body(), true).numbers() as u32;
    let (shape, angles) = (SHAPE.as_ptr(), ANGLES.as_ptr());
    // SAFETY: as above.
    let code = unsafe { hab_model_evaluate(&model, shape, 3, angles, 11, out.as_mut_ptr(), 3 * N, &mut detail) };
    assert_eq!((code, detail.first, out), (hab_code::HAB_NEEDS_EVALUATION, needed, [7.0; 3 * N]));
    let code =
        // SAFETY: as above.
        unsafe { hab_model_evaluate_range(&model, shape, 3, angles, 11, 0, 1, out.as_mut_ptr(), 3, &mut detail) };
    assert_eq!(code, hab_code::HAB_NEEDS_EVALUATION);
    let pointer = out.as_mut_ptr();
    // SAFETY: as above; the two outputs are not looked at.
    let code = unsafe { hab_model_linearise(&model, shape, 3, angles, 11, 0, 0, pointer, 0, pointer, 0, &mut detail) };
    assert_eq!(code, hab_code::HAB_NEEDS_EVALUATION);
}

#[test]
fn joints_say_who_carries_them_and_which_weights_they_have() {
    let model = opened_from(BODY);
    let skeleton = Model::open(BODY).unwrap().skeleton().unwrap();
    // SAFETY: numbers alone; zero is one.
    let mut joint: hab_joint = unsafe { MaybeUninit::zeroed().assume_init() };
    joint.struct_bytes = size_of::<hab_joint>() as u32;
    let mut first = 0;
    for index in 0..5 {
        // SAFETY: as above.
        assert_eq!(unsafe { hab_model_joint(&model, index, &mut joint, null_mut()) }, hab_code::HAB_OK);
        let known = skeleton.joint(index as usize).unwrap();
        assert_eq!(joint.parent, known.parent.map_or(HAB_NO_PARENT, |parent| parent as u32));
        assert_eq!((joint.first_weight, joint.n_weights as usize), (first, known.dim()));
        assert_eq!((joint.axis, joint.position), (known.axis.unwrap_or_default(), known.position));
        first += joint.n_weights;
        let (mut text, mut bytes) = (null(), 0);
        let id = hab_section_id::HAB_SECTION_JOINT_NAMES as u32;
        // SAFETY: as above.
        assert_eq!(unsafe { hab_model_text(&model, id, index, &mut text, &mut bytes, null_mut()) }, hab_code::HAB_OK);
    }
    let mut detail = NO_DETAIL;
    // SAFETY: as above.
    unsafe {
        assert_eq!(hab_model_joint(&model, 5, &mut joint, &mut detail), hab_code::HAB_INDEX_OUT_OF_RANGE);
        assert_eq!(hab_model_joint(&opened(), 0, &mut joint, &mut detail), hab_code::HAB_UNSUPPORTED);
        joint.struct_bytes = 4;
        assert_eq!(hab_model_joint(&model, 0, &mut joint, &mut detail), hab_code::HAB_BAD_STRUCT);
    }
    assert_eq!((first, detail.second), (11, 4));
}

#[test]
fn a_body_moves_in_the_way_that_was_set() {
    let mut model = opened_from(BODY);
    let counts = |model: &hab_model| {
        // SAFETY: numbers alone; zero is one.
        let mut counts: hab_counts = unsafe { MaybeUninit::zeroed().assume_init() };
        counts.struct_bytes = size_of::<hab_counts>() as u32;
        // SAFETY: as above.
        assert_eq!(unsafe { hab_model_counts(model, &mut counts, null_mut()) }, hab_code::HAB_OK);
        counts
    };
    let first = counts(&model);
    assert_eq!((first.kind, first.n_joints, first.blend, first.joints, first.needs_evaluation), (3, 5, 0, 0, 1));
    assert_eq!(first.element, hab_element::HAB_ELEMENT_F32 as u32);
    let before = begun(&model, null(), &SHAPE, &ANGLES, 0);
    // SAFETY: as above.
    unsafe {
        assert_eq!(hab_model_set_blend(&mut model, 1, null_mut()), hab_code::HAB_OK);
        assert_eq!(hab_model_set_joints(&mut model, 1, null_mut()), hab_code::HAB_OK);
    }
    assert_eq!((counts(&model).blend, counts(&model).joints), (1, 1));
    let changed = body().with_blend(Blend::DualQuaternion).with_joints(JointMode::Mean);
    assert!(same(&begun(&model, null(), &SHAPE, &ANGLES, 0).positions(0, N as u32), &expected(&changed).0));
    assert!(same(&before.positions(0, N as u32), &expected(&body()).0));
    let mut detail = NO_DETAIL;
    let mut face = opened();
    // SAFETY: as above.
    unsafe {
        assert_eq!(hab_model_set_blend(&mut model, 2, &mut detail), hab_code::HAB_BAD_OPTION);
        assert_eq!(hab_model_set_joints(&mut face, 2, &mut detail), hab_code::HAB_BAD_OPTION);
        assert_eq!(hab_model_set_joints(&mut face, 1, &mut detail), hab_code::HAB_WRONG_KIND);
        assert_eq!(hab_model_set_blend(&mut face, 0, &mut detail), hab_code::HAB_WRONG_KIND);
    }
    assert_eq!((detail.first, detail.second), (3, 1));
    assert_eq!((counts(&face).needs_evaluation, counts(&face).n_joints, counts(&model).blend), (0, 0, 1));
}

/// The landmarks of a posed body are found again, within the bounds of its angles, through the model and through forms.
#[test]
fn a_body_is_fitted_within_the_bounds_of_its_angles() {
    let model = opened_from(BODY);
    let file = Model::open(BODY).unwrap();
    let shape = begun(&model, null(), &SHAPE, &ANGLES, 0).positions(0, N as u32);
    let targets: Vec<f32> =
        file.landmarks().unwrap().iter().flat_map(|vertex| shape[3 * vertex as usize..][..3].to_vec()).collect();
    // SAFETY: numbers alone; zero is one.
    let mut options: hab_fit_options = unsafe { MaybeUninit::zeroed().assume_init() };
    // SAFETY: as above.
    assert_eq!(unsafe { hab_fit_options_init(&mut options, size_of::<hab_fit_options>()) }, hab_code::HAB_OK);
    (options.noise, options.max_iterations) = (1.0, 200);
    // The root joint already turns the body.
    (options.frame, options.place) = (hab_frame::HAB_FRAME_FIXED as u32, 0);
    options.pose_prior = hab_prior::HAB_PRIOR_BOUNDS as u32;
    let run = |form: *const hab_prepared, identity: &mut [f32], pose: &mut [f32], short: usize| {
        let mut placement = hab_placement {
            scale: 1.0,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            translation: [0.0; 3],
        };
        let (mut bytes, mut report, mut detail) = (0, [0u32; 5], NO_DETAIL);
        // SAFETY: as above; five words are as large as a report.
        let code = unsafe {
            hab_model_fit_workspace_bytes(&model, form, options.frame, &mut bytes, null_mut());
            let mut workspace = vec![f32::NAN; bytes / 4 - short];
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
                4 * workspace.len(),
                report.as_mut_ptr().cast(),
                &mut detail,
            )
        };
        (code, f32::from_bits(report[0]), detail)
    };
    let (mut identity, mut pose) = ([0.0; 3], [0.0; 11]);
    let (code, rms, _) = run(null(), &mut identity, &mut pose, 0);
    assert!(code == hab_code::HAB_OK && rms < 3.0, "{code:?} {rms} mm");
    let (lower, upper) = file.pose_bounds().unwrap();
    assert!(pose.iter().zip(lower.iter().zip(upper.iter())).all(|(angle, (low, high))| (low..=high).contains(angle)));
    let (person, _person) = prepared(&model, hab_mode::HAB_MODE_IDENTITY, &SHAPE, [0, 4]);
    let (code, rms, _) = run(&person, &mut [], &mut [0.0; 11], 0);
    assert!(code == hab_code::HAB_OK && rms < 0.1, "{code:?} {rms} mm");
    let (code, _, detail) = run(null(), &mut [0.0; 3], &mut [0.0; 11], 1);
    assert_eq!((code, detail.first - detail.second), (hab_code::HAB_WORKSPACE_TOO_SMALL, 1));
}

#[test]
fn bounds_are_wanted_where_a_file_has_none() {
    let (model, targets) = (opened(), [0f32; 39]);
    // SAFETY: numbers alone; zero is one.
    let mut options: hab_fit_options = unsafe { MaybeUninit::zeroed().assume_init() };
    let (mut identity, mut pose, mut placement, mut workspace) = (IDENTITY, POSE, [0f32; 13], [0f32; 4096]);
    let mut detail = NO_DETAIL;
    // SAFETY: as above.
    let code = unsafe { hab_fit_options_init(&mut options, size_of::<hab_fit_options>()) };
    assert_eq!(code, hab_code::HAB_OK);
    // SAFETY: as above; thirteen floats are as large as a placement.
    let mut run = |options: &hab_fit_options| unsafe {
        hab_fit_landmarks(
            &model,
            null(),
            options,
            targets.as_ptr(),
            39,
            null(),
            0,
            identity.as_mut_ptr(),
            6,
            pose.as_mut_ptr(),
            4,
            placement.as_mut_ptr().cast(),
            workspace.as_mut_ptr().cast(),
            16384,
            null_mut(),
            &mut detail,
        )
    };
    options.identity_prior = hab_prior::HAB_PRIOR_BOUNDS as u32;
    assert_eq!(run(&options), hab_code::HAB_BAD_OPTION);
    options.identity_prior = hab_prior::HAB_PRIOR_GAUSSIAN as u32;
    options.pose_prior = hab_prior::HAB_PRIOR_BOUNDS as u32;
    let code = run(&options);
    assert_eq!((code, detail.first), (hab_code::HAB_UNSUPPORTED, hab_section_id::HAB_SECTION_POSE_LOWER as u32));
}

#[test]
fn evaluations_that_were_not_begun_are_refused() {
    let model = opened_from(BODY);
    let none = Evaluated { evaluation: hab_evaluation { opaque: [MaybeUninit::zeroed(); 88] }, _workspace: Vec::new() };
    assert_eq!(none.joints(5), (hab_code::HAB_NOT_OPENED, vec![7.0; 15]));
    assert_eq!(none.linearised(1, 14).0, hab_code::HAB_NOT_OPENED);
    let without = begun(&model, null(), &SHAPE, &ANGLES, 0);
    let (code, values, _) = without.linearised(1, 14);
    assert_eq!((code, values[0]), (hab_code::HAB_BAD_OPTION, 7.0));
    let face = opened();
    let of_face = begun(&face, null(), &IDENTITY, &POSE, 0);
    assert_eq!(of_face.linearised(1, 10).0, hab_code::HAB_BAD_OPTION);
    let mut detail = NO_DETAIL;
    let mut evaluation = none.evaluation;
    let mut workspace = [7f32; 400];
    let memory: *mut core::ffi::c_void = workspace.as_mut_ptr().cast();
    let (shape, angles) = (SHAPE.as_ptr(), ANGLES.as_ptr());
    let bad = [f32::NAN; 3];
    // SAFETY: as above.
    unsafe {
        let mut init = |identity, ni, np, derivatives, bytes| {
            let out = &mut evaluation;
            hab_evaluation_init(&model, null(), identity, ni, angles, np, derivatives, memory, bytes, out, &mut detail)
        };
        assert_eq!(init(shape, 2, 11, 0, 1600), hab_code::HAB_DIMENSION_MISMATCH);
        assert_eq!(init(shape, 3, 12, 0, 1600), hab_code::HAB_DIMENSION_MISMATCH);
        assert_eq!(init(shape, 3, 11, 2, 1600), hab_code::HAB_BAD_OPTION);
        assert_eq!(init(bad.as_ptr(), 3, 11, 0, 1600), hab_code::HAB_NOT_FINITE);
        assert_eq!(init(shape, 3, 11, 1, 4 * 13), hab_code::HAB_WORKSPACE_TOO_SMALL);
        assert_eq!(init(memory.cast(), 3, 11, 1, 1600), hab_code::HAB_OVERLAP);
        assert_eq!(init(null(), 3, 11, 1, 1600), hab_code::HAB_NULL_POINTER);
    }
    assert!(workspace.iter().all(|number| *number == 7.0));
    // Positions that would be written into the evaluation's own workspace.
    let busy = begun(&model, null(), &SHAPE, &ANGLES, 0);
    let own = busy._workspace.as_ptr().cast_mut();
    // SAFETY: the overlap is what is refused before anything is written.
    let code = unsafe { hab_evaluation_positions(&busy.evaluation, 0, 1, own, 3, &mut detail) };
    assert_eq!((code, detail.first, detail.second), (hab_code::HAB_OVERLAP, 1, 4));
}
