//! The bilinear rows of the table of performance: ours, the limit and plain C++ in one run, in rounds that alternate.
//!
//! `cargo run --release -p habitus-benches --bin rows -- [--json] [--big] [--rounds N] [--threads N] [--job full|fixed|jacobian]
//! [--only-big] [--unaligned]`
//!
//! The limit of a row is the bytes that must move once over the read bandwidth of the same working set, measured in the same rounds: coefficients (or columns)
//! once, results twice, because an ordinary store first fetches its cache line. Beside it stands, for value + Jacobian, the time of a loop
//! that reads the coefficients and stores as many results without computing them ("mix").

use std::error::Error;
use std::hint::black_box;
use std::process::Command;
use std::time::Instant;

use habitus::evaluate::{evaluate_parallel, linearise_parallel, prepared};
use habitus_benches::peer::{FLAGS, Peer, Program};
use habitus_benches::samples::{Times, load};
use habitus_benches::workload::{BIG, ModelMemory, SMALL, Size};
use habitus_core::format::Mode;
use habitus_core::generator::prepared::prepared_req;
use habitus_core::generator::{Generator, NUMBERS, Weights};
use serde_json::json;

/// Calls at the start of a round that do not count.
const WARM_UP: usize = 6;

/// What the command line asks for.
struct Plan {
    /// Bytes behind a multiple of 64 at which the model lies.
    shift: usize,
    rounds: usize,
    threads: Vec<usize>,
    /// Only this job.
    job: Option<String>,
}

/// One line of the table.
struct Row {
    size: Size,
    job: &'static str,
    threads: usize,
    ours: Times,
    limit: Times,
    pieces: Option<Times>,
    mix: Option<Times>,
    plain: Times,
}

/// What a row measures: its name, the jobs of the peer, the bytes that must move.
struct Job {
    name: &'static str,
    read: &'static str,
    mix: bool,
    plain: &'static str,
    bytes: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    let value = |flag: &str| {
        let at = arguments.iter().position(|argument| argument == flag)?;
        Some(arguments.get(at + 1).cloned().unwrap_or_default())
    };
    let rounds = value("--rounds").map_or(Ok(12), |text| text.parse())?;
    let threads: Vec<usize> = match value("--threads") {
        Some(text) => vec![text.parse()?],
        None => vec![1, 2],
    };
    let plan = Plan { shift: usize::from(has("--unaligned")), rounds, threads, job: value("--job") };
    let program = Program::compiled(&[("peer.cpp", include_str!("../peer.cpp"))], &[])?;
    let mut rows = Vec::new();
    if !has("--only-big") {
        measure(&program, SMALL, &plan, 40, &mut rows)?;
    }
    if has("--big") || has("--only-big") {
        measure(&program, BIG, &plan, 2, &mut rows)?;
    }
    if has("--json") {
        print_json(&rows, &program)
    } else {
        print_table(&rows, &program)
    }
    Ok(())
}

/// Adds the rows of one size.
fn measure(
    program: &Program,
    size: Size,
    plan: &Plan,
    samples: usize,
    rows: &mut Vec<Row>,
) -> Result<(), Box<dyn Error>> {
    let memory = ModelMemory::new(size, plan.shift);
    let model = memory.generator();
    let mut command = Command::new(program.path());
    command.args([size.vertices, size.identity, size.pose].map(|count| count.to_string()));
    let mut peer = Peer::started(command)?;
    let (blocks, dim) = (model.block_count(), model.dim());
    let weights = Weights { identity: &memory.identity, pose: &memory.pose };
    let free = Weights { identity: &[], pose: &memory.pose };
    let mut columns = vec![0.0; prepared_req(&model, Mode::Identity, &(0..blocks)).numbers()];
    let form = prepared(&model, Mode::Identity, &memory.identity, 0..blocks, &mut columns)?;
    let mut out = vec![0.0; 3 * size.vertices];
    let mut values = vec![0.0; NUMBERS * blocks];
    let mut jacobian = vec![0.0; NUMBERS * blocks * dim];

    let number = |count: usize| 4.0 * count as f64;
    let coefficients = number(blocks * (1 + size.identity * size.pose) * NUMBERS);
    let positions = 2.0 * number(3 * size.vertices);
    let jobs = [
        Job { name: "full", read: "read", mix: false, plain: "full", bytes: coefficients + positions },
        Job {
            name: "identity fixed",
            read: "read_fixed",
            mix: false,
            plain: "fixed",
            bytes: number(blocks * (1 + size.pose) * NUMBERS) + positions,
        },
        Job {
            name: "value + Jacobian",
            read: "read",
            mix: true,
            plain: "jacobian",
            bytes: coefficients + 2.0 * number(NUMBERS * blocks * (1 + dim)),
        },
    ];
    for job in jobs.iter().filter(|job| plan.job.as_ref().is_none_or(|only| only == job.plain)) {
        for &threads in &plan.threads {
            let (mut ours, mut plain) = (vec![], vec![]);
            let (mut read, mut pieces, mut mix) = (vec![], vec![], vec![]);
            let (mut sum, mut read_bytes) = (0.0, 0.0);
            for _ in 0..plan.rounds {
                // The first calls of a round find another program's data in the caches, for all programs alike; they do not count.
                for sample in 0..samples + WARM_UP {
                    let start = Instant::now();
                    match job.name {
                        "full" => evaluate_parallel(&model, weights, 0..size.vertices, &mut out, threads),
                        "identity fixed" => evaluate_parallel(&form, free, 0..size.vertices, &mut out, threads),
                        _ => linearise_parallel(&model, weights, 0..blocks, &mut values, &mut jacobian, threads),
                    }?;
                    let seconds = start.elapsed().as_secs_f64();
                    black_box((&mut out, &mut jacobian));
                    if sample >= WARM_UP {
                        ours.push(seconds);
                    }
                }
                let answer = peer.run(job.plain, threads, samples + WARM_UP)?;
                plain.extend(&answer.seconds[WARM_UP..]);
                sum = answer.sum;
                let answer = peer.run(job.read, threads, samples + WARM_UP)?;
                read.extend(&answer.seconds[WARM_UP..]);
                read_bytes = answer.bytes;
                if size.vertices == BIG.vertices && job.read == "read" {
                    let answer = peer.run("read_pieces", threads, 24 * samples + WARM_UP)?;
                    pieces.extend(answer.seconds[WARM_UP..].iter().map(|seconds| seconds * read_bytes / answer.bytes));
                }
                if job.mix {
                    mix.extend(&peer.run("mix", threads, samples + WARM_UP)?.seconds[WARM_UP..]);
                }
            }
            let result = if job.mix { &jacobian } else { &out };
            let (total, magnitude) =
                result.iter().fold((0.0, 0.0), |(sum, size), &v| (sum + f64::from(v), size + f64::from(v.abs())));
            if !((total - sum).abs() <= 1e-6 * magnitude) {
                return Err(format!("{} {}: ours sums to {total}, C++ to {sum}", size.name, job.name).into());
            }
            rows.push(Row {
                size,
                job: job.name,
                threads,
                ours: Times::of(ours),
                limit: Times::of(read).scaled(job.bytes / read_bytes),
                pieces: (!pieces.is_empty()).then(|| Times::of(pieces).scaled(job.bytes / read_bytes)),
                mix: job.mix.then(|| Times::of(mix)),
                plain: Times::of(plain),
            });
        }
    }
    Ok(())
}

fn print_table(rows: &[Row], program: &Program) {
    println!("C++: {} {}; load {}", program.compiler, FLAGS.join(" "), load());
    println!();
    println!(
        "| model | job | threads | ours, ms: best / median | limit, ms | fraction of the limit | limit in pieces of 8 MiB, ms | read + write mix, ms | plain C++, ms | C++ / ours |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let pair = |times: Times| format!("{:.4} / {:.4}", times.best, times.median);
    for row in rows {
        let Size { name, vertices, identity, pose } = row.size;
        println!(
            "| {name} {vertices} v, {identity} x {pose} | {} | {} | {} | {} | {:.0} % / {:.0} % | {} | {} | {} | {:.2} / {:.2} |",
            row.job,
            row.threads,
            pair(row.ours),
            pair(row.limit),
            100.0 * row.limit.best / row.ours.best,
            100.0 * row.limit.median / row.ours.median,
            row.pieces.map_or("-".into(), pair),
            row.mix.map_or("-".into(), pair),
            pair(row.plain),
            row.plain.best / row.ours.best,
            row.plain.median / row.ours.median,
        );
    }
}

fn print_json(rows: &[Row], program: &Program) {
    let times = |times: Times| json!({ "best_ms": times.best, "median_ms": times.median });
    let rows: Vec<_> = rows
        .iter()
        .map(|row| {
            json!({
                "model": row.size.name,
                "vertices": row.size.vertices,
                "identity_dim": row.size.identity,
                "pose_dim": row.size.pose,
                "job": row.job,
                "threads": row.threads,
                "ours": times(row.ours),
                "limit": times(row.limit),
                "limit_in_pieces": row.pieces.map(times),
                "mix": row.mix.map(times),
                "plain_cpp": times(row.plain),
            })
        })
        .collect();
    let report = json!({ "compiler": program.compiler, "flags": FLAGS, "load": load(), "rows": rows });
    println!("{report:#}");
}
