//! The C++ program beside us: compiled when the measurement runs, asked over pipes so that samples alternate with ours.

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use crate::workload::Size;

/// Flags of the C++ compiler.
pub const FLAGS: [&str; 4] = ["-O3", "-march=native", "-std=c++17", "-pthread"];

/// The compiled program; the folder goes with it.
pub struct Program {
    path: PathBuf,
    _folder: tempfile::TempDir,
    /// Name and version of the compiler.
    pub compiler: String,
}

impl Program {
    /// Compiles `peer.cpp` with `$CXX`, else `c++`.
    ///
    /// # Errors
    /// When there is no compiler, or it refuses.
    pub fn compiled() -> Result<Self, Box<dyn Error>> {
        let compiler = std::env::var("CXX").unwrap_or_else(|_| "c++".into());
        let folder = tempfile::tempdir()?;
        let source = folder.path().join("peer.cpp");
        std::fs::write(&source, include_str!("peer.cpp"))?;
        let path = folder.path().join("peer");
        let status = Command::new(&compiler).args(FLAGS).arg(&source).arg("-o").arg(&path).status();
        if !status.map_err(|error| format!("{compiler}: {error}; set CXX to a C++ compiler"))?.success() {
            return Err(format!("{compiler} refused peer.cpp").into());
        }
        let version = Command::new(&compiler).arg("--version").output()?.stdout;
        let version = String::from_utf8_lossy(&version).lines().next().unwrap_or_default().to_owned();
        Ok(Program { path, _folder: folder, compiler: version })
    }
}

/// The program running on the model of one size.
pub struct Peer {
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
    /// Starts the program and waits until its model is made.
    ///
    /// # Errors
    /// When it cannot be started or fails.
    pub fn new(program: &Program, size: Size) -> Result<Self, Box<dyn Error>> {
        let counts = [size.vertices, size.identity, size.pose].map(|count| count.to_string());
        let mut child =
            Command::new(&program.path).args(counts).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let input = child.stdin.take().ok_or("no pipe to the peer")?;
        let output = BufReader::new(child.stdout.take().ok_or("no pipe from the peer")?);
        let mut peer = Peer { child, input, output };
        if peer.line()?.trim() != "ready" {
            return Err("the C++ program did not start".into());
        }
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
            _ => Err(format!("the C++ program ended in job {job}").into()),
        }
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
