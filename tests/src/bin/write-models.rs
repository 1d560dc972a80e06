//! Writes the developer's models into a folder: wavelet models of procedural faces, cubic and bilinear; from the shared data a body of 20 and of 100 components.

use std::path::PathBuf;
use std::process::ExitCode;

use habitus::Error;
use habitus_core::wavelet::Wavelet;
use habitus_tests::data::dir_or_skip;
use habitus_tests::models::{body, wavelet};

/// People of the wavelet models.
const PEOPLE: usize = 40;

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("usage: write-models FOLDER");
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

fn written(folder: &std::path::Path) -> Result<(), Error> {
    for (name, kind) in [("cubic", Wavelet::Cubic), ("bilinear", Wavelet::Bilinear)] {
        let path = folder.join(format!("face-{name}.hab"));
        habitus::io::atomic::write(&path, &wavelet::file(PEOPLE, kind)?)?;
        println!("{}", path.display());
    }
    let Some(data) = dir_or_skip("write-models") else { return Ok(()) };
    for dim in [20, 100] {
        let path = folder.join(format!("body{dim}.hab"));
        habitus::io::atomic::write(&path, &body::file(&data, dim)?)?;
        println!("{}", path.display());
    }
    Ok(())
}
