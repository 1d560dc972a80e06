//! Triangle meshes and point clouds in memory.

/// A triangle mesh, or a point cloud when it has no faces.
///
/// Right-handed, y up, faces counter-clockwise seen from outside; millimetres unless a reader says otherwise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, in file order.
    pub positions: Vec<[f64; 3]>,
    /// Vertex indices of each triangle, in file order (a polygon becomes a fan of its first corner).
    pub faces: Vec<[u32; 3]>,
    /// One normal per vertex, or empty.
    pub normals: Vec<[f64; 3]>,
    /// One sRGB colour per vertex, or empty.
    pub colours: Vec<[u8; 3]>,
}
