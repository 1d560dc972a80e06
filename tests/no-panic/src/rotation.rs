//! `rotation` of the kernel, in both precisions.

use habitus_core::rotation::axis_angle::{left_jacobian, product, rotation_matrix, transpose_applied};
use habitus_core::rotation::quaternion::{dual_part, quaternion_product, rotation_quaternion};
use habitus_core::rotation::similarity::Similarity;

macro_rules! checks {
    ($real:ty, $name:ident) => {
        #[unsafe(no_mangle)]
        extern "C" fn $name(a: [$real; 3], b: [$real; 3], scale: $real) -> $real {
            let matrix = rotation_matrix(a);
            let twice = product(&matrix, &left_jacobian(a));
            let start = Similarity { scale, rotation: twice, translation: b };
            let moved = start.moved(a, b, scale);
            let point = moved.inverse_applied(moved.applied(b));
            let turned = transpose_applied(&matrix, moved.inverse_rotated(point));
            let [x, y, z] = turned;
            let turn = rotation_quaternion(a);
            let [w, ..] = quaternion_product(turn, dual_part(turn, b));
            if moved.is_finite() { x + y + z } else { w }
        }
    };
}

checks!(f32, check_rotation_f32);
checks!(f64, check_rotation_f64);
