//! Normals of the vertices of a triangle mesh.

use super::Mesh;

impl Mesh {
    /// One unit normal per vertex: the sum of the normals of its triangles weighted by their areas, made a unit vector.
    ///
    /// A vertex without a triangle of positive area gets the zero vector. Triangles are summed in file order. A face
    /// that names a vertex that does not exist is left out.
    pub fn vertex_normals(&self) -> Vec<[f64; 3]> {
        let mut normals = vec![[0.0; 3]; self.positions.len()];
        for face in &self.faces {
            let corner = |k: usize| self.positions.get(face[k] as usize).copied();
            let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else { continue };
            let doubled_area = cross(difference(b, a), difference(c, a));
            for &vertex in face {
                let sum = &mut normals[vertex as usize];
                *sum = std::array::from_fn(|axis| sum[axis] + doubled_area[axis]);
            }
        }
        for normal in &mut normals {
            *normal = unit(*normal);
        }
        normals
    }
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The vector of length 1 in the direction of `v`, or zero where `v` has no direction.
pub(crate) fn unit(v: [f64; 3]) -> [f64; 3] {
    // Dividing by the largest component first keeps the squares away from overflow and underflow.
    let largest = v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return [0.0; 3];
    }
    let scaled = v.map(|x| x / largest);
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    scaled.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_square_has_equal_normals_and_loose_vertex_none() {
        let positions = vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [9.0, 9.0, 9.0]];
        let mesh = Mesh { positions, faces: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
        let normals = mesh.vertex_normals();
        assert!(normals[..4].iter().all(|n| *n == [0.0, 0.0, 1.0]));
        assert_eq!(normals[4], [0.0; 3]);
    }

    #[test]
    fn larger_triangles_weigh_more() {
        // Two triangles at the edge (0, 1): area 2 towards z, area 1 towards y.
        let positions = vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, -1.0]];
        let mesh = Mesh { positions, faces: vec![[0, 1, 2], [0, 1, 3]], ..Mesh::default() };
        let normal = mesh.vertex_normals()[0];
        assert!((normal[2] / normal[1] - 2.0).abs() < 1e-15, "{normal:?}");
    }

    #[test]
    fn unit_survives_extreme_lengths() {
        assert_eq!(unit([0.0, 1e-300, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!(unit([-1e300, 0.0, 0.0]), [-1.0, 0.0, 0.0]);
    }
}
