//! What a mesh file holds beside the mesh, and how it is read and written.

use crate::mesh::Mesh;

/// The content of a mesh file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshFile {
    /// The mesh or cloud.
    pub mesh: Mesh,
    /// Named displacements of the vertices (glTF).
    pub morphs: Vec<MorphTarget>,
    /// Joints that move the vertices (glTF).
    pub skin: Option<Skin>,
    /// What else is in the file and was not kept, a clause each with its number, such as "4 texture coordinates".
    /// Nothing is lost in silence.
    pub left_out: Vec<String>,
}

impl From<Mesh> for MeshFile {
    fn from(mesh: Mesh) -> Self {
        MeshFile { mesh, ..MeshFile::default() }
    }
}

/// One displacement per vertex, with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct MorphTarget {
    /// The name; empty where the file gives none.
    pub name: String,
    /// One displacement per vertex, in the unit of the mesh.
    pub displacements: Vec<[f64; 3]>,
}

/// Joints and the weights with which they move the vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct Skin {
    /// The joints, parents before children.
    pub joints: Vec<Joint>,
    /// For each vertex the joints that move it and their weights, which sum to 1.
    pub influences: Vec<Vec<(u32, f64)>>,
}

/// One joint of a [`Skin`].
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// The name; empty where the file gives none.
    pub name: String,
    /// Index of the parent joint.
    pub parent: Option<u32>,
    /// Its frame in the bind pose: columns of the rotation (and scale), then the position, in the unit and axes of the mesh.
    pub bind: [[f64; 3]; 4],
}

/// How a file is read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// What is done about coordinates that are not finite.
    pub non_finite: NonFinite,
}

/// What is done about coordinates that are not finite, with which some scanners mark what they did not see.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum NonFinite {
    /// The file is refused, with the place.
    #[default]
    Refuse,
    /// They are kept, for cleaning: the mesh then fails [`Mesh::check`].
    Keep,
}

/// How a file is written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct WriteOptions {
    /// The encoding of formats that have several (PLY, STL).
    pub encoding: Encoding,
}

/// How numbers are written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Encoding {
    /// Binary, little endian.
    #[default]
    Binary,
    /// Binary, big endian (PLY alone).
    BigEndian,
    /// Text.
    Text,
}

/// The bytes of a file, and what of the content it cannot hold.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Formatted {
    /// The bytes.
    pub bytes: Vec<u8>,
    /// What the format cannot hold, a clause each with its number, such as "642 colours of vertices".
    pub left_out: Vec<String>,
}
