//! Broken files, read and cleaned: the right result or an error that names the place. `--nocapture` prints the table.

mod files;
mod surfaces;
mod table;

use habitus::Error;
use habitus::io::mesh::{ReadOptions, read_file};

fn rows() -> Vec<table::Row> {
    let mut rows = surfaces::rows();
    rows.extend(files::rows());
    rows
}

#[test]
fn broken_files_give_the_right_mesh_or_a_named_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut wrong = Vec::new();
    for row in rows() {
        let (line, is_right) = row.tried(folder.path());
        println!("{} | {:40} | {line}", if is_right { "ok   " } else { "WRONG" }, row.name);
        if !is_right {
            wrong.push(row.name);
        }
    }
    assert!(rows().len() >= 40);
    assert!(wrong.is_empty(), "other outcomes than expected: {wrong:?}");
}

#[test]
fn truncated_and_altered_files_give_a_sound_mesh_or_an_error_that_names_the_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for row in rows() {
        let path = folder.path().join(row.file);
        let n = row.bytes.len();
        let truncated = (0..20).map(|cut| row.bytes[..n * cut / 20].to_vec());
        let altered = (0..if n == 0 { 0 } else { 50 }).map(|step| {
            let mut bytes = row.bytes.clone();
            bytes[step * 7919 % n] ^= 1 << (step % 8);
            bytes
        });
        for bytes in truncated.chain(altered) {
            // A new file each time: some file systems wait for the disk when a file is overwritten.
            if path.exists() {
                std::fs::remove_file(&path).expect("the temporary folder is writable");
            }
            std::fs::write(&path, &bytes).expect("the temporary folder is writable");
            match read_file(&path, &ReadOptions::default()) {
                Ok(file) => file.mesh.check().expect("what a reader gives is sound"),
                Err(error @ Error::Malformed { .. }) => assert!(error.to_string().contains(row.file), "{error}"),
                // A format that is not known is refused by its name, before the content is looked at.
                Err(Error::Input(problem)) if row.name == "unknown extension" => {
                    assert!(problem.contains(row.file), "{problem}");
                }
                Err(error) => panic!("{}: {error}", row.name),
            }
        }
    }
}
