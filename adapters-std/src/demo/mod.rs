//! The demonstration that needs nothing: a procedural population, a model of it, scans of people that it has not seen, fits of the model to these
//! scans, errors against the known truth, and a page that shows all of it.

mod figures;
mod files;
mod fits;
mod learned;
mod page;
mod scans;

use std::path::Path;

pub use figures::{DemoFigures, ErrorFigures, ScanFigures};

use crate::Error;
use crate::io::atomic;
use crate::io::model::opened;
use fits::FaceFit;
use learned::Learned;
use scans::UnseenScan;

/// How large the demonstration is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DemoOptions {
    /// People to learn from.
    pub identities: usize,
    /// People to scan and fit, drawn from another seed.
    pub unseen: usize,
    /// Seed.
    pub seed: u64,
}

impl Default for DemoOptions {
    fn default() -> Self {
        DemoOptions { identities: 100, unseen: 8, seed: 1 }
    }
}

/// Files of every demonstration, by which its folder is known.
const MARKS: [&str; 4] = ["face.hab", "faces.png", "figures.json", "index.html"];

/// Whether a demonstration may be left in `folder`: where there is none yet, or it is empty, or an earlier one was left there, which is replaced.
///
/// # Errors
/// [`Error::Input`] for a folder with other content.
pub fn check_folder(folder: &Path) -> Result<(), Error> {
    let is_empty = std::fs::read_dir(folder).map_or(true, |mut entries| entries.next().is_none());
    if is_empty || MARKS.iter().all(|name| folder.join(name).is_file()) {
        return Ok(());
    }
    Err(Error::input(format!(
        "{}: the folder is not empty, and no earlier demo was left in it; name another, or empty it",
        folder.display()
    )))
}

/// Told the name of the stage that runs, and how many of how many of its steps are done.
pub type Progress<'a> = &'a mut dyn FnMut(&'static str, usize, usize);

/// Runs the demonstration, leaves everything in `folder`, and returns what it measured with the seconds of each stage.
///
/// Determinism: the same options give the same bytes of every file, whatever the number of threads.
///
/// # Errors
/// [`Error::Write`]; fewer than two people to learn from.
pub fn run(
    options: &DemoOptions,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<(DemoFigures, Vec<(String, f64)>), Error> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.to_owned(), source })?;
    let mut clock = Clock::new(progress);
    let learned = Learned::of(options, &mut clock)?;
    let model = opened(&learned.bytes, &folder.join("face.hab"))?;
    let scans = UnseenScan::all(options, &mut clock)?;
    let fits = FaceFit::all(&model, &scans, &mut clock)?;
    clock.stage("drawing and writing", 3);
    let figures = DemoFigures::of(options, &learned, &model, &scans, &fits);
    let mut page = page::of(&model, &learned, &scans, &fits, &figures)?;
    clock.done(1);
    page.files = files::all(&model, &scans, &fits)?;
    clock.done(2);
    // Late, so that a demonstration that was stopped leaves an empty folder.
    atomic::write(folder.join("face.hab"), &learned.bytes)?;
    page.write(folder)?;
    clock.done(3);
    Ok((figures, clock.end()))
}

/// Seconds and progress of the stages.
struct Clock<'a> {
    progress: Progress<'a>,
    stages: Vec<(&'static str, f64)>,
    steps: usize,
    started: std::time::Instant,
}

impl<'a> Clock<'a> {
    fn new(progress: Progress<'a>) -> Self {
        Clock { progress, stages: Vec::new(), steps: 0, started: std::time::Instant::now() }
    }

    /// A stage of so many steps begins.
    fn stage(&mut self, name: &'static str, steps: usize) {
        self.close();
        self.stages.push((name, 0.0));
        self.steps = steps;
        self.done(0);
    }

    /// So many of the stage's steps are done.
    fn done(&mut self, steps: usize) {
        self.told(steps, self.steps);
    }

    /// So many of so many steps are done.
    fn told(&mut self, done: usize, total: usize) {
        if let Some((name, _)) = self.stages.last() {
            (self.progress)(name, done, total);
        }
    }

    fn close(&mut self) {
        if let Some(last) = self.stages.last_mut() {
            last.1 = self.started.elapsed().as_secs_f64();
        }
        self.started = std::time::Instant::now();
    }

    fn end(mut self) -> Vec<(String, f64)> {
        self.close();
        self.stages.into_iter().map(|(name, seconds)| (name.to_owned(), seconds)).collect()
    }
}
