//! The vertices of a PLY file.

use std::path::Path;

use super::super::coordinates::{colour_byte, is_finer_than_bytes};
use super::super::losses::Losses;
use super::fields::{FIELDS, Role, roles};
use super::header::{Element, Property};
use super::values::Values;
use super::{left_out, skip};
use crate::mesh::{Attribute, Mesh, Scalar};
use crate::{Error, Place};

/// Reads the records of the element `vertex` into the mesh.
pub(super) fn vertices(
    values: &mut Values<'_>,
    element: &Element,
    mesh: &mut Mesh,
    losses: &mut Losses,
    path: &Path,
) -> Result<(), Error> {
    let names: Vec<(&[u8], bool)> = element.properties.iter().map(|p| (&p.name[..], p.list.is_some())).collect();
    let roles = roles(&names);
    let has = |field: usize| roles.contains(&Role::Field(field));
    if let Some(missing) = (0..3).find(|&axis| !has(axis)) {
        let problem = format!("the vertices have no property \"{}\"", FIELDS[missing][0]);
        return Err(Error::malformed(path, Place::Line(element.line), problem));
    }
    let (normals, colours) = (has(3), has(6));
    // The room for this many records has been checked by the caller.
    let n = element.count as usize;
    mesh.positions.reserve(n);
    mesh.normals.reserve(if normals { n } else { 0 });
    mesh.colours.reserve(if colours { n } else { 0 });
    let mut attributes = attributes(element, &roles);
    let mut n_rounded = 0;
    for _ in 0..element.count {
        let mut record = [0.0; 6];
        let mut channels = [0; 3];
        let mut is_rounded = false;
        let mut next = 0;
        let place = values.place();
        for (property, role) in element.properties.iter().zip(&roles) {
            match *role {
                Role::Field(field) if field < 6 => {
                    record[field] = values.coordinate(property.scalar, FIELDS[field][0])?;
                }
                Role::Field(field) => {
                    let value = values.finite(property.scalar, FIELDS[field][0])?;
                    channels[field - 6] = channel(value, property.scalar, place, path)?;
                    is_rounded |= is_finer_than_bytes(value, full(property.scalar));
                }
                Role::Attribute => {
                    let attribute: &mut Attribute = &mut attributes[next];
                    attribute.values.push(values.any(property.scalar, &attribute.name)?);
                    next += 1;
                }
                Role::LeftOut => skip(values, property)?,
            }
        }
        let [x, y, z, nx, ny, nz] = record;
        mesh.positions.push([x, y, z]);
        if normals {
            mesh.normals.push([nx, ny, nz]);
        }
        if colours {
            mesh.colours.push(channels);
            n_rounded += usize::from(is_rounded);
        }
    }
    for attribute in &mut attributes {
        // A text may say more than the type that its header announces.
        if !attribute.values.iter().all(|&value| attribute.scalar.holds(value)) {
            attribute.scalar = Scalar::F64;
        }
    }
    mesh.attributes = attributes;
    losses.note_rounded_colours(n_rounded);
    for (property, _) in element.properties.iter().zip(&roles).filter(|(_, role)| **role == Role::LeftOut) {
        losses.say(left_out(property, element, "vertices"));
    }
    Ok(())
}

/// The attributes, without values yet, in the order of their properties.
fn attributes(element: &Element, roles: &[Role]) -> Vec<Attribute> {
    let named = |property: &Property| Attribute {
        name: String::from_utf8_lossy(&property.name).into_owned(),
        scalar: property.scalar,
        values: Vec::with_capacity(element.count as usize),
    };
    let properties = element.properties.iter().zip(roles).filter(|(_, role)| **role == Role::Attribute);
    let mut attributes: Vec<Attribute> = properties.map(|(property, _)| named(property)).collect();
    // Bytes that are no text may have become equal names.
    let mut is_taken = std::collections::HashSet::new();
    for attribute in &mut attributes {
        while !is_taken.insert(attribute.name.clone()) {
            attribute.name.push('_');
        }
    }
    attributes
}

/// A colour channel of 0 to 255.
fn channel(value: f64, scalar: Scalar, place: Place, path: &Path) -> Result<u8, Error> {
    let one = full(scalar);
    colour_byte(value, one).ok_or_else(|| {
        Error::malformed(path, place, format!("a colour channel of {value}; 0 to {one} is expected of its type"))
    })
}

/// The number of full intensity: integers by their type's range, real numbers from 0 to 1.
fn full(scalar: Scalar) -> f64 {
    match scalar {
        Scalar::F32 | Scalar::F64 => 1.0,
        Scalar::U16 => 65535.0,
        Scalar::I8 | Scalar::U8 | Scalar::I16 | Scalar::I32 | Scalar::U32 => 255.0,
    }
}
