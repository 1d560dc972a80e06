//! A program beside us: in C++ compiled when the measurement runs; asked over pipes so that samples alternate with ours.

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Flags of the C++ compiler.
pub const FLAGS: [&str; 5] = ["-O3", "-march=native", "-fno-math-errno", "-std=c++17", "-pthread"];

/// The compiled program; the folder goes with it.
pub struct Program {
    path: PathBuf,
    _folder: tempfile::TempDir,
    /// Name and version of the compiler.
    pub compiler: String,
}

impl Program {
    /// Compiles a source, given with the headers that it includes as files by name, the source first, with `$CXX`, else `c++`, and links the libraries.
    ///
    /// # Errors
    /// When there is no compiler, or it refuses.
    pub fn compiled(files: &[(&str, &str)], libraries: &[&str]) -> Result<Self, Box<dyn Error>> {
        let compiler = std::env::var("CXX").unwrap_or_else(|_| "c++".into());
        let folder = tempfile::tempdir()?;
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text)?;
        }
        let name = files.first().ok_or("no source")?.0;
        let file = folder.path().join(name);
        let path = folder.path().join("peer");
        let status = Command::new(&compiler).args(FLAGS).arg(&file).arg("-o").arg(&path).args(libraries).status();
        if !status.map_err(|error| format!("{compiler}: {error}; set CXX to a C++ compiler"))?.success() {
            return Err(format!("{compiler} refused {name}").into());
        }
        let version = Command::new(&compiler).arg("--version").output()?.stdout;
        let version = String::from_utf8_lossy(&version).lines().next().unwrap_or_default().to_owned();
        Ok(Program { path, _folder: folder, compiler: version })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// A program that runs and waits for jobs.
pub struct Peer {
    /// What it has said of itself behind the word `ready`.
    pub programs: String,
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

/// The answer to one command.
pub struct Answer {
    /// Bytes that were moved in one sample (limits only).
    pub bytes: f64,
    /// Sum of the result (loops only).
    pub sum: f64,
    /// Seconds of each sample.
    pub seconds: Vec<f64>,
}

impl Peer {
    /// Starts a program and waits until its data are made.
    ///
    /// # Errors
    /// When it cannot be started or fails.
    pub fn started(mut command: Command) -> Result<Self, Box<dyn Error>> {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let input = child.stdin.take().ok_or("no pipe to the peer")?;
        let output = BufReader::new(child.stdout.take().ok_or("no pipe from the peer")?);
        let mut peer = Peer { programs: String::new(), child, input, output };
        let line = peer.line()?;
        let programs = line.trim().strip_prefix("ready");
        peer.programs = programs.ok_or_else(|| format!("{command:?} did not start"))?.to_owned();
        Ok(peer)
    }

    fn line(&mut self) -> Result<String, Box<dyn Error>> {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        Ok(line)
    }

    /// Runs a job `samples` times.
    ///
    /// # Errors
    /// When the program has ended or answers nonsense.
    pub fn run(&mut self, job: &str, threads: usize, samples: usize) -> Result<Answer, Box<dyn Error>> {
        writeln!(self.input, "{job} {threads} {samples}")?;
        self.input.flush()?;
        let line = self.line()?;
        let numbers: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        match numbers.as_slice() {
            [bytes, sum, seconds @ ..] if seconds.len() == samples => {
                Ok(Answer { bytes: *bytes, sum: *sum, seconds: seconds.to_vec() })
            }
            _ => Err(format!("the program has ended in job {job}").into()),
        }
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
