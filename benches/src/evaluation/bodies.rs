//! Bodies of 20 and 100 components: skinning alone, both blends, every storage, batches, derivatives.

use std::error::Error;
use std::hint::black_box;

use habitus::evaluate::{
    evaluate_at, evaluate_at_parallel, evaluate_batch_at_parallel, linearise_at, linearise_at_parallel,
};
use habitus::io::model::quantise;
use habitus_core::format::{ElementType, Model};
use habitus_core::generator::skinned::{Blend, Skinned};
use habitus_core::generator::{Generator, Weights, linear::Linear};
use habitus_core::quantise::F32;

use super::inputs::Inputs;
use super::{Bench, Job};
use crate::workload::noise;

/// Bodies of a batch.
const BATCH: usize = 64;

type Body<'a> = Skinned<'a, Linear<'a, F32<'a>>>;

/// Bytes of the skin, and twice, because a store fetches its line first, of the result.
fn skin_bytes(body: &Body<'_>) -> f64 {
    68.0 * body.influences().len() as f64 + 24.0 * body.vertex_count() as f64
}

/// The rows of a body whose identity is fixed.
///
/// # Errors
/// When a program fails or results differ.
pub fn skinning(bench: &mut Bench<'_>, inputs: &Inputs, file: &[u8]) -> Result<(), Box<dyn Error>> {
    let body: Body<'_> = Model::open(file)?.skinned()?;
    let (n, blocks) = (body.vertex_count(), body.block_count());
    let mut memory = vec![0.0; body.with_identity_req(&(0..blocks)).numbers()];
    let fixed = body.with_identity(&vec![0.0; body.identity_dim()], 0..blocks, &mut memory)?;
    let free = Weights { identity: &[], pose: &inputs.pose };
    let bytes = 192.0 * blocks as f64 + skin_bytes(&body);
    let mut out = vec![0.0; 3 * n];
    for (name, blend, plain) in
        [("skinning", Blend::Linear, "skin_blocks"), ("dual quaternions", Blend::DualQuaternion, "skin_dual")]
    {
        let fixed = fixed.with_blend(blend);
        let mut state = vec![0.0; fixed.state_req(false).numbers()];
        let mut job = Job::new(format!("{name}, {n} v"), bytes).plain(plain);
        if blend == Blend::Linear {
            job = job.peer("skin_vertices", "C++, 4 weights a vertex", Some(0.3)).packaged("body_skin_only");
        }
        bench.row(&job, || {
            let at = fixed.begin(free, false, &mut state)?;
            Ok(evaluate_at(&fixed, at, 0..n, black_box(&mut out))?)
        })?;
        if blend == Blend::Linear {
            bench.expect("skin_vertices", &out, 1e-6)?;
        }
        bench.expect(plain, &out, 1e-6)?;
        bench.row(&job.on(2), || {
            let at = fixed.begin(free, false, &mut state)?;
            Ok(evaluate_at_parallel(&fixed, at, 0..n, black_box(&mut out), 2)?)
        })?;
    }
    Ok(())
}

/// The rows of a body with its identity free.
///
/// # Errors
/// When a program fails or results differ.
pub fn whole(bench: &mut Bench<'_>, inputs: &Inputs, file: &[u8]) -> Result<(), Box<dyn Error>> {
    let body: Body<'_> = Model::open(file)?.skinned()?;
    let (n, blocks, dim) = (body.vertex_count(), body.block_count(), body.identity_dim());
    let (skin, columns) = (skin_bytes(&body), body.dim());
    let weights = Weights { identity: &inputs.identity[..dim], pose: &inputs.pose };
    let mut state = vec![0.0; body.state_req(true).numbers()];
    let mut out = vec![0.0; 3 * n];
    let title = |what: &str| format!("body {n} v, {dim} components, {what}");
    let bytes = 192.0 * (blocks * (1 + dim)) as f64 + skin;
    let plain = |what: &str| format!("body{dim}_{what}");
    let eigen = plain("eigen");
    let target = (dim == 20).then_some(0.4);
    let job = Job::new(title("positions"), bytes).plain(plain("blocks")).peer(&eigen, "Eigen + C++", target);
    let job = job.packaged(if dim == 20 { "body_d20" } else { "body_d100" });
    bench.row(&job, || {
        let at = body.begin(weights, false, &mut state)?;
        Ok(evaluate_at(&body, at, 0..n, black_box(&mut out))?)
    })?;
    bench.expect(&eigen, &out, 1e-6)?;
    bench.expect(&plain("blocks"), &out, 1e-6)?;
    bench.row(&job.on(2), || {
        let at = body.begin(weights, false, &mut state)?;
        Ok(evaluate_at_parallel(&body, at, 0..n, black_box(&mut out), 2)?)
    })?;
    for (element, term) in [(ElementType::F16, 96.0), (ElementType::I8, 72.0)] {
        let (stored, _) = quantise(&Model::open(file)?, element)?;
        let stored = Model::open(&stored)?.generator()?;
        let job = Job::new(title(&format!("{element:?}")), (192.0 + term * dim as f64) * blocks as f64 + skin);
        let plain = plain(&format!("{element:?}"));
        let job = job.plain(&plain);
        bench.row(&job, || {
            let at = stored.begin(weights, false, &mut state)?;
            Ok(evaluate_at(&stored, at, 0..n, black_box(&mut out))?)
        })?;
        bench.expect(&plain, &out, 1e-6)?;
        bench.row(&job.on(2), || {
            let at = stored.begin(weights, false, &mut state)?;
            Ok(evaluate_at_parallel(&stored, at, 0..n, black_box(&mut out), 2)?)
        })?;
    }
    let mut states = vec![vec![0.0; body.state_req(false).numbers()]; BATCH];
    let mut batch = vec![0.0; BATCH * 3 * n];
    let job = Job::new(title(&format!("batch of {BATCH}")), bytes + (BATCH - 1) as f64 * 24.0 * n as f64);
    let job = job.plain(plain("batch")).packaged(if dim == 20 { "body_d20_batch64" } else { "body_d100_batch64" });
    for threads in [1, 2] {
        let job = if threads == 1 { job.clone() } else { job.on(threads) };
        bench.row(&job, || {
            let ats: Result<Vec<_>, _> = states.iter_mut().map(|state| body.begin(weights, false, state)).collect();
            Ok(evaluate_batch_at_parallel(&body, &ats?, 0..n, black_box(&mut batch), threads)?)
        })?;
    }
    bench.expect(&plain("batch"), &batch, 1e-6)?;
    let (mut values, mut jacobian) = (vec![0.0; 48 * blocks], vec![0.0; 48 * blocks * columns]);
    let job = Job::new(title("value + Jacobian"), bytes + 384.0 * (blocks * (1 + columns)) as f64);
    let job = job.plain(plain("jacobian"));
    bench.row(&job, || {
        let at = body.begin(weights, true, &mut state)?;
        Ok(linearise_at(&body, at, 0..blocks, black_box(&mut values), &mut jacobian)?)
    })?;
    bench.expect(&plain("jacobian"), &jacobian, 1e-5)?;
    bench.row(&job.on(2), || {
        let at = body.begin(weights, true, &mut state)?;
        Ok(linearise_at_parallel(&body, at, 0..blocks, black_box(&mut values), &mut jacobian, 2)?)
    })?;
    let gradients: Vec<f32> = (0..3 * n).map(noise).collect();
    // State, gradient and workspace.
    let [state, workspace] = [body.state_req(true), body.gradient_req()].map(|needed| needed.numbers());
    let mut memory = [(); 2].map(|()| (vec![0.0; state], vec![0.0; columns], vec![0.0; workspace]));
    let reverse = |(state, gradient, workspace): &mut (Vec<f32>, Vec<f32>, Vec<f32>)| {
        let at = body.begin(weights, true, state)?;
        body.gradient_at(at, &gradients, black_box(gradient), workspace)
    };
    let job = Job::new(title("gradient in reverse"), bytes).plain(plain("gradient"));
    bench.row(&job, || Ok(reverse(&mut memory[0])?))?;
    bench.expect(&plain("gradient"), &memory[0].1, 1e-4)?;
    bench.two(&job, &mut memory, reverse)
}
