//! What the demonstration leaves beside its page: meshes, and one picture of everything.

use habitus_core::format::{Mode, Model};

use super::fits::FaceFit;
use super::scans::UnseenScan;
use crate::Error;
use crate::generate::{mesh, positions, weights_from_deviations, weights_of_expression};
use crate::mesh::Mesh;
use crate::report::contact_sheet;
use crate::report::page::File;
use crate::report::portrait::{LINING, PORTRAIT};
use crate::synth::face_grid::LANDMARKS;
use crate::synth::face_motion::EXPRESSIONS;

/// The name of the files of an unseen face.
pub(super) fn name(number: usize, scan: &UnseenScan) -> String {
    format!("unseen_{number}_{}", EXPRESSIONS[scan.expression])
}

/// The mean face in every expression.
pub(super) fn expressions(model: &Model<'_>) -> Result<Vec<Mesh>, Error> {
    let identity = weights_from_deviations(model, Mode::Identity, &[])?;
    let face = |name: &&str| Ok(mesh(model, &positions(model, &identity, &weights_of_expression(model, name)?)?));
    EXPRESSIONS.iter().map(face).collect()
}

/// What the page does not name: the fits that it compares with (PLY), and `faces.png`.
pub(super) fn all(model: &Model<'_>, scans: &[UnseenScan], fits: &[FaceFit]) -> Result<Vec<File>, Error> {
    let mut files = Vec::new();
    for (number, (scan, fit)) in scans.iter().zip(fits).enumerate() {
        let name = name(number, scan);
        for (part, mesh) in [("landmark_fit", &fit.by_landmarks.mesh), ("point_fit", &fit.by_points.mesh)] {
            files.push(File::ply(format!("{name}_{part}.ply"), mesh)?);
        }
    }
    let plain = |mesh: &Mesh| Mesh { colours: Vec::new(), ..mesh.clone() };
    let rows = [
        in_place(&expressions(model)?, scans),
        scans.iter().map(UnseenScan::upright_person).collect(),
        scans.iter().zip(fits).map(|(scan, fit)| scan.upright(&fit.by_scan.mesh)).collect(),
        scans.iter().map(|scan| plain(&scan.upright(&scan.truth))).collect(),
    ];
    let sheet = contact_sheet(&rows, &[PORTRAIT], [220, 280], Some(LINING));
    files.push(File::new("faces.png", sheet.png_bytes()?));
    Ok(files)
}

/// The marked landmarks of a scan as a labelled list.
pub(super) fn landmarks(scan: &UnseenScan) -> String {
    let all = LANDMARKS.iter().zip(&scan.landmarks).zip(&scan.marked);
    let marked =
        all.filter(|(_, marked)| **marked).map(|((name, [x, y, z]), _)| format!("{name}\n{x:.4} {y:.4} {z:.4}\n"));
    let lines: Vec<String> = marked.collect();
    format!("{}\n{}", lines.len(), lines.concat())
}

/// Shapes of the model moved to where the scanned people are, so that all have one frame.
fn in_place(shapes: &[Mesh], scans: &[UnseenScan]) -> Vec<Mesh> {
    let centre = |meshes: &[Mesh]| -> [f64; 3] {
        let points = || meshes.iter().flat_map(|mesh| &mesh.positions);
        let n = points().count().max(1) as f64;
        std::array::from_fn(|axis| points().map(|point| point[axis]).sum::<f64>() / n)
    };
    let truths: Vec<Mesh> = scans.iter().map(|scan| scan.upright(&scan.truth)).collect();
    let (from, to) = (centre(shapes), centre(&truths));
    let moved = |mesh: &Mesh| Mesh {
        positions: mesh.positions.iter().map(|p| [0, 1, 2].map(|axis| p[axis] + to[axis] - from[axis])).collect(),
        ..mesh.clone()
    };
    shapes.iter().map(moved).collect()
}
