//! glTF 2.0: `.glb` (one binary file) and `.gltf` (JSON, with its numbers in it as base64 or in files beside it).
//!
//! Read are all meshes that the scene shows, joined into one and taken from metres to millimetres, with normals,
//! colours (linear to sRGB), attributes `_NAME`, morph targets and skin; the modules say how. Animations, materials,
//! textures and whatever else there is are named as left out.
//! Written is one mesh; its buffer holds millimetres, and the node scales by 0.001. What was written reads back with the
//! same numbers, those that `f32` does not hold rounded and named.
//!
//! Axes are those of glTF, which are ours. Normals become unit vectors and colours linear, as glTF asks for.

mod accessor;
mod buffers;
mod colour;
mod container;
mod json;
mod nodes;
mod placement;
mod primitive;
mod read;
mod skin;
mod tally;
#[cfg(test)]
mod tests;
mod write;
mod write_skin;

use std::path::Path;

use base64::Engine;
use serde_json::Value;

use self::accessor::Document;
use self::json::Object;
use super::losses::Losses;
use super::{Formatted, MeshFile, ReadOptions, WriteOptions, check_n_vertices};
use crate::io::text::without_byte_order_mark;
use crate::{Error, Place};

/// The extension that allows integers as positions, which are read anyway.
const QUANTIZATION: &str = "KHR_mesh_quantization";

/// The content of a `.glb` or `.gltf` file, told apart by their first bytes; `path` is for the messages, and the files
/// that the document names are looked for in its folder.
///
/// Joined meshes stand in the order of the scene, vertices in that of the file. Skins put the mesh into the bind pose.
///
/// # Errors
/// [`Error::Malformed`] with the byte of the container or line of the JSON, or with the path in the document, such as
/// `accessors[3].byteOffset`; also for extensions that a document requires and that are not read.
pub fn parse(bytes: &[u8], path: &Path, options: &ReadOptions) -> Result<MeshFile, Error> {
    let mut losses = Losses::default();
    let malformed = |problem: String| {
        let problem = problem.trim_start_matches(": ").to_owned();
        Error::malformed(path, Place::Whole, problem)
    };
    let (document, binary) = if bytes.starts_with(container::MAGIC) {
        let chunks = container::chunks(bytes, path, &mut losses)?;
        let place = |error: &serde_json::Error| {
            Place::Byte((chunks.json_start + byte_of(chunks.json, error.line(), error.column())) as u64)
        };
        (json(chunks.json, path, place)?, chunks.binary)
    } else {
        (json(without_byte_order_mark(bytes), path, |error| Place::Line(error.line()))?, None)
    };
    let document = Document::new(&document, binary, bytes.len(), path).map_err(malformed)?;
    check_header(document.root).map_err(malformed)?;
    let file = read::content(&document, options, losses).map_err(malformed)?;
    check_n_vertices(file.mesh.positions.len(), path)?;
    Ok(file)
}

/// The JSON of a document; `place` says where in the file an error is.
fn json(text: &[u8], path: &Path, place: impl Fn(&serde_json::Error) -> Place) -> Result<Value, Error> {
    serde_json::from_slice(text).map_err(|error| {
        let problem = format!("the JSON of the document is wrong: {error}");
        Error::malformed(path, place(&error), problem)
    })
}

/// The byte of a line and column, counted from 1.
fn byte_of(text: &[u8], line: usize, column: usize) -> usize {
    let lines = text.split_inclusive(|&byte| byte == b'\n').take(line.saturating_sub(1));
    (lines.map(<[u8]>::len).sum::<usize>() + column.saturating_sub(1)).min(text.len())
}

/// Whether the version and the extensions that the document requires are read.
fn check_header(root: Object<'_>) -> Result<(), String> {
    let asset = root.object("asset")?.ok_or("asset: it is missing: is this a glTF document?")?;
    let version = asset.text("version")?.unwrap_or_default();
    if !version.starts_with("2.") {
        return Err(format!("asset.version: {version:?}; 2.0 is read: save it as glTF 2.0"));
    }
    for name in root.list("extensionsRequired")?.iter().filter_map(Value::as_str) {
        // Those of the look of a surface move no vertex.
        let look = ["KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "MSFT_texture_"];
        if name != QUANTIZATION && !look.iter().any(|prefix| name.starts_with(prefix)) {
            let name: String = name.chars().take(60).collect();
            let remedy = "save the file without it (without compression, instances as meshes)";
            return Err(format!("extensionsRequired: {name:?} is not read: {remedy}"));
        }
    }
    Ok(())
}

/// The bytes of a `.glb` file of content whose mesh passes [`crate::mesh::Mesh::check`], and what it cannot hold.
///
/// # Errors
/// Numbers beyond `f32`; morph targets or a skin that do not fit the mesh; frames of joints that are no translation,
/// rotation and scale; more than 4 GiB.
pub fn format(file: &MeshFile, _: &WriteOptions) -> Result<Formatted, String> {
    let document = write::document(file)?;
    let json = document.root.to_vec().map_err(|error| error.to_string())?;
    let bytes = container::file(&json, &document.buffer).ok_or_else(|| {
        let n = document.buffer.len();
        format!("{n} bytes of numbers are more than a GLB file can have: divide the mesh, or write PLY")
    })?;
    Ok(document.losses.formatted(bytes))
}

/// The bytes of a `.gltf` file, with its numbers in it as base64.
///
/// # Errors
/// As [`format()`], but for the size.
pub fn format_json(file: &MeshFile, _: &WriteOptions) -> Result<Formatted, String> {
    let mut document = write::document(file)?;
    let numbers = base64::engine::general_purpose::STANDARD.encode(&document.buffer);
    if let Some(buffer) = document.root.buffers.first_mut() {
        buffer.uri = Some(format!("data:application/octet-stream;base64,{numbers}"));
    }
    let mut json = document.root.to_vec_pretty().map_err(|error| error.to_string())?;
    json.push(b'\n');
    Ok(document.losses.formatted(json))
}
