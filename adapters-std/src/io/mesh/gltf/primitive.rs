//! One primitive of a mesh: its vertices with all that belongs to them, and its triangles.

use serde_json::Value;

use super::super::coordinates::REMEDY;
use super::super::{NonFinite, ReadOptions, push_fan};
use super::accessor::{Document, Values};
use super::colour::{srgb, stands_for};
use super::json::{Object, whole};
use super::problem::{Problem, Within};
use super::tally::Tally;
use super::view::Component;
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
    ) -> Result<Self, Problem> {
        let missing = || Problem::at("attributes", "it is missing; POSITION is expected");
        let attributes = primitive.object("attributes")?.ok_or_else(missing)?;
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
) -> Result<Vertices, Problem> {
    let position = attributes.wanted("POSITION")?;
    let keep = options.non_finite == NonFinite::Keep;
    let positions = vectors(document, position, None, keep).within(|| "POSITION".into())?;
    let mut vertices = Vertices { positions, ..Vertices::default() };
    let n = vertices.positions.len();
    for (key, value) in attributes.entries() {
        let mut attribute = || -> Result<(), Problem> {
            let accessor = whole(value)?;
            let known = document.shape(accessor)?;
            if known.0 != n as u64 {
                return Err(other_count(accessor, known.0, n));
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
fn vectors(document: &Document<'_>, accessor: u64, n: Option<usize>, keep: bool) -> Result<Vec<[f64; 3]>, Problem> {
    let values = document.values(accessor, &["VEC3"])?;
    let vectors = values.elements::<3>();
    if let Some(n) = n.filter(|&n| n != vectors.len()) {
        return Err(other_count(accessor, vectors.len() as u64, n));
    }
    match values.numbers.iter().position(|x| !x.is_finite()).filter(|_| !keep) {
        Some(number) => {
            let (vertex, axis) = (number / 3, number % 3);
            let problem = format!("{:?} of vertex {vertex} is not finite: {REMEDY}", vectors[vertex]);
            Err(Problem::here(problem).with(values.datum(vertex, axis)))
        }
        None => Ok(vectors.to_vec()),
    }
}

/// The error for an accessor that has not one element for each vertex.
fn other_count(accessor: u64, n_elements: u64, n: usize) -> Problem {
    Problem::here(format!("it has {n_elements} elements for {n} vertices")).referred(accessor)
}

/// Colours as sRGB bytes; opacities and colours that bytes cannot hold are noted.
fn colours(document: &Document<'_>, accessor: u64, tally: &mut Tally) -> Result<Vec<[u8; 3]>, Problem> {
    let values = document.values(accessor, &["VEC3", "VEC4"])?;
    let steps = match values.component {
        Component::U8 => 255.0,
        Component::U16 | Component::F32 => 65535.0,
        _ => 0.0,
    };
    if steps == 0.0 || (values.component != Component::F32 && !values.normalised) {
        let problem = "it is no list of colours: f32, or normalised u8 or u16, is expected";
        return Err(Problem::at("componentType", problem).referred(accessor));
    }
    let (mut rounded, mut transparent) = (0, 0);
    let mut colours = Vec::with_capacity(values.len());
    for (vertex, numbers) in values.numbers.chunks_exact(values.width).enumerate() {
        if let Some(at) = numbers.iter().position(|x| !x.is_finite()) {
            let problem = format!("the colour {numbers:?} of vertex {vertex} is not finite");
            return Err(Problem::here(problem).with(values.datum(vertex, at)));
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
fn target_of(document: &Document<'_>, target: &Value, n: usize, tally: &mut Tally) -> Result<Vec<[f64; 3]>, Problem> {
    let mut displacements = None;
    for (key, value) in Object::of(target)?.entries() {
        let mut part = || -> Result<(), Problem> {
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
) -> Result<Vec<[u32; 3]>, Problem> {
    let indices = match primitive.whole("indices")? {
        Some(accessor) => indices(document, accessor, n).within(|| "indices".into())?,
        None => {
            document.charge(n as u64)?;
            (0..u32::try_from(n).map_err(|_| Problem::here("more vertices than can be indexed"))?).collect()
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
            _ => {
                let problem = format!("{n_indices} corners of triangles; a multiple of three is expected");
                return Err(Problem::at("indices", problem));
            }
        },
        // Every second triangle of a strip is turned round, so that all have the same side outside.
        5 => faces.extend(indices.windows(3).enumerate().map(|(k, corners)| match k % 2 {
            0 => [corners[0], corners[1], corners[2]],
            _ => [corners[0], corners[2], corners[1]],
        })),
        6 => push_fan(&mut faces, &indices),
        _ => return Err(Problem::at("mode", format!("{mode} is none; 0 to 6 are"))),
    }
    Ok(faces)
}

fn indices(document: &Document<'_>, accessor: u64, n: usize) -> Result<Vec<u32>, Problem> {
    let values = document.values(accessor, &["SCALAR"])?;
    if values.normalised || !matches!(values.component, Component::U8 | Component::U16 | Component::U32) {
        let problem = "it is no list of indices: u8, u16 or u32 is expected";
        return Err(Problem::at("componentType", problem).referred(accessor));
    }
    let index = |(position, &number): (usize, &f64)| match number {
        // Every integer of 32 bits is exact.
        _ if number < n as f64 => Ok(number as u32),
        _ => {
            let problem = format!("element {position} names vertex {number}, but there are {n}");
            Err(Problem::here(problem).with(values.datum(position, 0)).referred(accessor))
        }
    };
    values.numbers.iter().enumerate().map(index).collect()
}
