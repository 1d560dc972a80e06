//! `rotation` of the kernel, in both precisions.

use habitus_core::rotation::axis_angle::{product, rotation_matrix, transpose_applied};
use habitus_core::rotation::similarity::Similarity;

macro_rules! checks {
    ($real:ty, $name:ident) => {
        #[unsafe(no_mangle)]
        extern "C" fn $name(a: [$real; 3], b: [$real; 3], scale: $real) -> $real {
            let matrix = rotation_matrix(a);
            let twice = product(&matrix, &matrix);
            let start = Similarity { scale, rotation: twice, translation: b };
            let moved = start.moved(a, b, scale);
            let point = moved.inverse_applied(moved.applied(b));
            let turned = transpose_applied(&matrix, moved.inverse_rotated(point));
            let [x, y, z] = turned;
            if moved.is_finite() { x + y + z } else { scale }
        }
    };
}

checks!(f32, check_rotation_f32);
checks!(f64, check_rotation_f64);
