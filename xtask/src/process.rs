//! Running other programs: where the project is, what cargo is called, and a sentence when a run fails.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Why a command did not succeed.
#[derive(Debug)]
pub struct Failure {
    /// What happened and what to do about it.
    pub sentence: String,
    /// Exit status to pass on.
    pub status: u8,
}

impl From<String> for Failure {
    fn from(sentence: String) -> Self {
        Failure { sentence, status: 1 }
    }
}

/// Result of a developer command.
pub type Result<T> = std::result::Result<T, Failure>;

/// The project's folder.
pub fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

/// Where a package outside the workspace puts its build: a folder of its own in the common one.
pub fn target_dir(package: &str) -> PathBuf {
    let common = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| project().join("target"), PathBuf::from);
    // Cargo takes a relative folder from the directory it was started in.
    std::path::absolute(&common).unwrap_or(common).join(package)
}

/// Cargo, as it was when this program was started by it.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments).current_dir(project());
    command
}

/// Cargo for a package outside the workspace, in its folder. Flags meant for the workspace's build (as of a
/// coverage run) would replace the ones in the package's own configuration, so they are dropped.
pub fn cargo_in(folder: &str, target: &str, arguments: &[&str]) -> Command {
    let mut command = cargo(arguments);
    command.current_dir(project().join(folder)).env("CARGO_TARGET_DIR", target_dir(target));
    for flags in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_RUSTFLAGS", "CARGO_BUILD_TARGET"] {
        command.env_remove(flags);
    }
    command
}

/// Runs a command with its output passed through; a failure keeps its status.
pub fn succeed(command: &mut Command) -> Result<()> {
    let shown = shown(command);
    let status = command.stdin(Stdio::null()).status().map_err(|error| format!("cannot start {shown}: {error}"))?;
    if status.success() {
        return Ok(());
    }
    let code = status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1);
    Err(Failure { sentence: format!("{shown} failed ({status})"), status: code })
}

/// What a command prints, or `None` when it cannot be started or fails.
pub fn output(command: &mut Command) -> Option<String> {
    let output = command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

/// What a program printed, and how it ended.
pub struct Ended {
    /// Standard output.
    pub text: String,
    /// The end where it is not a success: a status, or the sentence that it took too long.
    pub failure: Option<String>,
}

/// Runs a program to its end, at most for `limit`.
pub fn ended(command: &mut Command, limit: Duration) -> Result<Ended> {
    let shown = shown(command);
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| format!("cannot start {shown}: {error}"))?;
    let mut stdout = child.stdout.take();
    let reader = std::thread::spawn(move || {
        let mut text = Vec::new();
        // What was printed before an interruption is still worth showing.
        stdout.as_mut().map(|stdout| stdout.read_to_end(&mut text));
        String::from_utf8_lossy(&text).into_owned()
    });
    let start = Instant::now();
    let failure = loop {
        if let Some(status) = child.try_wait().map_err(|error| format!("{shown}: {error}"))? {
            break (!status.success()).then(|| status.to_string());
        }
        if start.elapsed() > limit {
            // It may have ended just now.
            let _ = child.kill();
            let _ = child.wait();
            break Some(format!("it did not end within {} s", limit.as_secs()));
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    Ok(Ended { text: reader.join().unwrap_or_default(), failure })
}

fn shown(command: &Command) -> String {
    let program = Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    let words = std::iter::once(program).chain(command.get_args());
    format!("`{}`", words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" "))
}
