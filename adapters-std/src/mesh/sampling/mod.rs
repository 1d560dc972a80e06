//! Points on a surface, and smaller sets of the points of a cloud.

mod area;
mod farthest;
mod thinning;

pub use area::{poisson_disk_points, uniform_points};
pub use farthest::{FarthestPoint, farthest_points};
pub use thinning::{VoxelCells, thinned_by_distance, thinned_by_voxels};

use super::{Attribute, Mesh, Scalar, unit};
use crate::Error;

/// A point of a triangle mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The face on which it lies.
    pub face: u32,
    /// Its barycentric coordinates in the face; they sum to 1.
    pub barycentric: [f64; 3],
}

impl SurfacePoint {
    /// Where the point lies. The mesh must have the face.
    pub fn position(&self, mesh: &Mesh) -> [f64; 3] {
        mixed(mesh.triangle(self.face as usize), self.barycentric)
    }
}

fn mixed(corners: [[f64; 3]; 3], barycentric: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| (0..3).map(|k| barycentric[k] * corners[k][axis]).sum())
}

/// The points as a cloud, with the normals, colours and attributes of the mesh interpolated.
///
/// Normals are those of the mesh, or the unit normals of the faces when it has none. Colours are rounded. An attribute that
/// files store in a floating-point type is interpolated and rounded to that type; one of an integer type, such as a label,
/// takes its value from the corner of largest coordinate, the first of equal ones.
///
/// # Errors
/// Those of [`Mesh::check`]; [`Error::Input`] for a point on a face that does not exist.
pub fn interpolated(mesh: &Mesh, points: &[SurfacePoint]) -> Result<Mesh, Error> {
    mesh.check()?;
    if let Some(index) = points.iter().position(|point| point.face as usize >= mesh.faces.len()) {
        let (face, n_faces) = (points[index].face, mesh.faces.len());
        return Err(Error::input(format!("point {index} lies on face {face}, but there are {n_faces}: count from 0")));
    }
    let corners = |point: &SurfacePoint| mesh.faces[point.face as usize].map(|vertex| vertex as usize);
    let normal = |point: &SurfacePoint| {
        if mesh.normals.is_empty() {
            let [a, b, c] = mesh.triangle(point.face as usize).map(glam::DVec3::from_array);
            return unit((b - a).cross(c - a).to_array());
        }
        unit(mixed(corners(point).map(|vertex| mesh.normals[vertex]), point.barycentric))
    };
    let colour = |point: &SurfacePoint| {
        let mixed = mixed(corners(point).map(|vertex| mesh.colours[vertex].map(f64::from)), point.barycentric);
        mixed.map(|channel| channel.round().clamp(0.0, 255.0) as u8)
    };
    let attribute = |attribute: &Attribute| {
        let value = |point: &SurfacePoint| value(attribute, corners(point), point.barycentric);
        Attribute { values: points.iter().map(value).collect(), ..attribute.clone() }
    };
    Ok(Mesh {
        positions: points.iter().map(|point| point.position(mesh)).collect(),
        faces: Vec::new(),
        normals: points.iter().map(normal).collect(),
        colours: if mesh.colours.is_empty() { Vec::new() } else { points.iter().map(colour).collect() },
        attributes: mesh.attributes.iter().map(attribute).collect(),
    })
}

/// An attribute between three vertices: interpolated, or that of the nearest where a type of integers is stored.
pub(super) fn value(attribute: &Attribute, corners: [usize; 3], barycentric: [f64; 3]) -> f64 {
    let values = corners.map(|vertex| attribute.values[vertex]);
    let mixed = (0..3).map(|k| barycentric[k] * values[k]).sum::<f64>();
    match attribute.scalar {
        Scalar::F64 => mixed,
        Scalar::F32 => f64::from(mixed as f32),
        _ => values[(1..3).fold(0, |best, k| if barycentric[k] > barycentric[best] { k } else { best })],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn square() -> Mesh {
        let positions = vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
        Mesh { positions, faces: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
    }

    #[test]
    fn attributes_are_interpolated_and_labels_are_not() {
        let mut mesh = square();
        mesh.colours = vec![[0, 0, 0], [100, 0, 0], [0, 200, 0], [0; 3]];
        mesh.normals = vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
        let attribute = |name: &str, scalar| Attribute { name: name.into(), scalar, values: vec![0.0, 1.0, 2.0, 9.0] };
        mesh.attributes = vec![attribute("label", Scalar::U8), attribute("distance", Scalar::F32)];
        let point = SurfacePoint { face: 0, barycentric: [0.25, 0.5, 0.25] };
        let cloud = interpolated(&mesh, &[point]).unwrap();
        assert_eq!(cloud.positions, [[1.5, 0.5, 0.0]]);
        assert_eq!(cloud.colours, [[50, 50, 0]]);
        assert_eq!(cloud.normals, [unit([0.5, 0.0, 0.5])]);
        assert_eq!((cloud.attributes[0].values[0], cloud.attributes[1].values[0]), (1.0, 1.0));
        let near_last = SurfacePoint { barycentric: [0.1, 0.3, 0.6], ..point };
        let cloud = interpolated(&mesh, &[near_last]).unwrap();
        assert_eq!((cloud.attributes[0].values[0], cloud.attributes[1].values[0]), (2.0, f64::from(1.5_f32)));
        cloud.check().unwrap();
    }

    #[test]
    fn faces_give_normals_where_the_mesh_has_none() {
        let point = SurfacePoint { face: 1, barycentric: [1.0, 0.0, 0.0] };
        assert_eq!(interpolated(&square(), &[point]).unwrap().normals, [[0.0, 0.0, 1.0]]);
        let missing = SurfacePoint { face: 2, ..point };
        assert!(interpolated(&square(), &[point, missing]).unwrap_err().to_string().contains("point 1 lies on face 2"));
    }
}
