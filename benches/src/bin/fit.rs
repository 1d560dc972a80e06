//! Fits of a face model to simulated scans of ten thousand to a million points: time, exponent, and where it goes.
//!
//! `cargo run --release -p habitus-benches --bin fit -- [--json | --markdown] [--quick]`
//!
//! The model is trained on procedural faces (60 people, 8 expressions, 30 + 7 weights); the scans are of a face that it has not seen. `--quick` stops at 250 000 points.

use std::collections::BTreeMap;
use std::error::Error;
use std::time::Instant;

use habitus::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use habitus::face::remainder::{N_COMPONENTS, remainder};
use habitus::face::tensor::ShapeTensor;
use habitus::io::model::{ModelSource, hab};
use habitus::mesh::Mesh;
use habitus::register::gpa::{GpaOptions, align_in_place};
use habitus::register::scan_fit::{ScanFitOptions, Stage, fit_scan_watched};
use habitus::synth::faces::{FaceOptions, FacePopulation};
use habitus::synth::scanner::{ScanOptions, Viewpoint, scanned};
use habitus_benches::samples::{Times, load};
use habitus_core::format::Model;
use rayon::ThreadPoolBuilder;
use serde_json::{Value, json};

/// Points of the scans, about.
const SIZES: [usize; 4] = [10_000, 50_000, 250_000, 1_000_000];
/// What a fit to 50 000 points may take, ms, on two threads.
const MOST_MS: f64 = 500.0;
/// Fits of each size and number of threads.
const TURNS: usize = 5;

/// The times of one size.
struct Row {
    n_points: usize,
    n_used: usize,
    threads: usize,
    times: Times,
    /// Mean time of each stage, ms.
    stages: BTreeMap<Stage, f64>,
    /// Mean distance of the vertices from the truth, mm.
    error_mm: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    let before = load();
    let bytes = model_bytes()?;
    let model = Model::open(&bytes).map_err(|error| format!("the model: {error}"))?;
    let unseen = FacePopulation::of(&FaceOptions { identities: 1, seed: 99, level: 4 })?;
    let subject = unseen.mesh(0, 3).ok_or("no face")?;
    let landmarks: Vec<Option<[f64; 3]>> =
        unseen.landmarks.iter().map(|&vertex| Some(subject.positions[vertex as usize])).collect();
    let mut rows = Vec::new();
    for size in &SIZES[..if has("--quick") { 3 } else { 4 }] {
        let scan = scan_of(&subject, *size)?;
        for threads in [1, 2] {
            rows.push(measured(&model, &scan, &landmarks, &subject, threads)?);
        }
    }
    if has("--json") {
        println!("{}", serde_json::to_string_pretty(&json!(rows.iter().map(as_json).collect::<Vec<Value>>()))?);
    } else {
        println!("{}", markdown(&rows, &arguments, [before, load()]));
    }
    Ok(())
}

fn model_bytes() -> Result<Vec<u8>, Box<dyn Error>> {
    let drawn = FacePopulation::of(&FaceOptions { identities: 60, seed: 1, level: 4 })?;
    let [d2, d3, n, _] = drawn.extents();
    let mut shapes = ShapeTensor::from_array(d2, d3, n, &drawn.tensor)?;
    align_in_place(shapes.data_mut(), 3 * n, &GpaOptions::default())?;
    let (identity, expression) = (30, 7);
    let size = |dim| ModeSize::Dimension(dim);
    let options = HosvdOptions { identity: size(identity), expression: size(expression), hooi: None };
    let trained = hosvd(&shapes, &options)?.model;
    let mut source = ModelSource::of_multilinear(&trained);
    source.faces = drawn.faces.clone();
    source.landmarks = drawn.landmarks.to_vec();
    source.remainder = remainder(&shapes, [identity, expression], N_COMPONENTS)?.components;
    Ok(hab::bytes(&source)?)
}

/// About so many points from three sides.
fn scan_of(subject: &Mesh, n_points: usize) -> Result<Mesh, Box<dyn Error>> {
    let taken = |pixel: f64| {
        let options = ScanOptions { views: Viewpoint::on_arc(3, 90.0), pixel, ..ScanOptions::default() };
        scanned(subject, &options)
    };
    let coarse = 1.5;
    let n = taken(coarse)?.mesh.positions.len();
    Ok(taken(coarse * (n as f64 / n_points as f64).sqrt())?.mesh)
}

fn measured(
    model: &Model<'_>,
    scan: &Mesh,
    landmarks: &[Option<[f64; 3]>],
    subject: &Mesh,
    threads: usize,
) -> Result<Row, Box<dyn Error>> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
    let (mut seconds, mut stages) = (Vec::new(), BTreeMap::new());
    let mut found = None;
    for _ in 0..TURNS {
        let (start, mut now) = (Instant::now(), (Stage::Start, Instant::now()));
        let mut watch = |stage: Stage| {
            *stages.entry(now.0).or_insert(0.0) += 1e3 * now.1.elapsed().as_secs_f64() / TURNS as f64;
            now = (stage, Instant::now());
        };
        let options = ScanFitOptions::default();
        let fit = pool.install(|| {
            let fit = fit_scan_watched(model, scan, landmarks, &options, &mut |stage| watch(stage));
            watch(Stage::Start);
            fit
        })?;
        seconds.push(start.elapsed().as_secs_f64());
        found = Some(fit);
    }
    let fit = found.ok_or("no turn")?;
    let distance = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let error_mm = fit.vertices.iter().zip(&subject.positions).map(distance).sum::<f64>() / fit.vertices.len() as f64;
    let times = Times::of(seconds);
    Ok(Row { n_points: scan.positions.len(), n_used: fit.n_points, threads, times, stages, error_mm })
}

/// Slope of the logarithm of the best time over that of the points.
fn exponent(rows: &[&Row]) -> f64 {
    let points: Vec<[f64; 2]> = rows.iter().map(|row| [(row.n_points as f64).ln(), row.times.best.ln()]).collect();
    let mean = |axis: usize| points.iter().map(|p| p[axis]).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(0), mean(1));
    let products =
        |a: usize, b: usize, means: [f64; 2]| points.iter().map(|p| (p[a] - means[0]) * (p[b] - means[1])).sum::<f64>();
    products(0, 1, [x, y]) / products(0, 0, [x, x])
}

fn as_json(row: &Row) -> Value {
    let stages: BTreeMap<String, f64> = row.stages.iter().map(|(stage, ms)| (format!("{stage:?}"), *ms)).collect();
    json!({
        "points": row.n_points,
        "points_used": row.n_used,
        "threads": row.threads,
        "best_ms": row.times.best,
        "median_ms": row.times.median,
        "stages_ms": stages,
        "vertex_error_mm": row.error_mm,
    })
}

fn markdown(rows: &[Row], arguments: &[String], load: [String; 2]) -> String {
    const STAGES: [Stage; 6] =
        [Stage::Start, Stage::Target, Stage::Model, Stage::Pairs, Stage::Steps, Stage::Judgement];
    let mut text = format!(
        "## Fits to scans\n\n    cargo run --release -p habitus-benches --bin fit -- {}\n\nLoad average {} before, {} after. Times in ms: best and median of {TURNS}; stages: means.\n\n\
         | points | of them used | threads | best | median | start | target | model | pairs | steps | judgement | vertex error, mm |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        arguments.join(" "),
        load[0],
        load[1],
    );
    for row in rows {
        let stages: Vec<String> =
            STAGES.iter().map(|stage| format!("{:.0}", row.stages.get(stage).copied().unwrap_or(0.0))).collect();
        text += &format!(
            "| {} | {} | {} | {:.0} | {:.0} | {} | {:.2} |\n",
            row.n_points,
            row.n_used,
            row.threads,
            row.times.best,
            row.times.median,
            stages.join(" | "),
            row.error_mm,
        );
    }
    for threads in [1, 2] {
        let of: Vec<&Row> = rows.iter().filter(|row| row.threads == threads).collect();
        text += &format!("\nExponent with {threads} threads: {:.2}.", exponent(&of));
    }
    if let Some(row) = rows.iter().find(|row| row.threads == 2 && row.n_points.abs_diff(50_000) < 5_000) {
        let verdict = if row.times.best <= MOST_MS { "met" } else { "missed" };
        text += &format!(
            "\n{} points on two threads: {:.0} ms, at most {MOST_MS:.0} are asked for: {verdict}.\n",
            row.n_points, row.times.best
        );
    }
    text
}
