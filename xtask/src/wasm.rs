//! `cargo xtask wasm`: the module for browsers, its golden vectors and tests in Node.js, the assembled page, and the page in a headless Chromium.

use crate::compiler::{Build, Compiler, Kind};
use crate::figures::{Figures, printed_figures};
use crate::golden::{self, Cases, FOLDER, Interface, LIBRARY, Run, VECTORS};
use crate::process::{Result, ended, project, succeed, target_dir};
use crate::sizes::{self, Size};
use crate::targets::Target;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// That of the modules; the golden runner has one of the same name, so that `core` is built once for both.
const PROFILE: &str = "wasm";
/// What the page and its tests lie in.
const WEB: &str = "examples/web";
/// The model that the page starts with.
const MODEL: &str = "examples/firmware/models/face.hab";
/// Models of other kinds, for the wrapper's tests.
const BODY: &str = "examples/firmware/models/body.hab";
const WAVELET: &str = "examples/firmware/models/wavelet.hab";

/// A module: the same source for engines of different age.
struct Module {
    /// Its name for tables, and the folder of its build.
    title: &'static str,
    folder: &'static str,
    /// The file beside the page.
    file: &'static str,
    /// What the compiler may use.
    flags: &'static str,
}

/// The first instructions that every engine has; and vectors of 128 bits, which give the same bits in a quarter of the time and are in every
/// engine since 2023.
const MODULES: [Module; 2] = [
    Module {
        title: "JavaScript, wasm",
        folder: "wasm-plain",
        file: "habitus.wasm",
        flags: "-C target-cpu=mvp -C target-feature=+mutable-globals",
    },
    Module {
        title: "JavaScript, wasm SIMD",
        folder: "wasm-simd",
        file: "habitus-simd.wasm",
        flags: "-C target-feature=+simd128",
    },
];

/// Options of `cargo xtask wasm`.
#[derive(clap::Args)]
pub struct Options {
    /// Print the runs as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

/// Builds, runs, compares, assembles the page.
pub fn run(options: &Options) -> Result<()> {
    ready()?;
    let (known, made) = (Cases::read()?, made()?);
    if options.json {
        println!("{:#}", json!({"runs": golden::json_of(&made.runs, &known), "sizes": sizes::json_of(&made.sizes)}));
    } else {
        println!("{}\n\n{}", golden::table(&made.runs, &known), sizes::table(&made.sizes));
        println!("\nthe page: {}", page().join("index.html").display());
    }
    let wrong = made.runs.iter().flat_map(|run| run.objections(&known));
    let objections: Vec<String> = wrong.chain(made.objections).collect();
    if objections.is_empty() { Ok(()) } else { Err(objections.join("\n").into()) }
}

/// Fails when a tool is missing, before the first build.
pub fn ready() -> Result<()> {
    Compiler::installed(Target::Wasm)?;
    Target::Wasm.emulator()?;
    Ok(())
}

/// What the modules gave.
pub struct Made {
    /// The golden vectors.
    pub runs: Vec<Run>,
    /// What else is not as it should be.
    pub objections: Vec<String>,
    /// Each module, as it is and as a server sends it.
    pub sizes: Vec<Size>,
}

/// Builds the modules, runs vectors and tests in them, and assembles the page.
pub fn made() -> Result<Made> {
    let compiler = Compiler::installed(Target::Wasm)?;
    let (kernel, built) = builds(&compiler);
    let mut made = Made { runs: vec![kernel?], objections: Vec::new(), sizes: Vec::new() };
    let mut modules = Vec::new();
    for (module, path) in MODULES.iter().zip(built) {
        let path = path?;
        made.runs.push(wrapper_run(&compiler, module.title, &path)?);
        made.objections.extend(unit_tests(module.title, &path)?);
        made.sizes.extend(weighed(module, &path)?);
        modules.push(path);
    }
    assemble(&modules)?;
    Ok(made)
}

/// `cargo xtask web`: the assembled page in a headless Chromium.
pub fn web() -> Result<()> {
    if !page().join("bytes.js").is_file() {
        return Err(format!("{} is not assembled: run `cargo xtask wasm` first", page().display()).into());
    }
    let shots = page().with_file_name("web-shots");
    let ended = ended(node("page.mjs")?.arg(page()).arg(&shots), Duration::from_secs(900))?;
    print!("{}", ended.text);
    let checks = printed_figures(&ended.text).get("checks").copied().unwrap_or(0);
    match ended.failure {
        Some(how) => Err(format!("the page fails ({how}); its pictures are in {}", shots.display()).into()),
        None if checks < 60 => Err(format!("only {checks} checks were made").into()),
        None => Ok(()),
    }
}

/// The folder of the assembled page.
fn page() -> PathBuf {
    target_dir("web")
}

/// Node.js with a script of the page's tests.
fn node(script: &str) -> Result<Command> {
    let mut command = Target::Wasm.emulator()?;
    command.arg(project().join(WEB).join("tests").join(script));
    Ok(command)
}

/// Everything that is compiled, at the same time: a build uses one core most of the time.
fn builds(compiler: &Compiler) -> (Result<Run>, [Result<PathBuf>; 2]) {
    std::thread::scope(|scope| {
        let modules = MODULES.each_ref().map(|module| scope.spawn(|| built(compiler, module)));
        let kernel = scope.spawn(|| kernel_run(compiler));
        let panicked = || String::from("a build panicked").into();
        let modules = modules.map(|build| build.join().unwrap_or_else(|_| Err(panicked())));
        (kernel.join().unwrap_or_else(|_| Err(panicked())), modules)
    })
}

/// The kernel itself in the module of the golden runner.
fn kernel_run(compiler: &Compiler) -> Result<Run> {
    let module = module_of(compiler, FOLDER, LIBRARY, &MODULES[0], &[])?;
    let script = project().join(FOLDER).join("run.mjs");
    let ended = ended(Target::Wasm.emulator()?.arg(script).arg(module), Duration::from_secs(300))?;
    Ok(Run::new("Rust, wasm", Interface::Rust, compiler.version(), Target::Wasm.emulator_version()?, &ended))
}

/// The C interface as a module.
fn built(compiler: &Compiler, module: &Module) -> Result<PathBuf> {
    module_of(compiler, "ffi", "habitus-ffi", module, &["--no-default-features"])
}

/// The library of a package, built as a module is.
fn module_of(compiler: &Compiler, folder: &str, library: &str, module: &Module, options: &[&str]) -> Result<PathBuf> {
    let (kind, build_folder) = (Kind::SharedLibrary, target_dir(module.folder));
    let mut build = compiler.build(&Build { folder, profile: PROFILE, features: "", kind });
    build.args(options).env("CARGO_TARGET_DIR", &build_folder);
    build.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS", module.flags);
    succeed(&mut build)?;
    Ok(compiler.artefact_below(&build_folder, kind, PROFILE, library))
}

fn wrapper_run(compiler: &Compiler, title: &'static str, module: &Path) -> Result<Run> {
    let vectors = project().join(VECTORS);
    let ended = ended(node("golden.mjs")?.arg(module).arg(vectors), Duration::from_secs(300))?;
    Ok(Run::new(title, Interface::JavaScript, compiler.version(), Target::Wasm.emulator_version()?, &ended))
}

/// What the wrapper's own tests object to.
fn unit_tests(title: &str, module: &Path) -> Result<Option<String>> {
    let ended = {
        let mut command = node("wrapper.mjs")?;
        ended(
            command.arg(module).args([MODEL, BODY, WAVELET].map(|path| project().join(path))),
            Duration::from_secs(300),
        )?
    };
    let count = |name: &str| {
        let line = ended.text.lines().find_map(|line| line.strip_prefix(name));
        line.and_then(|count| count.trim().parse::<u64>().ok()).unwrap_or(0)
    };
    let (tests, passed) = (count("# tests"), count("# pass"));
    let good = ended.failure.is_none() && tests >= 18 && passed == tests;
    Ok((!good).then(|| format!("{title}: {passed} of {tests} tests of habitus.js passed\n{}", ended.text)))
}

/// Size of a module, as it is and as a server sends it.
fn weighed(module: &Module, path: &Path) -> Result<[Size; 2]> {
    let script = "const bytes = require('fs').readFileSync(process.argv[1]); console.log('@bytes ' + bytes.length); \
                  console.log('@gzip_bytes ' + require('zlib').gzipSync(bytes, { level: 9 }).length)";
    let ended = ended(Target::Wasm.emulator()?.args(["-e", script]).arg(path), Duration::from_secs(60))?;
    let figures: Figures = printed_figures(&ended.text);
    let figure = |name: &str| figures.get(name).copied().ok_or_else(|| format!("no size of {}", path.display()));
    let file = module.file;
    Ok([(file.to_owned(), figure("bytes")?), (format!("{file}, as gzip sends it"), figure("gzip_bytes")?)])
}

/// Puts the page together.
fn assemble(modules: &[PathBuf]) -> Result<()> {
    let mut command = Target::Wasm.emulator()?;
    command.arg(project().join(WEB).join("assemble.mjs")).arg(page()).arg(project().join(MODEL)).args(modules);
    succeed(&mut command)
}
