//! The golden vectors in one way: what a runner printed, whether that is as it must be, and the table of all ways.

use crate::figures::{Figures, printed_figures, printed_text};
use crate::process::{Ended, Result, project};
use serde_json::{Value, json};

/// The package with the runner and its hosts in C and JavaScript.
pub const FOLDER: &str = "tests/golden-c";
/// The committed vectors.
pub const VECTORS: &str = "tests/golden/vectors";
/// Its library.
pub const LIBRARY: &str = "habitus-golden-c";

/// What the vectors reach the kernel through. Not every kernel has a form in every interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interface {
    /// The core itself.
    Rust,
    /// The C functions, and C++ on top of them: no kernel that a fit is made of, and no reversed range.
    C,
    /// JavaScript on top of the C functions; its runner leaves out single vertices, which are lanes of blocks there.
    JavaScript,
}

impl Interface {
    fn has(self, kernel: &str, name: &str) -> bool {
        const C: [&str; 7] =
            ["evaluate", "linearised_block", "prepared", "fit_points", "fit_landmarks", "fit_wavelet", "open"];
        match self {
            Interface::Rust => true,
            Interface::C | Interface::JavaScript if name.ends_with("_reversed") => false,
            Interface::C => C.contains(&kernel) || kernel == "linearised_vertex",
            Interface::JavaScript => C.contains(&kernel),
        }
    }
}

/// One run.
pub struct Run {
    /// The way for the table: language, interface, target.
    pub way: String,
    interface: Interface,
    /// Name and version of the compiler.
    pub compiler: String,
    /// Name and version of what ran it; empty where this processor did.
    pub emulator: String,
    /// Failing cases, and whatever else it printed.
    text: Vec<String>,
    figures: Figures,
    /// How it ended, if badly.
    failure: Option<String>,
}

impl Run {
    /// What came of a program.
    pub fn new(way: &str, interface: Interface, compiler: String, emulator: String, ended: &Ended) -> Run {
        Run {
            way: way.to_owned(),
            interface,
            compiler,
            emulator,
            text: printed_text(&ended.text).map(str::to_owned).collect(),
            figures: printed_figures(&ended.text),
            failure: ended.failure.clone(),
        }
    }

    /// A figure that was not printed is none.
    pub fn figure(&self, name: &str) -> Option<u64> {
        self.figures.get(name).copied()
    }

    /// What is not as it must be: every case of the interface run and equal, and every changed bit noticed.
    pub fn objections(&self, known: &Cases) -> Vec<String> {
        let cases = known.of(self.interface);
        let wanted = [("cases", cases), ("failed", 0), ("differing_bits", 0), ("changed", cases), ("noticed", cases)];
        let wrong =
            wanted.into_iter().filter(|&(name, value)| self.figure(name) != Some(value)).map(|(name, value)| {
                let found = self.figure(name).map_or_else(|| String::from("missing"), |found| found.to_string());
                format!("{}: {name} is {found}, expected {value}", self.way)
            });
        let ended = self.failure.iter().map(|how| format!("{}: the program failed ({how})", self.way));
        let text = self.text.iter().map(|line| format!("{}: {line}", self.way));
        wrong.chain(ended).chain(text).collect()
    }

    /// An objection unless memory, and what the compiler took it for where the program knows, is as given.
    pub fn byte_order_objection(&self, big_endian: bool) -> Option<String> {
        let wanted = u64::from(big_endian);
        let right = self.figure("big_endian_memory") == Some(wanted)
            && self.figure("big_endian").is_none_or(|compiled| compiled == wanted);
        (!right).then(|| format!("{}: the byte order is not the expected one, so the run proves less", self.way))
    }
}

/// File, kernel and name of every case of the committed vectors.
pub struct Cases(Vec<[String; 3]>);

impl Cases {
    /// Reads the files.
    pub fn read() -> Result<Cases> {
        let folder = project().join(VECTORS);
        let failed = |error: std::io::Error| format!("{VECTORS}: {error}");
        let mut cases = Vec::new();
        for entry in std::fs::read_dir(&folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            // The models are what the cases are about, not cases.
            let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if file != "models.txt" {
                let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
                let lines = text.lines().filter_map(|line| line.strip_prefix("case ")?.split_once(' '));
                cases.extend(lines.map(|(kernel, name)| [file.as_str(), kernel, name].map(str::to_owned)));
            }
        }
        if cases.is_empty() { Err(format!("{VECTORS} holds no case").into()) } else { Ok(Cases(cases)) }
    }

    /// How many an interface has.
    pub fn of(&self, interface: Interface) -> u64 {
        self.0.iter().filter(|[_, kernel, name]| interface.has(kernel, name)).count() as u64
    }
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
pub fn table(runs: &[Run], known: &Cases) -> String {
    let mut text = String::from("| way | compiler | run by |");
    COLUMNS.iter().for_each(|(title, _)| text += &format!(" {title} |"));
    text += " not in that interface |\n|---|---|---|";
    COLUMNS.iter().for_each(|_| text += "---:|");
    text += "---:|";
    for run in runs {
        let emulator = if run.emulator.is_empty() { "this processor" } else { &run.emulator };
        text += &format!("\n| {} | {} | {emulator} |", run.way, run.compiler);
        for (_, name) in COLUMNS {
            text += &run.figure(name).map_or_else(|| String::from(" |"), |value| format!(" {value} |"));
        }
        text += &format!(" {} |", known.of(Interface::Rust) - known.of(run.interface));
    }
    text
}

/// The runs as JSON.
pub fn json_of(runs: &[Run], known: &Cases) -> Value {
    let run = |run: &Run| {
        json!({
            "way": run.way, "compiler": run.compiler, "emulator": run.emulator, "figures": run.figures,
            "not_in_interface": known.of(Interface::Rust) - known.of(run.interface),
            "text": run.text, "failure": run.failure,
        })
    };
    runs.iter().map(run).collect()
}

/// Prints the table, or the JSON, and fails with every objection.
pub fn concluded(runs: &[Run], known: &Cases, byte_orders: &[String], json: bool) -> Result<()> {
    if json {
        println!("{:#}", json_of(runs, known));
    } else {
        println!("{}", table(runs, known));
    }
    let objections: Vec<String> =
        runs.iter().flat_map(|run| run.objections(known)).chain(byte_orders.iter().cloned()).collect();
    if objections.is_empty() { Ok(()) } else { Err(objections.join("\n").into()) }
}

#[cfg(test)]
mod tests {
    use super::{Cases, Interface, Run};
    use crate::process::Ended;

    fn run(text: &str, failure: Option<&str>) -> Run {
        let ended = Ended { text: text.to_owned(), failure: failure.map(str::to_owned) };
        Run::new("AArch64", Interface::Rust, String::new(), String::new(), &ended)
    }

    fn known(n: usize) -> Cases {
        Cases(vec![["solve.txt", "prior", "one"].map(String::from); n])
    }

    const GOOD: &str = "@cases 9\n@failed 0\n@numbers 70\n@differing_bits 0\n@changed 9\n@noticed 9\n@big_endian 0\n";

    #[test]
    fn nothing_is_said_against_equal_bits() {
        assert!(run(GOOD, None).objections(&known(9)).is_empty());
    }

    #[test]
    fn differences_missing_cases_and_an_overlooked_change_are_objected_to() {
        let objections = |from: &str, to: &str| run(&GOOD.replace(from, to), None).objections(&known(9));
        assert_eq!(objections("bits 0", "bits 1"), ["AArch64: differing_bits is 1, expected 0"]);
        assert_eq!(objections("noticed 9", "noticed 8"), ["AArch64: noticed is 8, expected 9"]);
        assert_eq!(objections("@failed 0\n", ""), ["AArch64: failed is missing, expected 0"]);
        assert_eq!(objections("@cases", "solve.txt: cholesky_f32 size_1\n@cases").len(), 1);
        assert_eq!(run(GOOD, None).objections(&known(10)).len(), 3);
        assert_eq!(run(GOOD, Some("exit status: 1")).objections(&known(9)).len(), 1);
        assert_eq!(run("", None).objections(&known(9)).len(), 5);
    }

    #[test]
    fn the_byte_order_must_be_printed() {
        let both = format!("{GOOD}@big_endian_memory 0\n");
        assert_eq!(run(&both, None).byte_order_objection(false), None);
        assert!(run(&both, None).byte_order_objection(true).is_some());
        assert!(run(&both.replace("endian 0", "endian 1"), None).byte_order_objection(false).is_some());
        assert!(run(GOOD, None).byte_order_objection(false).is_some());
    }

    #[test]
    fn an_interface_lacks_what_it_cannot_express() {
        let case = |kernel: &str, name: &str| ["generator.txt", kernel, name].map(str::to_owned);
        let known = Cases(vec![
            case("evaluate", "whole"),
            case("evaluate", "linear_17_reversed"),
            case("linearised_vertex", "a"),
            case("prior", "b"),
            ["bodies.txt", "evaluate", "body"].map(str::to_owned),
        ]);
        assert_eq!([Interface::Rust, Interface::C, Interface::JavaScript].map(|way| known.of(way)), [5, 3, 2]);
    }

    #[test]
    fn the_committed_vectors_hold_many_cases() {
        let known = Cases::read().expect("they are part of the project");
        assert!(known.of(Interface::Rust) >= 630 && known.of(Interface::C) >= 320);
    }
}
