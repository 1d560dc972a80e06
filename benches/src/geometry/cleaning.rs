//! Rows of cleaning: a mesh that needs none, and one whose faces have to be joined first.

use std::error::Error;

use habitus::mesh::clean::{CleanOptions, clean};

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
