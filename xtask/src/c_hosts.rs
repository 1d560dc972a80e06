//! The golden vectors through the C and the C++ interface: the runners of tests/hosts, on this machine and on others.

use crate::c_library::{self, Libraries};
use crate::c_program::{Language, WARNINGS};
use crate::compiler::{Build, Compiler, Kind};
use crate::cross::Optimised;
use crate::fused::fused_multiply_adds_of_archive;
use crate::golden::{Interface, Run, VECTORS};
use crate::install::installed;
use crate::no_panic::MEMORY_FUNCTIONS;
use crate::process::{Result, ended, output, project, succeed, target_dir};
use crate::targets::Target;
use std::path::Path;
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

/// C with the static and with the shared library, and C++, from a folder that the libraries are installed to.
pub fn native_runs(libraries: &Libraries) -> Result<Vec<Run>> {
    let prefix = target_dir(c_library::TARGET).join("vectors");
    installed(libraries, &prefix)?;
    let (folder, library) = (prefix.join("lib"), prefix.join("lib/libhabitus.a"));
    let shared = folder.join(Libraries::LINK_NAME);
    let search = format!("-Wl,-rpath,{}", folder.display());
    let ways = [
        ("C, static library", Language::C99, &library, "-lm", "static-c"),
        ("C, shared library", Language::C99, &shared, search.as_str(), "shared-c"),
        ("C++", Language::Cpp17, &library, "-lm", "static-cpp"),
    ];
    ways.into_iter()
        .map(|(way, language, library, option, name)| {
            let program = prefix.join(name);
            build(&|| Ok(Language::C99.compiler()), language, library, &[option], &program)?;
            let ended = ended(Command::new(&program).arg(project().join(VECTORS)), Duration::from_secs(120))?;
            let compiler = version(&language.compiler());
            Ok(Run::new(way, Interface::C, compiler, String::new(), &ended))
        })
        .collect()
}

/// C on another target, linked without shared libraries, in its emulator.
pub fn emulated_run(target: Target, optimised: Optimised) -> Result<Run> {
    let compiler = Compiler::installed(target)?;
    let kind = Kind::StaticLibrary;
    let build_options = Build { folder: CRATE, profile: PROFILE, features: "", kind };
    let mut command = compiler.build(&build_options);
    optimised.set(&mut command);
    succeed(command.arg("--no-default-features"))?;
    let library = compiler.artefact(kind, PROFILE, LIBRARY);
    refuse_fused(&library, LIBRARY, |_| false)?;
    let program = library.with_file_name("vectors-c");
    let c = || {
        let mut command = target.c_compiler()?;
        command.arg("-std=c99");
        Ok(command)
    };
    build(&c, Language::C99, &library, &["-static"], &program)?;
    let vectors = project().join(VECTORS);
    let ended = ended(target.emulator()?.arg(&program).arg(vectors), Duration::from_secs(300))?;
    let way = format!("C, {}", target.title());
    Ok(Run::new(&way, Interface::C, version(&target.c_compiler()?), target.emulator_version()?, &ended))
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
    let compiled = |mut command: Command| {
        command.args(WARNINGS).args(["-O2", "-ffp-contract=off"]).arg("-I").arg(&include);
        command
    };
    let mut objects = Vec::new();
    for name in COMMON {
        let object = program.with_extension(format!("{name}.o"));
        succeed(compiled(c()?).arg("-c").arg(sources.join(name)).arg("-o").arg(&object))?;
        objects.push(object);
    }
    let (mut link, source) = match language {
        Language::C99 => (compiled(c()?), "vectors.c"),
        Language::Cpp17 | Language::Cpp20 => (compiled(language.compiler()), "vectors.cpp"),
    };
    succeed(link.arg(sources.join(source)).args(objects).arg(library).args(options).arg("-o").arg(program))
}

/// Name and version of a compiler for C or C++.
fn version(compiler: &Command) -> String {
    let program = compiler.get_program();
    let text = output(Command::new(program).arg("--version")).unwrap_or_default();
    let name = Path::new(program).file_name().unwrap_or(program).to_string_lossy();
    let name = match &*name {
        _ if text.contains("clang") => "clang",
        "cc" => "gcc",
        "c++" => "g++",
        name => name,
    };
    // GCC's; what a distribution adds to the first line is no part of it.
    let full = output(Command::new(program).args(["-dumpfullversion", "-dumpversion"])).unwrap_or_default();
    format!("{name} {}", full.trim())
}
