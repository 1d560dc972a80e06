//! Reverse mode: the derivative of an energy by the weights from its derivatives by the vertices, `J^T g`, without the Jacobian.

use super::lanes::Axes;
use super::{At, Block, Generator, LANES, NUMBERS};
use crate::Error;
use crate::workspace::{Requirement, Workspace, check_len};

/// Sums of sixteen lanes, one for each weight.
pub(crate) type Lane = [f32; LANES];

/// Scratch of [`by_jacobian`] for `dim` weights.
pub(crate) const fn by_jacobian_req(dim: usize) -> Requirement {
    Requirement::of(dim.saturating_mul(NUMBERS + LANES))
}

/// Block by block through the columns of the Jacobian: what a generator without a shorter way does.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub(crate) fn by_jacobian<G: Generator + ?Sized>(
    generator: &G,
    at: At<'_>,
    vertex_gradients: &[f32],
    gradient: &mut [f32],
    workspace: &mut [f32],
) -> Result<(), Error> {
    let dim = generator.dim();
    checked(generator, at, vertex_gradients, gradient, workspace, by_jacobian_req(dim))?;
    let mut pieces = Workspace::new(workspace);
    let columns = pieces.take(dim.saturating_mul(NUMBERS))?.as_chunks_mut::<NUMBERS>().0;
    let sums = pieces.take(dim.saturating_mul(LANES))?.as_chunks_mut::<LANES>().0;
    sums.fill([0.0; LANES]);
    for (block, numbers) in vertex_gradients.chunks(NUMBERS).enumerate() {
        let of_block = deinterleaved(numbers);
        let _ = generator.linearised_block_unchecked(at, block, columns);
        for (column, sum) in columns.iter().zip(sums.iter_mut()) {
            add_products(sum, &Block::load(column).axes, &of_block);
        }
    }
    for (to, sum) in gradient.iter_mut().zip(sums) {
        *to = total(sum);
    }
    Ok(())
}

/// Refuses wrong lengths before anything is written.
pub(crate) fn checked<G: Generator + ?Sized>(
    generator: &G,
    at: At<'_>,
    vertex_gradients: &[f32],
    gradient: &[f32],
    workspace: &[f32],
    requirement: Requirement,
) -> Result<(), Error> {
    generator.state_req(true).check(at.state.len())?;
    check_len(generator.vertex_count().saturating_mul(3), vertex_gradients.len())?;
    check_len(generator.dim(), gradient.len())?;
    requirement.check(workspace.len())
}

/// The gradients of a block's vertices by axes; zero behind the last.
#[inline(always)]
pub(crate) fn deinterleaved(numbers: &[f32]) -> Axes<LANES> {
    let mut block = Block::ZERO;
    for (lane, vertex) in numbers.as_chunks::<3>().0.iter().enumerate().take(LANES) {
        for (axis, value) in block.axes.iter_mut().zip(vertex) {
            if let Some(to) = axis.get_mut(lane) {
                *to = *value;
            }
        }
    }
    block.axes
}

/// `sum += (x x' + y y') + z z'`, lane by lane.
#[inline(always)]
pub(crate) fn add_products(sum: &mut Lane, [a, b, c]: &Axes<LANES>, [x, y, z]: &Axes<LANES>) {
    let products = a.iter().zip(x).zip(b.iter().zip(y)).zip(c.iter().zip(z));
    for (sum, (((a, x), (b, y)), (c, z))) in sum.iter_mut().zip(products) {
        *sum += a * x + b * y + c * z;
    }
}

/// The lanes, in order, from zero.
#[inline(always)]
pub(crate) fn total(lanes: &Lane) -> f32 {
    lanes.iter().fold(0.0, |sum, lane| sum + lane)
}
