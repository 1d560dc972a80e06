//! PLY (Stanford polygon format): text and binary of both byte orders; written as binary little endian.
//!
//! Of the element `vertex`, `x y z`, `nx ny nz` and `red green blue` are read, whatever their types; of the element
//! `face`, the list `vertex_indices` or `vertex_index`, polygons as fans. All else is passed over.

mod header;
mod values;

use std::io::Write;
use std::path::Path;

use self::header::{Element, Property, Scalar};
use self::values::Values;
use super::range::IndexRange;
use super::{check_n_vertices, colour_byte, push_fan};
use crate::mesh::Mesh;
use crate::{Error, Place};

/// The mesh in the bytes of a PLY file; `path` is for the messages.
///
/// # Errors
/// [`Error::Malformed`] with the line of a text, the byte of a binary file.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, Error> {
    let header = header::header(bytes, path)?;
    let mut values = Values::new(bytes, &header, path);
    let mut mesh = Mesh::default();
    let mut range = IndexRange::default();
    for element in &header.elements {
        let what = String::from_utf8_lossy(&element.name);
        let least_bytes = element.least_bytes(header.encoding);
        values.check_room(element.count, least_bytes, &format!("elements \"{what}\""))?;
        match &element.name[..] {
            // Records without properties take no bytes, so that no count of them means anything.
            _ if least_bytes == 0 => {}
            b"vertex" => vertices(&mut values, element, &mut mesh, path)?,
            b"face" => faces(&mut values, element, &mut mesh, &mut range)?,
            b"tristrips" if element.count > 0 => {
                return Err(values.malformed("triangle strips are not read: save the mesh with a list of faces"));
            }
            _ => {
                for _ in 0..element.count {
                    element.properties.iter().try_for_each(|property| skip(&mut values, property))?;
                }
            }
        }
    }
    values.check_end()?;
    check_n_vertices(mesh.positions.len(), path)?;
    range.check(mesh.positions.len(), "vertex", 0, path)?;
    Ok(mesh)
}

/// Passes over one value or list of a record.
fn skip(values: &mut Values<'_>, property: &Property) -> Result<(), Error> {
    let what = String::from_utf8_lossy(&property.name);
    let count = match property.list {
        Some(list) => values.whole(list, &format!("length of list \"{what}\""))?,
        None => 1,
    };
    values.skip(property.scalar, count, &what)
}

/// What the single values of a vertex are.
const VERTEX_FIELDS: [&[&str]; 9] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["red", "diffuse_red"],
    &["green", "diffuse_green"],
    &["blue", "diffuse_blue"],
];

fn vertices(values: &mut Values<'_>, element: &Element, mesh: &mut Mesh, path: &Path) -> Result<(), Error> {
    let property_named = |names: &[&str]| {
        let is_named = |p: &Property| p.list.is_none() && names.iter().any(|name| name.as_bytes() == p.name);
        element.properties.iter().position(is_named)
    };
    let at: [Option<usize>; 9] = VERTEX_FIELDS.map(property_named);
    if let Some(missing) = at[..3].iter().position(Option::is_none) {
        let problem = format!("the vertices have no property \"{}\"", VERTEX_FIELDS[missing][0]);
        return Err(Error::malformed(path, Place::Whole, problem));
    }
    let (normals, colours) = (at[3..6].iter().all(Option::is_some), at[6..].iter().all(Option::is_some));
    let mut field_of = vec![None; element.properties.len()];
    for (field, property) in at.into_iter().enumerate() {
        let wanted = match field {
            0..3 => true,
            3..6 => normals,
            _ => colours,
        };
        if let Some(property) = property.filter(|_| wanted) {
            field_of[property] = Some(field);
        }
    }
    // The room for this many records has been checked by the caller.
    mesh.positions.reserve(element.count as usize);
    for _ in 0..element.count {
        let mut record = [0.0; 9];
        let place = values.place();
        for (property, field) in element.properties.iter().zip(&field_of) {
            match *field {
                Some(field) => {
                    let what = VERTEX_FIELDS[field][0];
                    let value = values.finite(property.scalar, what)?;
                    record[field] = if field < 6 { value } else { channel(value, property.scalar, place, path)? };
                }
                None => skip(values, property)?,
            }
        }
        let [x, y, z, nx, ny, nz, red, green, blue] = record;
        mesh.positions.push([x, y, z]);
        if normals {
            mesh.normals.push([nx, ny, nz]);
        }
        if colours {
            mesh.colours.push([red as u8, green as u8, blue as u8]);
        }
    }
    Ok(())
}

/// A colour channel of 0 to 255: integers by their type's range, real numbers from 0 to 1.
fn channel(value: f64, scalar: Scalar, place: Place, path: &Path) -> Result<f64, Error> {
    let one = match scalar {
        Scalar::F32 | Scalar::F64 => 1.0,
        Scalar::U16 => 65535.0,
        Scalar::I8 | Scalar::U8 | Scalar::I16 | Scalar::I32 | Scalar::U32 => 255.0,
    };
    colour_byte(value, one).map(f64::from).ok_or_else(|| {
        Error::malformed(path, place, format!("a colour channel of {value}; 0 to {one} is expected of its type"))
    })
}

fn faces(values: &mut Values<'_>, element: &Element, mesh: &mut Mesh, range: &mut IndexRange) -> Result<(), Error> {
    let is_corners = |p: &Property| p.list.is_some() && matches!(&p.name[..], b"vertex_indices" | b"vertex_index");
    let corners = element.properties.iter().position(is_corners);
    if corners.is_none() && element.count > 0 {
        return Err(values.malformed("the faces have no list \"vertex_indices\" (or \"vertex_index\")"));
    }
    mesh.faces.reserve(element.count as usize);
    let mut polygon = Vec::new();
    for _ in 0..element.count {
        for (at, property) in element.properties.iter().enumerate() {
            match property.list {
                Some(list) if Some(at) == corners => {
                    polygon.clear();
                    let n = values.whole(list, "number of corners of a face")?;
                    if n < 3 {
                        return Err(values.malformed(format!("a face of {n} corners; at least 3 are expected")));
                    }
                    for _ in 0..n {
                        let place = values.place();
                        let vertex = values.whole(property.scalar, "vertex of a face")?;
                        range.include(vertex, place);
                        // An index beyond u32 fails the range in the end, so that what it becomes here is never seen.
                        polygon.push(u32::try_from(vertex).unwrap_or(u32::MAX));
                    }
                    push_fan(&mut mesh.faces, &polygon);
                }
                _ => skip(values, property)?,
            }
        }
    }
    Ok(())
}

/// The bytes of a binary little-endian PLY file that reads back as the same mesh, which must pass [`Mesh::check`].
///
/// Positions are `float` when all of them are exactly representable so, `double` otherwise; normals likewise.
pub fn format(mesh: &Mesh) -> Vec<u8> {
    let exact = |vectors: &[[f64; 3]]| vectors.iter().flatten().all(|&x| f64::from(x as f32) == x);
    let (short, short_normals) = (exact(&mesh.positions), exact(&mesh.normals));
    let mut bytes = Vec::with_capacity(512 + 51 * mesh.positions.len() + 13 * mesh.faces.len());
    let header = write_header(&mut bytes, mesh, short, short_normals);
    debug_assert!(header.is_ok(), "a vector takes every byte");
    for (vertex, position) in mesh.positions.iter().enumerate() {
        push_binary(&mut bytes, position, short);
        if let Some(normal) = mesh.normals.get(vertex) {
            push_binary(&mut bytes, normal, short_normals);
        }
        if let Some(colour) = mesh.colours.get(vertex) {
            bytes.extend_from_slice(colour);
        }
    }
    for face in &mesh.faces {
        bytes.push(3);
        bytes.extend(face.iter().flat_map(|vertex| vertex.to_le_bytes()));
    }
    bytes
}

fn write_header(bytes: &mut Vec<u8>, mesh: &Mesh, short: bool, short_normals: bool) -> std::io::Result<()> {
    let real = |short| if short { "float" } else { "double" };
    write!(bytes, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.len())?;
    for axis in ["x", "y", "z"] {
        writeln!(bytes, "property {} {axis}", real(short))?;
    }
    if !mesh.normals.is_empty() {
        for axis in ["nx", "ny", "nz"] {
            writeln!(bytes, "property {} {axis}", real(short_normals))?;
        }
    }
    if !mesh.colours.is_empty() {
        for channel in ["red", "green", "blue"] {
            writeln!(bytes, "property uchar {channel}")?;
        }
    }
    if !mesh.faces.is_empty() {
        // Signed indices are what most programs expect; they reach as far as any mesh that fits in memory here.
        let index = if i32::try_from(mesh.positions.len()).is_ok() { "int" } else { "uint" };
        write!(bytes, "element face {}\nproperty list uchar {index} vertex_indices\n", mesh.faces.len())?;
    }
    writeln!(bytes, "end_header")
}

fn push_binary(bytes: &mut Vec<u8>, vector: &[f64; 3], short: bool) {
    for &x in vector {
        match short {
            true => bytes.extend_from_slice(&(x as f32).to_le_bytes()),
            false => bytes.extend_from_slice(&x.to_le_bytes()),
        }
    }
}

#[cfg(test)]
mod tests;
