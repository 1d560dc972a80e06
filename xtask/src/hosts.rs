//! `cargo xtask hosts`: the libraries for C and C++ as their users meet them.
//!
//! Installs into a fresh folder and moves it; builds the examples from there by CMake and by pkg-config, with the shared and with the static library;
//! compares what they print and write; runs them and the programs of tests/hosts under sanitizers and Valgrind; prints the misuse table.

use crate::c_library::{self, Libraries, TARGET};
use crate::c_program::{Language, SANITIZERS, WARNINGS, accepted, compiled, printed, tool, under_valgrind};
use crate::example_output::{self, Example};
use crate::header::layout_entries;
use crate::install::installed;
use crate::process::{Failure, Result, cargo_in, project, succeed, target_dir};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::time::Instant;

/// The models that the programs open: a face, a body, and a wavelet model.
const MODEL: &str = "examples/firmware/models/face.hab";
const BODY: &str = "examples/firmware/models/body.hab";
const WAVELET: &str = "examples/firmware/models/wavelet.hab";

/// Options of `cargo xtask hosts`.
#[derive(clap::Args)]
pub struct Options {
    /// Print checks, sizes and misuse table as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

/// Where everything is.
struct Place {
    prefix: PathBuf,
    /// For builds; empty at first.
    scratch: PathBuf,
    /// A static library with the list of Rust's layout.
    layout_library: PathBuf,
    model: PathBuf,
    body: PathBuf,
    wavelet: PathBuf,
}

/// Says what it found in a few words.
type Finding = Box<dyn Fn(&Place) -> Result<String> + Send + Sync>;
/// A finding and its name.
type Check = (String, Finding);

/// Installs, builds, runs, prints.
pub fn run(options: &Options) -> Result<()> {
    for (name, package) in
        [("cmake", "cmake"), ("make", "make"), ("pkg-config", "pkg-config"), ("valgrind", "valgrind"), ("c++", "g++")]
    {
        tool(name, package)?;
    }
    let libraries = c_library::built("library")?;
    let place = placed(&libraries)?;
    let checks = checks();
    let start = Instant::now();
    let results = all_run(&checks, &place);
    let mut rows = Vec::new();
    for ((name, _), result) in checks.iter().zip(results) {
        let found = result
            .map_err(|Failure { sentence, status }| Failure { sentence: format!("{name}: {sentence}"), status })?;
        rows.push((name.as_str(), found));
    }
    for (folder, name) in [
        ("c", "examples/c, face, every build"),
        ("cpp", "examples/cpp, face, every build"),
        ("body", "examples/c and cpp, body, every build"),
        ("wavelet", "examples/c and cpp, wavelet, every build"),
    ] {
        rows.push((name, format!("{} meshes of the same bytes", same_meshes(&place, folder)?)));
    }
    let misuse = printed(Command::new(place.scratch.join("misuse")).args([&place.model, &place.body, &place.wavelet]))?;
    let size = |path: &Path| std::fs::metadata(path).map_or(0, |data| data.len());
    let sizes =
        [("shared library", size(&libraries.shared_library)), ("static library", size(&libraries.static_library))];
    if options.json {
        let rows: Vec<_> = rows.iter().map(|(check, found)| json!({ "check": check, "found": found })).collect();
        let misuse: Vec<Vec<_>> =
            table(&misuse).skip(2).map(|row| row.trim_matches('|').split('|').map(str::trim).collect()).collect();
        let sizes: serde_json::Map<_, _> =
            sizes.iter().map(|(name, bytes)| ((*name).to_owned(), json!(bytes))).collect();
        println!("{:#}", json!({ "checks": rows, "misuse": misuse, "bytes": sizes }));
        return Ok(());
    }
    println!("{misuse}");
    println!("| check | found |\n|---|---|");
    rows.iter().for_each(|(check, found)| println!("| {check} | {found} |"));
    println!("\n| library | bytes |\n|---|---|");
    sizes.iter().for_each(|(name, bytes)| println!("| {name} | {bytes} |"));
    println!("{} checks in {:.0} s after the build of the library", rows.len(), start.elapsed().as_secs_f32());
    Ok(())
}

fn table(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| line.starts_with('|'))
}

/// A fresh prefix, moved after the installation; the library with the layout; an empty folder for programs.
fn placed(libraries: &Libraries) -> Result<Place> {
    let folder = target_dir(TARGET).join("check");
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    if folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(failed)?;
    }
    let (first, prefix, scratch) = (folder.join("first"), folder.join("moved/prefix"), folder.join("build"));
    std::fs::create_dir_all(&scratch).map_err(failed)?;
    std::fs::create_dir_all(folder.join("moved")).map_err(failed)?;
    let paths = installed(libraries, &first)?;
    std::fs::rename(&first, &prefix).map_err(failed)?;
    for path in paths {
        let path = path.strip_prefix(&first).map_or_else(|_| path.clone(), |inside| prefix.join(inside));
        let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        for named in [&*first.to_string_lossy(), &*project().to_string_lossy()] {
            if bytes.windows(named.len()).any(|window| window == named.as_bytes()) {
                return Err(format!("{} contains the path {named}: it cannot be moved", path.display()).into());
            }
        }
    }
    succeed(&mut cargo_in(
        "ffi",
        TARGET,
        &["rustc", "--quiet", "--lib", "--crate-type", "staticlib", "--features", "layout"],
    ))?;
    let layout_library = target_dir(TARGET).join("debug/libhabitus_ffi.a");
    layout_entries(&scratch)?;
    for folder in ["c", "cpp", "body", "wavelet"] {
        std::fs::create_dir_all(scratch.join("meshes").join(folder)).map_err(failed)?;
    }
    Ok(Place {
        prefix,
        scratch,
        layout_library,
        model: project().join(MODEL),
        body: project().join(BODY),
        wavelet: project().join(WAVELET),
    })
}

/// Two at a time, in order; a failed one does not stop the others.
fn all_run(checks: &[Check], place: &Place) -> Vec<Result<String>> {
    let next = Mutex::new(checks.iter().enumerate());
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let taken = next.lock().ok().and_then(|mut next| next.next());
                    let Some((number, (_, check))) = taken else { break };
                    let result = check(place);
                    if let Ok(mut results) = results.lock() {
                        results.push((number, result));
                    }
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap_or_default();
    results.sort_by_key(|(number, _)| *number);
    results.into_iter().map(|(_, result)| result).collect()
}

fn checks() -> Vec<Check> {
    let mut checks: Vec<Check> = Vec::new();
    let mut add = |name: &str, check: Finding| checks.push((name.to_owned(), check));
    add("headers alone", Box::new(headers_alone));
    for example in [Example::C, Example::Cpp] {
        for (kind, linked) in [("shared", false), ("static", true)] {
            let name = format!("examples/{}, {kind} library", example.folder());
            add(&format!("{name}, CMake"), Box::new(move |place| by_cmake(place, example, linked)));
            add(&format!("{name}, pkg-config"), Box::new(move |place| by_make(place, example, linked)));
        }
        let name = format!("examples/{}", example.folder());
        add(&format!("{name}, sanitizers"), Box::new(move |place| example_sanitized(place, example)));
        add(&format!("{name}, Valgrind"), Box::new(move |place| example_in_valgrind(place, example)));
    }
    for language in [Language::C99, Language::Cpp17] {
        let name = if language == Language::C99 { "README.md, C" } else { "README.md, C++" };
        add(name, Box::new(move |place| readme(place, language)));
    }
    add("tests/hosts/layout.c", Box::new(layout));
    add("tests/hosts/misuse.c", Box::new(|place| host(place, "misuse", Language::C99, &["-O2"], false)));
    add("tests/hosts/misuse.c, sanitizers", Box::new(|place| host(place, "misuse", Language::C99, &SANITIZERS, false)));
    add("tests/hosts/misuse.c, Valgrind", Box::new(|place| host(place, "misuse", Language::C99, &["-g"], true)));
    add("tests/hosts/wrapper.cpp", Box::new(|place| host(place, "wrapper", Language::Cpp17, &["-O2"], false)));
    add("tests/hosts/wrapper.cpp, C++20", Box::new(|place| host(place, "wrapper", Language::Cpp20, &["-O1"], false)));
    add(
        "tests/hosts/wrapper.cpp, no exceptions, no RTTI",
        Box::new(|place| host(place, "wrapper", Language::Cpp17, &["-fno-exceptions", "-fno-rtti"], false)),
    );
    add(
        "tests/hosts/wrapper.cpp, sanitizers",
        Box::new(|place| host(place, "wrapper", Language::Cpp17, &SANITIZERS, false)),
    );
    add("tests/hosts/exceptions.cpp, with and without in one program", Box::new(mixed_exceptions));
    add("tests/hosts/wrapper.cpp, Valgrind", Box::new(|place| host(place, "wrapper", Language::Cpp17, &["-g"], true)));
    checks
}

/// Each header as the whole of a program.
fn headers_alone(place: &Place) -> Result<String> {
    let include = format!("-I{}", place.prefix.join("include").display());
    let quiet: [&[&str]; 2] = [&[], &["-fno-exceptions", "-fno-rtti"]];
    let mut count = 0;
    for (header, languages) in [
        ("habitus.h", &[Language::C99, Language::Cpp17, Language::Cpp20][..]),
        ("habitus.hpp", &[Language::Cpp17, Language::Cpp20]),
    ] {
        for &language in languages {
            let suffix = if language == Language::C99 { "c" } else { "cpp" };
            let source = place.scratch.join(format!("{header}.{suffix}"));
            std::fs::write(&source, format!("#include <{header}>\n"))
                .map_err(|error| format!("{}: {error}", source.display()))?;
            for flags in quiet.iter().take(if language == Language::C99 { 1 } else { 2 }) {
                accepted(language, &[&[include.as_str()], *flags].concat(), &source)?;
                count += 1;
            }
        }
    }
    Ok(format!("{count} compilations, no warning"))
}

fn by_cmake(place: &Place, example: Example, linked: bool) -> Result<String> {
    let build = place.scratch.join(format!("cmake-{}-{linked}", example.folder()));
    let flags = format!("-DCMAKE_{}_FLAGS={}", example.cmake_language(), WARNINGS.join(" "));
    let mut configure = Command::new("cmake");
    configure.args(["-Wno-dev", "--log-level=ERROR", "-DCMAKE_BUILD_TYPE=Release"]).arg(flags);
    configure.arg(format!("-DCMAKE_PREFIX_PATH={}", place.prefix.display()));
    configure.arg(format!("-DSTATIC={}", if linked { "ON" } else { "OFF" }));
    printed(configure.arg("-S").arg(example.source_folder()).arg("-B").arg(&build))?;
    printed(Command::new("cmake").arg("--build").arg(&build))?;
    let way = if linked { "cmake-static" } else { "cmake-shared" };
    example_run(place, example, way, |program| Ok(Command::new(build.join(program))))
}

fn by_make(place: &Place, example: Example, linked: bool) -> Result<String> {
    let build = place.scratch.join(format!("make-{}-{linked}", example.folder()));
    std::fs::create_dir_all(&build).map_err(|error| format!("{}: {error}", build.display()))?;
    let source = example.source_folder();
    let mut make = Command::new("make");
    make.current_dir(&build).arg("-f").arg(source.join("Makefile")).arg(format!("VPATH={}", source.display()));
    make.arg(format!("{}=-O2 {}", example.flags_variable(), WARNINGS.join(" ")));
    make.env("PKG_CONFIG_PATH", place.prefix.join("lib/pkgconfig"));
    if linked {
        make.arg("STATIC=1");
    }
    printed(&mut make)?;
    let way = if linked { "make-static" } else { "make-shared" };
    example_run(place, example, way, |program| Ok(Command::new(build.join(program))))
}

fn example_sanitized(place: &Place, example: Example) -> Result<String> {
    example_run(place, example, "sanitized", |program| {
        Ok(Command::new(example_compiled(place, example, program, "sanitized", &SANITIZERS)?))
    })
}

fn example_in_valgrind(place: &Place, example: Example) -> Result<String> {
    example_run(place, example, "valgrind", |program| {
        Ok(under_valgrind(&example_compiled(place, example, program, "valgrind", &["-g", "-O1"])?))
    })
}

fn example_compiled(place: &Place, example: Example, program: &str, way: &str, flags: &[&str]) -> Result<PathBuf> {
    let compiled_to = place.scratch.join(format!("{program}-{}-{way}", example.folder()));
    compiled(example.language(), &example.source(program), &with_library(place, flags), &compiled_to)
}

/// Flags with the installed header and static library.
fn with_library(place: &Place, flags: &[&str]) -> Vec<String> {
    let include = format!("-I{}", place.prefix.join("include").display());
    let library = place.prefix.join("lib/libhabitus.a").display().to_string();
    flags.iter().map(|flag| (*flag).to_owned()).chain([include, library]).collect()
}

/// Runs the programs of an example; their meshes go to the folders where [`same_meshes`] looks. Those of the body and the wavelet model are the same in both languages.
fn example_run(
    place: &Place,
    example: Example,
    way: &str,
    command: impl Fn(&str) -> Result<Command>,
) -> Result<String> {
    let ran = |program: &str, model: &Path, obj: &Path| -> Result<(String, String)> {
        let text = printed(command(program)?.arg(model).arg(obj))?;
        let obj = std::fs::read_to_string(obj).map_err(|error| format!("{}: {error}", obj.display()))?;
        Ok((text, obj))
    };
    let (text, obj) = ran("face", &place.model, &meshes(place, example.folder()).join(format!("{way}.obj")))?;
    let face = example_output::found(example, &text, &obj).map_err(|fault| format!("{fault}\n{text}"))?;
    let mesh = meshes(place, "body").join(format!("{}-{way}.obj", example.folder()));
    let (text, obj) = ran("body", &place.body, &mesh)?;
    let body = example_output::body(example, &text, &obj).map_err(|fault| format!("{fault}\n{text}"))?;
    let mesh = meshes(place, "wavelet").join(format!("{}-{way}.obj", example.folder()));
    let (text, obj) = ran("wavelet", &place.wavelet, &mesh)?;
    let wavelet = example_output::wavelet(&text, &obj).map_err(|fault| format!("{fault}\n{text}"))?;
    Ok(format!("{face}; {body}; {wavelet}"))
}

fn meshes(place: &Place, folder: &str) -> PathBuf {
    place.scratch.join("meshes").join(folder)
}

/// Fails unless a program wrote the same bytes whichever way it was built; returns the number of meshes.
fn same_meshes(place: &Place, folder: &str) -> Result<usize> {
    let folder = meshes(place, folder);
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    let mut all = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        all.push(std::fs::read(entry.map_err(failed)?.path()).map_err(failed)?);
    }
    if all.windows(2).any(|pair| pair[0] != pair[1]) {
        return Err(format!("the meshes in {} differ", folder.display()).into());
    }
    Ok(all.len())
}

/// A program of tests/hosts with the static library; its last line is what it found.
fn host(place: &Place, name: &str, language: Language, flags: &[&str], valgrind: bool) -> Result<String> {
    let suffix = if language == Language::C99 { "c" } else { "cpp" };
    let source = project().join(format!("tests/hosts/{name}.{suffix}"));
    // The plain one keeps its name: its output is shown.
    let way = if flags == ["-O2"] { String::new() } else { flags.concat().replace([',', '='], "") };
    let program =
        compiled(language, &source, &with_library(place, flags), &place.scratch.join(format!("{name}{way}")))?;
    let mut command = if valgrind { under_valgrind(&program) } else { Command::new(&program) };
    let text = printed(command.args([&place.model, &place.body, &place.wavelet]))?;
    Ok(text.lines().last().unwrap_or_default().to_owned())
}

/// One source, compiled with and without exceptions, linked in either order; the first definition of a function is the one that stays.
fn mixed_exceptions(place: &Place) -> Result<String> {
    let source = project().join("tests/hosts/exceptions.cpp");
    let include = format!("-I{}", place.prefix.join("include").display());
    let object = |name: &str, flags: &[&str]| {
        let inputs: Vec<_> = [&[include.as_str(), "-c"], flags].concat().into_iter().map(str::to_owned).collect();
        compiled(Language::Cpp17, &source, &inputs, &place.scratch.join(name))
    };
    let (with, without) = (object("exceptions-on.o", &[])?, object("exceptions-off.o", &["-fno-exceptions"])?);
    let mut found = String::new();
    for (first, second, name) in [(&with, &without, "exceptions-first"), (&without, &with, "exceptions-last")] {
        let second = second.display().to_string();
        let inputs = with_library(place, &[second.as_str()]);
        let program = compiled(Language::Cpp17, first, &inputs, &place.scratch.join(name))?;
        found = printed(&mut Command::new(program))?;
    }
    Ok(format!("{}, in both orders", found.trim()))
}

/// The program of the README in a language; its last line is what it found.
fn readme(place: &Place, language: Language) -> Result<String> {
    let fence = if language == Language::C99 { "c" } else { "cpp" };
    let text = std::fs::read_to_string(project().join("README.md")).map_err(|error| format!("README.md: {error}"))?;
    let behind = text.split_once(&format!("\n```{fence}\n")).map(|(_, behind)| behind);
    let program = behind.and_then(|behind| behind.split_once("\n```\n")).map(|(program, _)| program);
    let program = program.ok_or_else(|| format!("README.md has no block ```{fence}"))?;
    let source = place.scratch.join(format!("readme.{fence}"));
    std::fs::write(&source, format!("{program}\n")).map_err(|error| format!("{}: {error}", source.display()))?;
    let program =
        compiled(language, &source, &with_library(place, &SANITIZERS), &place.scratch.join(format!("readme-{fence}")))?;
    Ok(printed(Command::new(program).arg(&place.model))?.trim().to_owned())
}

fn layout(place: &Place) -> Result<String> {
    let include = [format!("-I{}", place.prefix.join("include").display()), format!("-I{}", place.scratch.display())];
    let library = place.layout_library.display().to_string();
    // This library is Rust's own, with the standard library and what that needs.
    let inputs = include
        .into_iter()
        .chain([library])
        .chain(["-lgcc_s", "-lpthread", "-ldl"].map(str::to_owned))
        .collect::<Vec<_>>();
    let source = project().join("tests/hosts/layout.c");
    let program = compiled(Language::C99, &source, &inputs, &place.scratch.join("layout"))?;
    Ok(printed(&mut Command::new(program))?.trim().to_owned())
}
