//! From landmarks or corresponding points to weights and placement.

use habitus_core::Error;
use habitus_core::fit::{FitOptions, FitReport, Frame, fit_points_req};
use habitus_core::format::{Mode, SectionId};
use habitus_core::generator::Generator;
use habitus_core::prior::Prior;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::{Limits, Status};
use habitus_dispatch as kernel;

use crate::code::{Refusal, hab_code, hab_error_detail, length};
use crate::measurements::{Landmarks, Measurements};
use crate::memory::{Arguments, Input, Object, OutObject, Output, call};
use crate::model::hab_model;
use crate::prepared::hab_prepared;
use crate::shape::Shape;

/// Which motions of the placement a fit seeks beside the weights; hab_fit_options takes it as a uint32_t.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum hab_frame {
    /// None: the placement is known.
    HAB_FRAME_FIXED = 0,
    /// Rotation and translation.
    HAB_FRAME_RIGID = 1,
    /// Rotation, translation and scale.
    HAB_FRAME_SIMILARITY = 2,
}

/// What a fit knows of the weights of a mode before it sees the data; hab_fit_options takes it as a uint32_t.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum hab_prior {
    /// Nothing: the data must determine every weight.
    HAB_PRIOR_NONE = 0,
    /// The Gaussian of the training data; its energy is multiplied by the factor. Wavelet models have none (HAB_NEEDS_LEVELS): take hab_fit_levels, or a box.
    HAB_PRIOR_GAUSSIAN = 1,
    /// Each weight within so many standard deviations of its mean as the factor says.
    HAB_PRIOR_BOX = 2,
    /// Each pose weight within the bounds of the file, HAB_SECTION_POSE_LOWER and HAB_SECTION_POSE_UPPER; the factor counts for nothing. There are no bounds of identity weights.
    HAB_PRIOR_BOUNDS = 3,
}

/// Why a fit stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum hab_status {
    /// At a minimum.
    HAB_STATUS_CONVERGED = 0,
    /// At the limit of iterations; the result is the best so far.
    HAB_STATUS_ITERATION_LIMIT = 1,
    /// Where even the smallest step raises the energy: at the limit of rounding.
    HAB_STATUS_STALLED = 2,
}

/// Where a model stands: x -> scale * rotation * x + translation takes a point of the model to the frame of the scan.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct hab_placement {
    /// Factor of lengths, above zero.
    pub scale: f32,
    /// Rotation matrix by rows.
    pub rotation: [f32; 9],
    /// Translation, millimetres.
    pub translation: [f32; 3],
}

/// How to fit; hab_fit_options_init fills it with what suits landmarks of a face.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct hab_fit_options {
    /// sizeof(hab_fit_options), so that later versions can add members.
    pub struct_bytes: u32,
    /// Which motions are sought, see hab_frame; option 1 of HAB_BAD_OPTION.
    pub frame: u32,
    /// 1: the first placement is found from the data; 0: it is the one given, whose scale must be above zero and whose rotation must be one to
    /// 0.001 (option 10); where the frame seeks no scale, its scale stays. Option 2.
    pub place: u32,
    /// Prior of the identity weights, see hab_prior; option 3.
    pub identity_prior: u32,
    /// Prior of the pose weights; option 4.
    pub pose_prior: u32,
    /// Factor of the identity prior, above zero; option 5.
    pub identity_factor: f32,
    /// Factor of the pose prior, above zero; option 6.
    pub pose_factor: f32,
    /// Standard deviation of the measured positions per axis, millimetres, above zero; option 7. A good fit has an rms of about 1.7 times as much.
    pub noise: f32,
    /// Most evaluations after the first.
    pub max_iterations: u32,
    /// Stop when a step would lower the energy by less than this fraction, at least 0; option 8.
    pub relative_decrease: f32,
    /// First damping relative to the diagonal of the normal equations, above zero; option 9.
    pub damping: f32,
}

/// A point of the model and where it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct hab_sample {
    /// Vertices of a triangle, or one vertex and any two others of weight 0.
    pub vertices: [u32; 3],
    /// Weights of the vertices, sum 1 (which is not checked).
    pub barycentric: [f32; 3],
    /// Measured position in the frame of the scan, millimetres.
    pub target: [f32; 3],
    /// Unit normal of the scan at the target: with it only the distance along the normal counts. All zero: no normal.
    pub normal: [f32; 3],
    /// Weight of the squared distance, at least 0; 0 leaves the sample out. A negative weight is HAB_NOT_FINITE.
    pub weight: f32,
}

/// How a fit ended. It has no struct_bytes and never grows.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct hab_fit_report {
    /// Root of the weighted mean squared distance of the samples in space, millimetres. Many times the noise means wrong units, another order of the
    /// landmarks, or a mirrored scan.
    pub rms: f32,
    /// Energy at the result: squared distances over the squared noise, and the priors.
    pub energy: f32,
    /// Energy after placing, before the first step.
    pub start_energy: f32,
    /// Iterations.
    pub iterations: u32,
    /// Why it stopped, see hab_status.
    pub status: u32,
}

/// Fills options with: rigid frame, placement from the data, Gaussian priors with factor 1, noise of 1 mm, at most 50 iterations, relative decrease 1.9e-6,
/// damping 1e-3. options_bytes is sizeof(hab_fit_options) of the program, so that a later library writes no more.
///
/// Returns HAB_OK, HAB_NULL_POINTER, HAB_MISALIGNED, or HAB_BAD_STRUCT for a size that this library does not know.
///
/// # Safety
/// `options` points to `options_bytes` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_fit_options_init(options: *mut hab_fit_options, options_bytes: usize) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.out_object(1, options);
        arguments.compared()?;
        if options_bytes != size_of::<hab_fit_options>() {
            let bytes = u32::try_from(options_bytes).unwrap_or(u32::MAX);
            return Err(Refusal::BadStruct { argument: 1, bytes });
        }
        let limits = Limits::<f32>::default();
        let options = hab_fit_options {
            struct_bytes: size_of::<hab_fit_options>() as u32,
            frame: hab_frame::HAB_FRAME_RIGID as u32,
            place: 1,
            identity_prior: hab_prior::HAB_PRIOR_GAUSSIAN as u32,
            pose_prior: hab_prior::HAB_PRIOR_GAUSSIAN as u32,
            identity_factor: 1.0,
            pose_factor: 1.0,
            noise: 1.0,
            max_iterations: limits.max_iterations,
            relative_decrease: limits.relative_decrease,
            damping: limits.damping,
        };
        // SAFETY: the caller's promise.
        unsafe { out.set(options) };
        Ok(())
    };
    // SAFETY: null is no detail.
    unsafe { call(core::ptr::null_mut(), 0, body) }
}

/// Bytes of workspace that a fit needs to a model whose vertices share no state (hab_counts.needs_evaluation is 0); HAB_FIT_WORKSPACE_BYTES says the same when a program is compiled. 0
/// for an unknown frame. hab_model_fit_workspace_bytes knows every model.
#[unsafe(no_mangle)]
pub extern "C" fn hab_fit_workspace_bytes(identity_dim: u32, pose_dim: u32, frame: u32) -> usize {
    match frame_of(frame) {
        Ok(frame) => fit_points_req(identity_dim as usize, pose_dim as usize, frame).f32_bytes(),
        Err(_) => 0,
    }
}

/// Bytes of workspace that a fit to a model of any kind needs, or through a form of all its blocks when prepared is not null.
///
/// Returns HAB_OK, HAB_BAD_OPTION (3) for an unknown frame, HAB_DIMENSION_MISMATCH when the form is not of the whole model, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP.
///
/// # Safety
/// `model` was opened, `prepared` is null or was made by hab_prepared_init; `workspace_bytes` can be written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_fit_workspace_bytes(
    model: *const hab_model,
    prepared: *const hab_prepared,
    frame: u32,
    workspace_bytes: *mut usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.out_object(4, workspace_bytes);
        // SAFETY: the caller's promise.
        let shape = unsafe { Shape::of(arguments, model, prepared)? };
        let frame = frame_of(frame).map_err(|_| Error::BadOption { option: 3 })?;
        let fit = fit_points_req(shape.identity_dim(), shape.pose_dim(), frame);
        // SAFETY: the caller's promise.
        unsafe { out.set(fit.and(shape.state_req(true)).f32_bytes()) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 5, body) }
}

/// Finds weights and placement from the model's landmarks: a maximum a posteriori estimate for measurements with independent noise.
///
/// prepared is null, or a form of all blocks of the same model: then the fixed mode stays as it is, has no weights here (length 0) and no prior, and an
/// iteration is cheaper. targets holds three numbers for each landmark of the model, in its order. measured says for each landmark whether it was measured (not 0) or is missing (0);
/// null with length 0 says that all were; the target of a missing one is not looked at and may be NaN. identity and pose hold the start and receive the result; so does
/// placement, whose start counts only when options->place is 0. The workspace has hab_model_fit_workspace_bytes. report may be null.
///
/// Start from the mean of the training data (hab_model_weights with deviations of 0); in a model without statistics set both priors to HAB_PRIOR_NONE and start from one of
/// its poses (HAB_SECTION_POSE_STARTS). Never start with both modes at zero: in a bilinear model no derivative leads away from there. In a multilinear model identity times a
/// factor and pose divided by it give the same shape, and only the priors choose between them: compare shapes, not weights.
///
/// Returns HAB_OK, HAB_DIMENSION_MISMATCH, HAB_INDEX_OUT_OF_RANGE, HAB_NOT_FINITE (first: the weight, or the landmark; 0 also when sums overflow), HAB_BAD_OPTION, HAB_EMPTY (also while a wavelet model has not all its vertices), HAB_DEGENERATE (fewer than three landmarks, or on
/// a line), HAB_WORKSPACE_TOO_SMALL, HAB_NON_POSITIVE_PIVOT, HAB_UNSUPPORTED (no landmarks, or no statistics or bounds for a prior), HAB_NEEDS_LEVELS (a Gaussian prior of a wavelet model), HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_BAD_STRUCT, HAB_MISALIGNED, HAB_OVERLAP,
/// HAB_BAD_LENGTH.
///
/// # Safety
/// `model` was opened, `prepared` is null or was made by hab_prepared_init; the others point to as many elements as are said; `report` and `detail` are null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_fit_landmarks(
    model: *const hab_model,
    prepared: *const hab_prepared,
    options: *const hab_fit_options,
    targets: *const f32,
    targets_len: usize,
    measured: *const u8,
    measured_len: usize,
    identity: *mut f32,
    identity_len: usize,
    pose: *mut f32,
    pose_len: usize,
    placement: *mut hab_placement,
    workspace: *mut core::ffi::c_void,
    workspace_bytes: usize,
    report: *mut hab_fit_report,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let options = arguments.object(3, options);
        let targets = arguments.input(4, targets, targets_len);
        let measured = arguments.input(6, measured, measured_len);
        let memory = FitMemory {
            positions: [8, 10],
            identity: arguments.output(8, identity, identity_len),
            pose: arguments.output(10, pose, pose_len),
            placement: arguments.out_object(12, placement),
            workspace: arguments.workspace(13, workspace.cast(), workspace_bytes),
            report: optional(arguments, 15, report),
        };
        // SAFETY: the caller's promise.
        let shape = unsafe { Shape::of(arguments, model, prepared)? };
        // SAFETY: the caller's promise.
        let options = unsafe { checked_options(&options)? };
        // SAFETY: the caller's promise.
        let (targets, measured) = unsafe { (targets.slice(), measured.slice()) };
        let landmarks = Landmarks::new(shape.opened(), targets, measured)?;
        // SAFETY: the caller's promise.
        unsafe { fitted(&shape, &options, &Measurements::Landmarks(landmarks), &memory) }
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 16, body) }
}

/// Finds weights and placement from points whose correspondences are known, on vertices or within triangles, each with a weight and perhaps a normal (point to
/// plane). The other arguments are those of hab_fit_landmarks.
///
/// Returns as hab_fit_landmarks, and HAB_BAD_SAMPLE for a normal that is neither zero nor of unit length.
///
/// # Safety
/// As hab_fit_landmarks.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_fit_points(
    model: *const hab_model,
    prepared: *const hab_prepared,
    options: *const hab_fit_options,
    samples: *const hab_sample,
    samples_len: usize,
    identity: *mut f32,
    identity_len: usize,
    pose: *mut f32,
    pose_len: usize,
    placement: *mut hab_placement,
    workspace: *mut core::ffi::c_void,
    workspace_bytes: usize,
    report: *mut hab_fit_report,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let options = arguments.object(3, options);
        let samples: Input<hab_sample> = arguments.input(4, samples, samples_len);
        let memory = FitMemory {
            positions: [6, 8],
            identity: arguments.output(6, identity, identity_len),
            pose: arguments.output(8, pose, pose_len),
            placement: arguments.out_object(10, placement),
            workspace: arguments.workspace(11, workspace.cast(), workspace_bytes),
            report: optional(arguments, 13, report),
        };
        // SAFETY: the caller's promise.
        let shape = unsafe { Shape::of(arguments, model, prepared)? };
        // SAFETY: the caller's promise.
        let options = unsafe { checked_options(&options)? };
        // SAFETY: the caller's promise.
        unsafe { fitted(&shape, &options, &Measurements::Points(samples.slice()), &memory) }
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 14, body) }
}

/// Where a fit reads its start and writes its result.
struct FitMemory {
    /// Positions of the arguments of identity and pose.
    positions: [u32; 2],
    identity: Output<f32>,
    pose: Output<f32>,
    placement: OutObject<hab_placement>,
    workspace: Output<f32>,
    report: Option<OutObject<hab_fit_report>>,
}

pub(crate) fn optional<T>(arguments: &mut Arguments, argument: u32, pointer: *mut T) -> Option<OutObject<T>> {
    (!pointer.is_null()).then(|| arguments.out_object(argument, pointer))
}

/// The options, once their size and numbers are known.
///
/// # Safety
/// `options` was compared and can be read.
unsafe fn checked_options(options: &Object<hab_fit_options>) -> Result<hab_fit_options, Refusal> {
    let pointer = options.pointer();
    // SAFETY: the caller's promise; the size comes first.
    let struct_bytes = unsafe { (&raw const (*pointer).struct_bytes).read() };
    if struct_bytes as usize != size_of::<hab_fit_options>() {
        return Err(Refusal::BadStruct { argument: 3, bytes: struct_bytes });
    }
    // SAFETY: the caller's promise.
    let options = unsafe { pointer.read() };
    let positive = |value: f32| value > 0.0 && value.is_finite();
    let checks = [
        options.frame <= hab_frame::HAB_FRAME_SIMILARITY as u32,
        options.place <= 1,
        options.identity_prior <= hab_prior::HAB_PRIOR_BOX as u32,
        options.pose_prior <= hab_prior::HAB_PRIOR_BOUNDS as u32,
        positive(options.identity_factor),
        positive(options.pose_factor),
        // What the solver works with.
        positive(options.noise) && positive(1.0 / (options.noise * options.noise)),
        options.relative_decrease >= 0.0 && options.relative_decrease.is_finite(),
        positive(options.damping),
    ];
    match checks.iter().position(|fits| !fits) {
        Some(option) => Err(Refusal::Kernel(Error::BadOption { option: option as u32 + 1 })),
        None => Ok(options),
    }
}

pub(crate) fn frame_of(number: u32) -> Result<Frame, Refusal> {
    match number {
        0 => Ok(Frame::Fixed),
        1 => Ok(Frame::Rigid),
        2 => Ok(Frame::Similarity),
        _ => Err(Refusal::Kernel(Error::BadOption { option: 1 })),
    }
}

/// Runs the fit.
///
/// # Safety
/// The memory can be read and written as far as it says.
unsafe fn fitted(
    shape: &Shape<'_>,
    options: &hab_fit_options,
    samples: &Measurements<'_>,
    memory: &FitMemory,
) -> Result<(), Refusal> {
    let core_options = FitOptions {
        frame: frame_of(options.frame)?,
        place: options.place != 0,
        identity_prior: prior(shape, Mode::Identity, options)?,
        pose_prior: prior(shape, Mode::Pose, options)?,
        noise: options.noise,
        limits: Limits {
            max_iterations: options.max_iterations,
            relative_decrease: options.relative_decrease,
            damping: options.damping,
        },
    };
    // SAFETY: the caller's promise.
    let (identity, pose, workspace) =
        unsafe { (memory.identity.slice(), memory.pose.slice(), memory.workspace.slice()) };
    let mut place = if core_options.place {
        // What is there need not be anything yet.
        Similarity::IDENTITY
    } else {
        // SAFETY: the caller's promise.
        similarity(&unsafe { memory.placement.old() })
    };
    let [identity_argument, pose_argument] = memory.positions;
    length(identity_argument, shape.identity_dim(), identity.len())?;
    length(pose_argument, shape.pose_dim(), pose.len())?;
    if !core_options.place && !is_placement(&place) {
        return Err(Refusal::Kernel(Error::BadOption { option: 10 }));
    }
    let report = kernel::fit_points(shape, samples, &core_options, identity, pose, &mut place, workspace)?;
    // SAFETY: the caller's promise.
    unsafe { memory.placement.set(placement(&place)) };
    if let Some(out) = &memory.report {
        // SAFETY: the caller's promise.
        unsafe { out.set(reported(&report)) };
    }
    Ok(())
}

/// The prior of a mode; none for a mode that is fixed.
fn prior<'a>(shape: &Shape<'a>, mode: Mode, options: &hab_fit_options) -> Result<Prior<'a>, Refusal> {
    let (dim, kind, factor, [mean, precision]) = match mode {
        Mode::Identity => (
            shape.identity_dim(),
            options.identity_prior,
            options.identity_factor,
            [SectionId::IdentityMean, SectionId::IdentityPrecision],
        ),
        Mode::Pose => {
            (shape.pose_dim(), options.pose_prior, options.pose_factor, [SectionId::PoseMean, SectionId::PosePrecision])
        }
    };
    if kind == hab_prior::HAB_PRIOR_NONE as u32 || dim == 0 {
        return Ok(Prior::None);
    }
    if kind == hab_prior::HAB_PRIOR_BOUNDS as u32 {
        let absent = Error::Unsupported { section: SectionId::PoseLower as u32 };
        let (lower, upper) = shape.model().pose_bounds().ok_or(absent)?;
        return Ok(Prior::Bounds(lower, upper));
    }
    let spread = shape.model().spread(mode).ok_or(Error::Unsupported { section: mean as u32 })?;
    if kind == hab_prior::HAB_PRIOR_BOX as u32 {
        return Ok(Prior::Box(spread, factor));
    }
    // Only wavelet models have means without a covariance.
    let gaussian = shape.model().gaussian(mode).ok_or(Refusal::NeedsLevels { section: precision as u32 })?;
    Ok(Prior::Gaussian(gaussian, factor))
}

/// A scale above zero and a rotation: rows of unit length at right angles to 0.001, right-handed.
pub(crate) fn is_placement(placement: &Similarity<f32>) -> bool {
    let [a, b, c] = placement.rotation;
    let dot = |u: [f32; 3], v: [f32; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let third = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let deviations = [dot(a, a) - 1.0, dot(b, b) - 1.0, dot(c, c) - 1.0, dot(a, b), dot(third, c) - 1.0];
    placement.is_finite() && deviations.iter().all(|deviation| (-1e-3..=1e-3).contains(deviation))
}

pub(crate) fn similarity(placement: &hab_placement) -> Similarity<f32> {
    let [a, b, c, d, e, f, g, h, i] = placement.rotation;
    Similarity {
        scale: placement.scale,
        rotation: [[a, b, c], [d, e, f], [g, h, i]],
        translation: placement.translation,
    }
}

pub(crate) fn placement(similarity: &Similarity<f32>) -> hab_placement {
    let [[a, b, c], [d, e, f], [g, h, i]] = similarity.rotation;
    hab_placement {
        scale: similarity.scale,
        rotation: [a, b, c, d, e, f, g, h, i],
        translation: similarity.translation,
    }
}

fn reported(report: &FitReport) -> hab_fit_report {
    let status = match report.status {
        Status::Converged => hab_status::HAB_STATUS_CONVERGED,
        Status::IterationLimit => hab_status::HAB_STATUS_ITERATION_LIMIT,
        Status::Stalled => hab_status::HAB_STATUS_STALLED,
    };
    hab_fit_report {
        rms: report.rms,
        energy: report.energy,
        start_energy: report.start_energy,
        iterations: report.iterations,
        status: status as u32,
    }
}
