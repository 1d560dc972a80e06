//! Compares the golden vectors with the reference; `--write` writes them.

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let write = match std::env::args().nth(1).as_deref() {
        None => false,
        Some("--write") => true,
        Some(other) => {
            eprintln!("unknown argument {other}; usage: write-vectors [--write]");
            return ExitCode::FAILURE;
        }
    };
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/vectors");
    let mut same = true;
    let mut total = 0;
    for (name, text) in habitus_tests::vectors::written() {
        let path = dir.join(name);
        let cases = text.lines().filter(|line| line.starts_with("case ")).count();
        println!("{name}: {cases} cases, {} bytes", text.len());
        total += text.len();
        if write {
            if let Err(error) = std::fs::write(&path, text) {
                eprintln!("{}: {error}", path.display());
                return ExitCode::FAILURE;
            }
        } else if std::fs::read_to_string(&path).ok() != Some(text) {
            eprintln!("{}: differs from the reference; --write writes it anew", path.display());
            same = false;
        }
    }
    println!("{total} bytes in all");
    if same { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
