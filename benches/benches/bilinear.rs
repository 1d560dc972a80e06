//! The bilinear kernels at three sizes; the big one (802 MB, 2 GB while it is made) only with `HABITUS_BENCH_BIG=1`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use habitus::evaluate::{evaluate, evaluate_parallel, linearise, linearise_parallel, normal_equations, prepared};
use habitus_benches::workload::{BIG, ModelMemory, SMALL, TOY};
use habitus_core::fit::{Frame, Sample, SurfacePoint, normal_equations_req};
use habitus_core::format::Mode;
use habitus_core::generator::prepared::prepared_req;
use habitus_core::generator::{Generator, NUMBERS, Weights};
use habitus_core::rotation::similarity::Similarity;

fn bilinear(criterion: &mut Criterion) {
    let big = std::env::var_os("HABITUS_BENCH_BIG").is_some_and(|value| value == "1");
    for size in [TOY, SMALL, BIG].into_iter().take(if big { 3 } else { 2 }) {
        let memory = ModelMemory::new(size, 0);
        let model = memory.generator();
        let weights = Weights { identity: &memory.identity, pose: &memory.pose };
        let (n, blocks) = (size.vertices, model.block_count());
        let coefficients = 4 * blocks * (1 + size.identity * size.pose) * NUMBERS;
        let mut out = vec![0.0; 3 * n];
        let mut values = vec![0.0; NUMBERS * blocks];
        let mut jacobian = vec![0.0; NUMBERS * blocks * model.dim()];

        let mut group = criterion.benchmark_group("bilinear");
        group.sample_size(20).throughput(Throughput::Bytes(coefficients as u64));
        group.bench_function(BenchmarkId::new("full, baseline instructions", size.name), |bencher| {
            bencher.iter(|| model.evaluate(weights, 0..n, &mut out));
        });
        group.bench_function(BenchmarkId::new("full", size.name), |bencher| {
            bencher.iter(|| evaluate(&model, weights, 0..n, &mut out));
        });
        group.bench_function(BenchmarkId::new("full, two threads", size.name), |bencher| {
            bencher.iter(|| evaluate_parallel(&model, weights, 0..n, &mut out, 2));
        });
        group.bench_function(BenchmarkId::new("value + Jacobian", size.name), |bencher| {
            bencher.iter(|| linearise(&model, weights, 0..blocks, &mut values, &mut jacobian));
        });
        group.bench_function(BenchmarkId::new("value + Jacobian, two threads", size.name), |bencher| {
            bencher.iter(|| linearise_parallel(&model, weights, 0..blocks, &mut values, &mut jacobian, 2));
        });
        for (name, mode, given) in
            [("identity", Mode::Identity, &memory.identity), ("expression", Mode::Pose, &memory.pose)]
        {
            let mut columns = vec![0.0; prepared_req(&model, mode, &(0..blocks)).numbers()];
            group.bench_function(BenchmarkId::new(format!("fix the {name}"), size.name), |bencher| {
                bencher.iter(|| prepared(&model, mode, given, 0..blocks, &mut columns).map(|form| form.free()));
            });
            let form = prepared(&model, mode, given, 0..blocks, &mut columns).expect("sizes fit");
            let free = match mode {
                Mode::Identity => Weights { identity: &[], pose: &memory.pose },
                Mode::Pose => Weights { identity: &memory.identity, pose: &[] },
            };
            group.bench_function(BenchmarkId::new(format!("{name} fixed"), size.name), |bencher| {
                bencher.iter(|| evaluate(&form, free, 0..n, &mut out));
            });
        }
        let samples: Vec<Sample> = (0..n)
            .map(|vertex| Sample {
                point: SurfacePoint::vertex(vertex as u32),
                target: [0, 1, 2].map(|axis| out[3 * vertex + axis]),
                normal: None,
                weight: 1.0,
            })
            .collect();
        let all = model.dim() + Frame::Rigid.dim();
        let (mut jtj, mut jtr) = (vec![0.0; all * all], vec![0.0; all]);
        let mut workspace = vec![0.0; normal_equations_req(model.dim(), Frame::Rigid).numbers()];
        group.bench_function(BenchmarkId::new("normal equations, every vertex", size.name), |bencher| {
            bencher.iter(|| {
                let placement = &Similarity::IDENTITY;
                let (jtj, jtr) = (&mut jtj, &mut jtr);
                normal_equations(&model, weights, &samples[..], placement, Frame::Rigid, jtj, jtr, &mut workspace)
            });
        });
        group.finish();
    }
}

criterion_group!(benches, bilinear);
criterion_main!(benches);
