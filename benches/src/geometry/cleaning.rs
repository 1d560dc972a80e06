//! Rows of cleaning: a mesh that needs none, one whose faces have to be joined first, a simulated scan; and of decimation.

use std::error::Error;
use std::path::{Path, PathBuf};

use habitus::io::mesh::{NonFinite, ReadOptions, read_file};
use habitus::mesh::clean::{CleanOptions, clean};
use habitus::mesh::decimation::{DecimationOptions, decimated};

use super::table::Row;
use super::workload::{bumpy_sphere, soup};
use super::{Bench, Candidate, Plan, memory};

/// Adds the rows: surfaces of about `20 f^2` faces. Bytes are those at the peak, beside the mesh that is cleaned.
///
/// # Errors
/// When cleaning fails, or leaves a mesh of another size than the one that the faces were taken from.
pub fn cleaning(plan: &Plan, rows: &mut Vec<Row>) -> Result<(), Box<dyn Error>> {
    for &frequency in &plan.frequencies {
        let sound = bumpy_sphere(frequency);
        let parted = soup(&sound);
        let n = sound.faces.len();
        let mut bench = Bench { plan, group: "cleaning", n, rows };
        for (name, job, mesh) in [("of a sound mesh", "clean", &sound), ("of single faces", "clean-soup", &parted)] {
            let cleaned = clean(mesh, &CleanOptions::default())?.mesh;
            let counts = (cleaned.positions.len(), cleaned.faces.len());
            if counts != (sound.positions.len(), n) {
                return Err(format!("cleaning {name}: {counts:?} vertices and faces are left of {n} faces").into());
            }
            let peak = memory::of(job, &frequency.to_string()).map(|memory| memory.peak);
            let candidate = Candidate::alone(n, || clean(mesh, &CleanOptions::default()));
            bench.add(name, n, vec![Candidate { bytes: peak, ..candidate }])?;
        }
    }
    Ok(())
}

/// Adds the row of a scan, the largest mesh file in the folders `bodies/scans` and `faces/scans` of the shared data, if
/// `HABITUS_DATA` names them. Those scans are simulated, with the faults of real ones.
///
/// # Errors
/// When it cannot be read or cleaned.
pub fn scan(plan: &Plan, rows: &mut Vec<Row>) -> Result<(), Box<dyn Error>> {
    let Some(path) = std::env::var_os("HABITUS_DATA").and_then(|data| largest_scan(Path::new(&data))) else {
        eprintln!("without a scan: set HABITUS_DATA to the shared data");
        return Ok(());
    };
    let mesh = read_file(&path, &ReadOptions { non_finite: NonFinite::Keep })?.mesh;
    let n = mesh.faces.len();
    let mut bench = Bench { plan, group: "simulated scan", n, rows };
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    bench.add(&format!("clean {name}"), n, vec![Candidate::alone(n, || clean(&mesh, &CleanOptions::default()))])
}

/// The scan with faces whose file is largest; of equal ones the first by name.
fn largest_scan(data: &Path) -> Option<PathBuf> {
    let folders = ["bodies/scans", "faces/scans"].map(|folder| data.join(folder));
    let files = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
    let mut paths: Vec<PathBuf> = files.map(|file| file.path()).collect();
    paths.retain(|path| {
        path.extension().is_some_and(|end| ["ply", "obj", "stl", "off"].iter().any(|known| end == *known))
    });
    paths.sort();
    let size = |path: &PathBuf| std::fs::metadata(path).map_or(0, |file| file.len());
    paths.into_iter().rev().max_by_key(size)
}

/// Adds the rows of decimation to a tenth: surfaces of about `20 f^2` faces. Items are the faces of the original.
///
/// # Errors
/// When the mesh is refused, or more than a tenth is left.
pub fn decimation(plan: &Plan, rows: &mut Vec<Row>) -> Result<(), Box<dyn Error>> {
    for &frequency in &plan.frequencies {
        let mesh = bumpy_sphere(frequency);
        let n = mesh.faces.len();
        let options = DecimationOptions::to_faces(n / 10);
        let left = decimated(&mesh, &options)?.mesh.faces.len();
        if left > n / 10 {
            return Err(format!("decimation leaves {left} faces of {n}").into());
        }
        let mut bench = Bench { plan, group: "decimation", n, rows };
        bench.add("to a tenth", n, vec![Candidate::alone(n, || decimated(&mesh, &options))])?;
    }
    Ok(())
}
