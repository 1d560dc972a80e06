//! The emulated board: QEMU's model of ARM MPS2+ with the AN386 image, a Cortex-M4F.

use crate::process::Result;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const EMULATOR: &str = "qemu-system-arm";
/// The same words as the `runner` in examples/firmware/.cargo/config.toml.
const BOARD: &str = "-M mps2-an386 -nographic -monitor none -serial none -chardev stdio,id=out \
                     -semihosting-config enable=on,target=native,chardev=out -kernel";

/// Fails with a remedy when the emulator is missing.
pub fn installed() -> Result<()> {
    match Command::new(EMULATOR).arg("--version").stdout(Stdio::null()).status() {
        Ok(_) => Ok(()),
        Err(_) => Err(format!("{EMULATOR} is missing: on Debian `apt-get install qemu-system-arm`").into()),
    }
}

/// Runs a program to its exit and returns what it printed; a status other than 0 or a hang is a failure.
pub fn run(program: &Path, limit: Duration) -> Result<String> {
    let name = program.file_name().unwrap_or_default().to_string_lossy();
    let mut child = Command::new(EMULATOR)
        .args(BOARD.split_whitespace())
        .arg(program)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| format!("cannot start {EMULATOR}: {error}"))?;
    let mut stdout = child.stdout.take();
    let reader = std::thread::spawn(move || {
        let mut text = Vec::new();
        // What was printed before an interruption is still worth showing.
        stdout.as_mut().map(|stdout| stdout.read_to_end(&mut text));
        String::from_utf8_lossy(&text).into_owned()
    });
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().map_err(|error| format!("{EMULATOR}: {error}"))? {
            break Some(status);
        }
        if start.elapsed() > limit {
            // It may have ended just now.
            let _ = child.kill();
            let _ = child.wait();
            break None;
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let text = reader.join().unwrap_or_default();
    match status {
        Some(status) if status.success() => Ok(text),
        Some(status) => Err(format!("the program {name} failed on the emulated board ({status}):\n{text}").into()),
        None => Err(format!("the program {name} did not end within {} s:\n{text}", limit.as_secs()).into()),
    }
}
