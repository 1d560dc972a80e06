//! The golden vectors through the C and the C++ interface: the runners of tests/hosts, on this machine and on others.

use crate::compiler::{Build, Compiler, Kind};
use crate::fused::fused_multiply_adds_of_archive;
use crate::golden::{Interface, Run, VECTORS};
use crate::no_panic::MEMORY_FUNCTIONS;
use crate::process::{Result, cargo, ended, output, project, succeed, target_dir};
use crate::targets::{Target, number};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// The package with the C interface.
pub const CRATE: &str = "ffi";
/// Its name.
pub const LIBRARY: &str = "habitus-ffi";
/// The profile of what hosts link; the one of `cargo xtask install`.
pub const PROFILE: &str = "library";
const SOURCES: &str = "tests/hosts";
/// What both runners share.
const COMMON: [&str; 4] = ["text.c", "case.c", "runner.c", "main.c"];
const WARNINGS: [&str; 5] = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-O2"];

/// The folder of this machine's libraries.
fn libraries() -> PathBuf {
    target_dir("").join(PROFILE)
}

/// Builds the libraries for this machine; returns the shared one.
pub fn shared_library() -> Result<PathBuf> {
    succeed(&mut cargo(&[
        "rustc",
        "--package",
        LIBRARY,
        "--lib",
        "--crate-type",
        "cdylib,staticlib",
        "--profile",
        PROFILE,
    ]))?;
    Ok(libraries().join("libhabitus_ffi.so"))
}

/// C with the static and with the shared library, and C++.
pub fn native_runs() -> Result<Vec<Run>> {
    let shared = shared_library()?;
    let library = libraries().join("libhabitus_ffi.a");
    let search = format!("-Wl,-rpath,{}", libraries().display());
    let ways = [
        ("C, static library", Language::C, &library, "-lm"),
        ("C, shared library", Language::C, &shared, search.as_str()),
        ("C++", Language::Cpp, &library, "-lm"),
    ];
    ways.into_iter()
        .map(|(way, language, library, option)| {
            let program = libraries().join(format!("vectors-{}", way.replace([' ', ','], "")));
            build(&|| Ok(Command::new("cc")), language, library, &[option], &program)?;
            let ended = ended(Command::new(&program).arg(project().join(VECTORS)), Duration::from_secs(120))?;
            Ok(Run::new(way, Interface::C, version(language.compiler()), String::new(), &ended))
        })
        .collect()
}

/// C on another target, linked without shared libraries, in its emulator.
pub fn emulated_run(target: Target) -> Result<Run> {
    let compiler = Compiler::installed(target)?;
    let kind = Kind::StaticLibrary;
    let build_options = Build { folder: CRATE, profile: PROFILE, features: "", kind };
    succeed(compiler.build(&build_options).arg("--no-default-features"))?;
    let library = compiler.artefact(kind, PROFILE, LIBRARY);
    refuse_fused(&library, LIBRARY, |_| false)?;
    let program = library.with_file_name("vectors-c");
    build(&|| target.c_compiler(), Language::C, &library, &["-static"], &program)?;
    let vectors = project().join(VECTORS);
    let ended = ended(target.emulator()?.arg(&program).arg(vectors), Duration::from_secs(300))?;
    let c = target.c_compiler()?.get_program().to_string_lossy().into_owned();
    let way = format!("C, {}", target.title());
    Ok(Run::new(&way, Interface::C, version(&c), target.emulator_version()?, &ended))
}

/// Fails when the library's own objects contain a fused multiply-add. They may refer to functions of C that calculate nothing, and to what
/// `own` accepts.
pub fn refuse_fused(path: &Path, library: &str, own: fn(&str) -> bool) -> Result<()> {
    let failed = |error: String| format!("{}: {error}", path.display());
    let bytes = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
    let allowed = |symbol: &str| MEMORY_FUNCTIONS.contains(&symbol) || own(symbol);
    match fused_multiply_adds_of_archive(&bytes, &library.replace('-', "_"), &allowed).map_err(failed)? {
        0 => Ok(()),
        count => Err(failed(format!("{count} fused multiply-adds: its results differ from other targets'")).into()),
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Language {
    C,
    Cpp,
}

impl Language {
    fn compiler(self) -> &'static str {
        match self {
            Language::C => "cc",
            Language::Cpp => "c++",
        }
    }
}

/// Compiles the runner and links it.
fn build(
    c: &dyn Fn() -> Result<Command>,
    language: Language,
    library: &Path,
    options: &[&str],
    program: &Path,
) -> Result<()> {
    let (sources, include) = (project().join(SOURCES), project().join("include"));
    // Neither compiler may fuse what a program calculates for itself.
    let compiled = |mut command: Command, standard: &str| {
        command.arg(format!("-std={standard}")).args(WARNINGS).arg("-ffp-contract=off").arg("-I").arg(&include);
        command
    };
    let link = if language == Language::C {
        let mut command = compiled(c()?, "c99");
        command.args(COMMON.map(|name| sources.join(name))).arg(sources.join("vectors.c"));
        command
    } else {
        let mut command = compiled(Command::new(language.compiler()), "c++17");
        command.arg(sources.join("vectors.cpp"));
        for name in COMMON {
            let object = program.with_file_name(format!("vectors-{name}.o"));
            succeed(compiled(c()?, "c99").arg("-c").arg(sources.join(name)).arg("-o").arg(&object))?;
            command.arg(object);
        }
        command
    };
    let mut link = link;
    succeed(link.arg(library).args(options).arg("-o").arg(program))
}

/// Name and version of a compiler for C or C++.
fn version(compiler: &str) -> String {
    let text = output(Command::new(compiler).arg("--version")).unwrap_or_default();
    let name =
        if text.contains("clang") { "clang" } else { compiler.trim_start_matches("cc").trim_start_matches("c++") };
    let name = match (name, compiler) {
        ("", "c++") => "g++",
        ("", _) => "gcc",
        (name, _) => name,
    };
    format!("{name} {}", number(text.lines().next().unwrap_or_default()))
}
