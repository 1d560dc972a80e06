//! `cargo xtask firmware`: the programs of examples/firmware on an emulated Cortex-M4F, measured.
//!
//! Linking proves that no panic path and no allocation is left. Stack is the high-water mark of painted memory,
//! code what a program has more than the empty one.

use crate::budgets::Budgets;
use crate::compiler::{Build, Compiler, Kind};
use crate::figures::{Figures, printed_figures, printed_text};
use crate::fused::fused_multiply_adds;
use crate::process::{Result, ended, project, succeed};
use crate::targets::Target;
use object::{Object, ObjectSection};
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

const FOLDER: &str = "examples/firmware";
/// The program whose code the others' is counted from.
const EMPTY: &str = "empty";
/// Optimised for size, and for speed.
const PROFILES: [&str; 2] = ["release", "speed"];

/// Options of `cargo xtask firmware`.
#[derive(clap::Args)]
pub struct Options {
    /// Print the figures as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
    /// Only this build profile: release (for size) or speed.
    #[arg(long, value_parser = PROFILES)]
    profile: Option<String>,
}

/// One program as built with one profile.
struct Row {
    profile: &'static str,
    program: String,
    /// What it printed, figures apart.
    text: String,
    figures: Figures,
}

/// Builds, runs, measures, compares.
pub fn run(options: &Options) -> Result<()> {
    let compiler = Compiler::installed(Target::CortexM)?;
    Target::CortexM.emulator()?;
    let budgets = Budgets::read()?;
    let mut rows = Vec::new();
    for profile in PROFILES.into_iter().filter(|&name| options.profile.as_deref().is_none_or(|only| only == name)) {
        let build = Build { folder: FOLDER, profile, features: "link-proof", kind: Kind::Programs };
        succeed(&mut compiler.build(&build))?;
        let base = code_bytes(&compiler.artefact(Kind::Programs, profile, EMPTY))?;
        for program in programs()? {
            let path = compiler.artefact(Kind::Programs, profile, &program);
            let code = code_bytes(&path)?.saturating_sub(base);
            let text = printed(&path)?;
            let mut figures = printed_figures(&text);
            figures.insert(String::from("code"), code);
            let text: String = printed_text(&text).map(|line| format!("  {line}\n")).collect();
            if !options.json {
                println!("{program} ({profile})\n{text}");
            }
            rows.push(Row { profile, program, text, figures });
        }
    }
    if options.json {
        println!("{}", json(&rows));
    } else {
        println!("\n{}", table(&rows));
    }
    if let Some(program) = differing(&rows) {
        return Err(format!(
            "{program} prints something else when it is optimised otherwise: a kernel or the compiler is at fault"
        )
        .into());
    }
    let exceeded: Vec<String> =
        rows.iter().flat_map(|row| budgets.exceeded(row.profile, &row.program, &row.figures)).collect();
    if exceeded.is_empty() {
        return Ok(());
    }
    Err(format!("{}\nmake it smaller, or change the budget and give the reason in the commit", exceeded.join("\n"))
        .into())
}

/// A program whose results depend on how it was optimised.
fn differing(rows: &[Row]) -> Option<&str> {
    let differs = |row: &&Row| rows.iter().any(|other| other.program == row.program && other.text != row.text);
    rows.iter().find(differs).map(|row| row.program.as_str())
}

/// The programs in src/bin, in the order of their names.
fn programs() -> Result<BTreeSet<String>> {
    let folder = project().join(FOLDER).join("src/bin");
    let entries = std::fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok(entries.filter_map(|entry| Some(entry.ok()?.path().file_stem()?.to_str()?.to_owned())).collect())
}

/// Bytes of code and constants of a linked program, after checking that it holds no fused multiply-add.
fn code_bytes(path: &Path) -> Result<u64> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let file = object::File::parse(bytes.as_slice()).map_err(|error| format!("{}: {error}", path.display()))?;
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
fn printed(program: &Path) -> Result<String> {
    let ended = ended(Target::CortexM.emulator()?.arg(program), Duration::from_secs(120))?;
    let name = program.file_name().unwrap_or_default().to_string_lossy();
    match ended.failure {
        None => Ok(ended.text),
        Some(how) => Err(format!("the program {name} failed on the emulated board ({how}):\n{}", ended.text).into()),
    }
}

/// The figures as Markdown.
fn table(rows: &[Row]) -> String {
    let names: BTreeSet<&String> = rows.iter().flat_map(|row| row.figures.keys()).collect();
    let mut text = String::from("| program | profile |");
    names.iter().for_each(|name| text += &format!(" {name} |"));
    text += "\n|---|---|";
    names.iter().for_each(|_| text += "---:|");
    for row in rows {
        text += &format!("\n| {} | {} |", row.program, row.profile);
        for name in &names {
            text += &row.figures.get(*name).map_or_else(|| String::from(" |"), |value| format!(" {value} |"));
        }
    }
    text
}

fn json(rows: &[Row]) -> serde_json::Value {
    rows.iter()
        .map(|row| serde_json::json!({ "program": row.program, "profile": row.profile, "figures": row.figures }))
        .collect()
}
