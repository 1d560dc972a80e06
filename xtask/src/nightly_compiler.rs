//! The nightly compiler, which alone has sanitizers and coverage for fuzzing.

use crate::process::{Result, output};
use std::path::PathBuf;
use std::process::Command;

/// A nightly compiler and the target that it runs on.
pub struct NightlyCompiler {
    /// The compiler.
    pub rustc: PathBuf,
    /// Its host, such as `x86_64-unknown-linux-gnu`.
    pub host: String,
}

impl NightlyCompiler {
    /// The one of rustup's toolchain `nightly`, or a sentence that says how to install it.
    pub fn installed() -> Result<Self> {
        let path = output(Command::new("rustup").args(["which", "--toolchain", "nightly", "rustc"]));
        let compiler = path.and_then(|path| {
            let rustc = PathBuf::from(path.trim());
            let version = output(Command::new(&rustc).arg("-vV"))?;
            let host = version.lines().find_map(|line| line.strip_prefix("host: "))?.to_owned();
            Some(NightlyCompiler { rustc, host })
        });
        compiler.ok_or_else(|| {
            let sentence = "fuzzing needs the nightly compiler, whose sanitizers stable does not have: \
                            rustup toolchain install nightly --profile minimal";
            String::from(sentence).into()
        })
    }
}
