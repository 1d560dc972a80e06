//! Writes GLB and glTF files of everything that our writer can write into a folder, for `cargo xtask gltf`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use habitus::Error;
use habitus::io::mesh::{WriteOptions, write_file};
use habitus_tests::data::dir_or_skip;
use habitus_tests::gltf_files::{body, contents};

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("usage: write-gltf FOLDER");
        return ExitCode::FAILURE;
    };
    match written(&folder) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn written(folder: &Path) -> Result<(), Error> {
    let mut files = contents();
    files.extend(dir_or_skip("the body of write-gltf").map(|data| ("body", body(&data))));
    for (name, file) in files {
        for extension in ["glb", "gltf"] {
            write_file(folder.join(format!("{name}.{extension}")), &file, &WriteOptions::default())?;
        }
    }
    Ok(())
}
