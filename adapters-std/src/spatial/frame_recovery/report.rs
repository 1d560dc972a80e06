//! What was found out about a frame, in words.

use std::fmt::{Display, Formatter, Result};

use super::{FrameRecovery, Handedness};

/// The candidates alone, without the outcome.
pub(super) struct Table<'a>(&'a FrameRecovery);

impl FrameRecovery {
    pub(super) fn table(&self) -> Table<'_> {
        Table(self)
    }
}

impl Display for Table<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        writeln!(f, "unit  size of the scan, mm  size / template")?;
        for size in &self.0.sizes {
            let mark = if size.fits { "  fits" } else { "" };
            writeln!(f, "{:4}  {:20.1}  {:15.4}{mark}", size.unit.symbol(), size.diagonal, size.ratio)?;
        }
        if self.0.candidates.is_empty() {
            return Ok(());
        }
        writeln!(f, "axes of the scan               residual, mm  of scan  of template  degrees off the axes")?;
        for candidate in &self.0.candidates {
            let mark = if candidate.mirrored { "  mirrored" } else { "" };
            writeln!(
                f,
                "{:29}  {:12.3}  {:7.3}  {:11.3}  {:20.1}{mark}",
                candidate.turn.to_string(),
                candidate.residual(),
                candidate.of_scan,
                candidate.of_template,
                candidate.off_axes
            )?;
        }
        if let Some(part) = self.0.normals_agree {
            writeln!(f, "normals that agree with the template: {:.1} %", 100.0 * part)?;
        }
        Ok(())
    }
}

impl Display for FrameRecovery {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "{}", self.table())?;
        match &self.outcome {
            Ok(frame) => {
                let handedness = match frame.handedness {
                    Handedness::ByShape => "not mirrored, by its shape",
                    Handedness::ByNormals => "not mirrored, by its normals",
                    Handedness::Unknown => "it may be mirrored: its shape is symmetric and it has no normals",
                };
                let (unit, turn) = (frame.unit.symbol(), frame.turn);
                writeln!(f, "unit {unit}; {turn}; residual {:.3} mm; {handedness}", frame.residual)
            }
            Err(reason) => writeln!(f, "{reason}"),
        }
    }
}
