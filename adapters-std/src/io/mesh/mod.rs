//! Mesh files: one format, one file, reading and writing together. The extension tells the format.
//!
//! | extension | reads | writes |
//! |---|---|---|
//! | `.obj` | yes | yes, text |
//! | `.ply` | text and binary | yes, binary little endian |
//! | `.off` | yes | yes, text |
//! | `.glb` | no | yes, metres |
//!
//! Readers keep the order and the number of the vertices as they are in the file, whatever the faces use: models and
//! landmarks name vertices by their index. No reader or writer but [`glb`] converts units.

mod file;
pub mod glb;
pub mod obj;
pub mod off;
pub mod ply;
mod range;
#[cfg(test)]
mod samples;

pub use file::{Encoding, Formatted, Joint, MeshFile, MorphTarget, NonFinite, ReadOptions, Skin, WriteOptions};

use std::path::Path;

use crate::io::{atomic, file_bytes};
use crate::mesh::Mesh;
use crate::{Error, Place};

/// The mesh or point cloud in the file at `path`.
///
/// # Errors
/// [`Error::Read`], [`Error::Malformed`] with the line or byte, or [`Error::Input`] for an extension that is not read.
pub fn read(path: impl AsRef<Path>) -> Result<Mesh, Error> {
    let path = path.as_ref();
    let parse = match extension(path).as_str() {
        "obj" => obj::parse,
        "ply" => ply::parse,
        "off" => off::parse,
        other => return Err(unknown(path, other, "read", "obj, ply, off")),
    };
    parse(&file_bytes(path)?, path)
}

/// All that the file at `path` holds.
///
/// # Errors
/// As [`read`].
pub fn read_file(path: impl AsRef<Path>, options: &ReadOptions) -> Result<MeshFile, Error> {
    let _ = options;
    Ok(read(path)?.into())
}

/// Writes the content to `path`, atomically, in the format of its extension; returns what the format cannot hold.
///
/// # Errors
/// As [`write`].
pub fn write_file(path: impl AsRef<Path>, file: &MeshFile, options: &WriteOptions) -> Result<Vec<String>, Error> {
    let _ = options;
    write(path, &file.mesh)?;
    Ok(Vec::new())
}

/// Writes the mesh to `path`, atomically, in the format of its extension.
///
/// # Errors
/// [`Error::Write`], or [`Error::Input`] for an extension that is not written or a mesh that fails [`Mesh::check`].
pub fn write(path: impl AsRef<Path>, mesh: &Mesh) -> Result<(), Error> {
    let path = path.as_ref();
    let format: fn(&Mesh) -> Vec<u8> = match extension(path).as_str() {
        "obj" => obj::format,
        "ply" => ply::format,
        "off" => off::format,
        "glb" => return glb::write_with_morphs(path, mesh, &[]),
        other => return Err(unknown(path, other, "written", "obj, ply, off, glb")),
    };
    check(path, mesh)?;
    atomic::write(path, &format(mesh))
}

/// [`Mesh::check`], with the file that would have been written in the message.
fn check(path: &Path, mesh: &Mesh) -> Result<(), Error> {
    mesh.check().map_err(|error| Error::input(format!("{} is not written: {error}", path.display())))
}

fn extension(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

fn unknown(path: &Path, extension: &str, verb: &str, known: &str) -> Error {
    let path = path.display();
    Error::input(match extension {
        "" => format!("{path}: a mesh file needs an extension that tells its format: {known}"),
        _ => format!("{path}: meshes are not {verb} as .{extension}; known extensions: {known}"),
    })
}

/// Appends the triangles of a polygon: a fan from its first corner.
fn push_fan(faces: &mut Vec<[u32; 3]>, polygon: &[u32]) {
    if let [first, rest @ ..] = polygon {
        faces.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
    }
}

/// Whether a file of `n` vertices is a mesh: there is at least one, and indices can name them all.
fn check_n_vertices(n: usize, path: &Path) -> Result<(), Error> {
    let problem = match u32::try_from(n) {
        Ok(0) => "there is no vertex in it: is it a mesh file of the format of its extension?".to_owned(),
        Ok(_) => return Ok(()),
        Err(_) => format!("it has {n} vertices; at most {} can be indexed: divide the mesh", u32::MAX),
    };
    Err(Error::malformed(path, Place::Whole, problem))
}

/// A colour channel given as a real number, as a byte. `one` is the number of full intensity.
fn colour_byte(value: f64, one: f64) -> Option<u8> {
    let scaled = (value / one * 255.0).round();
    (0.0..=255.0).contains(&scaled).then_some(scaled as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_reads_back_what_it_wrote() {
        let folder = tempfile::tempdir().expect("folder");
        for mesh in samples::meshes() {
            for name in ["a.obj", "a.PLY", "a.Off"] {
                let path = folder.path().join(name);
                write(&path, &mesh).expect("write");
                assert_eq!(read(&path).expect("read"), mesh, "{name}");
            }
        }
    }

    #[test]
    fn unknown_extensions_are_told_the_known_ones() {
        let message = |outcome: Result<(), Error>| outcome.expect_err("must fail").to_string();
        let mesh = samples::meshes().remove(0);
        assert!(message(write("a.stl", &mesh)).contains(".stl; known extensions: obj, ply, off, glb"));
        assert!(message(read("a.glb").map(|_| ())).contains(".glb; known extensions: obj, ply, off"));
        assert!(message(read("folder.obj/a").map(|_| ())).contains("needs an extension"));
    }

    #[test]
    fn a_mesh_that_does_not_fit_together_is_not_written() {
        let folder = tempfile::tempdir().expect("folder");
        let mesh = Mesh { positions: vec![[0.0; 3]], faces: vec![[0, 0, 1]], ..Mesh::default() };
        for name in ["a.obj", "a.ply", "a.off", "a.glb"] {
            let path = folder.path().join(name);
            let message = write(&path, &mesh).expect_err("must fail").to_string();
            assert!(message.contains("is not written: face 0"), "{message}");
            assert!(!path.exists());
        }
    }

    #[test]
    fn fans_start_at_the_first_corner() {
        let mut faces = Vec::new();
        push_fan(&mut faces, &[4, 7, 9, 1]);
        assert_eq!(faces, [[4, 7, 9], [4, 9, 1]]);
    }
}
