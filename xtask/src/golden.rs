//! The golden vectors on another target: what a run of tests/golden-c printed, whether that is as it must be, and the table.

use crate::figures::{Figures, printed_figures, printed_text};
use crate::process::{Ended, Result, project};
use serde_json::{Value, json};

/// The package with the runner and its hosts in C and JavaScript.
pub const FOLDER: &str = "tests/golden-c";
/// Its library.
pub const LIBRARY: &str = "habitus-golden-c";

/// One run.
pub struct Run {
    /// The target's name for the table.
    pub target: &'static str,
    /// Name and version of the compiler.
    pub compiler: String,
    /// Name and version of what ran it.
    pub emulator: String,
    /// Failing cases, and whatever else it printed.
    text: Vec<String>,
    figures: Figures,
    /// How it ended, if badly.
    failure: Option<String>,
}

impl Run {
    /// What came of a program.
    pub fn new(target: &'static str, compiler: String, emulator: String, ended: &Ended) -> Run {
        Run {
            target,
            compiler,
            emulator,
            text: printed_text(&ended.text).map(str::to_owned).collect(),
            figures: printed_figures(&ended.text),
            failure: ended.failure.clone(),
        }
    }

    /// A figure that was not printed is none.
    fn figure(&self, name: &str) -> Option<u64> {
        self.figures.get(name).copied()
    }

    /// What is not as it must be: every one of `cases` run and equal, and every changed bit noticed.
    pub fn objections(&self, cases: u64) -> Vec<String> {
        let wanted = [("cases", cases), ("failed", 0), ("differing_bits", 0), ("changed", cases), ("noticed", cases)];
        let wrong =
            wanted.into_iter().filter(|&(name, value)| self.figure(name) != Some(value)).map(|(name, value)| {
                let found = self.figure(name).map_or_else(|| String::from("missing"), |found| found.to_string());
                format!("{}: {name} is {found}, expected {value}", self.target)
            });
        let ended = self.failure.iter().map(|how| format!("{}: the program failed ({how})", self.target));
        let text = self.text.iter().map(|line| format!("{}: {line}", self.target));
        wrong.chain(ended).chain(text).collect()
    }

    /// An objection unless memory, and what the compiler took it for, is as given.
    pub fn byte_order_objection(&self, big_endian: bool) -> Option<String> {
        let wanted = Some(u64::from(big_endian));
        let right = ["big_endian", "big_endian_memory"].iter().all(|name| self.figure(name) == wanted);
        (!right).then(|| format!("{}: the byte order is not the expected one, so the run proves less", self.target))
    }
}

/// The number of cases in the committed vectors.
pub fn cases() -> Result<u64> {
    counted(|_| true)
}

/// The number of those of some kernels.
pub fn cases_of(kernels: &[&str]) -> Result<u64> {
    counted(|kernel| kernels.contains(&kernel))
}

fn counted(is_wanted: impl Fn(&str) -> bool) -> Result<u64> {
    let folder = project().join("tests/golden/vectors");
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    let mut cases = 0;
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        // The models are what the cases are about, not cases.
        if path.file_name().is_some_and(|name| name != "models.txt") {
            let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            let kernels = text.lines().filter_map(|line| line.strip_prefix("case ")?.split(' ').next());
            cases += kernels.filter(|kernel| is_wanted(kernel)).count() as u64;
        }
    }
    if cases == 0 { Err(format!("{} holds no such case", folder.display()).into()) } else { Ok(cases) }
}

const COLUMNS: [(&str, &str); 6] = [
    ("bits of a pointer", "pointer_bits"),
    ("cases", "cases"),
    ("numbers", "numbers"),
    ("differing bits", "differing_bits"),
    ("changed bits", "changed"),
    ("noticed", "noticed"),
];

/// The runs as Markdown.
pub fn table(runs: &[Run]) -> String {
    let mut text = String::from("| target | compiler | run by |");
    COLUMNS.iter().for_each(|(title, _)| text += &format!(" {title} |"));
    text += "\n|---|---|---|";
    COLUMNS.iter().for_each(|_| text += "---:|");
    for run in runs {
        text += &format!("\n| {} | {} | {} |", run.target, run.compiler, run.emulator);
        for (_, name) in COLUMNS {
            text += &run.figure(name).map_or_else(|| String::from(" |"), |value| format!(" {value} |"));
        }
    }
    text
}

/// The runs as JSON.
pub fn json_of(runs: &[Run]) -> Value {
    let run = |run: &Run| {
        json!({
            "target": run.target, "compiler": run.compiler, "emulator": run.emulator, "figures": run.figures,
            "text": run.text, "failure": run.failure,
        })
    };
    runs.iter().map(run).collect()
}

/// Prints the table, or the JSON, and fails with every objection.
pub fn concluded(runs: &[Run], objections: &[String], json: bool) -> Result<()> {
    if json {
        println!("{:#}", json_of(runs));
    } else {
        println!("{}", table(runs));
    }
    if objections.is_empty() { Ok(()) } else { Err(objections.join("\n").into()) }
}

#[cfg(test)]
mod tests {
    use super::{Run, cases, cases_of};
    use crate::process::Ended;

    fn run(text: &str, failure: Option<&str>) -> Run {
        let ended = Ended { text: text.to_owned(), failure: failure.map(str::to_owned) };
        Run::new("AArch64", String::new(), String::new(), &ended)
    }

    const GOOD: &str = "@cases 9\n@failed 0\n@numbers 70\n@differing_bits 0\n@changed 9\n@noticed 9\n@big_endian 0\n";

    #[test]
    fn nothing_is_said_against_equal_bits() {
        assert!(run(GOOD, None).objections(9).is_empty());
    }

    #[test]
    fn differences_missing_cases_and_an_overlooked_change_are_objected_to() {
        let objections = |from: &str, to: &str| run(&GOOD.replace(from, to), None).objections(9);
        assert_eq!(objections("bits 0", "bits 1"), ["AArch64: differing_bits is 1, expected 0"]);
        assert_eq!(objections("noticed 9", "noticed 8"), ["AArch64: noticed is 8, expected 9"]);
        assert_eq!(objections("@failed 0\n", ""), ["AArch64: failed is missing, expected 0"]);
        assert_eq!(objections("@cases", "solve.txt: cholesky_f32 size_1\n@cases").len(), 1);
        assert_eq!(run(GOOD, None).objections(10).len(), 3);
        assert_eq!(run(GOOD, Some("exit status: 1")).objections(9).len(), 1);
        assert_eq!(run("", None).objections(9).len(), 5);
    }

    #[test]
    fn the_byte_order_must_be_printed_by_both() {
        let both = format!("{GOOD}@big_endian_memory 0\n");
        assert_eq!(run(&both, None).byte_order_objection(false), None);
        assert!(run(&both, None).byte_order_objection(true).is_some());
        assert!(run(GOOD, None).byte_order_objection(false).is_some());
    }

    #[test]
    fn the_committed_vectors_hold_many_cases() {
        assert!(cases().is_ok_and(|cases| cases >= 248));
        assert!(cases_of(&["open", "prepared"]).is_ok_and(|cases| cases >= 50));
        assert!(cases_of(&["no such kernel"]).is_err());
    }
}
