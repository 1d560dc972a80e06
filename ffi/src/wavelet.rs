//! What wavelet models have beside others: levels of detail, windows of the surface, and fits level by level.

use habitus_core::Error;
use habitus_core::fit::{WaveletOptions, WaveletReport, fit_wavelet, fit_wavelet_req};
use habitus_core::format::{Kind, Mode, SectionId};
use habitus_core::generator::Generator;
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::wavelet::{Multiscale, Stored};
use habitus_core::quantise::Storage;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::wavelet::Wavelet;

use crate::body::altered;
use crate::code::{Refusal, hab_code, hab_error_detail, length};
use crate::fit::{
    frame_of, hab_frame, hab_placement, hab_sample, is_placement, optional, placement as numbers_of, similarity,
};
use crate::measurements::Measurements;
use crate::memory::{Arguments, Input, call};
use crate::model::{Opened, hab_model, opened};

/// Which wavelet the coefficients of a model belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum hab_wavelet {
    /// Cubic B-splines: smooth surfaces.
    HAB_WAVELET_CUBIC = 0,
    /// Hat functions.
    HAB_WAVELET_BILINEAR = 1,
}

/// The grid of a wavelet model, and which part of it is evaluated. Set struct_bytes to sizeof(hab_grid) before the call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct hab_grid {
    /// sizeof(hab_grid), so that later versions can add members.
    pub struct_bytes: u32,
    /// Nodes of a row of the base.
    pub base_width: u32,
    /// Nodes of a column of the base.
    pub base_height: u32,
    /// Refinements of the base; each doubles the intervals of both axes.
    pub levels: u32,
    /// The transform, see hab_wavelet.
    pub wavelet: u32,
    /// The finest level whose coefficients have weights; finer ones stand at their mean.
    pub detail: u32,
    /// The level of the surface, whose nodes are the vertices.
    pub resolution: u32,
    /// Nodes of a row of the surface without a window.
    pub width: u32,
    /// Nodes of a column of the surface without a window.
    pub height: u32,
    /// Coefficients that have weights.
    pub n_coefficients: u32,
    /// First column of the window.
    pub first_column: u32,
    /// Columns of the window.
    pub n_columns: u32,
    /// First row of the window.
    pub first_row: u32,
    /// Rows of the window. Vertex v is in row first_row + v / n_columns and in column first_column + v % n_columns.
    pub n_rows: u32,
}

/// How to fit level by level; hab_level_options_init fills it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct hab_level_options {
    /// sizeof(hab_level_options), so that later versions can add members.
    pub struct_bytes: u32,
    /// Which placement is sought, see hab_frame: by Procrustes from the samples before every pass and in the end. Option 1 of HAB_BAD_OPTION.
    pub frame: u32,
    /// 1: identity weights are sought; 0: they are held. Option 2.
    pub identity: u32,
    /// The same for pose weights; option 3.
    pub pose: u32,
    /// Half the box of each weight, in standard deviations about its mean; above 0, infinity for no box; option 4. Weights that start outside may stay.
    pub kappa: f32,
    /// Pull of every weight to its mean: omega * deviation^2 is added to the squared distances, mm^2; at least 0; option 5.
    pub omega: f32,
    /// The first level that is fitted.
    pub first_level: u32,
    /// Levels that are fitted, coarse to fine, at least 1; option 6.
    pub n_levels: u32,
    /// Passes over the coefficients of a level, at least 1; option 7.
    pub passes: u32,
}

/// How a fit by levels ended. It has no struct_bytes and never grows.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct hab_level_report {
    /// Root of the weighted mean squared distance of the samples, millimetres.
    pub rms: f32,
    /// The same after the first placement.
    pub start_rms: f32,
    /// Passes over a level.
    pub passes: u32,
    /// Coefficients that a sample reaches, summed over the passes.
    pub reached: u32,
}

/// Calls a function of the wavelet model that a generator is.
macro_rules! wavelet {
    ($any:expr, $of:ident => $call:expr) => {
        match $any {
            AnyGenerator::WaveletF32($of) => Ok($call),
            AnyGenerator::WaveletF16($of) => Ok($call),
            AnyGenerator::WaveletI8($of) => Ok($call),
            other => Err(Error::WrongKind { expected: Kind::Wavelet as u32, found: other.kind() as u32 }),
        }
    };
}

/// The grid and its part.
///
/// Returns HAB_OK, HAB_WRONG_KIND when the model is no wavelet model, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP, or HAB_BAD_STRUCT when grid->struct_bytes is
/// not set.
///
/// # Safety
/// `model` was opened; `grid` can be read and written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_grid(
    model: *const hab_model,
    grid: *mut hab_grid,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.out_object(2, grid);
        // SAFETY: the caller's promise.
        let Opened { generator, .. } = unsafe { opened(arguments, 1, model)? };
        // SAFETY: the caller's promise.
        let struct_bytes = unsafe { (&raw const (*out.pointer()).struct_bytes).read() };
        if struct_bytes as usize != size_of::<hab_grid>() {
            return Err(Refusal::BadStruct { argument: 2, bytes: struct_bytes });
        }
        let grid = wavelet!(generator, of => described(of))?;
        // SAFETY: the caller's promise.
        unsafe { out.set(grid) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 3, body) }
}

#[allow(clippy::cast_possible_truncation)]
fn described<'a, S: Storage<'a>>(of: &Multiscale<Stored<'a, S>>) -> hab_grid {
    let (whole, grid) = (of.whole_grid(), of.grid());
    let resolution = grid.levels();
    let [first_column, first_row] = of.node(0).unwrap_or_default();
    let [last_column, last_row] = of.node(of.vertex_count().saturating_sub(1)).unwrap_or_default();
    let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
    hab_grid {
        struct_bytes: size_of::<hab_grid>() as u32,
        base_width: count(whole.width(0)),
        base_height: count(whole.height(0)),
        levels: count(whole.levels()),
        wavelet: match of.wavelet() {
            Wavelet::Cubic => hab_wavelet::HAB_WAVELET_CUBIC as u32,
            Wavelet::Bilinear => hab_wavelet::HAB_WAVELET_BILINEAR as u32,
        },
        detail: count(of.detail()),
        resolution: count(resolution),
        width: count(grid.width(resolution)),
        height: count(grid.height(resolution)),
        n_coefficients: count(whole.node_count(of.detail())),
        first_column: count(first_column),
        n_columns: count(last_column + 1 - first_column),
        first_row: count(first_row),
        n_rows: count(last_row + 1 - first_row),
    }
}

/// Gives weights to the coefficients up to level detail_level alone, the finer ones standing at their mean, and evaluates the surface at the level resolution, whose nodes become
/// the vertices; from the next hab_evaluation_init, hab_prepared_init or fit on. What was made before stays as it is, copies of the hab_model keep their own levels. The
/// counts of the model change with it; the weights are a prefix of those of more levels. A window is given up. A model that is opened has all levels. No other thread
/// may use the hab_model meanwhile.
///
/// Triangles, landmarks and mirror of the file speak of the whole surface. While the vertices are fewer, their counts are 0, hab_model_read_u32 finds none of their elements, and hab_fit_landmarks returns
/// HAB_EMPTY; with the finest resolution and no window they are there, whatever detail_level is. The vertices are a grid in rows, see hab_grid: vertex v of resolution r lies at the node of the whole surface in column
/// (v % n_columns) << (levels - r) and row (v / n_columns) << (levels - r).
///
/// Returns HAB_OK, HAB_INDEX_OUT_OF_RANGE for a level that the grid has not, HAB_WRONG_KIND when the model is no wavelet model, HAB_NULL_POINTER, HAB_NOT_OPENED,
/// HAB_MISALIGNED, HAB_OVERLAP.
///
/// # Safety
/// `model` was opened and can be written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_set_levels(
    model: *mut hab_model,
    detail_level: u32,
    resolution: u32,
    detail: *mut hab_error_detail,
) -> hab_code {
    let set = |generator: &mut AnyGenerator<'static>| {
        *generator = generator.with_levels(detail_level as usize, resolution as usize)?;
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { altered(model, 4, set, detail) }
}

/// Evaluates a rectangle of nodes of the surface alone, in rows: they become the vertices, with the bits of the whole surface, for memory and time in proportion. Else as
/// hab_model_set_levels.
///
/// Returns HAB_OK, HAB_INDEX_OUT_OF_RANGE, HAB_EMPTY for no columns or no rows, HAB_WRONG_KIND when the model is no wavelet model, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED,
/// HAB_OVERLAP.
///
/// # Safety
/// As hab_model_set_levels.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_model_set_window(
    model: *mut hab_model,
    first_column: u32,
    n_columns: u32,
    first_row: u32,
    n_rows: u32,
    detail: *mut hab_error_detail,
) -> hab_code {
    let range = |first: u32, count: u32| first as usize..(first as usize).saturating_add(count as usize);
    let set = |generator: &mut AnyGenerator<'static>| {
        *generator = generator.with_window(range(first_column, n_columns), range(first_row, n_rows))?;
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { altered(model, 6, set, detail) }
}

/// Fills options with: rigid frame, identity and pose sought, boxes of one standard deviation, no pull, four passes over level 0: the start of a fit to landmarks.
/// options_bytes is sizeof(hab_level_options) of the program, so that a later library writes no more.
///
/// Returns HAB_OK, HAB_NULL_POINTER, HAB_MISALIGNED, or HAB_BAD_STRUCT for a size that this library does not know.
///
/// # Safety
/// `options` points to `options_bytes` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_level_options_init(options: *mut hab_level_options, options_bytes: usize) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.out_object(1, options);
        arguments.compared()?;
        if options_bytes != size_of::<hab_level_options>() {
            let bytes = u32::try_from(options_bytes).unwrap_or(u32::MAX);
            return Err(Refusal::BadStruct { argument: 1, bytes });
        }
        let options = hab_level_options {
            struct_bytes: size_of::<hab_level_options>() as u32,
            frame: hab_frame::HAB_FRAME_RIGID as u32,
            identity: 1,
            pose: 1,
            kappa: 1.0,
            omega: 0.0,
            first_level: 0,
            n_levels: 1,
            passes: 4,
        };
        // SAFETY: the caller's promise.
        unsafe { out.set(options) };
        Ok(())
    };
    // SAFETY: null is no detail.
    unsafe { call(core::ptr::null_mut(), 0, body) }
}

/// Bytes of workspace that hab_fit_levels needs for so many samples and these levels.
///
/// Returns HAB_OK, HAB_WRONG_KIND when the model is no wavelet model, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_MISALIGNED, HAB_OVERLAP.
///
/// # Safety
/// `model` was opened; `workspace_bytes` can be written; `detail` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_fit_levels_workspace_bytes(
    model: *const hab_model,
    samples_len: usize,
    first_level: u32,
    n_levels: u32,
    workspace_bytes: *mut usize,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let out = arguments.out_object(5, workspace_bytes);
        // SAFETY: the caller's promise.
        let generator = &unsafe { opened(arguments, 1, model)? }.generator;
        let levels = levels(first_level, n_levels);
        let needed = wavelet!(generator, of => fit_wavelet_req(of, samples_len, &levels))?;
        // SAFETY: the caller's promise.
        unsafe { out.set(needed.f32_bytes()) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 6, body) }
}

fn levels(first: u32, count: u32) -> core::ops::Range<usize> {
    first as usize..(first as usize).saturating_add(count as usize)
}

/// Finds weights of a wavelet model from points on its vertices, level by level and one coefficient at a time, coarse to fine: thousands of small problems instead of one large
/// one. Weights of other levels, and of coefficients that no sample reaches, stay.
///
/// samples are at vertices of the surface as it is evaluated (hab_model_set_levels, hab_model_set_window), one barycentric weight being 1; those of a model's landmarks are HAB_SECTION_LANDMARKS, vertices of the whole surface. identity and pose hold the start (commonly
/// hab_model_weights with deviations of 0) and receive the result; so does placement, whose start counts only for HAB_FRAME_FIXED. The workspace has
/// hab_fit_levels_workspace_bytes. report may be null.
///
/// Returns HAB_OK, HAB_DIMENSION_MISMATCH, HAB_NOT_FINITE, HAB_INDEX_OUT_OF_RANGE (a level without weights or beyond the surface, or a vertex), HAB_BAD_SAMPLE (no vertex, or a normal that is
/// neither zero nor of unit length), HAB_BAD_OPTION (8: a placement that is none), HAB_EMPTY, HAB_DEGENERATE, HAB_LIMIT_EXCEEDED, HAB_WORKSPACE_TOO_SMALL, HAB_UNSUPPORTED (no statistics of weights that are
/// sought), HAB_WRONG_KIND when the model is no wavelet model, HAB_NULL_POINTER, HAB_NOT_OPENED, HAB_BAD_STRUCT, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH.
///
/// # Safety
/// `model` was opened; the others point to as many elements as are said; `report` and `detail` are null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_fit_levels(
    model: *const hab_model,
    options: *const hab_level_options,
    samples: *const hab_sample,
    samples_len: usize,
    identity: *mut f32,
    identity_len: usize,
    pose: *mut f32,
    pose_len: usize,
    placement: *mut hab_placement,
    workspace: *mut core::ffi::c_void,
    workspace_bytes: usize,
    report: *mut hab_level_report,
    detail: *mut hab_error_detail,
) -> hab_code {
    let body = |arguments: &mut Arguments| {
        let options = arguments.object(2, options);
        let samples: Input<hab_sample> = arguments.input(3, samples, samples_len);
        let (identity, pose) = (arguments.output(5, identity, identity_len), arguments.output(7, pose, pose_len));
        let out_placement = arguments.out_object(9, placement);
        let workspace = arguments.workspace(10, workspace.cast(), workspace_bytes);
        let out_report = optional(arguments, 12, report);
        // SAFETY: the caller's promise.
        let opened = unsafe { opened(arguments, 1, model)? };
        // SAFETY: the caller's promise; the size comes first.
        let struct_bytes = unsafe { (&raw const (*options.pointer()).struct_bytes).read() };
        if struct_bytes as usize != size_of::<hab_level_options>() {
            return Err(Refusal::BadStruct { argument: 2, bytes: struct_bytes });
        }
        // SAFETY: the caller's promise.
        let options = unsafe { options.pointer().read() };
        let options = core_options(opened, &options)?;
        length(5, opened.generator.identity_dim(), identity_len)?;
        length(7, opened.generator.pose_dim(), pose_len)?;
        let mut place = Similarity::IDENTITY;
        if options.frame == habitus_core::fit::Frame::Fixed {
            // SAFETY: the caller's promise.
            place = similarity(&unsafe { out_placement.old() });
            if !is_placement(&place) {
                return Err(Refusal::Kernel(Error::BadOption { option: 8 }));
            }
        }
        // SAFETY: the caller's promise.
        let (identity, pose, workspace) = unsafe { (identity.slice(), pose.slice(), workspace.slice()) };
        // SAFETY: the caller's promise.
        let samples = Measurements::Points(unsafe { samples.slice() });
        let found = wavelet!(&opened.generator, of => fit_wavelet(of, &samples, &options, identity, pose, &mut place, workspace))??;
        // SAFETY: the caller's promise.
        unsafe { out_placement.set(numbers_of(&place)) };
        if let Some(out) = &out_report {
            let WaveletReport { rms, start_rms, passes, reached } = found;
            // SAFETY: the caller's promise.
            unsafe { out.set(hab_level_report { rms, start_rms, passes, reached }) };
        }
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { call(detail, 13, body) }
}

/// The options as the kernel has them; it counts them in another way, so they are checked here.
fn core_options(opened: &Opened, options: &hab_level_options) -> Result<WaveletOptions<'static>, Refusal> {
    let checks = [
        options.frame <= hab_frame::HAB_FRAME_SIMILARITY as u32,
        options.identity <= 1,
        options.pose <= 1,
        options.kappa > 0.0,
        options.omega >= 0.0 && options.omega.is_finite(),
        options.n_levels > 0,
        options.passes > 0,
    ];
    if let Some(option) = checks.iter().position(|fits| !fits) {
        return Err(Refusal::Kernel(Error::BadOption { option: option as u32 + 1 }));
    }
    let spread = |mode: Mode, sought: u32, section: SectionId| {
        if sought == 0 {
            return Ok(None);
        }
        let spread = opened.model.spread(mode).ok_or(Error::Unsupported { section: section as u32 })?;
        Ok::<_, Error>(Some(spread))
    };
    Ok(WaveletOptions {
        frame: frame_of(options.frame)?,
        identity: spread(Mode::Identity, options.identity, SectionId::IdentityMean)?,
        pose: spread(Mode::Pose, options.pose, SectionId::PoseMean)?,
        kappa: options.kappa,
        omega: options.omega,
        levels: levels(options.first_level, options.n_levels),
        passes: options.passes,
    })
}
