//! Measurements of geometry at sizes from ten thousand to a million: search, mesh files, cleaning.

pub mod cleaning;
pub mod files;
pub mod memory;
pub mod peers;
pub mod report;
pub mod search;
pub mod table;
pub mod workload;

use std::error::Error;

use rayon::ThreadPoolBuilder;

use crate::samples::{Effort, Run, run};
use peers::Peers;
use table::Row;

/// What is measured and how long.
pub struct Plan {
    /// Turns of the programs in each measurement.
    pub effort: Effort,
    /// Sizes of clouds: about `10 f^2` points for each of these.
    pub clouds: Vec<usize>,
    /// Sizes of surfaces: `20 f^2` faces.
    pub frequencies: Vec<usize>,
    /// Numbers of threads, the first of them 1.
    pub threads: Vec<usize>,
    /// Programs to compare with.
    pub peers: Peers,
}

/// The measurements at one size of one subject.
struct Bench<'a> {
    plan: &'a Plan,
    group: &'static str,
    n: usize,
    rows: &'a mut Vec<Row>,
}

/// One program in a measurement.
struct Candidate<'a> {
    program: String,
    threads: usize,
    /// How many items this program does in a run; others may do more.
    items: usize,
    run: Run<'a>,
    /// Bytes that its result or its work occupies.
    bytes: Option<usize>,
}

impl Bench<'_> {
    /// Lets the candidates take turns at a job of `items` items, and adds their rows.
    fn add(&mut self, job: &str, items: usize, candidates: Vec<Candidate<'_>>) -> Result<(), Box<dyn Error>> {
        let mut facts = Vec::new();
        let mut runs = Vec::new();
        for candidate in candidates {
            facts.push((candidate.program, candidate.threads, candidate.items, candidate.bytes));
            runs.push(candidate.run);
        }
        let times = self.plan.effort.times(&mut runs).map_err(|error| format!("{job}, {}: {error}", self.n))?;
        for ((program, threads, done, bytes), times) in facts.into_iter().zip(times) {
            self.rows.push(Row {
                group: self.group,
                job: job.to_owned(),
                program,
                threads,
                n: self.n,
                items,
                items_timed: done,
                times: times.scaled(items as f64 / done as f64),
                bytes,
            });
        }
        Ok(())
    }

    /// Ours on each number of threads.
    fn ours<'a, T: Send>(
        &self,
        items: usize,
        bytes: Option<usize>,
        job: impl Fn() -> T + Sync + Copy + Send + 'a,
    ) -> Result<Vec<Candidate<'a>>, Box<dyn Error>> {
        let candidate = |&threads: &usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
            let run = run(move || pool.install(job));
            Ok(Candidate { program: "habitus".into(), threads, items, run, bytes })
        };
        self.plan.threads.iter().map(candidate).collect()
    }
}

impl<'a> Candidate<'a> {
    /// Ours on the thread that calls it.
    fn alone<T>(items: usize, job: impl FnMut() -> T + 'a) -> Self {
        Candidate { program: "habitus".into(), threads: 1, items, run: run(job), bytes: None }
    }

    fn called(self, program: &str) -> Self {
        Candidate { program: program.into(), ..self }
    }
}
