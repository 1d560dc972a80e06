//! How a mesh of the document stands in the mesh that is read: millimetres, axes of the scene.

use glam::{DAffine3, DMat3, DVec3};

use crate::mesh::unit;

/// Millimetres of a metre, the unit of the format.
const MM: f64 = 1000.0;

/// The transform of a mesh's vertices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placement {
    matrix: DAffine3,
    /// Whether nothing changes, as with the files that we write: then no number is touched.
    identity: bool,
    normals: Option<DMat3>,
}

impl Placement {
    /// From the transform into the scene, which is in metres.
    pub(super) fn of(world: DAffine3) -> Self {
        // Scaled before it is applied: a node scale of 0.001 gives 1 exactly, and positions keep their bits.
        let matrix = DAffine3 { matrix3: world.matrix3 * MM, translation: world.translation * MM };
        let scale = matrix.matrix3.x_axis.x;
        let is_scale = scale > 0.0 && matrix.matrix3 == DMat3::from_diagonal(DVec3::splat(scale));
        let normals = (!is_scale).then(|| cofactors(matrix.matrix3));
        Placement { matrix, identity: matrix == DAffine3::IDENTITY, normals }
    }

    pub(super) fn point(&self, point: [f64; 3]) -> [f64; 3] {
        if self.identity { point } else { self.matrix.transform_point3(point.into()).into() }
    }

    pub(super) fn displacement(&self, vector: [f64; 3]) -> [f64; 3] {
        if self.identity { vector } else { (self.matrix.matrix3 * DVec3::from(vector)).into() }
    }

    /// A normal, which keeps its bits when directions do not change and is a unit vector else.
    pub(super) fn normal(&self, normal: [f64; 3]) -> [f64; 3] {
        // What is no direction stays for those who keep it.
        let matrix = self.normals.filter(|_| normal.iter().all(|x| x.is_finite()));
        matrix.map_or(normal, |matrix| unit((matrix * DVec3::from(normal)).into()))
    }

    /// Whether the outside of triangles becomes their inside.
    pub(super) fn mirrors(&self) -> bool {
        self.matrix.matrix3.determinant() < 0.0
    }

    /// The frame of a joint, given in the space of the mesh: its axes keep their lengths, which have no unit.
    pub(super) fn frame(&self, frame: DAffine3) -> [[f64; 3]; 4] {
        let mut placed = frame;
        if !self.identity {
            let scale = self.matrix.matrix3.determinant().abs().cbrt();
            placed = DAffine3 {
                matrix3: self.matrix.matrix3 * (1.0 / scale) * frame.matrix3,
                translation: self.matrix.transform_point3(frame.translation),
            };
        }
        let DMat3 { x_axis, y_axis, z_axis } = placed.matrix3;
        [x_axis, y_axis, z_axis, placed.translation].map(<[f64; 3]>::from)
    }
}

/// The cofactors of a matrix: normals go with them, whatever becomes of lengths and also where it is singular. A mirror
/// turns triangles round, and their normals stay outside with the sign of the determinant.
fn cofactors(matrix: DMat3) -> DMat3 {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = matrix;
    let sign = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn our_own_scale_touches_no_bit() {
        let placement = Placement::of(DAffine3::from_scale(DVec3::splat(0.001)));
        let point = [f64::from(0.1f32), -0.0, f64::from(f32::MIN_POSITIVE)];
        assert_eq!(placement.point(point).map(f64::to_bits), point.map(f64::to_bits));
        assert!(placement.identity && !placement.mirrors());
    }

    #[test]
    fn normals_stay_perpendicular_and_outside() {
        let placement = Placement::of(DAffine3::from_scale(DVec3::new(-1.0, 4.0, 1.0)));
        assert!(placement.mirrors());
        // A plane through the z axis and (1, 1, 0): its normal (1, -1, 0) becomes that of (-1, 4, 0).
        let normal = DVec3::from(placement.normal([1.0, -1.0, 0.0]));
        let along = DVec3::from(placement.displacement([1.0, 1.0, 0.0]));
        assert!(normal.dot(along).abs() < 1e-9 && normal.x < 0.0 && (normal.length() - 1.0).abs() < 1e-15);
        let metres = Placement::of(DAffine3::IDENTITY);
        assert_eq!((metres.point([1.0, 2.0, 3.0]), metres.normal([0.5, 0.0, 0.0])), ([1e3, 2e3, 3e3], [0.5, 0.0, 0.0]));
    }

    #[test]
    fn frames_keep_the_lengths_of_their_axes() {
        let frame = DAffine3::from_translation(DVec3::new(0.0, 1.5, 0.0));
        let placed = Placement::of(DAffine3::IDENTITY).frame(frame);
        assert_eq!(placed[3], [0.0, 1500.0, 0.0]);
        assert!((placed[0][0] - 1.0).abs() < 1e-15);
    }
}
