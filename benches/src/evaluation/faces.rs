//! Bilinear faces: 5996 vertices by 30 x 7 in every storage, and the large model of 26719 vertices by 100 x 25.

use std::error::Error;
use std::hint::black_box;

use habitus::evaluate::{
    evaluate, evaluate_parallel, fit_points, linearise, linearise_parallel, normal_equations, prepared,
};
use habitus_core::fit::{FitOptions, Frame, Sample, SurfacePoint, fit_points_req, normal_equations_req};
use habitus_core::format::{Checksums, ElementType, Mode, Model};
use habitus_core::generator::bilinear::Bilinear;
use habitus_core::generator::prepared::prepared_req;
use habitus_core::generator::{Generator, NUMBERS, Weights};
use habitus_core::prior::Prior;
use habitus_core::quantise::{F16, I8, Storage};
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::Limits;

use super::{Bench, Job};
use crate::workload::{BIG, ModelMemory, SMALL, Size};

/// Bytes of a block of one term in each storage.
const TERM: [(ElementType, f64); 3] = [(ElementType::F32, 192.0), (ElementType::F16, 96.0), (ElementType::I8, 72.0)];

/// Bytes of all coefficients and, twice, because a store fetches its line first, of the result.
fn bytes(size: Size, term: f64) -> f64 {
    let blocks = size.vertices.div_ceil(16) as f64;
    (192.0 + term * (size.identity * size.pose) as f64) * blocks + 24.0 * size.vertices as f64
}

/// The small model.
///
/// # Errors
/// When a program fails or results differ.
pub fn small(bench: &mut Bench<'_>) -> Result<(), Box<dyn Error>> {
    let memory = ModelMemory::new(SMALL, 0);
    let generator = memory.generator();
    let weights = Weights { identity: &memory.identity, pose: &memory.pose };
    let (n, blocks, dim) = (SMALL.vertices, generator.block_count(), generator.dim());
    let title = |what: &str| format!("face {n} v, {} x {}, {what}", SMALL.identity, SMALL.pose);
    let mut out = vec![0.0; 3 * n];
    let job = Job::new(title("full"), bytes(SMALL, 192.0)).plain("face_blocks").within(1.0 / 0.85);
    let job = job.peer("face_eigen", "Eigen gemv", Some(1.0)).packaged("bilinear_small");
    bench.row(&job, || Ok(evaluate(&generator, weights, 0..n, black_box(&mut out))?))?;
    bench.expect("face_eigen", &out, 1e-6)?;
    bench.expect("face_blocks", &out, 1e-6)?;
    bench.row(&job.on(2), || Ok(evaluate_parallel(&generator, weights, 0..n, black_box(&mut out), 2)?))?;
    for (element, term) in &TERM[1..] {
        let stored = memory.stored(*element);
        let job =
            Job::new(title(&format!("full, {element:?}")), bytes(SMALL, *term)).plain(format!("face_{element:?}"));
        match element {
            ElementType::F16 => stored_rows::<F16<'_>>(bench, &job, &stored, weights, n)?,
            _ => stored_rows::<I8<'_>>(bench, &job, &stored, weights, n)?,
        }
    }
    let mut columns = vec![0.0; prepared_req(&generator, Mode::Identity, &(0..blocks)).numbers()];
    let form = prepared(&generator, Mode::Identity, &memory.identity, 0..blocks, &mut columns)?;
    let free = Weights { identity: &[], pose: &memory.pose };
    let moved = (192 * blocks * (1 + SMALL.pose) + 24 * n) as f64;
    let job = Job::new(title("identity fixed"), moved).plain("face_fixed");
    bench.row(&job, || Ok(evaluate(&form, free, 0..n, black_box(&mut out))?))?;
    bench.row(&job.on(2), || Ok(evaluate_parallel(&form, free, 0..n, black_box(&mut out), 2)?))?;

    let (mut values, mut jacobian) = (vec![0.0; NUMBERS * blocks], vec![0.0; NUMBERS * blocks * dim]);
    let moved = (192 * blocks * (1 + SMALL.identity * SMALL.pose + 2 * (1 + dim))) as f64;
    let job = Job::new(title("value + Jacobian"), moved).plain("face_jacobian").within(1.7);
    let job = job.peer("face_fused", "C++ fused loop", Some(0.25)).packaged("bilinear_small_jacobian");
    bench.row(&job, || Ok(linearise(&generator, weights, 0..blocks, black_box(&mut values), &mut jacobian)?))?;
    bench.expect("face_fused", &values, 1e-6)?;
    bench.expect("face_jacobian", &jacobian, 1e-6)?;
    bench.row(&job.on(2), || {
        Ok(linearise_parallel(&generator, weights, 0..blocks, black_box(&mut values), &mut jacobian, 2)?)
    })?;

    let sample = |vertex: usize| {
        let target = [0, 1, 2].map(|axis| out[3 * vertex + axis] + 0.1);
        Sample { point: SurfacePoint::vertex(vertex as u32), target, normal: None, weight: 1.0 }
    };
    let samples: Vec<Sample> = (0..n).map(sample).collect();
    let workspace = normal_equations_req(dim, Frame::Fixed).numbers();
    let mut memory = [(); 2].map(|()| (vec![0.0; dim * dim], vec![0.0; dim], vec![0.0; workspace]));
    let equations = |(jtj, jtr, workspace): &mut (Vec<f32>, Vec<f32>, Vec<f32>)| {
        let at = &Similarity::IDENTITY;
        normal_equations(&generator, weights, &samples[..], at, Frame::Fixed, black_box(jtj), jtr, workspace).map(drop)
    };
    let job = Job::new(title("normal equations of all vertices"), bytes(SMALL, 192.0)).plain("face_equations");
    let job = job.peer("face_normal", "C++ fused loop + Eigen rank update", None);
    bench.row(&job, || Ok(equations(&mut memory[0])?))?;
    bench.expect("face_equations", &[&memory[0].0[..], &memory[0].1].concat(), 1e-4)?;
    bench.two(&job, &mut memory, equations)?;
    fitted(bench, &generator, weights, &mut out)
}

/// All weights from corresponding points, without a prior, from a start far away.
fn fitted(
    bench: &mut Bench<'_>,
    generator: &Bilinear<'_>,
    weights: Weights<'_>,
    out: &mut [f32],
) -> Result<(), Box<dyn Error>> {
    let n = generator.vertex_count();
    evaluate(generator, weights, 0..n, out)?;
    let sample = |vertex: usize| {
        let target = [0, 1, 2].map(|axis| out[3 * vertex + axis]);
        Sample { point: SurfacePoint::vertex(vertex as u32), target, normal: None, weight: 1.0 }
    };
    let samples: Vec<Sample> = (0..n).map(sample).collect();
    let options = FitOptions {
        frame: Frame::Fixed,
        place: false,
        identity_prior: Prior::None,
        pose_prior: Prior::None,
        noise: 1.0,
        limits: Limits::default(),
    };
    let (identity_dim, pose_dim) = (generator.identity_dim(), generator.pose_dim());
    let needed = fit_points_req(identity_dim, pose_dim, options.frame).numbers();
    // Identity, pose, workspace, and the iterations that were made.
    let mut memory = [(); 2].map(|()| (vec![0.0; identity_dim], vec![0.0; pose_dim], vec![0.0; needed], 0));
    let fit = |(identity, pose, memory, iterations): &mut (Vec<f32>, Vec<f32>, Vec<f32>, u32)| {
        identity.fill(0.2);
        pose.fill(0.2);
        let placement = &mut Similarity::IDENTITY.clone();
        let report = fit_points(generator, &samples[..], &options, identity, pose, placement, memory)?;
        *iterations = report.iterations;
        Ok(())
    };
    let name = format!("fit of {n} points, {} unknowns", identity_dim + pose_dim);
    let job = Job::new(name, bytes(SMALL, 192.0)).plain("face_fit_blocks").packaged("bilinear_fit_small").long();
    let job =
        job.peer("face_fit", "C++: Eigen's normal matrix of the products of weights once, least squares in turn", None);
    bench.row(&job, || Ok(fit(&mut memory[0])?))?;
    bench.two(&job, &mut memory, fit)?;
    let (identity, pose, _, iterations) = &memory[0];
    eprintln!("fit: {iterations} iterations");
    evaluate(generator, Weights { identity, pose }, 0..n, out)?;
    bench.expect("face_fit", out, 1e-4)?;
    bench.expect("face_fit_blocks", out, 1e-4)
}

fn stored_rows<'a, S: Storage<'a>>(
    bench: &mut Bench<'_>,
    job: &Job,
    file: &'a [u8],
    weights: Weights<'_>,
    n: usize,
) -> Result<(), Box<dyn Error>>
where
    Bilinear<'a, S>: Sync,
{
    let generator = Model::open_with(file, Checksums::Skip)?.bilinear_in::<S>()?;
    let mut out = vec![0.0; 3 * n];
    bench.row(job, || Ok(evaluate(&generator, weights, 0..n, black_box(&mut out))?))?;
    if let Some(plain) = &job.plain {
        bench.expect(plain, &out, 1e-5)?;
    }
    bench.row(&job.on(2), || Ok(evaluate_parallel(&generator, weights, 0..n, black_box(&mut out), 2)?))
}

/// The large model, one storage after another; the peer is one of that model.
///
/// # Errors
/// When a program fails or results differ.
pub fn large(bench: &mut Bench<'_>) -> Result<(), Box<dyn Error>> {
    let memory = ModelMemory::new(BIG, 0);
    let weights = Weights { identity: &memory.identity, pose: &memory.pose };
    let n = BIG.vertices;
    let title = |what: &str| format!("face {n} v, {} x {}, {what}", BIG.identity, BIG.pose);
    let f32_times = {
        let generator = memory.generator();
        let mut out = vec![0.0; 3 * n];
        let job = Job::new(title("full"), bytes(BIG, 192.0))
            .plain("large_blocks")
            .within(1.0 / 0.85)
            .packaged("bilinear_big")
            .long();
        bench.row(&job, || Ok(evaluate(&generator, weights, 0..n, black_box(&mut out))?))?;
        bench.expect("large_blocks", &out, 1e-6)?;
        bench.row(&job.on(2), || Ok(evaluate_parallel(&generator, weights, 0..n, black_box(&mut out), 2)?))?;
        let blocks = generator.block_count();
        let mut columns = vec![0.0; prepared_req(&generator, Mode::Identity, &(0..blocks)).numbers()];
        let form = prepared(&generator, Mode::Identity, &memory.identity, 0..blocks, &mut columns)?;
        let free = Weights { identity: &[], pose: &memory.pose };
        let moved = (192 * blocks * (1 + BIG.pose) + 24 * n) as f64;
        let job = Job::new(title("identity fixed"), moved).plain("large_fixed");
        bench.row(&job, || Ok(evaluate(&form, free, 0..n, black_box(&mut out))?))?;
        bench.row(&job.on(2), || Ok(evaluate_parallel(&form, free, 0..n, black_box(&mut out), 2)?))?;
        bench.rows[bench.rows.len() - 4].ours
    };
    for (element, term) in &TERM[1..] {
        let stored = memory.stored(*element);
        let job = Job::new(title(&format!("full, {element:?}")), bytes(BIG, *term))
            .plain(format!("large_{element:?}"))
            .long();
        match element {
            ElementType::F16 => stored_rows::<F16<'_>>(bench, &job, &stored, weights, n)?,
            _ => stored_rows::<I8<'_>>(bench, &job, &stored, weights, n)?,
        }
    }
    // Bytes are to be twice as fast as numbers of 32 bits.
    if let [.., bytes, _] = bench.rows.as_mut_slice() {
        (bytes.peer, bytes.peer_name, bytes.targets[0]) = (Some(f32_times), "ours in f32", Some(0.5));
    }
    Ok(())
}
