//! Placements and weights in the types of other crates, each behind the feature of its name.

#[cfg(any(feature = "glam", feature = "nalgebra"))]
use crate::rotation::similarity::Similarity;

/// The affine map of a placement, column vectors, for a renderer or a game engine.
#[cfg(feature = "glam")]
impl From<Similarity<f32>> for glam::Affine3A {
    fn from(placement: Similarity<f32>) -> Self {
        let [[a, b, c], [d, e, f], [g, h, i]] = placement.rotation.map(|row| row.map(|value| placement.scale * value));
        let linear = glam::Mat3A::from_cols_array(&[a, d, g, b, e, h, c, f, i]);
        glam::Affine3A { matrix3: linear, translation: placement.translation.into() }
    }
}

/// The 4 x 4 matrix of a placement, column vectors.
#[cfg(feature = "glam")]
impl From<Similarity<f32>> for glam::Mat4 {
    fn from(placement: Similarity<f32>) -> Self {
        glam::Mat4::from(glam::Affine3A::from(placement))
    }
}

/// The 4 x 4 matrix of a placement, homogeneous coordinates, column vectors.
#[cfg(feature = "nalgebra")]
impl<R: crate::Real + nalgebra::Scalar> From<Similarity<R>> for nalgebra::SMatrix<R, 4, 4> {
    fn from(placement: Similarity<R>) -> Self {
        let [[a, b, c], [d, e, f], [g, h, i]] = placement.rotation.map(|row| row.map(|value| placement.scale * value));
        let [x, y, z] = placement.translation;
        let (o, l) = (R::ZERO, R::ONE);
        // By columns.
        nalgebra::SMatrix::from_array_storage(nalgebra::ArrayStorage([
            [a, d, g, o],
            [b, e, h, o],
            [c, f, i, o],
            [x, y, z, l],
        ]))
    }
}

/// Scratch memory as a list of bounded length: `N` floats on the caller's stack or in a static, of which exactly as many are used as a call needs.
#[cfg(feature = "heapless")]
impl crate::workspace::Requirement {
    /// A workspace of this size, all zero.
    ///
    /// Errors: `WorkspaceTooSmall` when `N` floats are not enough.
    pub fn bounded<const N: usize>(self) -> Result<heapless::Vec<f32, N>, crate::Error> {
        self.check(N)?;
        let mut memory = heapless::Vec::new();
        // `N` floats fit, as was checked.
        let _ = memory.resize(self.numbers(), 0.0);
        Ok(memory)
    }
}

#[cfg(test)]
mod tests {
    #[cfg(any(feature = "glam", feature = "nalgebra"))]
    const PLACEMENT: crate::rotation::similarity::Similarity<f32> = crate::rotation::similarity::Similarity {
        scale: 2.0,
        rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [5.0, 6.0, 7.0],
    };

    #[cfg(feature = "glam")]
    #[test]
    fn glam_moves_points_to_the_same_place() {
        let point = [1.0, 2.0, 3.0];
        let affine = glam::Affine3A::from(PLACEMENT).transform_point3(point.into());
        let matrix = glam::Mat4::from(PLACEMENT).transform_point3(point.into());
        assert_eq!(affine.to_array(), PLACEMENT.applied(point));
        assert_eq!(matrix.to_array(), PLACEMENT.applied(point));
    }

    #[cfg(feature = "nalgebra")]
    #[test]
    fn nalgebra_moves_points_to_the_same_place() {
        let matrix = nalgebra::SMatrix::<f32, 4, 4>::from(PLACEMENT);
        let moved = matrix * nalgebra::Vector4::new(1.0, 2.0, 3.0, 1.0);
        assert_eq!([moved[0], moved[1], moved[2]], PLACEMENT.applied([1.0, 2.0, 3.0]));
    }

    #[cfg(feature = "heapless")]
    #[test]
    fn a_bounded_workspace_has_the_size_of_the_call_or_is_refused() {
        let requirement = crate::workspace::Requirement::of(5);
        assert_eq!(requirement.bounded::<8>().unwrap().len(), 5);
        let refusal = crate::Error::WorkspaceTooSmall { needed: 5, given: 4 };
        assert_eq!(requirement.bounded::<4>().unwrap_err(), refusal);
    }
}
