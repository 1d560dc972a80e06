//! C and C++ programs of the project: compiled with warnings as errors, run, and refused when they fail.

use crate::process::{Result, ended, output, project, succeed};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// What every C and C++ source of the project is compiled with.
pub const WARNINGS: [&str; 6] = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"];
/// Faults of a program end it.
pub const SANITIZERS: [&str; 3] =
    ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"];

/// A language and its standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// C of 1999.
    C99,
    /// C++ of 2017.
    Cpp17,
    /// C++ of 2020.
    Cpp20,
}

impl Language {
    /// The compiler, with the standard chosen.
    pub fn compiler(self) -> Command {
        let (variable, name, standard) = match self {
            Language::C99 => ("CC", "cc", "-std=c99"),
            Language::Cpp17 => ("CXX", "c++", "-std=c++17"),
            Language::Cpp20 => ("CXX", "c++", "-std=c++20"),
        };
        let mut command = Command::new(std::env::var_os(variable).unwrap_or_else(|| name.into()));
        command.arg(standard);
        command
    }
}

/// Fails with a sentence unless a tool can be started.
pub fn tool(name: &str, package: &str) -> Result<()> {
    match output(Command::new(name).arg("--version")) {
        Some(_) => Ok(()),
        None => Err(format!("{name} is missing: on Debian `apt-get install {package}`").into()),
    }
}

/// Compiles a source with warnings as errors; `inputs` are further flags and libraries.
pub fn compiled(language: Language, source: &Path, inputs: &[String], program: &Path) -> Result<PathBuf> {
    let mut command = language.compiler();
    command.args(WARNINGS).arg(source).args(inputs).arg("-lm").arg("-o").arg(program);
    succeed(&mut command)?;
    Ok(program.to_owned())
}

/// Fails unless a source alone is accepted.
pub fn accepted(language: Language, flags: &[&str], source: &Path) -> Result<()> {
    succeed(language.compiler().args(WARNINGS).args(flags).arg("-fsyntax-only").arg(source))
}

/// What a program prints; an end other than success is an error that shows it.
pub fn printed(command: &mut Command) -> Result<String> {
    let ended = ended(command, Duration::from_secs(120))?;
    match ended.failure {
        None => Ok(ended.text),
        Some(failure) => {
            let words = std::iter::once(command.get_program()).chain(command.get_args());
            let shown = words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ");
            Err(format!("`{shown}` ended with {failure}\n{}", ended.text).into())
        }
    }
}

/// A program under Valgrind: an access that is wrong, a value that is not set, memory that is lost, all are failures.
pub fn under_valgrind(program: &Path) -> Command {
    let mut command = Command::new("valgrind");
    command.args([
        "--quiet",
        "--error-exitcode=99",
        "--leak-check=full",
        "--show-leak-kinds=all",
        "--errors-for-leak-kinds=all",
    ]);
    command.arg(format!("--suppressions={}", project().join("tests/hosts/valgrind.supp").display()));
    command.arg(program);
    command
}
