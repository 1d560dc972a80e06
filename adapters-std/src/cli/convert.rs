//! `habitus convert`: a mesh file in another format, with other triangles or as points.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::convert_shape::ShapeArgs;
use super::{Console, Outputs, shown};
use crate::Error;
use crate::io::mesh::{self, ReadOptions, WriteOptions};

/// Arguments of `convert`.
#[derive(Debug, Args)]
pub(super) struct ConvertArgs {
    /// Mesh or point cloud; the extension tells the format
    input: PathBuf,
    /// How the numbers of a PLY or STL file are written [default: binary]
    #[arg(long, value_enum, value_name = "ENCODING")]
    encoding: Option<Encoding>,
    #[command(flatten)]
    shape: ShapeArgs,
    /// Output; the extension tells the format. What it cannot hold is named in a warning
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Encoding {
    /// Binary, little endian.
    Binary,
    /// Binary, big endian (PLY alone).
    BigEndian,
    /// Text.
    Text,
}

impl From<Encoding> for mesh::Encoding {
    fn from(encoding: Encoding) -> Self {
        match encoding {
            Encoding::Binary => mesh::Encoding::Binary,
            Encoding::BigEndian => mesh::Encoding::BigEndian,
            Encoding::Text => mesh::Encoding::Text,
        }
    }
}

pub(super) fn run(args: &ConvertArgs, console: &Console) -> Result<(), Error> {
    let has_encodings =
        |extension: &std::ffi::OsStr| ["ply", "stl"].iter().any(|known| extension.eq_ignore_ascii_case(known));
    if args.encoding.is_some() && !args.output.extension().is_some_and(has_encodings) {
        let output = args.output.display();
        return Err(Error::input(format!("{output}: only .ply and .stl have several encodings; leave out --encoding")));
    }
    mesh::expect_written(&args.output)?;
    Outputs::beside([&*args.input]).file("-o", Some(&args.output)).check()?;
    let mut file = mesh::read_file(&args.input, &ReadOptions::default())?;
    for clause in &file.left_out {
        console.warn(&format!("{}: not kept: {clause}", args.input.display()));
    }
    let (vertices, faces) = (file.mesh.positions.len(), file.mesh.faces.len());
    let reshaped = args.shape.applied(&mut file).map_err(|error| match error {
        Error::Input(problem) => Error::Input(format!("{}: {problem}", args.input.display())),
        other => other,
    })?;
    for sentence in &reshaped.warnings {
        console.warn(&format!("{}: {sentence}", args.input.display()));
    }
    let options = WriteOptions { encoding: args.encoding.map(mesh::Encoding::from).unwrap_or_default() };
    let not_held = mesh::write_file(&args.output, &file, &options)?;
    for clause in &not_held {
        console.warn(&format!("{}: the format cannot hold: {clause}", args.output.display()));
    }
    let mut object = json!({
        "output": shown(&args.output),
        "vertices": vertices,
        "faces": faces,
        "written_vertices": file.mesh.positions.len(),
        "written_faces": file.mesh.faces.len(),
        "not_kept": file.left_out,
        "not_held": not_held,
    });
    for (step, described) in reshaped.steps {
        object[step] = described;
    }
    let read = format!("{vertices} vertices, {faces} faces were read");
    console.result(&format!("{}{}: written; {read}", reshaped.text, args.output.display()), object)
}
