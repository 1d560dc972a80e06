//! PLY (Stanford polygon format): text and binary of both byte orders, read and written.
//!
//! Of the element `vertex`, `x y z`, `nx ny nz` and `red green blue` are read, whatever their types, and every other
//! single number as an attribute of its name; of the element `face`, the list `vertex_indices` or `vertex_index`,
//! polygons as fans. All else is counted and left out.

mod fields;
mod header;
mod values;
mod vertices;
mod write;

use std::path::Path;

use self::header::{Element, Encoding, Property};
use self::values::Values;
use self::vertices::vertices;
pub use self::write::format;
use super::losses::Losses;
use super::range::IndexRange;
use super::{MeshFile, ReadOptions, check_n_vertices, push_fan};
use crate::io::text::{check_is_text, shown};
use crate::mesh::Mesh;
use crate::{Error, Place};

/// The content of the bytes of a PLY file; `path` is for the messages.
///
/// # Errors
/// [`Error::Malformed`] with the line of a text, the byte of a binary file.
pub fn parse(bytes: &[u8], path: &Path, options: &ReadOptions) -> Result<MeshFile, Error> {
    let header = header::header(bytes, path)?;
    if header.encoding == Encoding::Text {
        check_is_text(bytes, path)?;
    }
    let mut values = Values::new(bytes, &header, path, options);
    let mut mesh = Mesh::default();
    let mut range = IndexRange::default();
    let mut losses = Losses::default();
    for element in &header.elements {
        let what = String::from_utf8_lossy(&element.name);
        let least_bytes = element.least_bytes(header.encoding);
        values.check_room(element.count, least_bytes, &format!("elements \"{what}\""))?;
        match &element.name[..] {
            // Records without properties take no bytes, so that no count of them means anything.
            _ if least_bytes == 0 => {}
            b"vertex" => vertices(&mut values, element, &mut mesh, &mut losses, path)?,
            b"face" => faces(&mut values, element, &mut mesh, &mut range, &mut losses)?,
            b"tristrips" if element.count > 0 => {
                return Err(values.malformed("triangle strips are not read: save the mesh with a list of faces"));
            }
            _ => {
                for _ in 0..element.count {
                    element.properties.iter().try_for_each(|property| skip(&mut values, property))?;
                }
                let what = shown(&element.name);
                losses.note(element.count as usize, &format!("element {what:?}"), &format!("elements {what:?}"));
            }
        }
    }
    losses.note(header.n_textures, "texture file", "texture files");
    values.check_end()?;
    check_n_vertices(mesh.positions.len(), path, || Place::Line(header.line_of_vertices()))?;
    range.check(mesh.positions.len(), "vertex", 0, path)?;
    Ok(MeshFile { left_out: losses.into_clauses(), ..mesh.into() })
}

/// Passes over one value or list of a record.
fn skip(values: &mut Values<'_>, property: &Property) -> Result<(), Error> {
    let what = String::from_utf8_lossy(&property.name);
    let count = match property.list {
        Some(list) => values.whole(list, "length of a list")?,
        None => 1,
    };
    values.skip(property.scalar, count, &what)
}

fn faces(
    values: &mut Values<'_>,
    element: &Element,
    mesh: &mut Mesh,
    range: &mut IndexRange,
    losses: &mut Losses,
) -> Result<(), Error> {
    if element.count == 0 {
        return Ok(());
    }
    let is_corners = |p: &Property| p.list.is_some() && matches!(&p.name[..], b"vertex_indices" | b"vertex_index");
    let Some(corners) = element.properties.iter().position(is_corners) else {
        return Err(values.malformed("the faces have no list \"vertex_indices\" (or \"vertex_index\")"));
    };
    // Whatever the header claims, a triangle takes its three corners.
    let least_bytes = 3 * element.properties[corners].scalar.n_bytes().min(2);
    mesh.faces.reserve((element.count as usize).min(values.n_remaining() / least_bytes));
    let mut polygon = Vec::new();
    let (mut n_divided, mut n_small) = (0, 0);
    for _ in 0..element.count {
        for (at, property) in element.properties.iter().enumerate() {
            match property.list {
                Some(list) if at == corners => {
                    polygon.clear();
                    for _ in 0..values.whole(list, "number of corners of a face")? {
                        let place = values.place();
                        let vertex = values.whole(property.scalar, "vertex of a face")?;
                        range.include(vertex, place);
                        // An index beyond u32 fails the range in the end, so that what it becomes here is never seen.
                        polygon.push(u32::try_from(vertex).unwrap_or(u32::MAX));
                    }
                    n_divided += usize::from(polygon.len() > 3);
                    n_small += usize::from(polygon.len() < 3);
                    push_fan(&mut mesh.faces, &polygon);
                }
                _ => skip(values, property)?,
            }
        }
    }
    losses.note_divided(n_divided);
    losses.note_small(n_small);
    for (at, property) in element.properties.iter().enumerate() {
        if at != corners {
            losses.say(left_out(property, element, "faces"));
        }
    }
    Ok(())
}

/// The clause for a property that is left out.
fn left_out(property: &Property, element: &Element, what: &str) -> String {
    let kind = if property.list.is_some() { "list" } else { "property" };
    format!("the {kind} {:?} of {} {what}", shown(&property.name), element.count)
}

#[cfg(test)]
mod tests;
