//! The rows of evaluation: each job by us, at the machine's limit, by a plain loop over our layout and by the peers' way, in rounds that alternate.

pub mod alignment;
pub mod bodies;
pub mod faces;
pub mod inputs;
pub mod packaged;
pub mod report;
pub mod wavelets;

use std::error::Error;
use std::time::Instant;

use crate::peer::Peer;
use crate::samples::Times;

/// Calls at the start of a round that do not count.
const WARM_UP: usize = 4;
const SAMPLES: usize = 40;
/// Samples of a job that takes tens of milliseconds.
const LONG_SAMPLES: usize = 2;

/// One line of the table, milliseconds.
pub struct Row {
    /// What is computed.
    pub name: String,
    /// Threads of ours, of the limit and of the loop over our layout; the peer has one.
    pub threads: usize,
    /// Ours.
    pub ours: Times,
    /// Bytes that must move once over the bandwidth of a working set of that size.
    pub limit: Times,
    /// The loop over our layout.
    pub plain: Option<Times>,
    /// The peers' way.
    pub peer: Option<Times>,
    /// What that is.
    pub peer_name: &'static str,
    /// Largest allowed ratio of ours to the peer, and to the limit.
    pub targets: [Option<f64>; 2],
    /// The job of the packaged peers.
    pub packaged: Option<&'static str>,
}

/// A row before it is measured.
#[derive(Clone)]
pub struct Job {
    /// What is computed.
    pub name: String,
    /// Threads.
    pub threads: usize,
    /// Bytes that must move once.
    pub bytes: f64,
    /// The job of the loop over our layout.
    pub plain: Option<String>,
    /// The peers' job, and what it is.
    pub peer: Option<(String, &'static str)>,
    /// Largest allowed ratio of ours to the peer, and to the limit.
    pub targets: [Option<f64>; 2],
    /// Tens of milliseconds: few samples.
    pub long: bool,
    /// The job of the packaged peers.
    pub packaged: Option<&'static str>,
}

impl Job {
    /// A job of one thread beside the limit alone.
    pub fn new(name: impl Into<String>, bytes: f64) -> Self {
        Job {
            name: name.into(),
            threads: 1,
            bytes,
            plain: None,
            peer: None,
            targets: [None; 2],
            long: false,
            packaged: None,
        }
    }

    /// With a loop over our layout.
    pub fn plain(self, job: impl Into<String>) -> Self {
        Job { plain: Some(job.into()), ..self }
    }

    /// With the peers' way, and what ours may take of its time.
    pub fn peer(self, job: impl Into<String>, name: &'static str, target: Option<f64>) -> Self {
        Job { peer: Some((job.into(), name)), targets: [target, self.targets[1]], ..self }
    }

    /// With the packaged peers' name of the job.
    pub fn packaged(self, job: &'static str) -> Self {
        Job { packaged: Some(job), ..self }
    }

    /// What ours may take of the limit's time.
    pub fn within(self, target: f64) -> Self {
        Job { targets: [self.targets[0], Some(target)], ..self }
    }

    /// The same on so many threads, without a peer and without targets.
    pub fn on(&self, threads: usize) -> Self {
        Job { threads, peer: None, targets: [None; 2], ..self.clone() }
    }

    /// Takes tens of milliseconds.
    pub fn long(self) -> Self {
        Job { long: true, ..self }
    }
}

/// The rows as they are measured.
pub struct Bench<'p> {
    /// Turns of each row.
    pub rounds: usize,
    /// The program beside us.
    pub peer: &'p mut Peer,
    /// What has been measured.
    pub rows: Vec<Row>,
}

impl Bench<'_> {
    /// Measures a row: its programs take turns.
    ///
    /// # Errors
    /// When one of them fails.
    pub fn row(
        &mut self,
        job: &Job,
        mut ours: impl FnMut() -> Result<(), Box<dyn Error>>,
    ) -> Result<(), Box<dyn Error>> {
        let samples = if job.long { LONG_SAMPLES } else { SAMPLES };
        let (mut own, mut read, mut plain, mut peer) = (vec![], vec![], vec![], vec![]);
        let read_job = format!("read_{}", (job.bytes / 1024.0).ceil().max(64.0) as usize);
        let mut read_bytes = 1.0;
        for _ in 0..self.rounds {
            for sample in 0..samples + WARM_UP {
                let start = Instant::now();
                ours()?;
                let seconds = start.elapsed().as_secs_f64();
                if sample >= WARM_UP {
                    own.push(seconds);
                }
            }
            if let Some(name) = &job.plain {
                plain.extend(&self.peer.run(name, job.threads, samples + WARM_UP)?.seconds[WARM_UP..]);
            }
            if let Some((name, _)) = &job.peer {
                peer.extend(&self.peer.run(name, 1, samples + WARM_UP)?.seconds[WARM_UP..]);
            }
            let answer = self.peer.run(&read_job, job.threads, samples + WARM_UP)?;
            read_bytes = answer.bytes;
            read.extend(&answer.seconds[WARM_UP..]);
        }
        let some = |seconds: Vec<f64>| (!seconds.is_empty()).then(|| Times::of(seconds));
        self.rows.push(Row {
            name: job.name.clone(),
            threads: job.threads,
            ours: Times::of(own),
            limit: Times::of(read).scaled(job.bytes / read_bytes),
            plain: some(plain),
            peer: some(peer),
            peer_name: job.peer.as_ref().map_or("", |(_, name)| name),
            targets: job.targets,
            packaged: job.packaged,
        });
        Ok(())
    }

    /// What has one order of its sums, hence one thread: two of them side by side, each with memory of its own.
    ///
    /// # Errors
    /// When one of them fails.
    pub fn two<T: Send>(
        &mut self,
        job: &Job,
        memory: &mut [T; 2],
        work: impl Fn(&mut T) -> Result<(), habitus_core::Error> + Sync,
    ) -> Result<(), Box<dyn Error>> {
        let job = Job { name: format!("two of: {}", job.name), bytes: 2.0 * job.bytes, packaged: None, ..job.on(2) };
        let [first, second] = memory;
        self.row(&job, || {
            let (first, second) = rayon::join(|| work(first), || work(second));
            Ok(first.and(second)?)
        })
    }

    /// The sum of a peer's result, which ours has to have too.
    ///
    /// # Errors
    /// When it has not.
    pub fn expect(&mut self, job: &str, result: &[f32], tolerance: f64) -> Result<(), Box<dyn Error>> {
        let theirs = self.peer.run(job, 1, 1)?.sum;
        let (sum, size) = result.iter().fold((0.0, 0.0), |(s, m), &v| (s + f64::from(v), m + f64::from(v.abs())));
        if (sum - theirs).abs() <= tolerance * size {
            return Ok(());
        }
        Err(format!("{job}: ours sums to {sum}, C++ to {theirs}").into())
    }
}
