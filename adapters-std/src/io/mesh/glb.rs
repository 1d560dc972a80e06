//! GLB (binary glTF 2.0), written only: one mesh, optionally with named morph targets.
//!
//! Millimetres stay in the buffer; the node scales by 0.001, because glTF is in metres. Axes are those of glTF.
//! Normals are made unit vectors and colours are taken from sRGB to linear, both as glTF asks for.

use std::path::Path;

use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Buffer, Stride, Target, View};
use gltf_json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use gltf_json::validation::Checked::Valid;
use gltf_json::validation::USize64;
use gltf_json::{Accessor, Asset, Index, Node, Root, Scene};

use super::check;
use crate::Error;
use crate::io::atomic;
use crate::mesh::Mesh;
use crate::mesh::unit;

/// Writes the mesh to `path`, atomically, with `morphs`: for each a name and one displacement per vertex, millimetres.
///
/// # Errors
/// [`Error::Write`]; [`Error::Input`] for a mesh that fails [`Mesh::check`] or displacements that do not fit it.
pub fn write_with_morphs(path: impl AsRef<Path>, mesh: &Mesh, morphs: &[(String, Vec<[f64; 3]>)]) -> Result<(), Error> {
    let path = path.as_ref();
    check(path, mesh)?;
    let bytes = format(mesh, morphs)
        .map_err(|problem| Error::input(format!("{} is not written: {problem}", path.display())))?;
    atomic::write(path, &bytes)
}

/// The bytes of a GLB file, or what in the mesh or the morph targets cannot be written.
///
/// The mesh must pass [`Mesh::check`].
pub fn format(mesh: &Mesh, morphs: &[(String, Vec<[f64; 3]>)]) -> Result<Vec<u8>, String> {
    let mut document = Document::default();
    let positions = document.vectors("positions", &mesh.positions)?;
    let mut attributes = std::collections::BTreeMap::from([(Valid(Semantic::Positions), positions)]);
    if !mesh.normals.is_empty() {
        // A vertex without a direction still needs a unit vector.
        let directions = mesh.normals.iter().map(|&normal| unit(normal));
        let normals: Vec<_> = directions.map(|n| if n == [0.0; 3] { [0.0, 1.0, 0.0] } else { n }).collect();
        attributes.insert(Valid(Semantic::Normals), document.vectors("normals", &normals)?);
    }
    if !mesh.colours.is_empty() {
        attributes.insert(Valid(Semantic::Colors(0)), document.colours(&mesh.colours));
    }
    let indices = (!mesh.faces.is_empty()).then(|| document.indices(&mesh.faces));
    let mut targets = Vec::with_capacity(morphs.len());
    for (name, displacements) in morphs {
        if displacements.len() != mesh.positions.len() {
            let (n, n_vertices) = (displacements.len(), mesh.positions.len());
            return Err(format!("the morph target {name:?} has {n} displacements for {n_vertices} vertices"));
        }
        let positions = document.vectors(&format!("morph target {name:?}"), displacements)?;
        targets.push(MorphTarget { positions: Some(positions), normals: None, tangents: None });
    }
    let mode = if indices.is_some() { Mode::Triangles } else { Mode::Points };
    let mesh = gltf_json::Mesh {
        extensions: None,
        extras: Default::default(),
        name: None,
        primitives: vec![Primitive {
            attributes,
            extensions: None,
            extras: Default::default(),
            indices,
            material: None,
            mode: Valid(mode),
            targets: (!targets.is_empty()).then_some(targets),
        }],
        weights: (!morphs.is_empty()).then(|| vec![0.0; morphs.len()]),
    };
    document.into_bytes(mesh, morphs.iter().map(|(name, _)| name.as_str()).collect())
}

/// A glTF document and its only buffer while they grow.
#[derive(Default)]
struct Document {
    root: Root,
    buffer: Vec<u8>,
}

impl Document {
    /// A view of the bytes behind `start`, which are the last of the buffer; then padding to the next view.
    fn view(&mut self, start: usize, stride: Option<usize>, target: Target) -> Index<View> {
        let byte_length = USize64::from(self.buffer.len() - start);
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        self.root.push(View {
            buffer: Index::new(0),
            byte_length,
            byte_offset: Some(USize64::from(start)),
            byte_stride: stride.map(Stride),
            name: None,
            target: Some(Valid(target)),
            extensions: None,
            extras: Default::default(),
        })
    }

    fn accessor(&mut self, view: Index<View>, count: usize, component: ComponentType, type_: Type) -> Accessor {
        Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(component)),
            extensions: None,
            extras: Default::default(),
            type_: Valid(type_),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        }
    }

    /// Vectors as `f32`, with their bounds.
    fn vectors(&mut self, what: &str, vectors: &[[f64; 3]]) -> Result<Index<Accessor>, String> {
        let start = self.buffer.len();
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for (vertex, vector) in vectors.iter().enumerate() {
            let short = vector.map(|x| x as f32);
            if short.iter().any(|x| !x.is_finite()) {
                return Err(format!("the {what} of vertex {vertex}, {vector:?}, are no finite f32"));
            }
            for axis in 0..3 {
                low[axis] = low[axis].min(short[axis]);
                high[axis] = high[axis].max(short[axis]);
                self.buffer.extend_from_slice(&short[axis].to_le_bytes());
            }
        }
        let view = self.view(start, None, Target::ArrayBuffer);
        let mut accessor = self.accessor(view, vectors.len(), ComponentType::F32, Type::Vec3);
        accessor.min = Some(serde_json::json!(low.map(f64::from)));
        accessor.max = Some(serde_json::json!(high.map(f64::from)));
        Ok(self.root.push(accessor))
    }

    /// Colours as four normalised 16-bit numbers: eight bits would lose the dark ones on the way to linear.
    fn colours(&mut self, colours: &[[u8; 3]]) -> Index<Accessor> {
        let start = self.buffer.len();
        for colour in colours {
            for channel in colour.map(linear_channel).into_iter().chain([u16::MAX]) {
                self.buffer.extend_from_slice(&channel.to_le_bytes());
            }
        }
        let view = self.view(start, Some(8), Target::ArrayBuffer);
        let mut accessor = self.accessor(view, colours.len(), ComponentType::U16, Type::Vec4);
        accessor.normalized = true;
        self.root.push(accessor)
    }

    fn indices(&mut self, faces: &[[u32; 3]]) -> Index<Accessor> {
        let start = self.buffer.len();
        self.buffer.extend(faces.iter().flatten().flat_map(|vertex| vertex.to_le_bytes()));
        let view = self.view(start, None, Target::ElementArrayBuffer);
        let accessor = self.accessor(view, 3 * faces.len(), ComponentType::U32, Type::Scalar);
        self.root.push(accessor)
    }

    /// The file: header of 12 bytes, chunk of JSON padded with spaces, chunk of the buffer padded with zeros.
    fn into_bytes(mut self, mesh: gltf_json::Mesh, morph_names: Vec<&str>) -> Result<Vec<u8>, String> {
        self.root.asset = Asset { generator: Some("Habitus".into()), ..Asset::default() };
        self.root.push(Buffer {
            byte_length: USize64::from(self.buffer.len()),
            name: None,
            uri: None,
            extensions: None,
            extras: Default::default(),
        });
        let mesh = self.root.push(mesh);
        let node = self.root.push(Node { mesh: Some(mesh), scale: Some([0.001; 3]), ..Node::default() });
        let scene = Scene { extensions: None, extras: Default::default(), name: None, nodes: vec![node] };
        self.root.scene = Some(self.root.push(scene));
        let mut json = self.root.to_value().map_err(|error| error.to_string())?;
        if !morph_names.is_empty() {
            // Names of morph targets are a convention outside the typed part of the format.
            json["meshes"][0]["extras"] = serde_json::json!({ "targetNames": morph_names });
        }
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + json.len() + 8 + self.buffer.len();
        let size = |n: usize| u32::try_from(n).map_err(|_| format!("{length} bytes are more than a GLB file can have"));
        let mut bytes = Vec::with_capacity(length);
        bytes.extend_from_slice(b"glTF");
        for number in [2, size(length)?, size(json.len())?] {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        bytes.extend_from_slice(b"JSON");
        bytes.extend_from_slice(&json);
        bytes.extend_from_slice(&size(self.buffer.len())?.to_le_bytes());
        bytes.extend_from_slice(b"BIN\0");
        bytes.extend_from_slice(&self.buffer);
        Ok(bytes)
    }
}

/// An sRGB channel (IEC 61966-2-1) as a linear fraction of 65535.
fn linear_channel(channel: u8) -> u16 {
    let encoded = f64::from(channel) / 255.0;
    let linear = if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) };
    (linear * 65535.0).round() as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use gltf_json::validation::Validate;

    fn square() -> Mesh {
        Mesh {
            positions: vec![[0.0, 0.0, 0.0], [10.0, 0.0, 0.1], [10.0, 20.0, 0.0], [0.0, 20.0, -1.0]],
            faces: vec![[0, 1, 2], [0, 2, 3]],
            normals: vec![[0.0, 0.0, 2.0], [0.0; 3], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]],
            colours: vec![[0, 1, 255], [10, 20, 30], [128, 128, 128], [255; 3]],
            ..Mesh::default()
        }
    }

    fn morphs() -> Vec<(String, Vec<[f64; 3]>)> {
        vec![("smile".into(), vec![[0.0; 3]; 4]), ("jaw \"open\"".into(), vec![[0.0, -3.5, 0.25]; 4])]
    }

    /// The JSON and the buffer of a GLB file, with the rules of the container checked.
    fn chunks(bytes: &[u8]) -> (serde_json::Value, &[u8]) {
        let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
        assert_eq!((&bytes[..4], number(4), number(8)), (&b"glTF"[..], 2, bytes.len()));
        let json_length = number(12);
        assert_eq!((json_length % 4, &bytes[16..20]), (0, &b"JSON"[..]));
        let binary = 20 + json_length;
        assert_eq!((number(binary) % 4, &bytes[binary + 4..binary + 8]), (0, &b"BIN\0"[..]));
        assert_eq!(binary + 8 + number(binary), bytes.len());
        (serde_json::from_slice(&bytes[20..binary]).expect("JSON"), &bytes[binary + 8..])
    }

    #[test]
    fn documents_are_valid_by_the_typed_rules() {
        let cloud = Mesh { positions: vec![[1.0, 2.0, 3.0]], colours: vec![[1, 2, 3]], ..Mesh::default() };
        for (mesh, morphs) in [(square(), morphs()), (square(), vec![]), (cloud, vec![])] {
            let bytes = format(&mesh, &morphs).expect("a file");
            let (json, buffer) = chunks(&bytes);
            let root: Root = serde_json::from_value(json).expect("a document");
            root.validate(&root, gltf_json::Path::new, &mut |path, error| panic!("{}: {error}", path()));
            assert_eq!(root.buffers[0].byte_length.0 as usize, buffer.len());
            for view in &root.buffer_views {
                let start = view.byte_offset.expect("an offset").0;
                assert!(start % 4 == 0 && start + view.byte_length.0 <= buffer.len() as u64);
            }
        }
    }

    #[test]
    fn positions_bounds_and_morph_targets_are_what_was_given() {
        let bytes = format(&square(), &morphs()).expect("a file");
        let (json, buffer) = chunks(&bytes);
        let real = |at: usize| f32::from_le_bytes(buffer[at..at + 4].try_into().expect("four bytes"));
        assert_eq!([real(12), real(16), real(20)], [10.0, 0.0, 0.1]);
        assert_eq!(json["accessors"][0]["min"], serde_json::json!([0.0, 0.0, -1.0]));
        assert_eq!(json["accessors"][0]["max"], serde_json::json!([10.0, 20.0, f64::from(0.1f32)]));
        assert_eq!(json["meshes"][0]["extras"]["targetNames"], serde_json::json!(["smile", "jaw \"open\""]));
        assert_eq!(json["meshes"][0]["weights"], serde_json::json!([0.0, 0.0]));
        let scale = json["nodes"][0]["scale"].as_array().expect("a scale");
        assert!(scale.iter().all(|s| (s.as_f64().expect("a number") - 0.001).abs() < 1e-9));
        let target = json["meshes"][0]["primitives"][0]["targets"][1]["POSITION"].as_u64().expect("an index");
        assert_eq!(json["accessors"][target as usize]["min"], serde_json::json!([0.0, -3.5, 0.25]));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let short = vec![("a".to_owned(), vec![[0.0; 3]; 3])];
        assert!(format(&square(), &short).unwrap_err().contains("\"a\" has 3 displacements for 4 vertices"));
        let mut mesh = square();
        mesh.positions[2][1] = 1e300;
        assert!(format(&mesh, &[]).unwrap_err().contains("positions of vertex 2"));
    }

    #[test]
    fn dark_colours_stay_apart() {
        let channels: Vec<u16> = (0..=255).map(linear_channel).collect();
        assert!(channels.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!((channels[0], channels[255]), (0, 65535));
    }
}
