//! A glTF document of one mesh and its buffer, while they grow.
//!
//! Millimetres stay in the buffer; the node scales by 0.001, because glTF is in metres. Numbers become `f32`, which is
//! what the format has; what that changes is named.

use std::collections::BTreeMap;

use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Buffer, Stride, Target, View};
use gltf_json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use gltf_json::validation::Checked::Valid;
use gltf_json::validation::{Checked, USize64};
use gltf_json::{Accessor, Asset, Index, Node, Root, Scene};

use super::super::MeshFile;
use super::super::losses::{Losses, Rounding};
use super::colour::linear_u16;
use crate::mesh::{Attribute, Scalar, unit};

/// What a millimetre is in metres, as a node's scale.
pub(super) const METRES: [f32; 3] = [0.001; 3];

/// A glTF document and its only buffer.
#[derive(Default)]
pub(super) struct Growing {
    pub root: Root,
    pub buffer: Vec<u8>,
    pub losses: Losses,
}

/// The attributes of a primitive.
pub(super) type Attributes = BTreeMap<Checked<Semantic>, Index<Accessor>>;

/// The document of the content, whose mesh passes [`crate::mesh::Mesh::check`].
pub(super) fn document(file: &MeshFile) -> Result<Growing, String> {
    let mut document = Growing::default();
    let mesh = &file.mesh;
    let positions = document.vectors("position", "positions", &mesh.positions)?;
    let mut attributes = Attributes::from([(Valid(Semantic::Positions), positions)]);
    if !mesh.normals.is_empty() {
        attributes.insert(Valid(Semantic::Normals), document.normals(&mesh.normals)?);
    }
    if !mesh.colours.is_empty() {
        attributes.insert(Valid(Semantic::Colors(0)), document.colours(&mesh.colours));
    }
    for attribute in &mesh.attributes {
        document.attribute(attribute, &mut attributes);
    }
    let indices = (!mesh.faces.is_empty()).then(|| document.indices(&mesh.faces));
    let targets = document.targets(file)?;
    let skin = match &file.skin {
        Some(skin) => Some(document.skin(skin, mesh.positions.len(), &mut attributes)?),
        None => None,
    };
    let mode = if indices.is_some() { Mode::Triangles } else { Mode::Points };
    let mesh = gltf_json::Mesh {
        extensions: None,
        extras: target_names(file)?,
        name: None,
        primitives: vec![Primitive {
            attributes,
            extensions: None,
            extras: None,
            indices,
            material: None,
            mode: Valid(mode),
            targets: (!targets.is_empty()).then_some(targets),
        }],
        weights: (!file.morphs.is_empty()).then(|| vec![0.0; file.morphs.len()]),
    };
    let mesh = document.root.push(mesh);
    // The transform of a node with a skin means nothing: there the joints are scaled.
    let scale = if skin.is_some() { None } else { Some(METRES) };
    let (skin, above) = skin.unzip();
    let node = document.root.push(Node { mesh: Some(mesh), skin, scale, ..Node::default() });
    let nodes = std::iter::once(node).chain(above).collect();
    let scene = Scene { extensions: None, extras: None, name: None, nodes };
    document.root.scene = Some(document.root.push(scene));
    document.root.asset = Asset { generator: Some("Habitus".into()), ..Asset::default() };
    let byte_length = USize64::from(document.buffer.len());
    document.root.push(Buffer { byte_length, name: None, uri: None, extensions: None, extras: None });
    Ok(document)
}

/// Names of morph targets are a convention outside the typed part of the format.
fn target_names(file: &MeshFile) -> Result<gltf_json::Extras, String> {
    if file.morphs.iter().all(|morph| morph.name.is_empty()) {
        return Ok(None);
    }
    let names: Vec<&str> = file.morphs.iter().map(|morph| morph.name.as_str()).collect();
    let extras = BTreeMap::from([("targetNames", names)]);
    serde_json::value::to_raw_value(&extras).map(Some).map_err(|error| error.to_string())
}

impl Growing {
    /// A view of the bytes behind `start`, which are the last of the buffer; then padding to the next view.
    fn view(&mut self, start: usize, stride: Option<usize>, target: Option<Target>) -> Index<View> {
        let byte_length = USize64::from(self.buffer.len() - start);
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        self.root.push(View {
            buffer: Index::new(0),
            byte_length,
            byte_offset: Some(USize64::from(start)),
            byte_stride: stride.map(Stride),
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: None,
        })
    }

    /// An accessor of `count` elements over the bytes behind `start`.
    pub(super) fn accessor(
        &mut self,
        start: usize,
        count: usize,
        component: ComponentType,
        type_: Type,
        target: Option<Target>,
    ) -> Accessor {
        let n_bytes = component.size() * type_.multiplicity();
        // Vertices begin at multiples of four bytes.
        let stride =
            (target == Some(Target::ArrayBuffer) && !n_bytes.is_multiple_of(4)).then(|| n_bytes.next_multiple_of(4));
        let view = self.view(start, stride, target);
        Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(component)),
            extensions: None,
            extras: None,
            type_: Valid(type_),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        }
    }

    /// Vectors as `f32`, with their bounds; those that `f32` does not hold are named.
    fn vectors(&mut self, one: &str, several: &str, vectors: &[[f64; 3]]) -> Result<Index<Accessor>, String> {
        let start = self.buffer.len();
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let mut rounding = Rounding::default();
        for (vertex, vector) in vectors.iter().enumerate() {
            let short = vector.map(|x| x as f32);
            if !short.iter().all(|x| x.is_finite()) {
                return Err(format!("the {one} of vertex {vertex}, {vector:?}, is no finite f32"));
            }
            rounding.include(vector, &short);
            for axis in 0..3 {
                low[axis] = low[axis].min(short[axis]);
                high[axis] = high[axis].max(short[axis]);
                self.buffer.extend_from_slice(&short[axis].to_le_bytes());
            }
        }
        rounding.note(one, several, &mut self.losses);
        let mut accessor =
            self.accessor(start, vectors.len(), ComponentType::F32, Type::Vec3, Some(Target::ArrayBuffer));
        accessor.min = Some(serde_json::json!(low.map(f64::from)));
        accessor.max = Some(serde_json::json!(high.map(f64::from)));
        Ok(self.root.push(accessor))
    }

    /// Normals of length 1, which the format asks for.
    fn normals(&mut self, normals: &[[f64; 3]]) -> Result<Index<Accessor>, String> {
        let (mut n_long, mut n_without) = (0, 0);
        let unit_normal = |&normal: &[f64; 3]| {
            let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
            if (length - 1.0).abs() < 1e-5 {
                return normal;
            }
            match unit(normal) {
                // A vertex without a direction still needs a unit vector.
                [0.0, 0.0, 0.0] => {
                    n_without += 1;
                    [0.0, 1.0, 0.0]
                }
                direction => {
                    n_long += 1;
                    direction
                }
            }
        };
        let normals: Vec<[f64; 3]> = normals.iter().map(unit_normal).collect();
        self.losses.note(n_long, "length of a normal (made 1)", "lengths of normals (made 1)");
        self.losses.note(
            n_without,
            "normal without a direction (made 0 1 0)",
            "normals without a direction (made 0 1 0)",
        );
        self.vectors("normal", "normals", &normals)
    }

    /// Colours as four normalised 16-bit numbers.
    fn colours(&mut self, colours: &[[u8; 3]]) -> Index<Accessor> {
        let start = self.buffer.len();
        for colour in colours {
            for channel in colour.map(linear_u16).into_iter().chain([u16::MAX]) {
                self.buffer.extend_from_slice(&channel.to_le_bytes());
            }
        }
        let target = Some(Target::ArrayBuffer);
        let mut accessor = self.accessor(start, colours.len(), ComponentType::U16, Type::Vec4, target);
        accessor.normalized = true;
        self.root.push(accessor)
    }

    /// An attribute in its own type where the format has it for vertices, else as `f32`.
    fn attribute(&mut self, attribute: &Attribute, attributes: &mut Attributes) {
        let start = self.buffer.len();
        let Attribute { name, scalar, values } = attribute;
        let four = |bytes: &[u8]| -> [u8; 4] { std::array::from_fn(|at| bytes.get(at).copied().unwrap_or(0)) };
        let component = match scalar {
            Scalar::I8 => ComponentType::I8,
            Scalar::U8 => ComponentType::U8,
            Scalar::I16 => ComponentType::I16,
            Scalar::U16 => ComponentType::U16,
            Scalar::I32 | Scalar::U32 | Scalar::F32 | Scalar::F64 => ComponentType::F32,
        };
        let mut rounding = Rounding::default();
        if component == ComponentType::F32 {
            if let Some(vertex) = values.iter().position(|&value| !(value as f32).is_finite()) {
                let value = values[vertex];
                self.losses.say(format!("the attribute {name:?}, which has the value {value} that is no finite f32"));
                return;
            }
            values.iter().for_each(|value| rounding.include(&[*value], &[*value as f32]));
        }
        for &value in values {
            self.buffer.extend(match component {
                ComponentType::I8 => four(&(value as i8).to_le_bytes()),
                ComponentType::U8 => four(&(value as u8).to_le_bytes()),
                ComponentType::I16 => four(&(value as i16).to_le_bytes()),
                ComponentType::U16 => four(&(value as u16).to_le_bytes()),
                ComponentType::U32 | ComponentType::F32 => (value as f32).to_le_bytes(),
            });
        }
        rounding.note(&format!("value of {name:?}"), &format!("values of {name:?}"), &mut self.losses);
        let accessor = self.accessor(start, values.len(), component, Type::Scalar, Some(Target::ArrayBuffer));
        attributes.insert(Valid(Semantic::Extras(name.clone())), self.root.push(accessor));
    }

    fn indices(&mut self, faces: &[[u32; 3]]) -> Index<Accessor> {
        let start = self.buffer.len();
        self.buffer.extend(faces.iter().flatten().flat_map(|vertex| vertex.to_le_bytes()));
        let target = Some(Target::ElementArrayBuffer);
        let accessor = self.accessor(start, 3 * faces.len(), ComponentType::U32, Type::Scalar, target);
        self.root.push(accessor)
    }

    fn targets(&mut self, file: &MeshFile) -> Result<Vec<MorphTarget>, String> {
        let mut targets = Vec::with_capacity(file.morphs.len());
        for morph in &file.morphs {
            let (name, n, n_vertices) = (&morph.name, morph.displacements.len(), file.mesh.positions.len());
            if n != n_vertices {
                return Err(format!("the morph target {name:?} has {n} displacements for {n_vertices} vertices"));
            }
            let one = format!("displacement in the morph target {name:?}");
            let several = format!("displacements in the morph target {name:?}");
            let positions = self.vectors(&one, &several, &morph.displacements)?;
            targets.push(MorphTarget { positions: Some(positions), normals: None, tangents: None });
        }
        Ok(targets)
    }
}
