//! `habitus clean --template`: what was cleaned, in millimetres and with the axes of a template.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};

use super::Console;
use crate::Error;
use crate::io::mesh::{self, Joint, MeshFile};
use crate::mesh::Mesh;
use crate::spatial::frame_recovery::{Frame, FrameOptions, FrameTemplate, Handedness, Unit};

/// Arguments of `clean` on units and axes.
#[derive(Debug, Args)]
pub(super) struct FrameArgs {
    /// A mesh or cloud of the same kind in mm, y up, z to the front: tells the unit and the axes of the input, which is
    /// written in mm and with the template's axes, or refused when they cannot be told
    #[arg(long, value_name = "FILE")]
    template: Option<PathBuf>,
    /// The unit of the input, where its size does not tell
    #[arg(long, value_name = "mm|cm|m|in|ft", requires = "template", value_parser = unit)]
    unit: Option<Unit>,
}

pub(super) fn unit(text: &str) -> Result<Unit, String> {
    Unit::of_symbol(text).ok_or_else(|| "give mm, cm, m, in or ft".into())
}

impl FrameArgs {
    /// Whether a template is given.
    pub(super) fn is_given(&self) -> bool {
        self.template.is_some()
    }

    /// The template, if one is given.
    pub(super) fn template(&self) -> Option<&Path> {
        self.template.as_deref()
    }

    /// The frame of the scan, with a line for people and an object for programs; warns where the scan may be mirrored.
    pub(super) fn of(&self, scan: &Mesh, console: &Console) -> Result<Option<(Frame, String, Value)>, Error> {
        let Some(path) = &self.template else { return Ok(None) };
        let template = FrameTemplate::new(&mesh::read(path)?).map_err(|error| match error {
            Error::Input(problem) => Error::Input(format!("{}: {problem}", path.display())),
            other => other,
        })?;
        let recovery = template.recovery(scan, &FrameOptions { unit: self.unit, ..FrameOptions::default() })?;
        let frame = recovery.frame()?;
        let handedness = match frame.handedness {
            Handedness::ByShape => "shape",
            Handedness::ByNormals => "normals",
            Handedness::Unknown => "unknown",
        };
        if frame.handedness == Handedness::Unknown {
            console.warn("it may be mirrored: its shape is about symmetric and it has no normals that would tell");
        }
        let mut others = recovery.candidates.iter().filter(|candidate| !candidate.mirrored);
        let object = json!({
            "unit": frame.unit.symbol(),
            "mm_per_unit": frame.unit.millimetres(),
            "axes": frame.turn.to_string(),
            "rotation": frame.turn.matrix(),
            "off_axes_degrees": others.next().map(|best| best.off_axes),
            "residual_mm": frame.residual,
            "second_residual_mm": others.next().map(|second| second.residual()),
            "not_mirrored_by": handedness,
        });
        let summary = recovery.to_string();
        let text = format!("frame: {}\n", summary.lines().last().unwrap_or_default());
        Ok(Some((frame, text, object)))
    }
}

/// The file in millimetres and the axes of the template, its morph targets and joints included.
pub(super) fn restored(file: MeshFile, frame: &Frame) -> MeshFile {
    let scale = frame.unit.millimetres();
    let placed = |v: [f64; 3]| frame.turn.applied(v.map(|x| x * scale));
    let MeshFile { mesh, mut morphs, mut skin, left_out } = file;
    for displacement in morphs.iter_mut().flat_map(|morph| &mut morph.displacements) {
        *displacement = placed(*displacement);
    }
    for Joint { bind: [x, y, z, position], .. } in skin.iter_mut().flat_map(|skin| &mut skin.joints) {
        [x, y, z].into_iter().for_each(|column| *column = frame.turn.applied(*column));
        *position = placed(*position);
    }
    MeshFile { mesh: frame.restored(&mesh), morphs, skin, left_out }
}
