//! `cargo xtask firmware`: the programs of examples/firmware and examples/firmware-c on an emulated Cortex-M4F and M7, measured.
//!
//! Linking proves that no panic path and no allocation is left, and that 64 KiB of memory suffice. Stack is the high-water mark of painted
//! memory, code what a program has more than the empty one.

use crate::boards::Board;
use crate::budgets::Budgets;
use crate::c_hosts;
use crate::compiler::{Build, Compiler, Kind};
use crate::figures::{COUNT, Figures, printed_figures, printed_text};
use crate::fused::fused_multiply_adds;
use crate::golden::{Interface, Run};
use crate::process::{Ended, Result, cargo, ended, output, project, succeed, target_dir};
use crate::side_by_side::{each, processors};
use crate::targets::{Target, number};
use object::{Object, ObjectSection, ObjectSymbol};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

const FOLDER: &str = "examples/firmware";
/// The program whose code the others' is counted from.
const EMPTY: &str = "empty";
/// The program that runs the golden vectors.
const GOLDEN: &str = "vectors";
/// The program that counts instructions.
const COUNTS: &str = "counts";
/// The program with the developer's models.
const LARGE: &str = "large";
/// The same programs in C.
const C_FOLDER: &str = "examples/firmware-c";
/// The profile of the library that they link.
const C_PROFILE: &str = "small";
const C: &str = "c";
/// In Rust optimised for size and for speed, and in C for size.
const PROFILES: [&str; 3] = ["release", SPEED, C];
/// The one that only [`nightly`](crate::nightly) builds among the vectors: it doubles the time of the others.
pub const SPEED: &str = "speed";

/// Options of `cargo xtask firmware`.
#[derive(clap::Args)]
pub struct Options {
    /// Print the figures as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
    /// Only this build profile: release (for size), speed, or c (the programs in C).
    #[arg(long, value_parser = PROFILES)]
    profile: Option<String>,
}

/// One program as built with one profile and run on one board.
pub struct Row {
    profile: &'static str,
    board: Board,
    program: String,
    /// What it printed.
    printed: String,
    figures: Figures,
}

/// Builds, runs, measures, compares.
pub fn run(options: &Options) -> Result<()> {
    ready()?;
    let rows = rows(|profile| options.profile.as_deref().is_none_or(|only| only == profile))?;
    if options.json {
        println!("{}", json(&rows));
    } else {
        for row in &rows {
            println!("{} ({}, {})", row.program, row.profile, row.board.processor());
            printed_text(&row.printed).for_each(|line| println!("  {line}"));
        }
        println!("\n{}", table(&rows));
    }
    let objections = objections(&rows)?;
    if objections.is_empty() { Ok(()) } else { Err(objections.join("\n").into()) }
}

/// Fails when a tool is missing, before the first build.
pub fn ready() -> Result<()> {
    Compiler::installed(Target::CortexM)?;
    Target::CortexM.c_compiler()?;
    Target::CortexM.emulator()?;
    Ok(())
}

/// Every program, those in C included, as built with each of the wanted profiles.
pub fn rows(wanted: impl Fn(&str) -> bool) -> Result<Vec<Row>> {
    let compiler = Compiler::installed(Target::CortexM)?;
    let profiles: Vec<_> = PROFILES.into_iter().filter(|name| wanted(name)).collect();
    let models = if profiles == [C] { None } else { models()? };
    // What is compiled for one board serves the other, so a profile is one row of builds; the programs in C come after their library.
    let built: Vec<Result<Vec<(Board, PathBuf)>>> = each(&profiles, processors(), |profile| match *profile {
        C => {
            let library = built_library(&compiler)?;
            Board::ALL.into_iter().map(|board| Ok((board, built_c_programs(&library, board)?))).collect()
        }
        profile => {
            let build = |board| Ok((board, built_programs(&compiler, profile, board, models.as_deref())?));
            Board::ALL.into_iter().map(build).collect()
        }
    })?;
    let mut programs = Vec::new();
    for (profile, folders) in profiles.iter().zip(built) {
        for (board, folder) in folders? {
            let base = linked(&folder.join(EMPTY), board, false)?;
            for program in names(profile, models.is_some())? {
                let wide = program == GOLDEN;
                // A program that holds no model is the same on every board, and this one takes minutes to build.
                let path = match board {
                    Board::An500 if wide && *profile != C => folder_of(profile, Board::An386).join(&program),
                    _ => folder.join(&program),
                };
                let code = linked(&path, board, wide)?.saturating_sub(base);
                programs.push((*profile, board, program, path, code));
            }
        }
    }
    // What a program counts does not depend on what runs beside it.
    let run = |(profile, board, program, path, code): &(&'static str, Board, String, PathBuf, u64)| {
        let printed = printed(path, *board)?;
        let mut figures = printed_figures(&printed);
        figures.insert(String::from("code"), *code);
        Ok(Row { profile, board: *board, program: program.clone(), printed, figures })
    };
    each(&programs, processors(), run)?.into_iter().collect()
}

/// The folder of the developer's models, written again, where their data are.
fn models() -> Result<Option<PathBuf>> {
    if std::env::var_os("HABITUS_DATA").is_none_or(|data| data.is_empty()) {
        eprintln!("{LARGE}: skipped, no data: set HABITUS_DATA");
        return Ok(None);
    }
    let folder = target_dir("models");
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    succeed(cargo(&["run", "--quiet", "--package", "habitus-tests", "--bin", "write-models", "--"]).arg(&folder))?;
    Ok(Some(folder))
}

/// Builds the programs in Rust for a board; returns their folder.
fn built_programs(compiler: &Compiler, profile: &str, board: Board, models: Option<&Path>) -> Result<PathBuf> {
    let mut features = String::from("link-proof");
    if board == Board::An386 {
        features += ",golden";
    }
    if models.is_some() {
        features += ",large";
    }
    let build = Build { folder: FOLDER, profile, features: &features, kind: Kind::Programs };
    let mut command = compiler.build(&build);
    if let Some(folder) = models {
        command.env("HABITUS_MODELS", folder);
    }
    succeed(command.env("HABITUS_BOARD", board.name()))?;
    // The next board's programs have the same names.
    let (made, kept) = (compiler.artefact(Kind::Programs, profile, ""), folder_of(profile, board));
    std::fs::create_dir_all(&kept).map_err(|error| format!("{}: {error}", kept.display()))?;
    for program in names(profile, models.is_some())? {
        if program != GOLDEN || board == Board::An386 {
            let copied = std::fs::copy(made.join(&program), kept.join(&program));
            copied.map_err(|error| format!("{}: {error}", made.join(&program).display()))?;
        }
    }
    Ok(kept)
}

/// Where the programs in Rust for a board are.
fn folder_of(profile: &str, board: Board) -> PathBuf {
    target_dir(board.folder()).join(profile)
}

/// What is not as it should be: results that depend on compiler or language, and budgets that are exceeded.
pub fn objections(rows: &[Row]) -> Result<Vec<String>> {
    let budgets = Budgets::read()?;
    let differing = rows.iter().filter(|row| differs(row, rows)).map(|row| {
        let Row { program, profile, board, .. } = row;
        let board = board.processor();
        format!("{program} ({profile}, {board}) prints something else when it is built otherwise: a kernel or the compiler is at fault")
    });
    let mut found: Vec<String> = differing.collect();
    let before = found.len();
    found.extend(rows.iter().flat_map(|row| budgets.exceeded(row.profile, &row.program, &row.figures)));
    if found.len() > before {
        found.push(String::from("make it smaller, or change the budget and give the reason in the commit"));
    }
    Ok(found)
}

/// The programs that run the golden vectors: way, compiler, what they printed.
pub fn golden_runs(rows: &[Row]) -> Result<Vec<Run>> {
    let compiler = Compiler::installed(Target::CortexM)?.version();
    let emulator = Target::CortexM.emulator_version()?;
    let gcc = output(Target::CortexM.c_compiler()?.arg("--version")).unwrap_or_default();
    let gcc = format!("arm-none-eabi-gcc {}", number(gcc.lines().next().unwrap_or_default()));
    let of = |row: &Row| {
        let ended = Ended { text: row.printed.clone(), failure: None };
        let (way, interface, compiler) = match row.profile {
            C => (format!("C, {}", row.board.processor()), Interface::C, &gcc),
            profile => (format!("Rust, {} ({profile})", row.board.processor()), Interface::Rust, &compiler),
        };
        Run::new(&way, interface, compiler.clone(), emulator.clone(), &ended)
    };
    Ok(rows.iter().filter(|row| row.program == GOLDEN).map(of).collect())
}

/// Bytes of code that the C interface adds to a program, by program.
pub fn c_code(rows: &[Row]) -> Vec<(&str, u64)> {
    let counted =
        |row: &&Row| row.profile == C && row.board == Board::An386 && ![EMPTY, GOLDEN].contains(&row.program.as_str());
    rows.iter().filter(counted).filter_map(|row| Some((row.program.as_str(), *row.figures.get("code")?))).collect()
}

/// Builds the bare-metal library that the programs in C link.
fn built_library(compiler: &Compiler) -> Result<PathBuf> {
    let kind = Kind::StaticLibrary;
    let build = Build { folder: c_hosts::CRATE, profile: C_PROFILE, features: "", kind };
    // Beside the programs in Rust, which hold their own folder while they are built.
    let folder = target_dir("firmware-c");
    let mut command = compiler.build(&build);
    succeed(command.arg("--no-default-features").env("CARGO_TARGET_DIR", &folder))?;
    Ok(compiler.artefact_below(&folder, kind, C_PROFILE, c_hosts::LIBRARY))
}

/// Builds the programs in C for a board with their own Makefile; returns their folder.
fn built_c_programs(library: &Path, board: Board) -> Result<PathBuf> {
    let folder = target_dir(board.folder()).join("c");
    let setting = |name: &str, path: &Path| format!("{name}={}", path.display());
    let settings = [setting("HABITUS", library), setting("BUILD", &folder), format!("BOARD={}", board.name())];
    // The objects depend on options and paths that make does not compare.
    let make = || {
        let mut command = Command::new("make");
        command.arg("--silent").arg("-C").arg(project().join(C_FOLDER)).args(&settings);
        command
    };
    succeed(make().arg("clean"))?;
    succeed(make().arg("all"))?;
    Ok(folder)
}

/// Whether the same program, built otherwise, prints something else. What the empty one and the vectors say depends on the language.
fn differs(row: &Row, rows: &[Row]) -> bool {
    let text = |row: &Row| printed_text(&row.printed).map(str::to_owned).collect::<Vec<_>>();
    let comparable =
        |other: &Row| (other.profile == C) == (row.profile == C) || ![EMPTY, GOLDEN].contains(&row.program.as_str());
    rows.iter().any(|other| other.program == row.program && comparable(other) && text(other) != text(row))
}

/// The programs in src/bin, in the order of their names; of a language other than Rust those that it has, too.
fn names(profile: &str, large: bool) -> Result<BTreeSet<String>> {
    let folder = project().join(FOLDER).join("src/bin");
    let entries = std::fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let names = entries.filter_map(|entry| Some(entry.ok()?.path().file_stem()?.to_str()?.to_owned()));
    let there = |name: &String| match profile {
        C => project().join(C_FOLDER).join(format!("{name}.c")).is_file(),
        _ => large || name != LARGE,
    };
    Ok(names.filter(there).collect())
}

/// Bytes of code and constants of a linked program, after checking where it lies, and that it holds no panic path and no fused multiply-add.
fn linked(path: &Path, board: Board, wide: bool) -> Result<u64> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let file = object::File::parse(bytes.as_slice()).map_err(|error| format!("{}: {error}", path.display()))?;
    let reached = file.symbols().filter_map(|symbol| symbol.name().ok()).find(|name| name.contains("panic"));
    if let Some(name) = reached {
        return Err(format!("{}: it contains {name}, so a panic can be reached", path.display()).into());
    }
    if let Some(sentence) = board.misplaced(&file, wide).first() {
        return Err(format!("{}: {sentence}", path.display()).into());
    }
    let fused = fused_multiply_adds(&file).map_err(|error| format!("{}: {error}", path.display()))?;
    if let Some(address) = fused.first() {
        let count = fused.len();
        return Err(format!(
            "{}: {count} fused multiply-adds, the first at {address:#x}: its results differ from other targets'",
            path.display()
        )
        .into());
    }
    let sections = [".vectors", ".text", ".rodata", ".data"];
    Ok(sections.iter().filter_map(|name| file.section_by_name(name)).map(|section| section.size()).sum())
}

/// What a program prints on the emulated board; a status other than 0 or a hang is a failure.
fn printed(program: &Path, board: Board) -> Result<String> {
    let name = program.file_name().unwrap_or_default().to_string_lossy();
    let ended = ended(board.emulator(name == COUNTS || name == LARGE)?.arg(program), Duration::from_secs(300))?;
    match ended.failure {
        None => Ok(ended.text),
        Some(how) => {
            Err(format!("the program {name} failed on the emulated {} ({how}):\n{}", board.processor(), ended.text)
                .into())
        }
    }
}

/// The figures as Markdown: bytes of each program, and instructions of each kind and storage.
pub fn table(rows: &[Row]) -> String {
    let names = |counts: bool| -> BTreeSet<&String> {
        rows.iter().flat_map(|row| row.figures.keys()).filter(|name| name.starts_with(COUNT) == counts).collect()
    };
    let columns = names(false);
    let mut text = String::from("| program | profile | processor |");
    columns.iter().for_each(|name| text += &format!(" {name} |"));
    text += "\n|---|---|---|";
    columns.iter().for_each(|_| text += "---:|");
    let cell =
        |row: &Row, name: &str| row.figures.get(name).map_or_else(|| String::from(" |"), |value| format!(" {value} |"));
    for row in rows {
        text += &format!("\n| {} | {} | {} |", row.program, row.profile, row.board.processor());
        columns.iter().for_each(|name| text += &cell(row, name));
    }
    let counted: Vec<&Row> = rows.iter().filter(|row| row.figures.keys().any(|name| name.starts_with(COUNT))).collect();
    if !counted.is_empty() {
        text += "\n\n| instructions |";
        counted
            .iter()
            .for_each(|row| text += &format!(" {} ({}, {}) |", row.program, row.profile, row.board.processor()));
        text += "\n|---|";
        counted.iter().for_each(|_| text += "---:|");
        for name in names(true) {
            text += &format!("\n| {} |", name.trim_start_matches(COUNT).replace('_', " "));
            counted.iter().for_each(|row| text += &cell(row, name));
        }
    }
    text
}

fn json(rows: &[Row]) -> serde_json::Value {
    rows.iter()
        .map(|row| {
            let processor = row.board.processor();
            serde_json::json!({ "program": row.program, "profile": row.profile, "processor": processor, "figures": row.figures })
        })
        .collect()
}
