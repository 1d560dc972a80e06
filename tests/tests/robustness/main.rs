//! Broken files, read and cleaned: the right result or an error that names the place. `--nocapture` prints the table.

mod files;
mod formats;
mod frames;
mod surfaces;
mod table;

use habitus::Error;
use habitus::io::mesh::{ReadOptions, read_file};
use habitus::mesh::clean::{CleanOptions, clean};

fn rows() -> Vec<table::Row> {
    let mut rows = surfaces::rows();
    rows.extend(files::rows());
    rows.extend(formats::rows());
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
    assert!(rows().len() >= 75);
    assert!(wrong.is_empty(), "other outcomes than expected: {wrong:?}");
}

/// Whether the message begins with the file and a line or byte of it.
fn names_a_place(text: &str, file: &str) -> bool {
    let behind = text.split_once(&format!("{file}, ")).map_or("", |(_, behind)| behind);
    let number = behind.strip_prefix("line ").or(behind.strip_prefix("byte ")).unwrap_or_default();
    number.starts_with(|digit: char| digit.is_ascii_digit())
}

#[test]
fn every_error_of_a_file_names_its_line_or_byte() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut n_refused = 0;
    for row in rows() {
        let path = folder.path().join(row.file);
        std::fs::write(&path, &row.bytes).expect("the temporary folder is writable");
        if let Err(error @ Error::Malformed { .. }) = read_file(&path, &ReadOptions::default()) {
            assert!(names_a_place(&error.to_string(), row.file), "{}: {error}", row.name);
            n_refused += 1;
        }
    }
    assert!(n_refused >= 50, "{n_refused}");
    assert!(!names_a_place("a.obj: there is no vertex", "a.obj") && names_a_place("b/a.obj, line 1: no", "a.obj"));
}

#[test]
fn truncated_and_altered_files_give_a_sound_mesh_or_an_error_that_names_the_place() {
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
                Err(error @ Error::Malformed { .. }) => assert!(names_a_place(&error.to_string(), row.file), "{error}"),
                // A format that is not known is refused by its name, before the content is looked at.
                Err(Error::Input(problem)) if row.name == "unknown extension" => {
                    assert!(problem.contains(row.file), "{problem}");
                }
                Err(error) => panic!("{}: {error}", row.name),
            }
        }
    }
}

#[test]
fn what_is_no_file_is_an_error_that_names_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir(folder.path().join("folder.ply")).expect("the temporary folder is writable");
    for name in ["folder.ply", "missing.ply", "missing.obj", "missing.glb", "", "folder.ply/missing.off"] {
        let error = read_file(folder.path().join(name), &ReadOptions::default()).expect_err("there is no such file");
        println!("{name:24} | {error}");
        assert!(error.to_string().contains(name), "{error}");
        assert!(matches!(error, Error::Read { .. } | Error::Input(_)), "{name}: {error}");
    }
}

#[test]
fn labels_and_other_properties_stay_with_their_vertices() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.ply");
    std::fs::write(&path, surfaces::labelled()).expect("the temporary folder is writable");
    let file = read_file(&path, &ReadOptions::default()).expect("it is sound but for its vertices");
    let mesh = clean(&file.mesh, &CleanOptions::default()).expect("it can be cleaned").mesh;
    let values: Vec<_> = mesh.attributes.iter().map(|of| (of.name.as_str(), of.values.as_slice())).collect();
    assert_eq!(values, [("label", &[1.0, 1.0, 2.0, 3.0][..]), ("quality", &[0.5, 0.25, 0.0, 4.0])]);
}
