//! One primitive of a mesh: its vertices with all that belongs to them, and its triangles.

use serde_json::Value;

use super::super::coordinates::REMEDY;
use super::super::{NonFinite, ReadOptions, push_fan};
use super::accessor::{Component, Document, Values};
use super::colour::{srgb, stands_for};
use super::json::{Object, Within, whole};
use super::tally::Tally;
use crate::mesh::{Attribute, Scalar};

/// The vertices of a primitive in the space of its mesh.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    pub positions: Vec<[f64; 3]>,
    pub normals: Option<Vec<[f64; 3]>>,
    pub colours: Option<Vec<[u8; 3]>>,
    pub attributes: Vec<Attribute>,
    /// For each morph target the displacements.
    pub targets: Vec<Vec<[f64; 3]>>,
}

impl Vertices {
    /// Reads all but joints and weights, which [`super::skin::influences`] reads; what is not kept is noted.
    pub(super) fn of(
        document: &Document<'_>,
        primitive: Object<'_>,
        options: &ReadOptions,
        tally: &mut Tally,
    ) -> Result<Self, String> {
        let attributes = primitive.object("attributes")?.ok_or("attributes: it is missing; POSITION is expected")?;
        let mut vertices = read_attributes(document, attributes, options, tally).within(|| "attributes".into())?;
        for (index, target) in primitive.list("targets")?.iter().enumerate() {
            let displacements = target_of(document, target, vertices.positions.len(), tally);
            vertices.targets.push(displacements.within(|| format!("targets[{index}]"))?);
        }
        Ok(vertices)
    }
}

fn read_attributes(
    document: &Document<'_>,
    attributes: Object<'_>,
    options: &ReadOptions,
    tally: &mut Tally,
) -> Result<Vertices, String> {
    let position = attributes.wanted("POSITION")?;
    let keep = options.non_finite == NonFinite::Keep;
    let positions = vectors(document, position, None, keep).within(|| "POSITION".into())?;
    let mut vertices = Vertices { positions, ..Vertices::default() };
    let n = vertices.positions.len();
    for (key, value) in attributes.entries() {
        let mut attribute = || -> Result<(), String> {
            let accessor = whole(value)?;
            let known = document.shape(accessor)?;
            if known.0 != n as u64 {
                return Err(format!(": accessors[{accessor}] has {} elements for {n} vertices", known.0));
            }
            match key.split_once('_') {
                None if key == "POSITION" => {}
                None if key == "NORMAL" => vertices.normals = Some(vectors(document, accessor, Some(n), keep)?),
                None if key == "TANGENT" => tally.note(n, "tangent", "tangents"),
                Some(("COLOR", "0")) => vertices.colours = Some(colours(document, accessor, tally)?),
                Some(("COLOR", _)) => tally.note(n, "further colour", "further colours"),
                Some(("TEXCOORD", _)) => tally.note(n, "texture coordinate", "texture coordinates"),
                Some(("JOINTS" | "WEIGHTS", _)) => {}
                Some(("", name)) if known.1 == "SCALAR" => {
                    vertices.attributes.push(attribute_of(name, document.values(accessor, &["SCALAR"])?));
                }
                Some(("", name)) => tally.note_named(n, "vector of the attribute", "vectors of the attribute", name),
                _ => tally.note_named(n, "value of the attribute", "values of the attribute", key),
            }
            Ok(())
        };
        attribute().within(|| key.to_owned())?;
    }
    Ok(vertices)
}

/// Three numbers for each vertex, finite unless others are kept.
fn vectors(document: &Document<'_>, accessor: u64, n: Option<usize>, keep: bool) -> Result<Vec<[f64; 3]>, String> {
    let values = document.values(accessor, &["VEC3"])?;
    let vectors = values.elements::<3>();
    if let Some(n) = n.filter(|&n| n != vectors.len()) {
        return Err(format!(": accessors[{accessor}] has {} elements for {n} vertices", vectors.len()));
    }
    match vectors.iter().position(|vector| !vector.iter().all(|x| x.is_finite())).filter(|_| !keep) {
        Some(vertex) => Err(format!(": {:?} of vertex {vertex} is not finite: {REMEDY}", vectors[vertex])),
        None => Ok(vectors.to_vec()),
    }
}

/// Colours as sRGB bytes; opacities and colours that bytes cannot hold are noted.
fn colours(document: &Document<'_>, accessor: u64, tally: &mut Tally) -> Result<Vec<[u8; 3]>, String> {
    let values = document.values(accessor, &["VEC3", "VEC4"])?;
    let steps = match values.component {
        Component::U8 => 255.0,
        Component::U16 | Component::F32 => 65535.0,
        _ => 0.0,
    };
    if steps == 0.0 || (values.component != Component::F32 && !values.normalised) {
        return Err(format!(
            ": accessors[{accessor}] is no list of colours: f32, or normalised u8 or u16, is expected"
        ));
    }
    let (mut rounded, mut transparent) = (0, 0);
    let mut colours = Vec::with_capacity(values.len());
    for (vertex, numbers) in values.numbers.chunks_exact(values.width).enumerate() {
        if !numbers.iter().all(|x| x.is_finite()) {
            return Err(format!(": the colour {numbers:?} of vertex {vertex} is not finite"));
        }
        let colour = [numbers[0], numbers[1], numbers[2]].map(srgb);
        rounded += usize::from(colour.iter().zip(numbers).any(|(byte, &x)| !stands_for(*byte, x, steps)));
        transparent += usize::from(numbers.get(3).is_some_and(|&opacity| opacity != 1.0));
        colours.push(colour);
    }
    tally.note(
        rounded,
        "colour finer than 8 bits a channel (rounded)",
        "colours finer than 8 bits a channel (rounded)",
    );
    tally.note(transparent, "opacity of a colour", "opacities of colours");
    Ok(colours)
}

fn attribute_of(name: &str, values: Values) -> Attribute {
    let scalar = match values.component {
        // A fraction such as 51/255 is exact in neither of the smaller types.
        _ if values.normalised => Scalar::F64,
        Component::I8 => Scalar::I8,
        Component::U8 => Scalar::U8,
        Component::I16 => Scalar::I16,
        Component::U16 => Scalar::U16,
        Component::U32 => Scalar::U32,
        Component::F32 => Scalar::F32,
    };
    Attribute { name: name.to_owned(), scalar, values: values.numbers }
}

/// The displacements of a morph target; those of anything but positions are noted.
fn target_of(document: &Document<'_>, target: &Value, n: usize, tally: &mut Tally) -> Result<Vec<[f64; 3]>, String> {
    let mut displacements = None;
    for (key, value) in Object::of(target)?.entries() {
        let mut part = || -> Result<(), String> {
            let accessor = whole(value)?;
            if key == "POSITION" {
                displacements = Some(vectors(document, accessor, Some(n), false)?);
                return Ok(());
            }
            document.shape(accessor)?;
            tally.note_named(n, "displacement in a morph target of", "displacements in morph targets of", key);
            Ok(())
        };
        part().within(|| key.to_owned())?;
    }
    match displacements {
        Some(displacements) => Ok(displacements),
        None => {
            document.charge(3 * n as u64)?;
            Ok(vec![[0.0; 3]; n])
        }
    }
}

/// The triangles of a primitive of `n` vertices; lines are noted.
pub(super) fn triangles(
    document: &Document<'_>,
    primitive: Object<'_>,
    n: usize,
    tally: &mut Tally,
) -> Result<Vec<[u32; 3]>, String> {
    let indices = match primitive.whole("indices")? {
        Some(accessor) => indices(document, accessor, n).within(|| "indices".into())?,
        None => {
            document.charge(n as u64)?;
            (0..u32::try_from(n).map_err(|_| ": more vertices than can be indexed")?).collect()
        }
    };
    let n_indices = indices.len();
    let mode = primitive.whole("mode")?.unwrap_or(4);
    let mut faces = Vec::new();
    match mode {
        0 => {}
        1 => tally.note(n_indices / 2, "line", "lines"),
        2 => tally.note(n_indices, "line", "lines"),
        3 => tally.note(n_indices.saturating_sub(1), "line", "lines"),
        4 => match indices.as_chunks::<3>() {
            (triangles, []) => faces.extend_from_slice(triangles),
            _ => return Err(format!("indices: {n_indices} corners of triangles; a multiple of three is expected")),
        },
        // Every second triangle of a strip is turned round, so that all have the same side outside.
        5 => faces.extend(indices.windows(3).enumerate().map(|(k, corners)| match k % 2 {
            0 => [corners[0], corners[1], corners[2]],
            _ => [corners[0], corners[2], corners[1]],
        })),
        6 => push_fan(&mut faces, &indices),
        _ => return Err(format!("mode: {mode} is none; 0 to 6 are")),
    }
    Ok(faces)
}

fn indices(document: &Document<'_>, accessor: u64, n: usize) -> Result<Vec<u32>, String> {
    let values = document.values(accessor, &["SCALAR"])?;
    if values.normalised || !matches!(values.component, Component::U8 | Component::U16 | Component::U32) {
        return Err(format!(": accessors[{accessor}] is no list of indices: u8, u16 or u32 is expected"));
    }
    let index = |(position, &number): (usize, &f64)| match number {
        // Every integer of 32 bits is exact.
        _ if number < n as f64 => Ok(number as u32),
        _ => Err(format!(": accessors[{accessor}], element {position} names vertex {number}, but there are {n}")),
    };
    values.numbers.iter().enumerate().map(index).collect()
}
