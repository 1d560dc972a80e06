//! Mesh files: one format, one file, reading and writing together. The extension tells the format.
//!
//! | extension | reads | writes |
//! |---|---|---|
//! | `.obj` | yes | yes, text |
//! | `.ply` | text and binary | yes, text and binary |
//! | `.off` | yes | yes, text |
//! | `.stl` | text and binary | yes, binary and text, without vertices of its own |
//! | `.npy` | clouds | yes, without faces |
//! | `.glb`, `.gltf` | yes | yes, metres |
//!
//! Readers keep the order and the number of the vertices as they are in the file, whatever the faces use: models and
//! landmarks name vertices by their index. No reader or writer but [`gltf`] converts units.

mod coordinates;
mod file;
pub mod gltf;
mod losses;
pub mod npy_cloud;
pub mod obj;
pub mod off;
pub mod ply;
mod range;
#[cfg(test)]
mod samples;
pub mod stl;

pub use file::{Encoding, Formatted, Joint, MeshFile, MorphTarget, NonFinite, ReadOptions, Skin, WriteOptions};

use std::path::Path;

use crate::io::{atomic, file_bytes};
use crate::mesh::Mesh;
use crate::{Error, Place};

/// Reads a file's bytes; the path is for the messages, and for the files that it names.
type Parse = fn(&[u8], &Path, &ReadOptions) -> Result<MeshFile, Error>;
/// The bytes of a file, or what in the content it cannot be without.
type Format = fn(&MeshFile, &WriteOptions) -> Result<Formatted, String>;

/// Every format: its extension, and how it is read and written.
const FORMATS: &[(&str, Option<Parse>, Option<Format>)] = &[
    ("obj", Some(obj::parse), Some(obj::format)),
    ("ply", Some(ply::parse), Some(ply::format)),
    ("off", Some(off::parse), Some(off::format)),
    ("stl", Some(stl::parse), Some(stl::format)),
    ("npy", Some(npy_cloud::parse), Some(npy_cloud::format)),
    ("glb", Some(gltf::parse), Some(gltf::format)),
    ("gltf", Some(gltf::parse), Some(gltf::format_json)),
];

/// The extensions of the formats that are read.
pub fn read_extensions() -> Vec<&'static str> {
    FORMATS.iter().filter(|(_, parse, _)| parse.is_some()).map(|(known, ..)| *known).collect()
}

/// Whether meshes are read from files of this extension.
pub fn is_read(path: &Path) -> bool {
    let extension = extension(path);
    FORMATS.iter().any(|(known, parse, _)| *known == extension && parse.is_some())
}

/// The mesh or point cloud in the file at `path`; [`read_file`] says what else is in the file.
///
/// # Errors
/// [`Error::Read`], [`Error::Malformed`] with the line or byte, or [`Error::Input`] for an extension that is not read.
pub fn read(path: impl AsRef<Path>) -> Result<Mesh, Error> {
    Ok(read_file(path, &ReadOptions::default())?.mesh)
}

/// All that the file at `path` holds.
///
/// # Errors
/// As [`read`].
pub fn read_file(path: impl AsRef<Path>, options: &ReadOptions) -> Result<MeshFile, Error> {
    let path = path.as_ref();
    let extension = extension(path);
    let parse = FORMATS.iter().find(|(known, ..)| *known == extension).and_then(|(_, parse, _)| *parse);
    let parse = parse.ok_or_else(|| {
        let known = FORMATS.iter().filter(|(_, parse, _)| parse.is_some());
        unknown(path, &extension, "read", &known.map(|(known, ..)| *known).collect::<Vec<_>>())
    })?;
    parse(&file_bytes(path)?, path, options)
}

/// Refuses a path whose extension is not written, before anything is computed for it.
///
/// # Errors
/// [`Error::Input`] with the extensions that are.
pub fn expect_written(path: &Path) -> Result<(), Error> {
    format_of(path).map(|_| ())
}

fn format_of(path: &Path) -> Result<Format, Error> {
    let extension = extension(path);
    let format = FORMATS.iter().find(|(known, ..)| *known == extension).and_then(|(.., format)| *format);
    format.ok_or_else(|| {
        let known = FORMATS.iter().filter(|(.., format)| format.is_some());
        unknown(path, &extension, "written", &known.map(|(known, ..)| *known).collect::<Vec<_>>())
    })
}

/// Writes the content to `path`, atomically, in the format of its extension; returns what the format cannot hold, a
/// clause each.
///
/// # Errors
/// As [`write()`].
pub fn write_file(path: impl AsRef<Path>, file: &MeshFile, options: &WriteOptions) -> Result<Vec<String>, Error> {
    let path = path.as_ref();
    let format = format_of(path)?;
    check(path, &file.mesh)?;
    let formatted = format(file, options)
        .map_err(|problem| Error::input(format!("{} is not written: {problem}", path.display())))?;
    atomic::write(path, &formatted.bytes)?;
    Ok(formatted.left_out)
}

/// Writes the mesh to `path`, atomically, in the format of its extension; [`write_file`] says what that cannot hold.
///
/// # Errors
/// [`Error::Write`], or [`Error::Input`] for an extension that is not written, a mesh that fails [`Mesh::check`] or one
/// that the format cannot be written of.
pub fn write(path: impl AsRef<Path>, mesh: &Mesh) -> Result<(), Error> {
    write_file(path, &mesh.clone().into(), &WriteOptions::default())?;
    Ok(())
}

/// [`Mesh::check`], with the file that would have been written in the message.
fn check(path: &Path, mesh: &Mesh) -> Result<(), Error> {
    mesh.check().map_err(|error| Error::input(format!("{} is not written: {error}", path.display())))
}

fn extension(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

fn unknown(path: &Path, extension: &str, verb: &str, known: &[&str]) -> Error {
    let path = path.display();
    let known = known.join(", ");
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

/// Whether a file of `n` vertices is a mesh: there is at least one, and indices can name them all. `place` is where the
/// file says how many there are, or where it ends.
fn check_n_vertices(n: usize, path: &Path, place: impl FnOnce() -> Place) -> Result<(), Error> {
    let problem = match u32::try_from(n) {
        Ok(0) => "there is no vertex in it: is it a mesh file of the format of its extension?".to_owned(),
        Ok(_) => return Ok(()),
        Err(_) => format!("it has {n} vertices; at most {} can be indexed: divide the mesh", u32::MAX),
    };
    Err(Error::malformed(path, place(), problem))
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
            let path = folder.path().join("a.npy");
            let left_out = write_file(&path, &mesh.clone().into(), &WriteOptions::default()).expect("write");
            assert_eq!(left_out.len(), usize::from(!mesh.faces.is_empty()) + usize::from(!mesh.colours.is_empty()));
            assert_eq!(read(&path).expect("read").positions, mesh.positions);
        }
    }

    #[test]
    fn unknown_extensions_are_told_the_known_ones() {
        let message = |outcome: Result<(), Error>| outcome.expect_err("must fail").to_string();
        let mesh = samples::meshes().remove(0);
        let known = "known extensions: obj, ply, off, stl, npy, glb, gltf";
        assert!(message(write("a.3ds", &mesh)).contains(&format!("not written as .3ds; {known}")));
        assert!(message(read("a.fbx").map(|_| ())).contains(&format!("not read as .fbx; {known}")));
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
