//! QR, least squares, 3 x 3 singular values and polar factors, measures of isometry, each in `f32` and `f64`.

use habitus_core::isometry::jacobian::{Distortion, green_strain, local};
use habitus_core::isometry::samples::{TangentFit, Unfit, weight};
use habitus_core::isometry::triangle::Metric;
use habitus_core::linalg::least_squares::{least_squares_in_place, least_squares_req};
use habitus_core::linalg::polar::{Nearest, polar};
use habitus_core::linalg::qr;
use habitus_core::linalg::svd3::svd3;

use super::Context;
use crate::backend::Backend;
use crate::memory::{Number, array, integer, number};
use crate::result::Problem;

/// An order of columns; the largest `n` of the vectors is below this.
const MOST_COLUMNS: usize = 8;

fn order_of(n: usize, pivoted: u32, order: &mut [u32; MOST_COLUMNS]) -> Result<&mut [u32], Problem> {
    order.get_mut(..if pivoted > 0 { n } else { 0 }).ok_or(Problem::Memory)
}

pub(super) fn factors<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, pieces, tally, .. } = context;
    let n = integer(case, "n")? as usize;
    let a = pieces.numbers::<R>(case, "matrix")?;
    let b = pieces.numbers::<R>(case, "b")?;
    let tau = pieces.zeros::<R>(n)?;
    let mut order = [0; MOST_COLUMNS];
    let order = order_of(n, integer(case, "pivoted")?, &mut order)?;
    qr::factor_in_place(a, b.len(), n, tau, order)?;
    tally.compare("factors", a)?;
    tally.compare("tau", tau)?;
    tally.compare_integers("order", order)?;
    let again = pieces.numbers::<R>(case, "b")?;
    qr::transpose_applied_in_place(a, tau, b)?;
    tally.compare("transposed", b)?;
    qr::applied_in_place(a, tau, again)?;
    tally.compare("applied", again)
}

pub(super) fn least_squares<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, pieces, tally, .. } = context;
    let n = integer(case, "n")? as usize;
    let a = pieces.numbers::<R>(case, "matrix")?;
    let b = pieces.numbers::<R>(case, "b")?;
    let x = pieces.zeros::<R>(n)?;
    let workspace = pieces.zeros::<R>(least_squares_req(n).numbers())?;
    let mut order = [0; MOST_COLUMNS];
    let order = order_of(n, integer(case, "pivoted")?, &mut order)?;
    let tolerance = number(case, "tolerance")?;
    let found = least_squares_in_place(a, b, x, order, tolerance, workspace)?;
    tally.compare("x", x)?;
    tally.compare_integers("rank", &[found.rank])?;
    tally.compare("residual", &[found.residual])?;
    tally.compare("rotated", b)
}

pub(super) fn singular_values<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, tally, .. } = context;
    let [a, b, c, d, e, f, g, h, i]: [R; 9] = array(case, "matrix")?;
    let matrix = [[a, b, c], [d, e, f], [g, h, i]];
    let found = svd3(&matrix)?;
    tally.compare("u", found.u.as_flattened())?;
    tally.compare("singular", &found.singular)?;
    tally.compare("v", found.v.as_flattened())?;
    let found = polar(&matrix)?;
    tally.compare("rotation", found.rotation.as_flattened())?;
    tally.compare("stretch", found.stretch.as_flattened())?;
    let nearest = match found.nearest {
        Nearest::Rotation => 0,
        Nearest::OfReflection => 1,
        Nearest::Open => 2,
    };
    tally.compare_integers("nearest", &[nearest])
}

pub(super) fn triangles<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, tally, .. } = context;
    let [a, b, c, d, e, f, g, h, i]: [R; 9] = array(case, "corners")?;
    let [u, v, between]: [R; 3] = array(case, "lengths")?;
    let from = Metric::of_corners([[a, b, c], [d, e, f], [g, h, i]]);
    let to = Metric::of_lengths(u, v, between);
    let jacobian = from.jacobian_to(&to)?;
    let numbers = |metric: Metric<R>| [metric.uu, metric.uv, metric.vv, metric.double_area];
    tally.compare("metrics", [numbers(from), numbers(to)].as_flattened())?;
    tally.compare("jacobian", jacobian.as_flattened())?;
    tally.compare("strain", &green_strain(&jacobian))?;
    tally.compare("local", &[local(&jacobian)])?;
    let found = Distortion::of(&jacobian);
    tally.compare("singular", &[found.longest, found.shortest])?;
    tally.compare("factors", &[found.stretch(), found.area(), found.angle()])
}

pub(super) fn samples<B: Backend, R: Number>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { case, pieces, tally, .. } = context;
    let samples: &[[R; 4]] = pieces.numbers(case, "samples")?.as_chunks().0;
    let weights = pieces.zeros::<R>(samples.len())?;
    let spacing = number(case, "spacing")?;
    let mut fit = TangentFit::new();
    for (&[b_x, b_y, a_x, a_y], to) in samples.iter().zip(weights.iter_mut()) {
        *to = weight([b_x, b_y], spacing);
        fit.add([b_x, b_y], [a_x, a_y], *to);
    }
    let found = fit.jacobian();
    tally.compare("weights", weights)?;
    match found {
        Ok(jacobian) => {
            tally.compare_integers("fit", &[2])?;
            tally.compare("jacobian", jacobian.as_flattened())
        }
        Err(Unfit::TooFew) => tally.compare_integers("fit", &[0]),
        Err(Unfit::IllConditioned) => tally.compare_integers("fit", &[1]),
    }
}
