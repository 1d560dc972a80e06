//! A compiler for a target without the standard library: rustup's if the target is installed, else Debian's, which brings the
//! source of `core` to build for any target.

use crate::process::{Result, cargo_in, output, project, target_dir};
use crate::targets::{Target, number};
use std::path::{Path, PathBuf};
use std::process::Command;

/// How to build for a target on this machine.
pub struct Compiler {
    target: Target,
    source: Source,
}

enum Source {
    /// The target's `core` is installed.
    Rustup,
    /// `core` is built from source; the linker is needed where Rust links.
    Debian { linker: Option<PathBuf> },
}

/// What to build.
pub struct Build<'b> {
    /// The package's folder, from the project's. A member of the workspace is built with the workspace's profiles, which unwind:
    /// append `--config profile.PROFILE.panic="abort"` then.
    pub folder: &'b str,
    /// The profile of cargo.
    pub profile: &'b str,
    /// Features, separated by commas.
    pub features: &'b str,
    /// Which of the package's products.
    pub kind: Kind,
}

/// A product of a package.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Every program.
    Programs,
    /// A library for a C program, `libNAME.a`.
    StaticLibrary,
    /// A module of wasm, `NAME.wasm`; elsewhere `libNAME.so`.
    SharedLibrary,
}

impl Compiler {
    /// What is there to build with; a sentence with the remedy if nothing is.
    pub fn installed(target: Target) -> Result<Compiler> {
        let triple = target.triple();
        let targets = output(Command::new("rustup").args(["target", "list", "--installed"])).unwrap_or_default();
        if targets.lines().any(|line| line.trim() == triple) {
            return Ok(Compiler { target, source: Source::Rustup });
        }
        let sysroot = output(Command::new(DEBIAN).args(["--print", "sysroot"]));
        let source = sysroot.map(|root| Path::new(root.trim()).join("lib/rustlib/src/rust/library/Cargo.lock"));
        if !source.is_some_and(|lock| lock.is_file()) {
            return Err(format!(
                "no compiler for {triple}: `rustup target add {triple}`, or on Debian \
                 `apt-get install rustc-web rust-web-src lld`"
            )
            .into());
        }
        let flavour = match target {
            Target::CortexM => Flavour::Gnu,
            Target::Wasm => Flavour::Wasm,
            // A C compiler links.
            Target::AArch64 | Target::BigEndian => {
                return Ok(Compiler { target, source: Source::Debian { linker: None } });
            }
        };
        match linker(flavour) {
            Some(linker) => Ok(Compiler { target, source: Source::Debian { linker: Some(linker) } }),
            None => Err(format!("no linker for {triple}: on Debian `apt-get install lld`").into()),
        }
    }

    /// Its name and version.
    pub fn version(&self) -> String {
        let (program, origin) = match self.source {
            Source::Rustup => ("rustc", "rustup"),
            Source::Debian { .. } => (DEBIAN, "Debian"),
        };
        let version = output(Command::new(program).arg("--version")).unwrap_or_default();
        format!("rustc {} ({origin})", number(&version))
    }

    /// The command that builds; further arguments of cargo can be appended.
    pub fn build(&self, build: &Build<'_>) -> Command {
        let triple = self.target.triple();
        let product: &[&str] = match build.kind {
            Kind::Programs => &["build", "--bins"],
            Kind::StaticLibrary => &["rustc", "--lib", "--crate-type", "staticlib"],
            Kind::SharedLibrary => &["rustc", "--lib", "--crate-type", "cdylib"],
        };
        let common = ["--profile", build.profile, "--features", build.features, "--target", triple];
        let mut command = cargo_in(build.folder, self.target.folder(), &[product, &common].concat());
        let setting = |name: &str| format!("CARGO_TARGET_{}_{name}", triple.to_uppercase().replace('-', "_"));
        if let Source::Debian { .. } = self.source {
            command
                .arg("-Zbuild-std=core")
                .env("RUSTC", DEBIAN)
                // Debian's compiler is a stable one; building `core` is not a stable option.
                .env("RUSTC_BOOTSTRAP", "1");
        }
        let linker = match &self.source {
            Source::Debian { linker: Some(linker) } => Some(linker.clone()),
            _ if matches!(self.target, Target::AArch64 | Target::BigEndian) => {
                self.target.c_compiler_name().map(PathBuf::from)
            }
            _ => None,
        };
        if let Some(linker) = linker {
            command.env(setting("LINKER"), linker);
        }
        if self.target == Target::CortexM && !turns_pass_off(build.folder) {
            command.env(setting("RUSTFLAGS"), PASS_OFF);
        }
        command
    }

    /// Where [`Compiler::build`] leaves a product of the name `name`, a program's or a library's.
    pub fn artefact(&self, kind: Kind, profile: &str, name: &str) -> PathBuf {
        self.artefact_below(&target_dir(self.target.folder()), kind, profile, name)
    }

    /// The same in a build folder of its own (`CARGO_TARGET_DIR`).
    pub fn artefact_below(&self, build_folder: &Path, kind: Kind, profile: &str, name: &str) -> PathBuf {
        // Cargo's own profiles of development share a folder.
        let folder = if matches!(profile, "dev" | "test") { "debug" } else { profile };
        let library = name.replace('-', "_");
        let file = match (kind, self.target) {
            (Kind::Programs, _) => name.to_owned(),
            (Kind::StaticLibrary, _) => format!("lib{library}.a"),
            (Kind::SharedLibrary, Target::Wasm) => format!("{library}.wasm"),
            (Kind::SharedLibrary, _) => format!("lib{library}.so"),
        };
        build_folder.join(self.target.triple()).join(folder).join(file)
    }
}

/// Debian's compiler, also where rustup's comes first on the path.
const DEBIAN: &str = "/usr/bin/rustc";

/// Turns off the pass of LLVM that miscompiles ARM code (examples/firmware/README.md, "A compiler fault").
pub const PASS_OFF: &str = "-C llvm-args=-arm-load-store-opt=false";

/// Whether the package's own configuration has the option: LLVM refuses it when it is given twice.
fn turns_pass_off(folder: &str) -> bool {
    let configuration = project().join(folder).join(".cargo/config.toml");
    std::fs::read_to_string(configuration).is_ok_and(|text| text.contains("-arm-load-store-opt=false"))
}

#[derive(Clone, Copy)]
enum Flavour {
    Gnu,
    Wasm,
}

/// The LLD of the compiler in use, else the system's.
fn linker(flavour: Flavour) -> Option<PathBuf> {
    let (word, system) = match flavour {
        Flavour::Gnu => ("gnu", "/usr/bin/ld.lld"),
        Flavour::Wasm => ("wasm", "/usr/bin/wasm-ld"),
    };
    let own = || {
        let root = output(Command::new("rustc").args(["--print", "sysroot"]))?;
        let version = output(Command::new("rustc").arg("-vV"))?;
        let host = version.lines().find_map(|line| line.strip_prefix("host: "))?;
        Some(Path::new(root.trim()).join("lib/rustlib").join(host).join("bin/rust-lld"))
    };
    let works = |linker: &PathBuf| output(Command::new(linker).args(["-flavor", word, "--version"])).is_some();
    own().filter(works).or_else(|| {
        let system = PathBuf::from(system);
        output(Command::new(&system).arg("--version")).map(|_| system)
    })
}

#[cfg(test)]
mod tests {
    use super::{Compiler, Kind, Source, turns_pass_off};
    use crate::targets::Target;

    #[test]
    fn products_are_sought_where_cargo_leaves_them() {
        let path = |target, kind, profile| {
            let path = Compiler { target, source: Source::Rustup }.artefact(kind, profile, "habitus-golden-c");
            path.components().rev().take(4).map(|part| part.as_os_str().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(
            path(Target::AArch64, Kind::StaticLibrary, "release"),
            ["libhabitus_golden_c.a", "release", "aarch64-unknown-linux-gnu", "aarch64"]
        );
        assert_eq!(
            path(Target::Wasm, Kind::SharedLibrary, "dev"),
            ["habitus_golden_c.wasm", "debug", "wasm32-unknown-unknown", "wasm"]
        );
        assert_eq!(path(Target::CortexM, Kind::Programs, "speed")[..2], ["habitus-golden-c", "speed"]);
    }

    #[test]
    fn the_option_against_the_fault_is_given_once() {
        assert!(turns_pass_off("examples/firmware"));
        assert!(!turns_pass_off("tests/golden-c"));
    }
}
