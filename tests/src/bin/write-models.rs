//! Writes the developer's models into a folder: wavelet models of procedural faces, cubic and bilinear; from the shared data a face of 30 + 7 weights, a
//! body of 20 and of 100 components. Beside them lies what the firmware compares with: results of this machine.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use habitus::Error;
use habitus_core::format::Model;
use habitus_core::quantise::F32;
use habitus_core::wavelet::Wavelet;
use habitus_tests::data::dir_or_skip;
use habitus_tests::models::{body, face, wavelet};

#[path = "../../../examples/firmware/src/cases.rs"]
#[allow(dead_code)]
mod cases;

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

fn written(folder: &Path) -> Result<(), Error> {
    for (name, kind) in [("cubic", Wavelet::Cubic), ("bilinear", Wavelet::Bilinear)] {
        let file = wavelet::file(PEOPLE, kind)?;
        write(folder, &format!("face-{name}.hab"), &file)?;
        let (landmarks, rms) = kernel(fitted_wavelet(&file))?;
        write(folder, &format!("face-{name}.landmarks"), &landmarks)?;
        write(folder, &format!("face-{name}.rms"), &rms)?;
    }
    let Some(data) = dir_or_skip("write-models") else { return Ok(()) };
    let file = face::file(&data)?;
    write(folder, "face30.hab", &file)?;
    write(folder, "face30.rms", &kernel(fitted_face(&file))?)?;
    for dim in [20, 100] {
        let file = body::file(&data, dim)?;
        write(folder, &format!("body{dim}.hab"), &file)?;
        write(folder, &format!("body{dim}.mean"), &kernel(body_mean(&file))?)?;
    }
    Ok(())
}

/// Room for every state and fit here, floats.
const MEMORY: usize = 1 << 20;

/// Mean of all coordinates of a body.
fn body_mean(file: &[u8]) -> Result<[u8; 4], habitus_core::Error> {
    let body = Model::open(file)?.skinned::<F32<'_>>()?;
    Ok(cases::mean_by_ranges(&body, &mut vec![0.0; MEMORY])?.to_le_bytes())
}

/// What is left of the distances of a face's landmarks.
fn fitted_face(file: &[u8]) -> Result<[u8; 4], habitus_core::Error> {
    let model = Model::open(file)?;
    let (face, mut memory) = (model.bilinear()?, vec![0.0; MEMORY]);
    let targets = cases::targets(&model, &face, 0, &mut memory)?;
    Ok(cases::fitted(&model, &face, &targets, &mut memory)?.rms.to_le_bytes())
}

/// Landmarks of a wavelet model's shape, three numbers each, and what is left of their distances when the first two levels are fitted.
fn fitted_wavelet(file: &[u8]) -> Result<(Vec<u8>, [u8; 4]), habitus_core::Error> {
    let model = Model::open(file)?;
    let (generator, mut memory) = (model.wavelet::<F32<'_>>()?, vec![0.0; MEMORY]);
    let targets = cases::targets(&model, &generator, 0, &mut memory)?;
    let rms = cases::wavelet_fitted(&model, &generator, &targets, 2, &mut memory)?.rms;
    let numbers = targets.iter().flat_map(|target| target.unwrap_or([f32::NAN; 3]));
    Ok((numbers.flat_map(f32::to_le_bytes).collect(), rms.to_le_bytes()))
}

fn kernel<T>(result: Result<T, habitus_core::Error>) -> Result<T, Error> {
    result.map_err(|error| Error::Kernel { what: "the model cannot be used".into(), error })
}

fn write(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), Error> {
    let path = folder.join(name);
    habitus::io::atomic::write(&path, bytes)?;
    println!("{}", path.display());
    Ok(())
}
