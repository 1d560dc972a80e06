//! Scans as files: `scan_00.ply`, what is true of it, and `scans.json` with everything that was done.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{Label, Scan, ScanOptions};
use crate::Error;
use crate::io::{self, atomic, npy};
use crate::measure::distance::{DistanceSummary, PointDistance, Target};
use crate::mesh::Mesh;
use crate::register::rigid::Similarity;
use crate::spatial::frame_recovery::Unit;

/// The face of a point that is none of the subject, in `truth_face_00.npy`.
pub const NO_FACE: u32 = u32::MAX;

/// Digits of the numbers in the names of the files of so many scans.
fn digits(n_scans: usize) -> usize {
    n_scans.saturating_sub(1).to_string().len().max(2)
}

/// The meshes that a folder of so many scans will have.
pub fn scan_names(n_scans: usize) -> impl Iterator<Item = String> {
    let width = digits(n_scans);
    (0..n_scans).flat_map(move |k| ["scan", "truth"].map(|name| format!("{name}_{k:0width$}.ply")))
}

/// A folder of scans that grows.
#[derive(Debug)]
pub struct ScanFolder {
    path: PathBuf,
    unit: Unit,
    /// Digits of the numbers in file names.
    width: usize,
    records: Vec<Value>,
}

impl ScanFolder {
    /// The folder at `path`, which is made when it does not exist, for `n_scans` scans in files of this unit.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn new(path: &Path, unit: Unit, n_scans: usize) -> Result<Self, Error> {
        std::fs::create_dir_all(path).map_err(|source| Error::Write { path: path.to_owned(), source })?;
        let width = digits(n_scans);
        Ok(ScanFolder { path: path.to_owned(), unit, width, records: Vec::new() })
    }

    /// The records of the scans so far, as they will be in `scans.json`.
    pub fn records(&self) -> &[Value] {
        &self.records
    }

    /// Writes the next scan: itself, the subject placed as it is in the scan (`truth_00.ply`), and where on the subject each point
    /// comes from (`truth_face_00.npy`, `truth_barycentric_00.npy`). `subject`, in mm, is the mesh that was scanned, from `input`.
    ///
    /// Positions of the scan are rounded to single precision, which is what scanners write.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn add(&mut self, scan: &Scan, subject: &Mesh, input: &Path, options: &ScanOptions) -> Result<(), Error> {
        let number = format!("{:0width$}", self.records.len(), width = self.width);
        let [file, truth, faces, barycentric] = [
            format!("scan_{number}.ply"),
            format!("truth_{number}.ply"),
            format!("truth_face_{number}.npy"),
            format!("truth_barycentric_{number}.npy"),
        ];
        let placed = placed(subject, &scan.placement);
        let scale = 1.0 / self.unit.millimetres();
        let mut in_unit = scan.mesh.clone();
        for x in in_unit.positions.iter_mut().flatten() {
            *x = f64::from((*x * scale) as f32);
        }
        io::mesh::write(self.path.join(&file), &in_unit)?;
        let mut truth_in_unit = placed.clone();
        truth_in_unit.positions.iter_mut().flatten().for_each(|x| *x *= scale);
        io::mesh::write(self.path.join(&truth), &truth_in_unit)?;
        let n = scan.truth.len();
        let face_of: Vec<u32> = scan.truth.iter().map(|at| at.map_or(NO_FACE, |at| at.face)).collect();
        npy::write_u32(self.path.join(&faces), &[n], &face_of)?;
        let coordinates: Vec<f64> = scan.truth.iter().flat_map(|at| at.map_or([0.0; 3], |at| at.barycentric)).collect();
        npy::write_f64(self.path.join(&barycentric), &[n, 3], &coordinates)?;
        let of_subject: Vec<[f64; 3]> =
            scan.mesh.positions.iter().zip(&scan.truth).filter(|(_, at)| at.is_some()).map(|(&p, _)| p).collect();
        let views = scan.views.iter().map(|view| {
            json!({
                "yaw_deg": view.viewpoint.yaw_deg,
                "pitch_deg": view.viewpoint.pitch_deg,
                "pixels": view.size,
                "calibration_mm": matrix(&view.calibration, 1.0),
                "points": view.points,
                "grazing": view.grazing,
                "from_behind": view.from_behind,
                "in_holes": view.in_holes,
            })
        });
        let holes = scan.holes.iter().map(|hole| json!({ "centre_mm": hole.centre, "radius_mm": hole.radius }));
        self.records.push(json!({
            "file": file,
            "input": input.display().to_string(),
            "truth": truth,
            "truth_face": faces,
            "truth_barycentric": barycentric,
            "points": n,
            "triangles": scan.mesh.faces.len(),
            "labels": {
                "surface": scan.count(Label::Surface),
                "clutter": scan.count(Label::Clutter),
                "outlier": scan.count(Label::Outlier),
            },
            "distance_to_truth_mm": summary(scan.errors(subject)),
            "distance_to_surface_mm":
                summary(Target::new(&placed)?.distances(&of_subject).iter().map(|point| point.distance)),
            "placement": matrix(&scan.placement, scale),
            "views": views.collect::<Vec<_>>(),
            "holes": holes.collect::<Vec<_>>(),
            "options": options,
        }));
        Ok(())
    }

    /// Writes `scans.json`.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn finish(&self) -> Result<(), Error> {
        let whole = json!({
            "simulated": true,
            "unit": self.unit.symbol(),
            "labels": { "0": "surface", "1": "clutter", "2": "outlier" },
            "no_face": NO_FACE,
            "scans": self.records,
        });
        atomic::write(self.path.join("scans.json"), format!("{whole:#}\n").as_bytes())
    }
}

/// The shape of the subject in the frame of the scan.
fn placed(subject: &Mesh, placement: &Similarity) -> Mesh {
    Mesh {
        positions: subject.positions.iter().map(|&p| placement.point(p)).collect(),
        faces: subject.faces.clone(),
        colours: subject.colours.clone(),
        ..Mesh::default()
    }
}

/// The rows of a rigid motion of which the translation is multiplied by `scale`.
fn matrix(motion: &Similarity, scale: f64) -> [[f64; 4]; 4] {
    std::array::from_fn(|row| match row {
        3 => [0.0, 0.0, 0.0, 1.0],
        _ => {
            let [a, b, c] = motion.rotation[row];
            [a, b, c, motion.translation[row] * scale]
        }
    })
}

/// Figures of distances; null without any.
fn summary(distances: impl IntoIterator<Item = f64>) -> Value {
    let point = |distance| (PointDistance { distance, signed: None, at_boundary: false }, 1.0);
    let points: Vec<_> = distances.into_iter().map(point).collect();
    DistanceSummary::of(&points, &[]).map_or(Value::Null, |all| {
        json!({ "mean": all.mean, "rms": all.rms, "median": all.median, "p95": all.quantile_95, "largest": all.largest })
    })
}
