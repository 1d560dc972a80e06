//! Writing PLY, in each of its encodings.

use std::io::Write;

use super::super::losses::Losses;
use super::super::{Encoding, Formatted, MeshFile, WriteOptions};
use super::fields::{Role, roles};
use super::header::MOST_NAMES;
use crate::io::text::push_real;
use crate::mesh::{Attribute, Mesh, Scalar};

/// The bytes of a PLY file that reads back as the same mesh, which must pass [`Mesh::check`].
///
/// Positions are `float` when all of them are exactly representable so, `double` otherwise; normals likewise. Attributes
/// have their own type, or `double` if it does not hold all values.
///
/// # Errors
/// None: what PLY cannot hold is left out and named.
pub fn format(file: &MeshFile, options: &WriteOptions) -> Result<Formatted, String> {
    let mesh = &file.mesh;
    let mut losses = Losses::default();
    let columns = columns(mesh, &mut losses);
    losses.note_beyond_mesh(file);
    let n_bytes: usize = columns.iter().map(|column| column.scalar.n_bytes()).sum();
    let factor = if options.encoding == Encoding::Text { 3 } else { 1 };
    let mut bytes = Vec::with_capacity(factor * (512 + n_bytes * mesh.positions.len() + 13 * mesh.faces.len()));
    let header = write_header(&mut bytes, mesh, &columns, options.encoding);
    debug_assert!(header.is_ok(), "a vector takes every byte");
    let encoding = options.encoding;
    for vertex in 0..mesh.positions.len() {
        for column in &columns {
            put(&mut bytes, column.scalar, column.values.get(vertex), encoding);
        }
        end_record(&mut bytes, encoding);
    }
    let index = index_type(mesh);
    for face in &mesh.faces {
        put(&mut bytes, Scalar::U8, 3.0, encoding);
        face.iter().for_each(|&vertex| put(&mut bytes, index, f64::from(vertex), encoding));
        end_record(&mut bytes, encoding);
    }
    Ok(losses.formatted(bytes))
}

/// One property of the vertices.
struct Column<'a> {
    name: &'a str,
    scalar: Scalar,
    values: Source<'a>,
}

/// Where the numbers of a column are.
enum Source<'a> {
    Vectors(&'a [[f64; 3]], usize),
    Colours(&'a [[u8; 3]], usize),
    Attribute(&'a [f64]),
}

impl Source<'_> {
    fn get(&self, vertex: usize) -> f64 {
        match *self {
            Source::Vectors(vectors, axis) => vectors[vertex][axis],
            Source::Colours(colours, channel) => f64::from(colours[vertex][channel]),
            Source::Attribute(values) => values[vertex],
        }
    }
}

/// The properties of the vertices, without attributes whose names would not read back as theirs.
fn columns<'a>(mesh: &'a Mesh, losses: &mut Losses) -> Vec<Column<'a>> {
    let mut columns = Vec::new();
    for (names, vectors) in [(["x", "y", "z"], &mesh.positions), (["nx", "ny", "nz"], &mesh.normals)] {
        let is_exact = vectors.iter().flatten().all(|&x| Scalar::F32.holds(x));
        let scalar = if is_exact { Scalar::F32 } else { Scalar::F64 };
        let axes = if vectors.is_empty() { 0 } else { 3 };
        let column = |(axis, name)| Column { name, scalar, values: Source::Vectors(vectors, axis) };
        columns.extend(names.into_iter().take(axes).enumerate().map(column));
    }
    let channels = if mesh.colours.is_empty() { 0 } else { 3 };
    let column = |(channel, name)| Column { name, scalar: Scalar::U8, values: Source::Colours(&mesh.colours, channel) };
    columns.extend(["red", "green", "blue"].into_iter().take(channels).enumerate().map(column));
    let n_own = columns.len();
    let (writable, other): (Vec<&Attribute>, Vec<&Attribute>) =
        mesh.attributes.iter().partition(|attribute| is_word(&attribute.name));
    let names = columns.iter().map(|column| column.name).chain(writable.iter().map(|attribute| &attribute.name[..]));
    let roles = roles(&names.map(|name| (name.as_bytes(), false)).collect::<Vec<_>>());
    for attribute in other {
        losses.say(format!("the attribute {:?}, whose name is no word: give it another", attribute.name));
    }
    for (attribute, role) in writable.into_iter().zip(&roles[n_own..]) {
        let name = &attribute.name;
        if *role != Role::Attribute {
            losses.say(format!("the attribute {name:?}, whose name PLY has for something else: give it another"));
        } else if columns.len() == MOST_NAMES {
            losses.say(format!("the attribute {name:?}, for which there is no room behind {MOST_NAMES} others"));
        } else {
            let holds_all = attribute.values.iter().all(|&value| attribute.scalar.holds(value));
            let scalar = if holds_all { attribute.scalar } else { Scalar::F64 };
            columns.push(Column { name, scalar, values: Source::Attribute(&attribute.values) });
        }
    }
    columns
}

/// Whether the name can stand in a header.
fn is_word(name: &str) -> bool {
    !name.is_empty() && !name.bytes().any(|byte| byte.is_ascii_whitespace() || byte == 0)
}

/// Signed indices are what most programs expect; they reach as far as any mesh that fits in memory here.
fn index_type(mesh: &Mesh) -> Scalar {
    if i32::try_from(mesh.positions.len()).is_ok() { Scalar::I32 } else { Scalar::U32 }
}

fn write_header(bytes: &mut Vec<u8>, mesh: &Mesh, columns: &[Column<'_>], encoding: Encoding) -> std::io::Result<()> {
    let format = match encoding {
        Encoding::Binary => "binary_little_endian",
        Encoding::BigEndian => "binary_big_endian",
        Encoding::Text => "ascii",
    };
    write!(bytes, "ply\nformat {format} 1.0\nelement vertex {}\n", mesh.positions.len())?;
    for column in columns {
        writeln!(bytes, "property {} {}", name(column.scalar), column.name)?;
    }
    if !mesh.faces.is_empty() {
        let index = name(index_type(mesh));
        write!(bytes, "element face {}\nproperty list uchar {index} vertex_indices\n", mesh.faces.len())?;
    }
    writeln!(bytes, "end_header")
}

/// The original name of the type, which every reader knows.
fn name(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::I8 => "char",
        Scalar::U8 => "uchar",
        Scalar::I16 => "short",
        Scalar::U16 => "ushort",
        Scalar::I32 => "int",
        Scalar::U32 => "uint",
        Scalar::F32 => "float",
        Scalar::F64 => "double",
    }
}

/// Appends a number, which the type holds, and in a text a space.
fn put(bytes: &mut Vec<u8>, scalar: Scalar, value: f64, encoding: Encoding) {
    if encoding == Encoding::Text {
        push_real(bytes, value);
        bytes.push(b' ');
        return;
    }
    match scalar {
        Scalar::I8 => put_bytes(bytes, (value as i8).to_le_bytes(), encoding),
        Scalar::U8 => put_bytes(bytes, (value as u8).to_le_bytes(), encoding),
        Scalar::I16 => put_bytes(bytes, (value as i16).to_le_bytes(), encoding),
        Scalar::U16 => put_bytes(bytes, (value as u16).to_le_bytes(), encoding),
        Scalar::I32 => put_bytes(bytes, (value as i32).to_le_bytes(), encoding),
        Scalar::U32 => put_bytes(bytes, (value as u32).to_le_bytes(), encoding),
        Scalar::F32 => put_bytes(bytes, (value as f32).to_le_bytes(), encoding),
        Scalar::F64 => put_bytes(bytes, value.to_le_bytes(), encoding),
    }
}

/// Appends bytes that are given with the least significant first.
fn put_bytes<const N: usize>(bytes: &mut Vec<u8>, mut number: [u8; N], encoding: Encoding) {
    if encoding == Encoding::BigEndian {
        number.reverse();
    }
    bytes.extend_from_slice(&number);
}

/// Ends a line of a text, whose last space becomes the line's end.
fn end_record(bytes: &mut [u8], encoding: Encoding) {
    if let (Encoding::Text, Some(last)) = (encoding, bytes.last_mut()) {
        *last = b'\n';
    }
}
