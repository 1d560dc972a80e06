//! Evaluation by ranges, derivatives, prepared forms.

use habitus_core::format::Mode;
use habitus_core::generator::{Generator, NUMBERS, Weights};

use super::Context;
use crate::backend::Backend;
use crate::memory::integer;
use crate::result::Problem;

pub(super) fn evaluate<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { backend, models, case, pieces, tally } = context;
    let (_, model) = super::wavelet::generator(pieces, case, models)?;
    let weights = Weights { identity: pieces.numbers(case, "identity")?, pose: pieces.numbers(case, "pose")? };
    let state = pieces.zeros(model.state_req(false).numbers())?;
    let at = model.begin(weights, false, state)?;
    for range in pieces.integers(case, "ranges")?.as_chunks::<2>().0 {
        let [from, to] = range.map(|bound| bound as usize);
        // A wrong range is refused before the output is looked at.
        let out = pieces.zeros(3 * to.saturating_sub(from).min(model.vertex_count()))?;
        backend.evaluate(&model, at, from..to, out)?;
        // "out" is the whole shape: every range has to give the bits of its part.
        tally.compare_part("out", 3 * from, out)?;
    }
    Ok(())
}

pub(super) fn linearised_block<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { backend, models, case, pieces, tally } = context;
    let (_, model) = super::wavelet::generator(pieces, case, models)?;
    let weights = Weights { identity: pieces.numbers(case, "identity")?, pose: pieces.numbers(case, "pose")? };
    let state = pieces.zeros(model.state_req(true).numbers())?;
    let at = model.begin(weights, true, state)?;
    let jacobian = pieces.zeros(model.dim() * NUMBERS)?.as_chunks_mut().0;
    let block = integer(case, "block")? as usize;
    let values = backend.linearised_block(&model, at, block, jacobian).ok_or(Problem::Text("block"))?;
    tally.compare("values", values.axes.as_flattened())?;
    tally.compare("jacobian", jacobian.as_flattened())
}

pub(super) fn linearised_vertex<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { models, case, pieces, tally, .. } = context;
    let (_, model) = super::wavelet::generator(pieces, case, models)?;
    let weights = Weights { identity: pieces.numbers(case, "identity")?, pose: pieces.numbers(case, "pose")? };
    let state = pieces.zeros(model.state_req(true).numbers())?;
    let at = model.begin(weights, true, state)?;
    let jacobian = pieces.zeros(model.dim() * 3)?.as_chunks_mut().0;
    let vertex = integer(case, "vertex")? as usize;
    let value = model.linearised_vertex_unchecked(at, vertex, jacobian).ok_or(Problem::Text("vertex"))?;
    tally.compare("value", &value)?;
    tally.compare("jacobian", jacobian.as_flattened())
}

pub(super) fn gradient<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { models, case, pieces, tally, .. } = context;
    let (_, model) = super::wavelet::generator(pieces, case, models)?;
    let weights = Weights { identity: pieces.numbers(case, "identity")?, pose: pieces.numbers(case, "pose")? };
    let state = pieces.zeros(model.state_req(true).numbers())?;
    let at = model.begin(weights, true, state)?;
    let by_vertex: &[f32] = pieces.numbers(case, "vertex_gradients")?;
    let (gradient, workspace) = (pieces.zeros(model.dim())?, pieces.zeros(model.gradient_req().numbers())?);
    model.gradient_at(at, by_vertex, gradient, workspace)?;
    tally.compare("gradient", gradient)
}

pub(super) fn batch<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { backend, models, case, pieces, tally } = context;
    let (_, model) = super::wavelet::generator(pieces, case, models)?;
    let (identity, pose): (&[f32], &[f32]) = (pieces.numbers(case, "identity")?, pieces.numbers(case, "pose")?);
    let (mut identity, mut pose) = (identity.chunks(model.identity_dim().max(1)), pose.chunks(model.pose_dim().max(1)));
    let mut begun = || {
        let weights = Weights { identity: identity.next().unwrap_or_default(), pose: pose.next().unwrap_or_default() };
        Ok::<_, Problem>(model.begin(weights, false, pieces.zeros(model.state_req(false).numbers())?)?)
    };
    let ats = [begun()?, begun()?, begun()?];
    let (from, to) = (integer(case, "from")? as usize, integer(case, "to")? as usize);
    let out = pieces.zeros(ats.len() * 3 * to.saturating_sub(from))?;
    backend.evaluate_batch(&model, &ats, from..to, out)?;
    tally.compare("out", out)
}

pub(super) fn prepared<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { backend, models, case, pieces, tally } = context;
    let (_, model) = super::wavelet::generator(pieces, case, models)?;
    let (identity, pose) = (pieces.numbers(case, "identity")?, pieces.numbers(case, "pose")?);
    let (fixed, fixed_weights, weights) = match case.word("fixed") {
        Some("identity") => (Mode::Identity, &*identity, Weights { identity: &[], pose }),
        Some("pose") => (Mode::Pose, &*pose, Weights { identity, pose: &[] }),
        _ => return Err(Problem::Text("fixed")),
    };
    let (from, to) = (integer(case, "from")? as usize, integer(case, "to")? as usize);
    let memory = pieces.zeros(model.prepared_req(fixed, &(from..to))?.numbers())?;
    let form = backend.prepared(&model, fixed, fixed_weights, from..to, memory)?;
    let state = pieces.zeros(form.state_req(true).numbers())?;
    let at = form.begin(weights, true, state)?;
    let out = pieces.zeros(3 * form.vertex_count())?;
    backend.evaluate(&form, at, 0..form.vertex_count(), out)?;
    tally.compare("out", out)?;
    for block in 0..form.block_count() {
        let jacobian = pieces.zeros(form.dim() * NUMBERS)?;
        let values = backend.linearised_block(&form, at, block, jacobian.as_chunks_mut().0);
        tally.compare_part("values", block * NUMBERS, values.ok_or(Problem::Text("to"))?.axes.as_flattened())?;
        tally.compare_part("jacobian", block * form.dim() * NUMBERS, jacobian)?;
    }
    Ok(())
}
