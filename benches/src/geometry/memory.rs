//! How much memory a job needs: in a process of its own, as the system counts it (Linux; elsewhere it stays unknown).

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::Command;

use habitus::io::mesh::{ReadOptions, read_file};
use habitus::mesh::clean::{CleanOptions, clean};
use habitus::spatial::{PointTree, WindingTree};

use super::workload::{bumpy_sphere, shuffled, soup};

/// The flag with which a program that uses this module calls itself.
pub const FLAG: &str = "--memory-of";

/// Bytes beyond those at the start.
#[derive(Debug, Clone, Copy)]
pub struct Memory {
    /// At the worst moment of the job.
    pub peak: usize,
    /// Still occupied when only the result is left.
    pub kept: usize,
}

/// The memory of a job of [`answer`]. Nothing where the system does not tell.
pub fn of(job: &str, argument: &str) -> Option<Memory> {
    let mut command = Command::new(std::env::current_exe().ok()?);
    // What is freed goes back to the system at once, so that it is not counted, nor hides what comes after it.
    let command = command.env("MALLOC_MMAP_THRESHOLD_", "16384").env("MALLOC_TRIM_THRESHOLD_", "0");
    let output = command.env("RAYON_NUM_THREADS", "1").args([FLAG, job, argument]).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let mut numbers = text.split_whitespace().map(str::parse);
    let (peak, kept) = (numbers.next()?.ok()?, numbers.next()?.ok()?);
    Some(Memory { peak, kept })
}

/// Does a job in this process and prints what it needed. The argument is a frequency, or the path of a file.
///
/// # Errors
/// When the job is unknown or fails.
pub fn answer(job: &str, argument: &str) -> Result<(), Box<dyn Error>> {
    let mesh = || argument.parse().map(bumpy_sphere);
    let memory = match job {
        "read" => during(|| read_file(Path::new(argument), &ReadOptions::default()))?,
        "points" => {
            let points = shuffled(mesh()?.positions);
            during(|| PointTree::new(&points))?
        }
        "winding" => {
            let mesh = mesh()?;
            during(|| WindingTree::of_mesh(&mesh.positions, &mesh.faces))?
        }
        "clean" => {
            let mesh = mesh()?;
            during(|| clean(&mesh, &CleanOptions::default()))?
        }
        "clean-soup" => {
            let mesh = soup(&mesh()?);
            during(|| clean(&mesh, &CleanOptions::default()))?
        }
        _ => return Err(format!("no job {job:?} to tell the memory of").into()),
    };
    if let Some(Memory { peak, kept }) = memory {
        println!("{peak} {kept}");
    }
    Ok(())
}

fn during<T>(job: impl FnOnce() -> Result<T, habitus::Error>) -> Result<Option<Memory>, Box<dyn Error>> {
    // The system forgets the peak so far.
    let forgets = fs::write("/proc/self/clear_refs", "5").is_ok();
    let before = status("VmRSS:");
    let result = job()?;
    let (peak, after) = (status("VmHWM:"), status("VmRSS:"));
    drop(result);
    let beyond = |bytes: Option<usize>| Some(bytes?.saturating_sub(before?));
    Ok(beyond(peak).zip(beyond(after)).filter(|_| forgets).map(|(peak, kept)| Memory { peak, kept }))
}

/// A line of the system's account of this process, in bytes.
fn status(name: &str) -> Option<usize> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    Some(1024 * line.trim().strip_suffix(" kB")?.parse::<usize>().ok()?)
}
