//! Rows of mesh files: reading from a file that the system holds in memory, writing into memory.
//!
//! Coordinates have three decimals, micrometres, as scanners write them; what text costs depends on it.

use std::error::Error;
use std::path::Path;

use habitus::io::mesh::{
    Encoding, Formatted, MeshFile, ReadOptions, WriteOptions, gltf, npy_cloud, obj, off, ply, read_file, stl,
};

use super::peers::Task;
use super::table::Row;
use super::workload::bumpy_sphere;
use super::{Bench, Candidate, Plan, memory};

type Format = fn(&MeshFile, &WriteOptions) -> Result<Formatted, String>;

/// Adds the rows: surfaces of about `20 f^2` faces. Items are the bytes of the file; bytes are those at the peak of reading.
///
/// # Errors
/// When a file is not read as it was written.
pub fn files(plan: &Plan, rows: &mut Vec<Row>) -> Result<(), Box<dyn Error>> {
    let opponents = plan.peers.readers()?;
    let folder = tempfile::tempdir()?;
    let formats: [(&str, &str, Format, Encoding); 9] = [
        ("PLY", "ply", ply::format, Encoding::Binary),
        ("PLY, big endian", "ply", ply::format, Encoding::BigEndian),
        ("PLY, text", "ply", ply::format, Encoding::Text),
        ("STL", "stl", stl::format, Encoding::Binary),
        ("STL, text", "stl", stl::format, Encoding::Text),
        ("OBJ", "obj", obj::format, Encoding::Text),
        ("OFF", "off", off::format, Encoding::Text),
        ("GLB", "glb", gltf::format, Encoding::Binary),
        ("NPY", "npy", npy_cloud::format, Encoding::Binary),
    ];
    for &frequency in &plan.frequencies {
        let mut mesh = bumpy_sphere(frequency);
        mesh.positions.iter_mut().flatten().for_each(|x| *x = (*x * 1e3).round() / 1e3);
        let n = mesh.faces.len();
        let file = MeshFile::from(mesh);
        let mut bench = Bench { plan, group: "files", n, rows };
        for (at, (name, extension, format, encoding)) in formats.into_iter().enumerate() {
            let options = WriteOptions { encoding };
            let bytes = format(&file, &options)?.bytes;
            let path = folder.path().join(format!("{at}.{extension}"));
            std::fs::write(&path, &bytes)?;
            let size = bytes.len();
            drop(bytes);

            let read = || read_file(&path, &ReadOptions::default());
            let again = read()?.mesh;
            let n_read = if extension == "npy" { 2 * again.positions.len() - 4 } else { again.faces.len() };
            if n_read != n {
                return Err(format!("{name}: {n_read} faces were read of {n}").into());
            }
            let text = path.to_str().ok_or("the folder for temporary files has a name that is no text")?;
            let peak = memory::of("read", text).map(|memory| memory.peak);
            let mut candidates = vec![Candidate { bytes: peak, ..Candidate::alone(size, read) }];
            candidates.extend(crate_of(extension, &path, size));
            if !matches!(extension, "npy") {
                candidates.extend(opponents.candidates(&Task {
                    job: format!("read {text}"),
                    items: size,
                    values: &[],
                })?);
            }
            bench.add(&format!("{name}: read"), size, candidates)?;
            let write = || format(&file, &options);
            bench.add(&format!("{name}: write"), size, vec![Candidate::alone(size, write)])?;
        }
    }
    Ok(())
}

/// The crate of others that reads such files, if we have one.
fn crate_of<'a>(extension: &str, path: &'a Path, size: usize) -> Option<Candidate<'a>> {
    let open = move || std::io::BufReader::new(std::fs::File::open(path).expect("the file that was written"));
    match extension {
        "obj" => {
            let candidate = Candidate::alone(size, move || tobj::load_obj(path, &tobj::LoadOptions::default()));
            Some(candidate.called("tobj (32 bits)"))
        }
        "stl" => Some(Candidate::alone(size, move || stl_io::read_stl(&mut open())).called("stl_io (32 bits)")),
        "ply" => {
            let parser = ply_rs_bw::parser::Parser::<ply_rs_bw::ply::DefaultElement>::new();
            Some(Candidate::alone(size, move || parser.read_ply(&mut open())).called("ply-rs-bw"))
        }
        _ => None,
    }
}
