//! A wavelet model with its identity or its pose fixed: its local models are linear in what is left.

use core::ops::Range;

use super::local::{Fixed, Stored, gathered};
use super::{Locals, Multiscale};
use crate::Error;
use crate::format::Mode;
use crate::generator::prepared::check_blocks;
use crate::generator::{Block, Generator, LANES, NUMBERS, Weights};
use crate::quantise::Storage;
use crate::workspace::Requirement;

/// Memory of [`with_fixed`]: a mean and a column per free weight for each block of coefficients that have weights.
pub fn with_fixed_req<'a, S: Storage<'a>>(generator: &Multiscale<Stored<'a, S>>, fixed: Mode) -> Requirement {
    let dim = match fixed {
        Mode::Identity => generator.locals.pose_dim(),
        Mode::Pose => generator.locals.identity_dim(),
    };
    let blocks = generator.n_weighted().div_ceil(LANES);
    Requirement::of(blocks.saturating_mul(dim.saturating_add(1)).saturating_mul(NUMBERS))
}

/// Fixes one mode for the vertices of `blocks`: vertex `v` of the result is vertex `LANES * blocks.start + v` of the model.
///
/// | argument | shape | note |
/// |---|---|---|
/// | `fixed` | | which mode `weights` are |
/// | `weights` | its dimension | checked as in [`Weights::check`] |
/// | `workspace` | [`with_fixed_req`] | borrowed as long as the result lives |
///
/// The blocks are of vertices; the memory is that of the coefficients, whichever vertices are wanted. The result is a generator over the other mode's weights, with
/// the state that [`Generator::begin`] asks for; see [`Fixed`] for its bits.
/// Cost: one pass over the coefficients that have weights.
/// Errors: `DimensionMismatch`, `NotFinite`, `IndexOutOfRange`, `WorkspaceTooSmall`. Panics: never.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub fn with_fixed<'w, 'a: 'w, S: Storage<'a>>(
    generator: &Multiscale<Stored<'a, S>>,
    fixed: Mode,
    weights: &[f32],
    blocks: &Range<usize>,
    workspace: &'w mut [f32],
) -> Result<Multiscale<Fixed<'w, Stored<'a, S>>>, Error> {
    let locals = generator.locals;
    let (fixed_dim, all, dim, free) = match fixed {
        Mode::Identity => (locals.identity_dim(), generator.identity_dim(), locals.pose_dim(), Mode::Pose),
        Mode::Pose => (locals.pose_dim(), generator.pose_dim(), locals.identity_dim(), Mode::Identity),
    };
    check_blocks(generator, blocks)?;
    Weights { identity: weights, pose: &[] }.check(all, 0)?;
    let requirement = with_fixed_req(generator, fixed);
    requirement.check(workspace.len())?;
    let (numbers, _) = workspace.split_at_mut_checked(requirement.numbers()).unwrap_or_default();
    let stride = dim.saturating_add(1).saturating_mul(NUMBERS).max(1);
    for (block, out) in numbers.chunks_exact_mut(stride).enumerate() {
        let Some((mean, columns)) = out.as_chunks_mut().0.split_first_mut() else { break };
        let weight = |index| gathered(weights, fixed_dim, block * LANES, index);
        locals.with_fixed(fixed, block, weight, columns).unwrap_or(Block::ZERO).store(mean);
    }
    let locals = Fixed { free, dim, columns: numbers.as_chunks().0, source: locals };
    Ok(generator.with_locals(locals).with_blocks(blocks))
}
