//! `habitus quantise`: a model in fewer bytes, with its measured error inside.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use habitus_core::format::ElementType;
use serde_json::json;

use super::{Console, Outputs, shown};
use crate::Error;
use crate::io::model::{opened, quantise};
use crate::io::{self, atomic};

/// Arguments of `quantise`.
#[derive(Debug, Args)]
pub(super) struct QuantiseArgs {
    /// Model file with 32-bit coefficients
    model: PathBuf,
    /// How coefficients are stored: f16 halves the file; i8, with a scale and an offset for every 16 vertices, axis and component, makes it 2.7 times smaller
    #[arg(long = "as", value_enum, value_name = "STORAGE")]
    storage: Storage,
    /// Output (.hab)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// A storage.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Storage {
    /// Half precision.
    F16,
    /// Bytes.
    I8,
}

pub(super) fn run(args: &QuantiseArgs, console: &Console) -> Result<(), Error> {
    if !args.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("hab")) {
        return Err(Error::input(format!("{}: a model file is called .hab", args.output.display())));
    }
    Outputs::beside([&*args.model]).file("-o", Some(&args.output)).check()?;
    let bytes = io::file_bytes(&args.model)?;
    let model = opened(&bytes, &args.model)?;
    let element = match args.storage {
        Storage::F16 => ElementType::F16,
        Storage::I8 => ElementType::I8,
    };
    let (file, error) = quantise(&model, element).map_err(|error| match error {
        Error::Input(problem) => Error::Input(format!("{}: {problem}", args.model.display())),
        other => other,
    })?;
    atomic::write(&args.output, &file)?;
    let text = format!(
        "{}: {} bytes of {}; vertices of random shapes are {:.4} mm off on average, {:.4} mm at most\n",
        args.output.display(),
        file.len(),
        bytes.len(),
        error.mean_mm,
        error.largest_mm
    );
    console.result(
        &text,
        json!({
            "output": shown(&args.output),
            "bytes": file.len(),
            "bytes_before": bytes.len(),
            "error_mean_mm": error.mean_mm,
            "error_rms_mm": error.rms_mm,
            "error_largest_mm": error.largest_mm,
        }),
    )
}
