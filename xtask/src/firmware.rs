//! `cargo xtask firmware`: the programs of examples/firmware on an emulated Cortex-M4F, measured.
//!
//! Linking proves that no panic path and no allocation is left. Stack is the high-water mark of painted memory,
//! code what a program has more than the empty one.

use crate::bare_metal::Compiler;
use crate::budgets::{Budgets, Figures};
use crate::fused::fused_multiply_adds;
use crate::process::{Result, project, succeed};
use crate::qemu;
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
    let compiler = Compiler::installed()?;
    qemu::installed()?;
    let budgets = Budgets::read()?;
    let mut rows = Vec::new();
    for profile in PROFILES.into_iter().filter(|&name| options.profile.as_deref().is_none_or(|only| only == name)) {
        succeed(&mut compiler.build(FOLDER, profile, "link-proof"))?;
        let base = code_bytes(&compiler.program(profile, EMPTY))?;
        for program in programs()? {
            let path = compiler.program(profile, &program);
            let code = code_bytes(&path)?.saturating_sub(base);
            let text = qemu::run(&path, Duration::from_secs(120))?;
            let mut figures = measured(&text);
            figures.insert(String::from("code"), code);
            let text: String =
                text.lines().filter(|line| !line.starts_with('@')).map(|line| format!("  {line}\n")).collect();
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

/// The lines `@name value` of a program's output.
fn measured(text: &str) -> Figures {
    let lines = text.lines().filter_map(|line| line.strip_prefix('@')?.split_once(' '));
    lines.filter_map(|(name, value)| Some((name.to_owned(), value.parse().ok()?))).collect()
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

#[cfg(test)]
mod tests {
    use super::measured;

    #[test]
    fn only_lines_that_announce_a_figure_are_read() {
        let figures = measured("opened\n@stack 1234\n@checked 7\n@odd x\nstack 9\n");
        assert_eq!(figures.into_iter().collect::<Vec<_>>(), [("checked".into(), 7), ("stack".into(), 1234)]);
    }
}
