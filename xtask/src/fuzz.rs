//! `cargo xtask fuzz`: every fuzz target for a short time, in one instrumented build, without cargo-fuzz.
//!
//! Faults that are planted on purpose are sought first: a fuzzer that does not find them would find nothing else either.

use crate::nightly_compiler::NightlyCompiler;
use crate::process::{Result, cargo_in, project, succeed, target_dir};
use crate::side_by_side::{each, processors};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The package with the targets.
pub const FOLDER: &str = "fuzz";
/// Its folder below the build folder.
const TARGET: &str = "fuzz";
/// Targets with a planted fault, and how the name of the input begins that shows it.
const CONTROLS: [(&str, &str); 2] = [("control_panic", "crash-"), ("control_memory", "oom-")];
/// Longest search for a planted fault, seconds; they are found in one or two.
const CONTROL_SECONDS: u32 = 60;
/// Edges, comparisons and memory errors, as cargo-fuzz has them instrumented.
const FLAGS: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares -Zsanitizer=address --cfg fuzzing";
/// Seconds for one input, MiB for the process, and MiB for one allocation: inputs have a few KiB.
const LIMITS: [&str; 3] = ["-timeout=10", "-rss_limit_mb=2048", "-malloc_limit_mb=64"];

/// Without the search for leaks at the end, which needs ptrace.
const NO_LEAKS: &str = "detect_leaks=0";

/// Options of `cargo xtask fuzz`.
#[derive(clap::Args)]
pub struct Options {
    /// Seconds for each target.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    seconds: u32,
    /// Targets that run at the same time [default: the number of processors].
    #[arg(long)]
    jobs: Option<usize>,
    /// Build the targets, and run none.
    #[arg(long, conflicts_with_all = ["seconds", "jobs", "json", "targets"])]
    build: bool,
    /// Print the figures as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
    /// Only these targets.
    targets: Vec<String>,
}

/// How a target ended.
struct Row {
    target: String,
    executions: u64,
    executions_per_second: u64,
    /// Edges of the control flow that were reached.
    coverage: u64,
    /// Inputs that reach something of their own.
    corpus: u64,
    finding: Option<Finding>,
}

/// An input that a target does not survive.
struct Finding {
    input: PathBuf,
    /// What was said of it first: the panic's message, or the limit that was exceeded.
    message: String,
    log: PathBuf,
}

/// Builds all targets, finds the planted faults, runs the targets.
pub fn run(options: &Options) -> Result<()> {
    let all = targets()?;
    for name in &options.targets {
        if !all.contains(name) {
            return Err(format!("there is no fuzz target {name}; there are {}", all.join(", ")).into());
        }
    }
    let chosen: Vec<String> =
        all.into_iter().filter(|name| options.targets.is_empty() || options.targets.contains(name)).collect();
    let compiler = NightlyCompiler::installed()?;
    let programs = build(&compiler)?;
    if options.build {
        return Ok(());
    }
    let jobs = options.jobs.unwrap_or_else(processors);
    let controls: Vec<String> = CONTROLS.iter().map(|(name, _)| String::from(*name)).collect();
    for row in fuzzed(&programs, &controls, CONTROL_SECONDS, jobs)? {
        check_control(&row)?;
    }
    let rows = fuzzed(&programs, &chosen, options.seconds, jobs)?;
    if options.json {
        println!("{}", serde_json::Value::from_iter(rows.iter().map(of_json)));
    } else {
        println!("{}", table(&rows));
    }
    let findings: Vec<String> =
        rows.iter().filter_map(|row| Some(told(&programs, row, row.finding.as_ref()?))).collect();
    if findings.is_empty() {
        return Ok(());
    }
    Err(findings.join("\n").into())
}

/// Names of the targets but the controls, sorted.
fn targets() -> Result<Vec<String>> {
    let folder = project().join(FOLDER).join("fuzz_targets");
    let entries = std::fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut names: Vec<String> = entries
        .filter_map(|entry| Some(entry.ok()?.path().file_stem()?.to_str()?.to_owned()))
        .filter(|name| CONTROLS.iter().all(|(control, _)| control != name))
        .collect();
    names.sort();
    Ok(names)
}

/// Builds every target, instrumented, and runs the tests of what they assert; returns the folder with the programs.
fn build(compiler: &NightlyCompiler) -> Result<PathBuf> {
    let options = ["--quiet", "--release", "--features", "control", "--target", &compiler.host];
    for command in [&["build"][..], &["test", "--lib"]] {
        let mut cargo = cargo_in(FOLDER, TARGET, &[command, &options].concat());
        cargo.env("RUSTC", &compiler.rustc).env("RUSTFLAGS", FLAGS).env("ASAN_OPTIONS", NO_LEAKS);
        // The figures alone belong on standard output.
        succeed(cargo.stdout(std::io::stderr()))?;
    }
    Ok(target_dir(TARGET).join(&compiler.host).join("release"))
}

/// Runs the targets, so many at a time; rows are in the order of the names.
fn fuzzed(programs: &Path, names: &[String], seconds: u32, jobs: usize) -> Result<Vec<Row>> {
    each(names, jobs.max(1), |name| fuzz(programs, name, seconds))?.into_iter().collect()
}

/// Runs one target on its committed corpus and what earlier runs have found; new inputs go to the build folder.
fn fuzz(programs: &Path, name: &str, seconds: u32) -> Result<Row> {
    let folder = |what: &str| -> Result<PathBuf> {
        let folder = target_dir(TARGET).join(what).join(name);
        std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        Ok(folder)
    };
    let (found, artifacts) = (folder("corpus")?, folder("artifacts")?);
    let control = CONTROLS.iter().any(|(control, _)| *control == name);
    if control {
        // A control that knew the way from before would prove nothing.
        std::fs::remove_dir_all(&found).map_err(|error| format!("{}: {error}", found.display()))?;
        folder("corpus")?;
    }
    let log = target_dir(TARGET).join("artifacts").join(format!("{name}.log"));
    let file = std::fs::File::create(&log).map_err(|error| format!("{}: {error}", log.display()))?;
    let program = programs.join(name);
    let mut command = Command::new(&program);
    // The limit of one allocation hangs on libFuzzer's own search for leaks, which therefore stays on.
    command.args(LIMITS).arg("-print_final_stats=1").env("ASAN_OPTIONS", NO_LEAKS);
    command.arg(format!("-max_total_time={seconds}")).arg(format!("-artifact_prefix={}/", artifacts.display()));
    command.arg(&found);
    let committed = project().join(FOLDER).join("corpus").join(name);
    if committed.is_dir() {
        command.arg(committed);
    }
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(file);
    let status = command.status().map_err(|error| format!("cannot start {}: {error}", program.display()))?;
    let text = std::fs::read(&log).map_err(|error| format!("{}: {error}", log.display()))?;
    let text = String::from_utf8_lossy(&text);
    let input = kept_input(&text);
    let finding = match (status.success(), input) {
        (true, None) => None,
        (_, Some(input)) => Some(Finding { input, message: message(&text), log: log.clone() }),
        (false, None) => {
            let end = text.lines().rev().take(5).collect::<Vec<_>>().into_iter().rev().collect::<Vec<_>>().join("\n");
            return Err(format!("{name} ended with {status} and kept no input; {} ends:\n{end}", log.display()).into());
        }
    };
    let row = Row {
        target: String::from(name),
        executions: last_number(&text, "stat::number_of_executed_units:"),
        executions_per_second: last_number(&text, "stat::average_exec_per_sec:"),
        coverage: last_number(&text, " cov: "),
        corpus: last_number(&text, " corp: "),
        finding,
    };
    if row.finding.is_none() && (row.executions == 0 || row.coverage == 0) {
        return Err(format!("{name} ran nothing, or is not instrumented; see {}", log.display()).into());
    }
    Ok(row)
}

/// The input that the target did not survive. One that was only slow is kept by libFuzzer too, but is no finding.
fn kept_input(log: &str) -> Option<PathBuf> {
    let kept = log.lines().filter_map(|line| line.split_once("Test unit written to "));
    kept.map(|(_, path)| PathBuf::from(path)).find(|path| {
        let name = path.file_name().map(|name| name.to_string_lossy());
        name.is_some_and(|name| !name.starts_with("slow-unit-"))
    })
}

/// The number behind the last occurrence of `mark`; 0 when there is none.
fn last_number(text: &str, mark: &str) -> u64 {
    let digits = |rest: &str| rest.trim_start().chars().take_while(char::is_ascii_digit).collect::<String>();
    text.rsplit_once(mark).and_then(|(_, rest)| digits(rest).parse().ok()).unwrap_or(0)
}

/// What the log says of the finding: the line of a panic and its message, or libFuzzer's summary.
fn message(log: &str) -> String {
    let mut lines = log.lines();
    let found = lines.find(|line| line.contains("panicked at") || line.contains("ERROR: "));
    [found, lines.next()].into_iter().flatten().map(str::trim).collect::<Vec<_>>().join(" ")
}

/// Fails unless the planted fault was found, and as the kind of fault that it is.
fn check_control(row: &Row) -> Result<()> {
    let kind = CONTROLS.iter().find(|(name, _)| *name == row.target).map_or("", |(_, kind)| kind);
    let name = |finding: &Finding| finding.input.file_name().map(|name| name.to_string_lossy().into_owned());
    match row.finding.as_ref().and_then(name) {
        Some(name) if name.starts_with(kind) => Ok(()),
        Some(name) => Err(format!("the planted fault of {} was found as {name}, not as {kind}*", row.target).into()),
        None => Err(format!("the planted fault of {} was not found: the fuzzers are blind", row.target).into()),
    }
}

fn told(programs: &Path, row: &Row, finding: &Finding) -> String {
    format!(
        "{}: {}\n  input: {}\n  again: {} {} {}\n  log: {}\n  then mend the cause and keep the input as a unit test \
         beside it (fuzz/README.md)",
        row.target,
        finding.message,
        finding.input.display(),
        programs.join(&row.target).display(),
        LIMITS.join(" "),
        finding.input.display(),
        finding.log.display(),
    )
}

fn of_json(row: &Row) -> serde_json::Value {
    json!({
        "target": row.target,
        "executions": row.executions,
        "executions_per_second": row.executions_per_second,
        "coverage": row.coverage,
        "corpus": row.corpus,
        "finding": row.finding.as_ref().map(|finding| finding.input.display().to_string()),
    })
}

fn table(rows: &[Row]) -> String {
    let mut text = format!(
        "{:<10} {:>12} {:>9} {:>9} {:>7} {:>9}",
        "target", "executions", "exec/s", "coverage", "corpus", "findings"
    );
    for row in rows {
        let Row { target, executions, executions_per_second, coverage, corpus, finding } = row;
        let findings = usize::from(finding.is_some());
        text += &format!(
            "\n{target:<10} {executions:>12} {executions_per_second:>9} {coverage:>9} {corpus:>7} {findings:>9}"
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{kept_input, last_number, message};

    const LOG: &str = "#12\tINITED cov: 7 ft: 8 corp: 3/20b exec/s: 0 rss: 39Mb\n\
        #99\tREDUCE cov: 1273 ft: 5519 corp: 718/143Kb lim: 4096 exec/s: 5332 rss: 498Mb L: 486/4004 MS: 1 EraseBytes-\n\
        thread '<unnamed>' (6353) panicked at src/bilinear.rs:171:5:\nassertion failed: a == b\n\
        ==6353== ERROR: libFuzzer: deadly signal\n\
        stat::number_of_executed_units: 2495640\nstat::average_exec_per_sec:     5332\n";

    #[test]
    fn figures_are_those_of_the_last_line() {
        let numbers = [" cov: ", " corp: ", "stat::number_of_executed_units:", "stat::average_exec_per_sec:", "none:"];
        assert_eq!(numbers.map(|mark| last_number(LOG, mark)), [1273, 718, 2_495_640, 5332, 0]);
    }

    #[test]
    fn slow_inputs_are_no_findings() {
        let slow = "artifact_prefix='a/'; Test unit written to a/slow-unit-5c48";
        assert_eq!(kept_input(slow), None);
        let both = format!("{slow}\nartifact_prefix='a/'; Test unit written to a/crash-12");
        assert_eq!(kept_input(&both), Some("a/crash-12".into()));
    }

    #[test]
    fn the_message_is_that_of_the_panic_or_of_the_limit() {
        let told = "thread '<unnamed>' (6353) panicked at src/bilinear.rs:171:5: assertion failed: a == b";
        assert_eq!(message(LOG), told);
        let limit = "==7961== ERROR: libFuzzer: out-of-memory (malloc(134611008))\n   To change";
        assert!(message(limit).starts_with("==7961== ERROR: libFuzzer: out-of-memory"));
    }
}
