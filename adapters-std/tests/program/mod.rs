//! Running the program, and folders for what it reads and writes: shared by the tests of the command line.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use habitus::mesh::Mesh;
use serde_json::Value;

pub fn habitus(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_habitus")).args(arguments).output().expect("the program starts")
}

/// Runs with `--json` and returns the object; fails with what the program said.
pub fn json(arguments: &[&str]) -> Value {
    json_and_said(arguments).0
}

/// The same, and what was said on stderr.
pub fn json_and_said(arguments: &[&str]) -> (Value, String) {
    let output = habitus(&[arguments, &["--json"]].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    (serde_json::from_slice(&output.stdout).expect("an object"), said)
}

/// Runs what must be refused with this status; returns what was said on stderr.
pub fn refused(arguments: &[&str], status: i32) -> String {
    let output = habitus(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {said}");
    said
}

/// A folder of one test.
pub struct Folder(pub PathBuf);

impl Folder {
    /// The folder `name` of the tests `group`, anew.
    pub fn new(group: &str, name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(group).join(name);
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).expect("a folder");
        Folder(folder)
    }

    /// The path of a file.
    pub fn path(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }

    /// Writes a mesh and returns its path.
    pub fn write(&self, name: &str, mesh: &Mesh) -> String {
        let path = self.path(name);
        habitus::io::mesh::write(&path, mesh).expect("written");
        path
    }
}
