//! Where the shared real data lie, and what happens to a test when they do not.

use std::io::Write;
use std::path::PathBuf;

/// The folder of the shared data: `HABITUS_DATA`, else `../shared/data` beside the project.
///
/// `None` after noting that `test` was skipped; the run's last line counts the notes (`cargo xtask test`).
///
/// # Panics
/// Under `CI=true`, where data tests must not be skipped.
pub fn dir_or_skip(test: &str) -> Option<PathBuf> {
    let project = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let dir = match std::env::var_os("HABITUS_DATA") {
        Some(dir) => PathBuf::from(dir),
        None => project.join("../shared/data"),
    };
    if dir.join("faces").is_dir() {
        return Some(dir);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{test}: no data at {}: set HABITUS_DATA", dir.display());
    eprintln!("{test}: skipped, no data at {}: set HABITUS_DATA", dir.display());
    if let Some(log) = std::env::var_os("HABITUS_SKIPPED") {
        let note = std::fs::OpenOptions::new().create(true).append(true).open(log);
        note.and_then(|mut file| writeln!(file, "{test}")).expect("the list of skipped tests can be written");
    }
    None
}
