//! Triangle meshes and point clouds in memory.

mod area;
pub mod attribute;
#[cfg(feature = "models")]
pub mod clean;
#[cfg(feature = "models")]
pub mod decimation;
#[cfg(feature = "models")]
pub mod field;
#[cfg(feature = "models")]
pub mod isosurface;
mod normals;
#[cfg(feature = "models")]
pub mod sampling;
pub mod topology;

pub use area::EdgeLengths;
pub use attribute::{Attribute, Scalar};
#[cfg(feature = "models")]
pub use clean::{CleanOptions, CleanReport, Cleaned, Keep, clean};
pub(crate) use normals::unit;
pub use topology::Topology;

use crate::Error;

/// What computes lengths and areas refuses larger coordinates: up to here fourth powers of distances are finite.
pub(crate) const LARGEST_COORDINATE: f64 = 1e70;

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
    /// Further numbers of the vertices by name, such as the labels or confidences of a scan.
    pub attributes: Vec<Attribute>,
}

impl Mesh {
    /// The smallest and the largest coordinate on each axis, in the unit of the mesh; `None` without vertices.
    pub fn bounding_box(&self) -> Option<([f64; 3], [f64; 3])> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(low, high), p| {
            (std::array::from_fn(|axis| low[axis].min(p[axis])), std::array::from_fn(|axis| high[axis].max(p[axis])))
        }))
    }

    /// The corners of a face, which must name existing vertices.
    pub fn triangle(&self, face: usize) -> [[f64; 3]; 3] {
        self.faces[face].map(|vertex| self.positions[vertex as usize])
    }

    /// The mesh of these vertices, in this order and with all that belongs to them, and of these faces, which count in
    /// the new order.
    pub fn rearranged(&self, vertices: &[u32], faces: Vec<[u32; 3]>) -> Mesh {
        fn chosen<T: Copy>(values: &[T], vertices: &[u32]) -> Vec<T> {
            if values.is_empty() { Vec::new() } else { vertices.iter().map(|&v| values[v as usize]).collect() }
        }
        Mesh {
            positions: chosen(&self.positions, vertices),
            faces,
            normals: chosen(&self.normals, vertices),
            colours: chosen(&self.colours, vertices),
            attributes: self
                .attributes
                .iter()
                .map(|attribute| Attribute { values: chosen(&attribute.values, vertices), ..attribute.clone() })
                .collect(),
        }
    }

    /// Whether the parts fit together: there are vertices, all numbers are finite, faces name existing vertices, and
    /// normals and colours are either absent or one per vertex.
    ///
    /// # Errors
    /// [`Error::Input`] names the first part that does not fit.
    pub fn check(&self) -> Result<(), Error> {
        self.check_parts()?;
        for (what, vectors) in [("position", &self.positions), ("normal", &self.normals)] {
            if let Some(vertex) = vectors.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
                return Err(Error::input(format!(
                    "the {what} of vertex {vertex} is not finite: `habitus clean` removes what is not"
                )));
            }
        }
        Ok(())
    }

    /// [`Self::check`] but for numbers that are not finite.
    pub(crate) fn check_parts(&self) -> Result<(), Error> {
        let n_vertices = self.positions.len();
        if n_vertices == 0 {
            return Err(Error::input("a mesh without vertices: give it at least one"));
        }
        if u32::try_from(n_vertices).is_err() {
            return Err(Error::input(format!("a mesh of {n_vertices} vertices: at most {} can be indexed", u32::MAX)));
        }
        if let Some(face) = self.faces.iter().position(|f| f.iter().any(|&v| v as usize >= n_vertices)) {
            let corners = self.faces[face];
            return Err(Error::input(format!(
                "face {face} names the vertices {corners:?}, but there are {n_vertices}: indices count from 0"
            )));
        }
        for (what, n) in [("normals", self.normals.len()), ("colours", self.colours.len())] {
            if n != 0 && n != n_vertices {
                return Err(Error::input(format!("{n} {what} for {n_vertices} vertices: give one each, or none")));
            }
        }
        for (index, attribute) in self.attributes.iter().enumerate() {
            let (name, n) = (&attribute.name, attribute.values.len());
            if n != n_vertices {
                return Err(Error::input(format!("{n} values of {name:?} for {n_vertices} vertices: give one each")));
            }
            if self.attributes[..index].iter().any(|other| other.name == *name) {
                return Err(Error::input(format!("two attributes of the vertices are called {name:?}: rename one")));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Mesh {
        let positions = vec![[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
        Mesh { positions, faces: vec![[0, 1, 2]], ..Mesh::default() }
    }

    #[test]
    fn bounding_box_spans_all_vertices() {
        assert_eq!(triangle().bounding_box(), Some(([0.0, 0.0, -1.0], [1.0, 3.0, 0.0])));
        assert_eq!(Mesh::default().bounding_box(), None);
    }

    #[test]
    fn check_names_what_does_not_fit() {
        assert!(triangle().check().is_ok());
        let spoilt = |spoil: fn(&mut Mesh)| {
            let mut mesh = triangle();
            spoil(&mut mesh);
            mesh.check().unwrap_err().to_string()
        };
        assert!(spoilt(|m| m.positions.clear()).contains("without vertices"));
        assert!(spoilt(|m| m.positions[1][2] = f64::NAN).contains("position of vertex 1"));
        assert!(spoilt(|m| m.normals = vec![[0.0, 0.0, f64::INFINITY]; 3]).contains("normal of vertex 0"));
        assert!(spoilt(|m| m.faces.push([0, 3, 1])).contains("face 1"));
        assert!(spoilt(|m| m.colours.push([0; 3])).contains("1 colours for 3 vertices"));
    }
}
