//! Writing STL: binary with `f32`, or text with every digit.

use std::collections::HashSet;

use super::super::losses::{Losses, Rounding};
use super::super::{Encoding, Formatted, MeshFile, WriteOptions};
use super::RECORD;
use super::corners::{key, normal_of};
use crate::io::text::push_vector;
use crate::mesh::Mesh;

/// The bytes of an STL file of a mesh that passes [`Mesh::check`], and what it cannot hold.
///
/// # Errors
/// A cloud, which has no triangles; coordinates beyond `f32` and more than 2^32 triangles in the binary form.
pub fn format(file: &MeshFile, options: &WriteOptions) -> Result<Formatted, String> {
    let mesh = &file.mesh;
    if mesh.faces.is_empty() {
        return Err("it has no faces, and STL holds triangles alone: write PLY, OBJ or NPY".into());
    }
    let mut losses = Losses::default();
    let (bytes, written) = match options.encoding {
        Encoding::Text => (text(mesh), mesh.positions.clone()),
        Encoding::Binary => binary(mesh, &mut losses)?,
        Encoding::BigEndian => return Err("STL has no big-endian form: write it binary or as text".into()),
    };
    note_vertices(mesh, &written, &mut losses);
    losses.note(mesh.normals.len(), "normal of a vertex", "normals of vertices");
    losses.note(mesh.colours.len(), "colour of a vertex", "colours of vertices");
    losses.note_attributes(mesh);
    losses.note_beyond_mesh(file);
    Ok(losses.formatted(bytes))
}

fn text(mesh: &Mesh) -> Vec<u8> {
    let mut text = b"solid habitus\n".to_vec();
    for face in 0..mesh.faces.len() {
        let corners = mesh.triangle(face);
        text.extend_from_slice(b"facet normal ");
        push_vector(&mut text, &normal_of(corners));
        text.extend_from_slice(b"\n outer loop\n");
        for corner in &corners {
            text.extend_from_slice(b"  vertex ");
            push_vector(&mut text, corner);
            text.push(b'\n');
        }
        text.extend_from_slice(b" endloop\nendfacet\n");
    }
    text.extend_from_slice(b"endsolid habitus\n");
    text
}

/// The bytes, and the positions as they were written.
fn binary(mesh: &Mesh, losses: &mut Losses) -> Result<(Vec<u8>, Vec<[f64; 3]>), String> {
    let n = u32::try_from(mesh.faces.len())
        .map_err(|_| format!("{} triangles are more than a binary STL can count: divide it", mesh.faces.len()))?;
    let mut rounding = Rounding::default();
    let mut written = Vec::with_capacity(mesh.positions.len());
    for (vertex, position) in mesh.positions.iter().enumerate() {
        let short = position.map(|x| x as f32);
        if !short.iter().all(|x| x.is_finite()) {
            return Err(format!("the position of vertex {vertex}, {position:?}, is no finite f32: write it as text"));
        }
        rounding.include(position, &short);
        written.push(short.map(f64::from));
    }
    rounding.note("position", "positions", losses);
    let mut bytes = Vec::with_capacity(84 + RECORD * mesh.faces.len());
    // Not "solid", with which texts begin.
    bytes.extend_from_slice(b"binary STL by Habitus");
    bytes.resize(super::HEADER, b' ');
    bytes.extend_from_slice(&n.to_le_bytes());
    for face in &mesh.faces {
        let corners = face.map(|vertex| written[vertex as usize]);
        for vector in std::iter::once(&normal_of(corners)).chain(&corners) {
            vector.iter().for_each(|&x| bytes.extend_from_slice(&(x as f32).to_le_bytes()));
        }
        bytes.extend_from_slice(&[0, 0]);
    }
    Ok((bytes, written))
}

/// Notes what becomes of vertices when only the corners of triangles are known.
fn note_vertices(mesh: &Mesh, written: &[[f64; 3]], losses: &mut Losses) {
    let mut seen = vec![false; written.len()];
    let mut places = HashSet::with_capacity(written.len());
    let (mut n_merged, mut n_seen, mut in_order) = (0, 0u32, true);
    for &vertex in mesh.faces.as_flattened() {
        if std::mem::replace(&mut seen[vertex as usize], true) {
            continue;
        }
        in_order &= vertex == n_seen;
        n_seen += 1;
        n_merged += usize::from(!places.insert(key(written[vertex as usize])));
    }
    let (one, several) = (
        "vertex at the place of another (will be read as that one)",
        "vertices at the places of others (will be read as those)",
    );
    losses.note(n_merged, one, several);
    let n_loose = written.len() - n_seen as usize;
    losses.note(n_loose, "vertex that no face has", "vertices that no face has");
    if !in_order {
        losses.say("the order of the vertices (they will be read in the order of the triangles' corners)".into());
    }
}
