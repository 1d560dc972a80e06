//! Times of equal runs, and programs that take turns so that what slows one slows the others.

use std::error::Error;
use std::time::Instant;

/// Best and median of samples, milliseconds.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    /// The shortest.
    pub best: f64,
    /// The middle one.
    pub median: f64,
}

impl Times {
    /// Of these samples, of which there is at least one.
    pub fn of(mut seconds: Vec<f64>) -> Self {
        seconds.sort_by(f64::total_cmp);
        Times { best: 1e3 * seconds[0], median: 1e3 * seconds[seconds.len() / 2] }
    }

    /// Both times a factor.
    pub fn scaled(self, factor: f64) -> Self {
        Times { best: factor * self.best, median: factor * self.median }
    }
}

/// One program at one job: a call runs it once and gives the seconds that it took.
pub type Run<'a> = Box<dyn FnMut() -> Result<f64, Box<dyn Error>> + 'a>;

/// A run of a closure whose result is thrown away outside of the time taken.
pub fn run<'a, T>(mut job: impl FnMut() -> T + 'a) -> Run<'a> {
    Box::new(move || {
        let start = Instant::now();
        let result = std::hint::black_box(job());
        let seconds = start.elapsed().as_secs_f64();
        drop(result);
        Ok(seconds)
    })
}

/// How long programs take turns.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Turns at most.
    pub rounds: usize,
    /// After so many seconds no further turn begins; there are at least two.
    pub seconds: f64,
}

impl Effort {
    /// The times of the programs, in turns.
    ///
    /// # Errors
    /// The first of a run.
    pub fn times(self, runs: &mut [Run<'_>]) -> Result<Vec<Times>, Box<dyn Error>> {
        let mut samples = vec![Vec::new(); runs.len()];
        let start = Instant::now();
        for round in 0..self.rounds.max(2) {
            if round >= 2 && start.elapsed().as_secs_f64() > self.seconds {
                break;
            }
            for (run, samples) in runs.iter_mut().zip(&mut samples) {
                samples.push(run()?);
            }
        }
        Ok(samples.into_iter().map(Times::of).collect())
    }
}

/// Load average of the last minute where the system tells it.
pub fn load() -> String {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split_whitespace().next().unwrap_or("unknown").to_owned()
}
