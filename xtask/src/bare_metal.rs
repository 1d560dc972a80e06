//! A compiler for the Cortex-M4F: rustup's if its target is installed, else Debian's, which brings the source
//! of `core` to build for any target.

use crate::process::{Result, cargo_in, output, target_dir};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The bare-metal target: Cortex-M4F and M7F.
pub const TRIPLE: &str = "thumbv7em-none-eabihf";
/// Below the build folder.
const TARGET: &str = "firmware";

/// How to build for [`TRIPLE`] on this machine.
pub enum Compiler {
    /// The target's `core` is installed.
    Rustup,
    /// `core` is built from source, and linked by the given linker.
    Debian {
        /// An LLD.
        linker: PathBuf,
    },
}

impl Compiler {
    /// What is there to build with.
    pub fn installed() -> Result<Compiler> {
        let targets = output(Command::new("rustup").args(["target", "list", "--installed"])).unwrap_or_default();
        if targets.lines().any(|line| line.trim() == TRIPLE) {
            return Ok(Compiler::Rustup);
        }
        let sysroot = output(Command::new("/usr/bin/rustc").args(["--print", "sysroot"]));
        let source = sysroot.map(|root| Path::new(root.trim()).join("lib/rustlib/src/rust/library/Cargo.lock"));
        if !source.is_some_and(|lock| lock.is_file()) {
            return Err(format!(
                "no compiler for {TRIPLE}: `rustup target add {TRIPLE}`, or on Debian \
                 `apt-get install rustc-web rust-web-src lld`"
            )
            .into());
        }
        match linker() {
            Some(linker) => Ok(Compiler::Debian { linker }),
            None => Err(String::from("no linker for ARM: on Debian `apt-get install lld`").into()),
        }
    }

    /// Builds every program of a package outside the workspace.
    pub fn build(&self, folder: &str, profile: &str, features: &str) -> Command {
        let arguments = ["build", "--bins", "--profile", profile, "--features", features, "--target", TRIPLE];
        let mut command = cargo_in(folder, TARGET, &arguments);
        if let Compiler::Debian { linker } = self {
            command
                .arg("-Zbuild-std=core")
                .env("RUSTC", "/usr/bin/rustc")
                // Debian's compiler is a stable one; building `core` is not a stable option.
                .env("RUSTC_BOOTSTRAP", "1")
                .env(format!("CARGO_TARGET_{}_LINKER", TRIPLE.to_uppercase().replace('-', "_")), linker);
        }
        command
    }

    /// Where [`Compiler::build`] leaves a program.
    pub fn program(&self, profile: &str, name: &str) -> PathBuf {
        target_dir(TARGET).join(TRIPLE).join(profile).join(name)
    }
}

/// The LLD of the compiler in use, else the system's.
fn linker() -> Option<PathBuf> {
    let own = || {
        let root = output(Command::new("rustc").args(["--print", "sysroot"]))?;
        let version = output(Command::new("rustc").arg("-vV"))?;
        let host = version.lines().find_map(|line| line.strip_prefix("host: "))?;
        Some(Path::new(root.trim()).join("lib/rustlib").join(host).join("bin/rust-lld"))
    };
    let works = |linker: &PathBuf| output(Command::new(linker).args(["-flavor", "gnu", "--version"])).is_some();
    own().filter(works).or_else(|| {
        let system = PathBuf::from("/usr/bin/ld.lld");
        output(Command::new(&system).arg("--version")).map(|_| system)
    })
}
