//! The C functions on a wavelet model that is evaluated in part, and the priors of its dense fits.

use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use habitus_ffi::code::*;
use habitus_ffi::evaluation::*;
use habitus_ffi::fit::*;
use habitus_ffi::model::*;
use habitus_ffi::sections::*;
use habitus_ffi::wavelet::*;

/// A small wavelet model with triangles and landmarks.
const WAVELET: &[u8] = include_bytes!("../../examples/firmware/models/wavelet.hab");
const NO_DETAIL: hab_error_detail = hab_error_detail { code: 0, first: 0, second: 0, argument: 0 };
const SURFACE: [hab_section_id; 2] = [hab_section_id::HAB_SECTION_FACES, hab_section_id::HAB_SECTION_LANDMARKS];

fn opened() -> hab_model {
    let mut model = hab_model { opaque: [MaybeUninit::zeroed(); 80] };
    // SAFETY: every pointer is that of a Rust object of the length given.
    let code = unsafe { hab_model_open(WAVELET.as_ptr(), WAVELET.len(), &mut model, null_mut()) };
    assert_eq!(code, hab_code::HAB_OK);
    model
}

fn counts(model: &hab_model) -> hab_counts {
    // SAFETY: numbers alone; zero is one.
    let mut counts: hab_counts = unsafe { MaybeUninit::zeroed().assume_init() };
    counts.struct_bytes = size_of::<hab_counts>() as u32;
    // SAFETY: as above.
    assert_eq!(unsafe { hab_model_counts(model, &mut counts, null_mut()) }, hab_code::HAB_OK);
    counts
}

fn grid(model: &hab_model) -> hab_grid {
    // SAFETY: numbers alone; zero is one.
    let mut grid: hab_grid = unsafe { MaybeUninit::zeroed().assume_init() };
    grid.struct_bytes = size_of::<hab_grid>() as u32;
    // SAFETY: as above.
    assert_eq!(unsafe { hab_model_grid(model, &mut grid, null_mut()) }, hab_code::HAB_OK);
    grid
}

fn read(model: &hab_model, section: hab_section_id, len: usize) -> (hab_code, hab_error_detail, Vec<u32>) {
    let (mut out, mut detail) = (vec![u32::MAX; len], NO_DETAIL);
    // SAFETY: as above.
    let code = unsafe { hab_model_read_u32(model, section as u32, 0, out.as_mut_ptr(), len, &mut detail) };
    (code, detail, out)
}

fn set_levels(model: &mut hab_model, detail: u32, resolution: u32) {
    // SAFETY: as above.
    assert_eq!(unsafe { hab_model_set_levels(model, detail, resolution, null_mut()) }, hab_code::HAB_OK);
}

fn mean(model: &hab_model, mode: hab_mode, dim: u32) -> Vec<f32> {
    let (zeros, mut out) = (vec![0.0; dim as usize], vec![0.0; dim as usize]);
    let (from, to, len) = (zeros.as_ptr(), out.as_mut_ptr(), zeros.len());
    // SAFETY: as above.
    let code = unsafe { hab_model_weights(model, mode as u32, from, len, to, len, null_mut()) };
    assert_eq!(code, hab_code::HAB_OK);
    out
}

/// Fits landmarks with the same prior on both modes; code, detail, distance, identity.
fn fit(
    model: &hab_model,
    targets: &[f32],
    prior: hab_prior,
    factor: f32,
) -> (hab_code, hab_error_detail, f32, Vec<f32>) {
    let counts = counts(model);
    // SAFETY: numbers alone; zero is one.
    let (mut options, mut report): (hab_fit_options, hab_fit_report) =
        unsafe { (MaybeUninit::zeroed().assume_init(), MaybeUninit::zeroed().assume_init()) };
    // SAFETY: as above.
    assert_eq!(unsafe { hab_fit_options_init(&mut options, size_of::<hab_fit_options>()) }, hab_code::HAB_OK);
    (options.identity_prior, options.pose_prior) = (prior as u32, prior as u32);
    (options.identity_factor, options.pose_factor) = (factor, factor);
    let mut identity = mean(model, hab_mode::HAB_MODE_IDENTITY, counts.identity_dim);
    let mut pose = mean(model, hab_mode::HAB_MODE_POSE, counts.pose_dim);
    let mut placement = hab_placement { scale: 1.0, rotation: [0.0; 9], translation: [0.0; 3] };
    let (mut bytes, mut detail) = (0, NO_DETAIL);
    // SAFETY: as above.
    let code = unsafe {
        let known = hab_model_fit_workspace_bytes(model, null(), options.frame, &mut bytes, null_mut());
        assert_eq!(known, hab_code::HAB_OK);
        let mut workspace = vec![f32::NAN; bytes / 4];
        hab_fit_landmarks(
            model,
            null(),
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
            &mut detail,
        )
    };
    (code, detail, report.rms, identity)
}

/// Positions of all vertices.
fn positions(model: &hab_model, identity: &[f32], pose: &[f32]) -> Vec<f32> {
    let mut out = vec![0.0; 3 * counts(model).n_vertices as usize];
    let mut evaluation = hab_evaluation { opaque: [MaybeUninit::zeroed(); 88] };
    let mut bytes = 0;
    // SAFETY: as above; the workspace lives as long as the evaluation is used.
    unsafe {
        let code = hab_evaluation_workspace_bytes(model, null(), 0, &mut bytes, null_mut());
        assert_eq!(code, hab_code::HAB_OK);
        let mut memory = vec![f32::NAN; bytes / 4];
        let (x, y, to) = (identity.as_ptr(), pose.as_ptr(), memory.as_mut_ptr().cast());
        let of = &mut evaluation;
        let code = hab_evaluation_init(model, null(), x, identity.len(), y, pose.len(), 0, to, bytes, of, null_mut());
        assert_eq!(code, hab_code::HAB_OK);
        let (n, len) = (out.len() as u32 / 3, out.len());
        let code = hab_evaluation_positions(&evaluation, 0, n, out.as_mut_ptr(), len, null_mut());
        assert_eq!(code, hab_code::HAB_OK);
    }
    out
}

/// What a host reads by the counts never leads beyond its vertices.
#[test]
fn triangles_and_landmarks_are_those_of_the_whole_surface_alone() {
    let whole = opened();
    let (all, levels) = (counts(&whole), grid(&whole).levels);
    assert!(all.n_faces > 0 && all.n_landmarks > 0);
    let coarse = |model: &mut hab_model| set_levels(model, levels, levels - 1);
    let window = |model: &mut hab_model| {
        // SAFETY: as above.
        assert_eq!(unsafe { hab_model_set_window(model, 0, 2, 0, 2, null_mut()) }, hab_code::HAB_OK);
    };
    for part in [&coarse as &dyn Fn(&mut hab_model), &window] {
        let mut model = whole;
        part(&mut model);
        let few = counts(&model);
        assert!(few.n_vertices < all.n_vertices);
        assert_eq!([few.n_faces, few.n_landmarks], [0, 0]);
        for section in SURFACE {
            assert_eq!(read(&model, section, 0).0, hab_code::HAB_OK);
            let (code, detail, untouched) = read(&model, section, 3);
            assert_eq!((code, detail.first, detail.second), (hab_code::HAB_INDEX_OUT_OF_RANGE, 3, 0));
            assert_eq!(untouched, [u32::MAX; 3]);
        }
        for n in [0, all.n_landmarks as usize] {
            assert_eq!(fit(&model, &vec![0.0; 3 * n], hab_prior::HAB_PRIOR_BOX, 1.0).0, hab_code::HAB_EMPTY);
        }
        // The copy from before keeps all, and so does the model when it is whole again.
        set_levels(&mut model, 0, levels);
        for model in [&whole, &model] {
            let found = counts(model);
            assert_eq!(
                [found.n_vertices, found.n_faces, found.n_landmarks],
                [all.n_vertices, all.n_faces, all.n_landmarks]
            );
            for (section, len) in SURFACE.into_iter().zip([3 * all.n_faces, all.n_landmarks]) {
                let (code, _, vertices) = read(model, section, len as usize);
                assert_eq!(code, hab_code::HAB_OK);
                assert!(vertices.iter().all(|vertex| *vertex < found.n_vertices));
            }
        }
    }
}

/// A box takes the spread of the weights, of the first of them where only the base has weights; a Gaussian would need their covariance.
#[test]
fn a_box_bounds_the_weights_of_a_wavelet_model_and_a_gaussian_is_refused() {
    let mut model = opened();
    let levels = grid(&model).levels;
    set_levels(&mut model, 0, levels);
    let of = counts(&model);
    let (mean_x, mean_y) = (
        mean(&model, hab_mode::HAB_MODE_IDENTITY, of.identity_dim),
        mean(&model, hab_mode::HAB_MODE_POSE, of.pose_dim),
    );
    let mut scale = vec![0.0; mean_x.len()];
    let id = hab_section_id::HAB_SECTION_IDENTITY_SCALE as u32;
    // SAFETY: as above.
    let code = unsafe { hab_model_read_f32(&model, id, 0, scale.as_mut_ptr(), scale.len(), null_mut()) };
    assert_eq!(code, hab_code::HAB_OK);
    let shape: Vec<f32> = mean_x.iter().zip(&scale).map(|(mean, scale)| mean + 0.75 * scale).collect();
    let surface = positions(&model, &shape, &mean_y);
    let (_, _, landmarks) = read(&model, hab_section_id::HAB_SECTION_LANDMARKS, of.n_landmarks as usize);
    let targets: Vec<f32> = landmarks.iter().flat_map(|vertex| surface[3 * *vertex as usize..][..3].to_vec()).collect();
    let (code, _, rms, identity) = fit(&model, &targets, hab_prior::HAB_PRIOR_BOX, 1.0);
    assert!(code == hab_code::HAB_OK && rms < 0.5, "{code:?} {rms} mm");
    for ((weight, mean), scale) in identity.iter().zip(&mean_x).zip(&scale) {
        assert!((weight - mean).abs() <= scale * 1.001, "{weight} {mean} {scale}");
    }
    let (code, _, narrow, _) = fit(&model, &targets, hab_prior::HAB_PRIOR_BOX, 1e-3);
    assert!(code == hab_code::HAB_OK && narrow > rms, "{code:?} {narrow} mm");
    let (code, detail, ..) = fit(&model, &targets, hab_prior::HAB_PRIOR_GAUSSIAN, 1.0);
    let precision = hab_section_id::HAB_SECTION_IDENTITY_PRECISION as u32;
    assert_eq!((code, detail.first), (hab_code::HAB_NEEDS_LEVELS, precision));
}
