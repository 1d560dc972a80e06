//! `habitus validate`: whether a model file is sound.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::Console;
use crate::Error;
use crate::io;
use crate::io::model::opened;

/// Arguments of `validate`.
#[derive(Debug, Args)]
pub(super) struct ValidateArgs {
    /// Model file (.hab)
    model: PathBuf,
}

pub(super) fn run(args: &ValidateArgs, console: &Console) -> Result<(), Error> {
    let bytes = io::file_bytes(&args.model)?;
    let model = opened(&bytes, &args.model)?;
    if let Some(faces) = model.faces() {
        let degenerate = faces.iter().filter(|[a, b, c]| a == b || b == c || a == c).count();
        if degenerate > 0 {
            console.warn(&format!("{degenerate} of {} triangles have a vertex twice", faces.len()));
        }
    } else {
        console.warn("no triangles: the model gives points, not meshes");
    }
    if model.landmarks().is_none() {
        console.warn("no landmarks: the model cannot be fitted to landmarks");
    }
    let count = model.sections().iter().count();
    console.result(
        &format!("{}: sound; {count} sections, every checksum, index and number checked", args.model.display()),
        json!({ "sound": true, "sections": count }),
    )
}
