//! The rows of geometry in the table of performance: spatial search, mesh files and cleaning, from ten thousand to a million elements,
//! ours and others in one run, in turns.
//!
//! `cargo run --release -p habitus-benches --bin geometry -- [--json | --markdown] [--quick] [--alone] [--only SUBJECT]`
//!
//! Subjects: `points`, `triangles`, `winding`, `files`, `cleaning`, `scan`, `decimation`. `--markdown` gives the section of `RESULTS.md`.
//!
//! Others are taken as far as they are installed: nanoflann and CGAL (headers, and a C++ compiler: `CXX`), Open3D for Embree (`PYTHON`);
//! `--alone` leaves them out. `--quick` stops at a hundred thousand faces.

use std::error::Error;

use habitus_benches::geometry::peers::Peers;
use habitus_benches::geometry::report::{Circumstances, section};
use habitus_benches::geometry::table::{Row, markdown};
use habitus_benches::geometry::{Plan, cleaning, files, memory, search};
use habitus_benches::samples::{Effort, load};
use serde_json::json;

/// Numbers of threads.
const THREADS: [usize; 2] = [1, 2];

type Subject = fn(&Plan, &mut Vec<Row>) -> Result<(), Box<dyn Error>>;

/// What is measured, in this order.
const SUBJECTS: [(&str, Subject); 7] = [
    ("points", search::points),
    ("triangles", search::triangles),
    ("winding", search::winding),
    ("files", files::files),
    ("cleaning", cleaning::cleaning),
    ("scan", cleaning::scan),
    ("decimation", cleaning::decimation),
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, job, argument] = arguments.as_slice()
        && flag == memory::FLAG
    {
        return memory::answer(job, argument);
    }
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    let only = arguments.iter().position(|argument| argument == "--only").map(|at| arguments.get(at + 1));
    if let Some(subject) = only
        && !SUBJECTS.iter().any(|(name, _)| subject.is_some_and(|subject| subject == name))
    {
        return Err(format!("--only {subject:?}: give one of {:?}", SUBJECTS.map(|(name, _)| name)).into());
    }
    let (effort, clouds, frequencies) = if has("--quick") {
        (Effort { rounds: 3, seconds: 1.0 }, vec![32, 100], vec![22, 71])
    } else {
        (Effort { rounds: 7, seconds: 3.0 }, vec![32, 57, 100, 141, 316], vec![22, 40, 71, 141, 224])
    };
    let peers = if has("--alone") { Peers::none() } else { Peers::found(&THREADS) };
    let compiler = peers.compiler().map(str::to_owned);
    let plan = Plan { effort, clouds, frequencies, threads: THREADS.to_vec(), peers };
    let (before, mut rows) = (load(), Vec::new());
    for (name, subject) in SUBJECTS {
        if only.flatten().is_none_or(|only| only == name) {
            eprintln!("{name}, load {}", load());
            subject(&plan, &mut rows)?;
        }
    }
    if has("--json") {
        let rows: Vec<_> = rows.iter().map(Row::json).collect();
        println!("{:#}", json!({ "compiler": compiler, "load": load(), "rows": rows }));
    } else if has("--markdown") {
        let arguments = arguments.join(" ");
        print!("{}", section(&rows, &Circumstances { arguments, compiler, load: [before, load()] }));
    } else {
        println!("C++: {}; load {}\n\n{}", compiler.as_deref().unwrap_or("none"), load(), markdown(&rows));
    }
    Ok(())
}
