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
mod problem;
mod read;
mod skin;
mod source;
mod tally;
#[cfg(test)]
mod tests;
mod view;
mod write;
mod write_skin;

use std::path::Path;

use base64::Engine;
use serde_json::Value;

use self::accessor::Document;
use self::json::Object;
use self::problem::Problem;
use self::source::Source;
use super::losses::Losses;
use super::{Formatted, MeshFile, ReadOptions, WriteOptions, check_n_vertices};
use crate::Error;

/// The extension that allows integers as positions, which are read anyway.
const QUANTIZATION: &str = "KHR_mesh_quantization";

/// The content of a `.glb` or `.gltf` file, told apart by their first bytes; `path` is for the messages, and the files
/// that the document names are looked for in its folder.
///
/// Joined meshes stand in the order of the scene, vertices in that of the file. Skins put the mesh into the bind pose.
///
/// # Errors
/// [`Error::Malformed`] with the byte of a `.glb` file or the line and column of a `.gltf` file at which the value of the
/// document stands, and its path, such as `accessors[3].byteOffset`; with the byte of the number when that is wrong. Also
/// for extensions that a document requires and that are not read.
pub fn parse(bytes: &[u8], path: &Path, options: &ReadOptions) -> Result<MeshFile, Error> {
    let mut losses = Losses::default();
    let source = Source::of(bytes, path, &mut losses)?;
    let root = source.document()?;
    let content = || {
        let document = Document::new(&root, source.binary, bytes.len(), path)?;
        check_header(document.root)?;
        read::content(&document, options, losses)
    };
    let file = content().map_err(|problem| source.refused(&root, &problem))?;
    check_n_vertices(file.mesh.positions.len(), path, || source.place_of("meshes"))?;
    Ok(file)
}

/// Whether the version and the extensions that the document requires are read.
fn check_header(root: Object<'_>) -> Result<(), Problem> {
    let missing = || Problem::at("asset", "it is missing: is this a glTF document?");
    let asset = root.object("asset")?.ok_or_else(missing)?;
    let version = asset.text("version")?.unwrap_or_default();
    if !version.starts_with("2.") {
        return Err(Problem::at("asset.version", format!("{version:?}; 2.0 is read: save it as glTF 2.0")));
    }
    for name in root.list("extensionsRequired")?.iter().filter_map(Value::as_str) {
        // Those of the look of a surface move no vertex.
        let look = ["KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "MSFT_texture_"];
        if name != QUANTIZATION && !look.iter().any(|prefix| name.starts_with(prefix)) {
            let name: String = name.chars().take(60).collect();
            let remedy = "save the file without it (without compression, instances as meshes)";
            return Err(Problem::at("extensionsRequired", format!("{name:?} is not read: {remedy}")));
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
