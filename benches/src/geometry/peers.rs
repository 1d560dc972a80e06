//! Other programs at the same jobs, as far as they are installed: C++ (nanoflann, CGAL, a plain loop) and Python (Open3D, whose search
//! and rays are those of Embree).

use std::cell::RefCell;
use std::error::Error;
use std::path::Path;
use std::process::Command;
use std::rc::Rc;

use habitus::mesh::Mesh;
use habitus::spatial::Ray;
use tempfile::TempDir;

use super::Candidate;
use crate::peer::{Peer, Program};

/// The means of two programs may differ by this part: one of them computes in 32 bits.
const TOLERANCE: f64 = 1e-4;

/// The programs that there are.
pub struct Peers {
    search: Option<Program>,
    python: Option<String>,
    threads: Vec<usize>,
}

/// A job for a peer.
pub struct Task<'a> {
    /// What it calls the job.
    pub job: String,
    /// Of how many items it consists.
    pub items: usize,
    /// What we have found; the peer's mean must be ours. Empty when there is none.
    pub values: &'a [f64],
}

impl<'a> Task<'a> {
    /// The building of a search structure.
    pub fn build(job: &str, items: usize) -> Self {
        Task { job: job.into(), items, values: &[] }
    }

    /// The first positions of the file `name`, as many as we have found distances of.
    pub fn queries(among: &str, name: &str, distances: &'a [f64]) -> Self {
        Task { job: format!("{among}.{name}"), items: distances.len(), values: distances }
    }
}

impl Peers {
    /// No other program.
    pub fn none() -> Self {
        Peers { search: None, python: None, threads: vec![1] }
    }

    /// The programs that are installed; for the others a line on the error output says what is missing.
    pub fn found(threads: &[usize]) -> Self {
        let source = include_str!("peers.cpp");
        let search = Program::compiled(&[("peers.cpp", source)], &["-lgmp", "-lmpfr"])
            .or_else(|_| Program::compiled(&[("peers.cpp", source)], &[]))
            .inspect_err(|error| eprintln!("without peers in C++: {error}"))
            .ok();
        let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
        let imports = Command::new(&python).args(["-c", "import numpy, open3d"]).output();
        let has_open3d = imports.is_ok_and(|output| output.status.success());
        if !has_open3d {
            eprintln!("without Open3D and Embree: {python} does not import open3d; set PYTHON to one that does");
        }
        Peers { search, python: has_open3d.then_some(python), threads: threads.to_vec() }
    }

    /// Name and version of the C++ compiler.
    pub fn compiler(&self) -> Option<&str> {
        self.search.as_ref().map(|program| program.compiler.as_str())
    }

    /// The programs, started on these data.
    ///
    /// # Errors
    /// When the data cannot be written or a program does not start.
    pub fn at(
        &self,
        mesh: &Mesh,
        positions: &[(&str, Vec<[f64; 3]>)],
        rays: &[Ray],
    ) -> Result<Opponents, Box<dyn Error>> {
        let folder = tempfile::tempdir()?;
        let write = |name: &str, bytes: Vec<u8>| std::fs::write(folder.path().join(name), bytes);
        let reals = |values: &[[f64; 3]]| values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        write("vertices", reals(&mesh.positions))?;
        write("faces", mesh.faces.iter().flatten().flat_map(|v| v.to_le_bytes()).collect())?;
        for (name, positions) in positions {
            write(name, reals(positions))?;
        }
        let pairs: Vec<[f64; 3]> = rays.iter().flat_map(|ray| [ray.origin, ray.direction]).collect();
        write("rays", reals(&pairs))?;
        let mut opponents = Opponents { list: Vec::new(), _folder: folder };
        if let Some(program) = &self.search {
            let mut command = Command::new(program.path());
            command.arg(opponents._folder.path());
            opponents.start(command, &self.threads)?;
        }
        // It has nothing for clouds.
        if let Some(command) = self.python(opponents._folder.path())?.filter(|_| !mesh.faces.is_empty()) {
            opponents.start(command, &self.threads)?;
        }
        Ok(opponents)
    }

    /// Open3D alone, for files.
    ///
    /// # Errors
    /// When it does not start.
    pub fn readers(&self) -> Result<Opponents, Box<dyn Error>> {
        let mut opponents = Opponents { list: Vec::new(), _folder: tempfile::tempdir()? };
        if let Some(command) = self.python(opponents._folder.path())? {
            opponents.start(command, &[1])?;
        }
        Ok(opponents)
    }

    fn python(&self, folder: &Path) -> Result<Option<Command>, Box<dyn Error>> {
        let Some(python) = &self.python else { return Ok(None) };
        let script = folder.join("peers.py");
        std::fs::write(&script, include_str!("peers.py"))?;
        let mut command = Command::new(python);
        command.arg(script).arg(folder);
        Ok(Some(command))
    }
}

/// The programs that have data and wait for jobs.
pub struct Opponents {
    list: Vec<Opponent>,
    _folder: TempDir,
}

/// A program, or one of several in a process.
struct Opponent {
    name: String,
    jobs: Vec<String>,
    threads: Vec<usize>,
    process: Rc<RefCell<Peer>>,
}

impl Opponents {
    /// Starts a process. Its first line names the programs in it, each `;name:jobs,separated`, with a `+` before those that can use
    /// several threads.
    fn start(&mut self, command: Command, threads: &[usize]) -> Result<(), Box<dyn Error>> {
        let peer = Peer::started(command)?;
        let programs = peer.programs.clone();
        let process = Rc::new(RefCell::new(peer));
        for program in programs.split(';').filter(|program| !program.is_empty()) {
            let (name, jobs) = program.split_once(':').ok_or_else(|| format!("a peer calls itself {program:?}"))?;
            let parallel = name.starts_with('+');
            self.list.push(Opponent {
                name: name.trim_start_matches('+').into(),
                jobs: jobs.split(',').map(str::to_owned).collect(),
                threads: if parallel { threads.to_vec() } else { vec![1] },
                process: Rc::clone(&process),
            });
        }
        Ok(())
    }

    /// Those that know the job, each after a first run whose result has been compared with ours.
    ///
    /// # Errors
    /// When a program ends or finds something else.
    pub(super) fn candidates(&self, task: &Task<'_>) -> Result<Vec<Candidate<'_>>, Box<dyn Error>> {
        let kind = task.job.split(' ').next().unwrap_or_default();
        let mut candidates = Vec::new();
        for opponent in self.list.iter().filter(|opponent| opponent.jobs.iter().any(|job| job == kind)) {
            for &threads in &opponent.threads {
                let command = task.job.clone();
                let first = opponent.process.borrow_mut().run(&command, threads, 1)?;
                let ours = task.values.iter().sum::<f64>() / task.values.len().max(1) as f64;
                let theirs = if task.values.is_empty() { ours } else { first.sum / task.values.len() as f64 };
                if !((ours - theirs).abs() <= TOLERANCE * ours.abs()) {
                    return Err(format!("{}, {kind}: mean {theirs}, ours {ours}", opponent.name).into());
                }
                let process = Rc::clone(&opponent.process);
                candidates.push(Candidate {
                    program: opponent.name.clone(),
                    threads,
                    items: task.items,
                    run: Box::new(move || Ok(process.borrow_mut().run(&command, threads, 1)?.seconds[0])),
                    bytes: (first.bytes > 0.0).then_some(first.bytes as usize),
                });
            }
        }
        Ok(candidates)
    }
}
