//! One function per kernel: reads the inputs of a case, calls the core, compares.

mod files;
mod fit;
mod generator;
mod lbfgsb;
mod linalg;
mod solve;
mod wavelet;

use crate::backend::Backend;
use crate::memory::{Memory, Pieces};
use crate::result::{CaseResult, Problem, Tally};
use crate::text::Case;

/// What a kernel's function is given.
pub(crate) struct Context<'c, 'm, 't, B> {
    pub backend: &'c B,
    pub models: &'c str,
    pub case: Case<'t>,
    pub pieces: Pieces<'m>,
    pub tally: Tally<'t>,
}

/// Runs one case.
pub(crate) fn case_result<'t, B: Backend>(
    file: &'t str,
    case: Case<'t>,
    models: &str,
    backend: &B,
    memory: &mut Memory<'_>,
) -> CaseResult<'t> {
    let mut context = Context { backend, models, case, pieces: memory.pieces(), tally: Tally::new(file, case) };
    let outcome = match case.kernel {
        "evaluate" => generator::evaluate(&mut context),
        "linearised_block" => generator::linearised_block(&mut context),
        "linearised_vertex" => generator::linearised_vertex(&mut context),
        "gradient" => generator::gradient(&mut context),
        "batch" => generator::batch(&mut context),
        "prepared" => generator::prepared(&mut context),
        "normal_equations" => fit::normal_equations(&mut context),
        "prior" => fit::prior(&mut context),
        "fit_points" => fit::fit_points(&mut context),
        "fit_landmarks" => fit::fit_landmarks(&mut context),
        "cholesky_f32" => solve::cholesky::<_, f32>(&mut context),
        "cholesky_f64" => solve::cholesky::<_, f64>(&mut context),
        "eigenpairs_f32" => solve::eigenpairs::<_, f32>(&mut context),
        "eigenpairs_f64" => solve::eigenpairs::<_, f64>(&mut context),
        "procrustes_f32" => solve::procrustes::<_, f32>(&mut context),
        "procrustes_f64" => solve::procrustes::<_, f64>(&mut context),
        "aligned_f32" => solve::aligned::<_, f32>(&mut context),
        "aligned_f64" => solve::aligned::<_, f64>(&mut context),
        "rotation_f32" => solve::rotation::<_, f32>(&mut context),
        "rotation_f64" => solve::rotation::<_, f64>(&mut context),
        "moved_f32" => solve::moved::<_, f32>(&mut context),
        "moved_f64" => solve::moved::<_, f64>(&mut context),
        "minimised_f32" => solve::minimised::<_, f32>(&mut context),
        "minimised_f64" => solve::minimised::<_, f64>(&mut context),
        "qr_f32" => linalg::factors::<_, f32>(&mut context),
        "qr_f64" => linalg::factors::<_, f64>(&mut context),
        "least_squares_f32" => linalg::least_squares::<_, f32>(&mut context),
        "least_squares_f64" => linalg::least_squares::<_, f64>(&mut context),
        "svd3_f32" => linalg::singular_values::<_, f32>(&mut context),
        "svd3_f64" => linalg::singular_values::<_, f64>(&mut context),
        "isometry_triangles_f32" => linalg::triangles::<_, f32>(&mut context),
        "isometry_triangles_f64" => linalg::triangles::<_, f64>(&mut context),
        "isometry_samples_f32" => linalg::samples::<_, f32>(&mut context),
        "isometry_samples_f64" => linalg::samples::<_, f64>(&mut context),
        "lbfgsb_f32" => lbfgsb::minimised::<_, f32>(&mut context),
        "lbfgsb_f64" => lbfgsb::minimised::<_, f64>(&mut context),
        "wavelet_step_f32" => wavelet::step::<f32>(&context.case, &mut context.pieces, &mut context.tally),
        "wavelet_step_f64" => wavelet::step::<f64>(&context.case, &mut context.pieces, &mut context.tally),
        "wavelet_analysis_f32" => wavelet::coefficients::<f32>(&context.case, &mut context.pieces, &mut context.tally),
        "wavelet_analysis_f64" => wavelet::coefficients::<f64>(&context.case, &mut context.pieces, &mut context.tally),
        "wavelet_synthesis_f32" => wavelet::windows::<f32>(&context.case, &mut context.pieces, &mut context.tally),
        "wavelet_synthesis_f64" => wavelet::windows::<f64>(&context.case, &mut context.pieces, &mut context.tally),
        "wavelet_lines_f32" => wavelet::lines::<f32>(&context.case, &mut context.pieces, &mut context.tally),
        "wavelet_lines_f64" => wavelet::lines::<f64>(&context.case, &mut context.pieces, &mut context.tally),
        "fit_wavelet" => wavelet::fit(&context.case, &mut context.pieces, &mut context.tally, models),
        "open" => files::open(&mut context),
        _ => Err(Problem::Kernel),
    };
    context.tally.finished(outcome)
}
