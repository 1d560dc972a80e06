//! The rows of bodies, wavelets and alignment: ours, the limit, a plain loop over our layout and the peers' way, in rounds that alternate, on one thread and on two.
//!
//! `cargo run --release -p habitus-benches --bin evaluation -- [--json] [--rounds N] [--big]`
//!
//! The body is the developer's (`habitus_tests::models::body`): it wants the shared data. The peers are compiled when the measurement runs and want Eigen
//! (`libeigen3-dev`). `--big` adds the bilinear model of 802 MB in its three storages.

use std::error::Error;
use std::hint::black_box;
use std::io::Write;
use std::process::Command;
use std::time::Instant;

use habitus::evaluate::{evaluate, evaluate_at, evaluate_at_parallel, evaluate_batch_at, linearise_at};
use habitus::io::model::quantise;
use habitus_benches::peer::{FLAGS, Peer, Program};
use habitus_benches::samples::{Times, load};
use habitus_benches::workload::{BIG, ModelMemory, noise};
use habitus_core::format::{Checksums, ElementType, Model};
use habitus_core::generator::skinned::{Blend, Skinned};
use habitus_core::generator::{Generator, Weights, linear::Linear};
use habitus_core::quantise::{F32, I8};
use habitus_core::wavelet::{Grid, Wavelet, transform};
use habitus_tests::data::dir_or_skip;
use habitus_tests::models::body::{self, Pca, Rig};
use serde_json::json;

/// Calls at the start of a round that do not count.
const WARM_UP: usize = 4;
const SAMPLES: usize = 40;
/// Bodies of a batch.
const BATCH: usize = 64;

/// One line of the table, milliseconds.
struct Row {
    name: String,
    ours: Times,
    /// Bytes that must move once over the bandwidth of a working set of that size.
    limit: Option<Times>,
    blocks: Option<Times>,
    peer: Option<Times>,
    peer_name: &'static str,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    let at = arguments.iter().position(|argument| argument == "--rounds");
    let rounds = at.and_then(|at| arguments.get(at + 1)).map_or(Ok(10), |text| text.parse())?;
    let Some(data) = dir_or_skip("the rows of evaluation") else { return Ok(()) };
    let program = Program::compiled("peers.cpp", include_str!("../evaluation/peers.cpp"), &["-I/usr/include/eigen3"])
        .map_err(|error| format!("{error}; on Debian: apt-get install libeigen3-dev"))?;
    let (rig, pca) = (Rig::read(&data)?, body::pca(&data, 100)?);
    let files = [20, 100].map(|dim| body::file(&data, dim));
    let [twenty, hundred] = files;
    let (twenty, hundred) = (twenty?, hundred?);
    let inputs = Inputs::new(&rig, &pca, &hundred)?;
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("inputs");
    std::fs::write(&path, inputs.bytes())?;
    let mut command = Command::new(program.path());
    command.arg(&path);
    let mut peer = Peer::started(command)?;
    let mut bench = Bench { rounds, peer: &mut peer, rows: Vec::new() };
    bodies(&mut bench, &inputs, [(20, &twenty), (100, &hundred)])?;
    wavelets(&mut bench, &inputs)?;
    rigid(&mut bench, &inputs)?;
    if has("--big") {
        big(&mut bench)?;
    }
    let rows = bench.rows;
    if has("--json") {
        print_json(&rows, &program)
    } else {
        print_table(&rows, &program, &peer.programs)
    }
    Ok(())
}

/// Deterministic inputs of both sides.
struct Inputs {
    floats: Vec<Vec<f32>>,
    integers: Vec<Vec<i32>>,
    identity: Vec<f32>,
    pose: Vec<f32>,
    wavelets: [Vec<f32>; 2],
    points: Vec<f32>,
}

impl Inputs {
    fn new(rig: &Rig, pca: &Pca, file: &[u8]) -> Result<Self, Box<dyn Error>> {
        let (len, joints) = (pca.mean.len(), rig.parents.len());
        let single = |values: &[f64]| values.iter().map(|&value| value as f32).collect::<Vec<f32>>();
        let transposed = |columns: &[Vec<f64>], len: usize| -> Vec<f32> {
            (0..len).flat_map(|row| columns.iter().map(move |column| column[row] as f32)).collect()
        };
        let components: Vec<Vec<f64>> = pca.components.chunks(len).map(<[f64]>::to_vec).collect();
        let slopes: Vec<Vec<f64>> =
            components.iter().map(|component| rig.joints(component).into_iter().flatten().collect()).collect();
        let place: Vec<f64> = rig.joints(&pca.mean).into_iter().flatten().collect();
        let (mut held, mut weight) = (Vec::new(), Vec::new());
        for vertex in &rig.weights {
            let sum: f64 = vertex.iter().map(|(_, value)| value).sum();
            for k in 0..4 {
                let (bone, value) = vertex.get(k).copied().unwrap_or((0, 0.0));
                held.push(bone as i32);
                weight.push((value / sum) as f32);
            }
        }
        let identity: Vec<f32> = (0..100).map(|k| noise(3_000_000 + k)).collect();
        let pose: Vec<f32> = (0..3 * joints).map(|k| 0.3 * noise(4_000_000 + k)).collect();
        let model = Model::open(file)?;
        let section = |id: u32| model.sections().find(id).map(|section| section.bytes.to_vec()).unwrap_or_default();
        let words = |bytes: Vec<u8>| bytes.as_chunks::<4>().0.iter().map(|raw| i32::from_le_bytes(*raw)).collect();
        let block_weights = section(28).as_chunks::<4>().0.iter().map(|raw| f32::from_le_bytes(*raw)).collect();
        let parents = rig.parents.iter().map(|parent| parent.map_or(-1, |parent| parent as i32)).collect();
        let floats = vec![
            single(&pca.mean),
            transposed(&components, len),
            single(&place),
            transposed(&slopes, 3 * joints),
            weight,
            identity.clone(),
            pose.clone(),
            block_weights,
        ];
        let wavelets = [5usize, 6].map(|levels| {
            let count = ((4 << levels) + 1) * ((6 << levels) + 1);
            (0..3 * count).map(|k| noise(5_000_000 + k)).collect()
        });
        let points = (0..3 * 26719).map(|k| 100.0 * noise(6_000_000 + k)).collect();
        Ok(Inputs {
            floats,
            integers: vec![parents, held, words(section(26)), words(section(27))],
            identity,
            pose,
            wavelets,
            points,
        })
    }

    /// As the peers read them; wavelets as (height, width, 3).
    fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let mut put = |count: usize, bytes: Vec<u8>| {
            let _ = out.write_all(&(count as u64).to_le_bytes());
            let _ = out.write_all(&bytes);
        };
        for floats in &self.floats {
            put(floats.len(), floats.iter().flat_map(|value| value.to_le_bytes()).collect());
        }
        for integers in &self.integers {
            put(integers.len(), integers.iter().flat_map(|value| value.to_le_bytes()).collect());
        }
        for (levels, planes) in [5, 6].into_iter().zip(&self.wavelets) {
            let in_place = self.interleaved(levels, planes);
            put(in_place.len(), in_place.iter().flat_map(|value| value.to_le_bytes()).collect());
        }
        put(self.points.len(), self.points.iter().flat_map(|value| value.to_le_bytes()).collect());
        out
    }

    /// Coefficients level by level in planes, brought to their nodes.
    fn interleaved(&self, levels: usize, planes: &[f32]) -> Vec<f32> {
        let grid = Grid::new(5, 7, levels).expect("a grid");
        let count = grid.len();
        let mut out = vec![0.0; 3 * count];
        for coefficient in 0..count {
            let node = grid.node_of(coefficient).expect("a node");
            let at = node.row * ((4 << levels) + 1) + node.column;
            (0..3).for_each(|axis| out[3 * at + axis] = planes[axis * count + coefficient]);
        }
        out
    }
}

struct Bench<'p> {
    rounds: usize,
    peer: &'p mut Peer,
    rows: Vec<Row>,
}

impl Bench<'_> {
    /// A row whose programs take turns; `bytes` must move once; `jobs` are the loop over our layout and the peer.
    fn row(
        &mut self,
        name: String,
        bytes: f64,
        jobs: [Option<&str>; 2],
        peer_name: &'static str,
        mut ours: impl FnMut() -> Result<(), Box<dyn Error>>,
    ) -> Result<(), Box<dyn Error>> {
        let (mut own, mut read) = (vec![], vec![]);
        let mut others = [vec![], vec![]];
        let kilobytes = (bytes / 1024.0).ceil().max(64.0) as usize;
        let mut read_bytes = 1.0;
        for _ in 0..self.rounds {
            for sample in 0..SAMPLES + WARM_UP {
                let start = Instant::now();
                ours()?;
                let seconds = start.elapsed().as_secs_f64();
                if sample >= WARM_UP {
                    own.push(seconds);
                }
            }
            for (job, seconds) in jobs.iter().zip(&mut others) {
                if let Some(job) = job {
                    seconds.extend(&self.peer.run(job, 1, SAMPLES + WARM_UP)?.seconds[WARM_UP..]);
                }
            }
            let answer = self.peer.run(&format!("read_{kilobytes}"), 1, SAMPLES + WARM_UP)?;
            read_bytes = answer.bytes;
            read.extend(&answer.seconds[WARM_UP..]);
        }
        let [blocks, peer] = others.map(|seconds| (!seconds.is_empty()).then(|| Times::of(seconds)));
        let limit = Some(Times::of(read).scaled(bytes / read_bytes));
        self.rows.push(Row { name, ours: Times::of(own), limit, blocks, peer, peer_name });
        Ok(())
    }

    /// The sum of a peer's result, which ours has to have too.
    fn expect(&mut self, job: &str, result: &[f32], tolerance: f64) -> Result<(), Box<dyn Error>> {
        let theirs = self.peer.run(job, 1, 1)?.sum;
        let (sum, size) = result.iter().fold((0.0, 0.0), |(s, m), &v| (s + f64::from(v), m + f64::from(v.abs())));
        if (sum - theirs).abs() <= tolerance * size {
            return Ok(());
        }
        Err(format!("{job}: ours sums to {sum}, C++ to {theirs}").into())
    }
}

type BodyModel<'a> = Skinned<'a, Linear<'a, F32<'a>>>;

fn bodies(bench: &mut Bench<'_>, inputs: &Inputs, files: [(usize, &Vec<u8>); 2]) -> Result<(), Box<dyn Error>> {
    for (dim, file) in files {
        let body: BodyModel<'_> = Model::open(file)?.skinned()?;
        let (n, blocks) = (body.vertex_count(), body.block_count());
        let skin = 4.0 * 17.0 * body.influences().len() as f64 + 2.0 * 12.0 * n as f64;
        let identity = &inputs.identity[..dim];
        let weights = Weights { identity, pose: &inputs.pose };
        let mut state = vec![0.0; body.state_req(true).numbers()];
        let mut out = vec![0.0; 3 * n];
        if dim == 20 {
            let mut memory = vec![0.0; body.with_identity_req(&(0..blocks)).numbers()];
            let fixed = body.with_identity(&vec![0.0; dim], 0..blocks, &mut memory)?;
            let free = Weights { identity: &[], pose: &inputs.pose };
            let bytes = 192.0 * blocks as f64 + skin;
            for (name, blend) in [("skinning", Blend::Linear), ("dual quaternions", Blend::DualQuaternion)] {
                let fixed = fixed.with_blend(blend);
                let linear = blend == Blend::Linear;
                let mut state = vec![0.0; fixed.state_req(true).numbers()];
                let jobs = [linear.then_some("skin_blocks"), linear.then_some("skin_vertices")];
                bench.row(format!("{name}, {n} v"), bytes, jobs, "C++, 4 weights a vertex", || {
                    let at = fixed.begin(free, false, &mut state)?;
                    Ok(evaluate_at(&fixed, at, 0..n, black_box(&mut out))?)
                })?;
                if linear {
                    bench.expect("skin_vertices", &out, 1e-6)?;
                    bench.expect("skin_blocks", &out, 1e-6)?;
                }
            }
        }
        let bytes = 192.0 * (blocks * (1 + dim)) as f64 + skin;
        let (plain, eigen) = (format!("body{dim}_blocks"), format!("body{dim}_eigen"));
        bench.row(format!("body, {dim} components"), bytes, [Some(&plain), Some(&eigen)], "Eigen + C++", || {
            let at = body.begin(weights, false, &mut state)?;
            Ok(evaluate_at(&body, at, 0..n, black_box(&mut out))?)
        })?;
        bench.expect(&eigen, &out, 1e-6)?;
        bench.row(format!("body, {dim} components, two threads"), bytes, [None, None], "", || {
            let at = body.begin(weights, false, &mut state)?;
            Ok(evaluate_at_parallel(&body, at, 0..n, black_box(&mut out), 2)?)
        })?;
        for element in [ElementType::F16, ElementType::I8] {
            let (stored, _) = quantise(&Model::open(file)?, element)?;
            let stored_body = Model::open(&stored)?.generator()?;
            let term = if element == ElementType::I8 { 72.0 } else { 96.0 };
            let bytes = (192.0 + term * dim as f64) * blocks as f64 + skin;
            bench.row(format!("body, {dim} components, {element:?}"), bytes, [None, None], "", || {
                let at = stored_body.begin(weights, false, &mut state)?;
                Ok(evaluate_at(&stored_body, at, 0..n, black_box(&mut out))?)
            })?;
        }
        let mut states = vec![vec![0.0; body.state_req(false).numbers()]; BATCH];
        let mut batch = vec![0.0; BATCH * 3 * n];
        let bytes = 192.0 * (blocks * (1 + dim)) as f64 + BATCH as f64 * skin;
        bench.row(format!("body, {dim} components, batch of {BATCH}"), bytes, [None, None], "", || {
            let ats: Result<Vec<_>, _> = states.iter_mut().map(|state| body.begin(weights, false, state)).collect();
            Ok(evaluate_batch_at(&body, &ats?, 0..n, black_box(&mut batch))?)
        })?;
        let columns = body.dim();
        let (mut values, mut jacobian) = (vec![0.0; 48 * blocks], vec![0.0; 48 * blocks * columns]);
        let bytes = 192.0 * (blocks * (1 + dim)) as f64 + skin + 2.0 * 192.0 * (blocks * (1 + columns)) as f64;
        bench.row(format!("body, {dim} components, value + Jacobian"), bytes, [None, None], "", || {
            let at = body.begin(weights, true, &mut state)?;
            Ok(linearise_at(&body, at, 0..blocks, black_box(&mut values), &mut jacobian)?)
        })?;
        let gradients: Vec<f32> = (0..3 * n).map(noise).collect();
        let mut gradient = vec![0.0; columns];
        let mut workspace = vec![0.0; body.gradient_req().numbers()];
        let bytes = 192.0 * (blocks * (1 + dim)) as f64 + skin;
        bench.row(format!("body, {dim} components, gradient in reverse"), bytes, [None, None], "", || {
            let at = body.begin(weights, true, &mut state)?;
            Ok(body.gradient_at(at, &gradients, black_box(&mut gradient), &mut workspace)?)
        })?;
    }
    Ok(())
}

fn wavelets(bench: &mut Bench<'_>, inputs: &Inputs) -> Result<(), Box<dyn Error>> {
    for (levels, coefficients) in [5, 6].into_iter().zip(&inputs.wavelets) {
        let grid = Grid::new(5, 7, levels)?;
        let mut workspace = vec![0.0; transform::synthesis_req(&grid, levels).numbers()];
        let mut out = vec![0.0; 3 * grid.len()];
        let job = format!("wavelet{levels}");
        let name = format!("wavelet synthesis, {} x {} x 3", grid.width(levels), grid.height(levels));
        bench.row(name, 3.0 * 12.0 * grid.len() as f64, [None, Some(&job)], "C++ lifting in place", || {
            let out = black_box(&mut out);
            Ok(habitus::evaluate::wavelet_synthesis(&grid, Wavelet::Cubic, levels, coefficients, out, &mut workspace)?)
        })?;
        bench.expect(&job, &out, 1e-5)?;
    }
    Ok(())
}

fn rigid(bench: &mut Bench<'_>, inputs: &Inputs) -> Result<(), Box<dyn Error>> {
    let points = inputs.points.as_chunks::<3>().0;
    let turned: Vec<[f32; 3]> = points.iter().map(|[x, y, z]| [1.1 * y + 1.0, -1.1 * x + 2.0, 1.1 * z + 3.0]).collect();
    let bytes = 24.0 * points.len() as f64;
    bench.row(format!("rigid alignment, {} points", points.len()), bytes, [None, Some("rigid")], "Eigen", || {
        let moments = habitus::evaluate::moments(black_box(points), &turned)?;
        black_box(moments.similarity(true)?);
        Ok(())
    })
}

/// The large bilinear model as f32 and as i8.
fn big(bench: &mut Bench<'_>) -> Result<(), Box<dyn Error>> {
    let memory = ModelMemory::new(BIG, 0);
    let weights = Weights { identity: &memory.identity, pose: &memory.pose };
    let mut out = vec![0.0; 3 * BIG.vertices];
    let terms = (BIG.identity * BIG.pose * BIG.vertices.div_ceil(16)) as f64;
    let rounds = std::mem::replace(&mut bench.rounds, 1);
    {
        let generator = memory.generator();
        bench.row("big bilinear, f32".into(), 192.0 * terms, [None, None], "", || {
            Ok(evaluate(&generator, weights, 0..BIG.vertices, black_box(&mut out))?)
        })?;
    }
    let stored = memory.stored(ElementType::I8);
    let model = Model::open_with(&stored, Checksums::Skip)?.bilinear_in::<I8<'_>>()?;
    bench.row("big bilinear, i8".into(), 72.0 * terms, [None, None], "", || {
        Ok(evaluate(&model, weights, 0..BIG.vertices, black_box(&mut out))?)
    })?;
    bench.rounds = rounds;
    Ok(())
}

fn print_table(rows: &[Row], program: &Program, peers: &str) {
    println!("C++: {} {};{peers}; load {}\n", program.compiler, FLAGS.join(" "), load());
    println!(
        "| job | ours, ms: best / median | limit, ms | limit / ours | plain loop over our layout, ms | peer, ms | ours / peer |"
    );
    println!("|---|---|---|---|---|---|---|");
    let pair = |times: Option<Times>| times.map_or("-".into(), |t| format!("{:.4} / {:.4}", t.best, t.median));
    for row in rows {
        let ratio = |peer: Times| format!("{:.2} / {:.2}", row.ours.best / peer.best, row.ours.median / peer.median);
        println!(
            "| {} | {} | {} | {} | {} | {} {} | {} |",
            row.name,
            pair(Some(row.ours)),
            pair(row.limit),
            row.limit.map_or("-".into(), |l| format!(
                "{:.0} % / {:.0} %",
                100.0 * l.best / row.ours.best,
                100.0 * l.median / row.ours.median
            )),
            pair(row.blocks),
            row.peer_name,
            pair(row.peer),
            row.peer.map_or("-".into(), ratio),
        );
    }
}

fn print_json(rows: &[Row], program: &Program) {
    let times = |times: Option<Times>| times.map(|times| json!({ "best_ms": times.best, "median_ms": times.median }));
    let rows: Vec<_> = rows
        .iter()
        .map(|row| {
            json!({
                "job": row.name,
                "ours": times(Some(row.ours)),
                "limit": times(row.limit),
                "plain_cpp_own_layout": times(row.blocks),
                "peer": times(row.peer),
                "peer_name": row.peer_name,
            })
        })
        .collect();
    println!("{:#}", json!({ "compiler": program.compiler, "flags": FLAGS, "load": load(), "rows": rows }));
}
