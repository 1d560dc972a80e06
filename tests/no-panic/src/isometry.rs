//! `isometry` of the kernel, in both precisions.

use crate::memory::Input;
use habitus_core::isometry::jacobian::{Distortion, green_strain, local, local_of_relative, relative_of_local};
use habitus_core::isometry::pairs::{Deviation, Relative, absolute};
use habitus_core::isometry::samples::{TangentFit, Unfit, weight};
use habitus_core::isometry::summary::Summary;
use habitus_core::isometry::triangle::{Metric, jacobian};

macro_rules! checks {
    ($real:ty, $triangles:ident, $samples:ident, $pairs:ident) => {
        #[unsafe(no_mangle)]
        extern "C" fn $triangles(corners: [[$real; 3]; 3], lengths: [$real; 3], edges: [[[$real; 2]; 2]; 2]) -> $real {
            let [u, v, between] = lengths;
            let (from, to) = (Metric::of_corners(corners), Metric::of_lengths(u, v, between));
            let [first, second] = edges;
            let (Ok(spatial), Ok(planar)) = (from.jacobian_to(&to), jacobian(first, second)) else { return to.area() };
            let found = Distortion::of(&planar);
            let [xx, xy, yy] = green_strain(&spatial);
            let turned = if found.folds(u > v) { found.stretch() } else { found.area() + found.angle() };
            let tolerance = local_of_relative(relative_of_local(local(&spatial)));
            turned + tolerance + xx + xy + yy
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $samples(samples: Input<[[$real; 2]; 2]>, spacing: $real) -> $real {
            let mut fit = TangentFit::new();
            // SAFETY: the caller's promise.
            for &[b, a] in unsafe { samples.slice() } {
                fit.add(b, a, weight(b, spacing));
            }
            match fit.jacobian() {
                Ok(found) => local(&found),
                Err(Unfit::TooFew) => -1.0,
                Err(Unfit::IllConditioned) => -2.0,
            }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $pairs(pairs: Input<[$real; 3]>, spacing: $real, tolerance: $real) -> $real {
            let mut summary = Summary::new(tolerance);
            let relative = Relative::with_spacing(spacing);
            // SAFETY: the caller's promise.
            for &[d1, d2, weight] in unsafe { pairs.slice() } {
                summary.add(absolute(d1, d2), weight);
                summary.add(relative.deviation(d1, d2), weight);
            }
            summary.add(Deviation::Skipped, 1.0);
            let [calls, skipped] = summary.counts();
            let (largest, at) = summary.largest().unwrap_or_default();
            let fractions =
                summary.fraction_within().unwrap_or(spacing) + summary.fraction_violated().unwrap_or(spacing);
            summary.mean().unwrap_or(largest) + fractions + calls.wrapping_add(skipped).wrapping_add(at) as $real
        }
    };
}

checks!(f32, check_isometry_triangles_f32, check_isometry_samples_f32, check_isometry_pairs_f32);
checks!(f64, check_isometry_triangles_f64, check_isometry_samples_f64, check_isometry_pairs_f64);
