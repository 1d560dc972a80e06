//! Normals of the vertices of a triangle mesh.

use glam::DVec3;

use super::Mesh;

impl Mesh {
    /// One unit normal per vertex: the sum of the normals of its triangles weighted by their areas, made a unit vector.
    ///
    /// A vertex without a triangle of positive area gets the zero vector. Triangles are summed in file order. A face
    /// that names a vertex that does not exist is left out.
    pub fn vertex_normals(&self) -> Vec<[f64; 3]> {
        self.area_vectors().into_iter().map(unit).collect()
    }

    /// Twice the sum of the area vectors of the triangles of each vertex, of which [`Self::vertex_normals`] are the directions. Summed over a
    /// patch of noisy triangles they are those of the patch without the noise, as far as it returns to where it was at the border.
    pub(crate) fn area_vectors(&self) -> Vec<[f64; 3]> {
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
        normals
    }

    /// One unit normal per vertex: the sum of the unit normals of its triangles weighted by their angles there, made a unit
    /// vector. It does not depend on how the surface is divided into triangles, and its sign tells inside from outside at
    /// the vertices of a closed mesh (Baerentzen and Aanaes 2005).
    ///
    /// Otherwise as [`Self::vertex_normals`].
    pub fn vertex_normals_by_angle(&self) -> Vec<[f64; 3]> {
        let mut normals = vec![DVec3::ZERO; self.positions.len()];
        for &face in &self.faces {
            let corner = |k: usize| self.positions.get(face[k % 3] as usize).copied().map(DVec3::from_array);
            let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else { continue };
            let normal = DVec3::from_array(unit((b - a).cross(c - a).to_array()));
            for (vertex, [at, next, last]) in face.into_iter().zip([[a, b, c], [b, c, a], [c, a, b]]) {
                let (one, other) = (next - at, last - at);
                // atan2 is exact also where the angle is near 0 or pi.
                let angle = one.cross(other).length().atan2(one.dot(other));
                if angle.is_finite() {
                    normals[vertex as usize] += normal * angle;
                }
            }
        }
        normals.into_iter().map(|normal| unit(normal.to_array())).collect()
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
    fn angles_do_not_count_the_triangles_of_a_side() {
        // The corner of a cube; one of its three sides is two triangles, another is large.
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 5.0], [1.0, 1.0, 0.0]];
        let faces = vec![[0, 4, 1], [0, 2, 4], [0, 3, 2], [0, 1, 3]];
        let mesh = Mesh { positions, faces, ..Mesh::default() };
        let expected = -1.0 / 3.0_f64.sqrt();
        assert!(mesh.vertex_normals_by_angle()[0].iter().all(|x| (x - expected).abs() < 1e-15));
        assert!(mesh.vertex_normals()[0].iter().any(|x| (x - expected).abs() > 0.1));
    }

    #[test]
    fn unit_survives_extreme_lengths() {
        assert_eq!(unit([0.0, 1e-300, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!(unit([-1e300, 0.0, 0.0]), [-1.0, 0.0, 0.0]);
    }
}
