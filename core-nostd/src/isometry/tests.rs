//! Maps whose distortion is known: plane to cylinder and to sphere cap, catenoid to helicoid, scale, shear, mirror; pairs and sums.

use super::jacobian::{Distortion, Matrix2, green_strain, local, local_of_relative, relative_of_local};
use super::pairs::{Deviation, Relative, absolute};
use super::samples::{TangentFit, Unfit, weight};
use super::summary::Summary;
use super::triangle::{Metric, jacobian};
use crate::Error;
use crate::testing::cases;
use proptest::prelude::*;

type Surface = fn(f64, f64) -> [f64; 3];

/// Jacobian of a map between two surfaces with common parameters, from a triangle of size h at (u, v).
fn of_triangle(from: Surface, to: Surface, [u, v]: [f64; 2], h: f64) -> Matrix2<f64> {
    let corners = |surface: Surface| [surface(u, v), surface(u + h, v + 0.3 * h), surface(u - 0.2 * h, v + h)];
    Metric::of_corners(corners(from)).jacobian_to(&Metric::of_corners(corners(to))).unwrap()
}

fn plane(x: f64, y: f64) -> [f64; 3] {
    [x, y, 0.0]
}

fn cylinder(x: f64, y: f64) -> [f64; 3] {
    [2.0 * (x / 2.0).sin(), y, 2.0 * (x / 2.0).cos()]
}

/// The unit sphere by the exponential map at its pole.
fn cap(x: f64, y: f64) -> [f64; 3] {
    let a = x.hypot(y);
    [x * a.sin() / a, y * a.sin() / a, a.cos()]
}

fn catenoid(u: f64, v: f64) -> [f64; 3] {
    [v.cosh() * u.cos(), v.cosh() * u.sin(), v]
}

fn helicoid(u: f64, v: f64) -> [f64; 3] {
    [v.sinh() * u.sin(), -v.sinh() * u.cos(), u]
}

#[test]
fn isometries_keep_the_metric() {
    for (from, to) in [(plane as Surface, cylinder as Surface), (catenoid, helicoid)] {
        for at in [[0.3, 0.2], [-1.0, 0.7], [2.0, -0.4]] {
            // Chords differ from arcs in second order, the measure in fourth.
            let [coarse, fine] = [1e-1, 1e-2].map(|h| local(&of_triangle(from, to, at, h)));
            assert!(coarse < 1e-3 && fine < 2e-7 && fine < 1e-3 * coarse.max(1e-9), "{coarse:e} {fine:e}");
        }
    }
    // Distances along the surface are the same to the last bit: 3.1, 3.2.
    assert_eq!(absolute(3.5, 3.5), Deviation::Value(0.0));
    assert_eq!(Relative::with_spacing(0.5).deviation(3.5, 3.5), Deviation::Value(0.0));
}

#[test]
fn sphere_cap_shortens_its_parallels() {
    for a in [0.2f64, 0.5, 1.0, 1.5] {
        let expected = a.sin() / a;
        let found = Distortion::of(&of_triangle(plane, cap, [a, 0.0], 1e-5));
        assert!((found.longest - 1.0).abs() < 2e-5 && (found.shortest - expected).abs() < 2e-5);
        assert!((found.stretch() - (1.0 / expected - 1.0)).abs() < 1e-4 && (found.area() - expected).abs() < 1e-4);
        // The same from scattered samples: tangent coordinates are along the meridian and the parallel.
        let mut fit = TangentFit::new();
        for k in 0..9 {
            let (x, y) = (1e-4 * f64::from(k % 3 - 1), 1e-4 * f64::from(k / 3 - 1));
            let image = cap(a + x, y);
            let tangent = [image[0] * a.cos() - image[2] * a.sin(), image[1]];
            fit.add([x, y], tangent, weight([x, y], 1e-4));
        }
        let jacobian = fit.jacobian().unwrap();
        let found = Distortion::of(&jacobian);
        assert!((found.longest - 1.0).abs() < 1e-6 && (found.shortest - expected).abs() < 1e-6);
        assert!((local(&jacobian) - (expected * expected - 1.0).powi(2)).abs() < 1e-6);
    }
}

#[test]
fn uniform_scale_is_exact() {
    for scale in [2.0f32, 0.5, 1.25, 1.0] {
        let corners = [[1.0, 2.0, 3.0], [5.0, 5.0, 3.0], [1.0, 2.0, 4.0]];
        let image = corners.map(|corner| corner.map(|x| scale * x));
        let jacobian = Metric::of_corners(corners).jacobian_to(&Metric::of_corners(image)).unwrap();
        assert_eq!(jacobian, [[scale, 0.0], [0.0, scale]]);
        assert_eq!(local(&jacobian), 2.0 * (scale * scale - 1.0) * (scale * scale - 1.0));
        let found = Distortion::of(&jacobian);
        assert_eq!((found.longest, found.shortest, found.area(), found.angle()), (scale, scale, scale * scale, 1.0));
        assert_eq!(found.stretch(), scale.max(1.0 / scale) - 1.0);
        let exact = Relative { floor: 0.0, shortest: 0.0 };
        assert_eq!(exact.deviation(8.0, scale * 8.0), Deviation::Value(scale.max(1.0 / scale) - 1.0));
        assert_eq!(absolute(8.0, scale * 8.0), Deviation::Value((scale * 8.0 - 8.0).abs()));
    }
}

#[test]
fn strain_of_a_shear() {
    let shear = [[1.0, 0.5], [0.0, 1.0]];
    assert_eq!(green_strain(&shear), [0.0, 0.25, 0.125]);
    assert_eq!(local(&shear), 4.0 * (2.0 * 0.0625 + 0.015625));
    let flat = Distortion::of(&[[2.0, 0.0], [0.0, 0.0]]);
    assert_eq!((flat.longest, flat.shortest, flat.area()), (2.0, 0.0, 0.0));
    assert!(flat.stretch() == f64::INFINITY && flat.angle() == f64::INFINITY);
}

#[test]
fn folds_are_told_by_orientation() {
    let edges = [[1.0, 0.0], [0.0, 2.0]];
    let mirrored = jacobian(edges, [[-1.0, 0.0], [0.0, 2.0]]).unwrap();
    let found = Distortion::of(&mirrored);
    assert_eq!((found.longest, found.shortest, local(&mirrored)), (1.0, -1.0, 0.0));
    assert!(found.folds(false) && !found.folds(true));
    let kept = Distortion::of(&jacobian(edges, edges).unwrap());
    assert!(!kept.folds(false) && kept.folds(true));
}

#[test]
fn triangles_without_area_are_refused() {
    let line = Metric::of_corners([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]);
    assert_eq!(line.edges(), Err(Error::Degenerate));
    let whole = Metric::of_lengths(3.0, 4.0, 5.0);
    assert_eq!((whole.uv, whole.area(), whole.edges()), (0.0, 6.0, Ok([[3.0, 0.0], [0.0, 4.0]])));
    assert_eq!(line.jacobian_to(&whole), Err(Error::Degenerate));
    assert_eq!(whole.jacobian_to(&line), Err(Error::Degenerate));
    // The triangle inequality is broken.
    assert_eq!(Metric::of_lengths(1.0, 1.0, 3.0).edges(), Err(Error::Degenerate));
    assert_eq!(Metric::of_lengths(f64::NAN, 1.0, 1.0).edges(), Err(Error::Degenerate));
    assert_eq!(jacobian([[1.0, 2.0], [2.0, 4.0]], [[1.0, 0.0], [0.0, 1.0]]), Err(Error::Degenerate));
    // Kahan's needle: the area is right to the last digits, where Heron's formula gives another.
    let needle = Metric::of_lengths(100000.0, 99999.99979, 0.00029);
    assert!((needle.area() / 9.99999999f64 - 1.0).abs() < 1e-6, "{}", needle.area());
}

#[test]
fn samples_that_give_no_jacobian() {
    let mut fit = TangentFit::new();
    for (k, b) in [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]].into_iter().enumerate() {
        assert_eq!(fit.jacobian(), Err(Unfit::TooFew));
        fit.add(b, [-b[1], b[0]], 1.0 / (k + 1) as f64);
    }
    let turn = fit.jacobian().unwrap();
    assert!((turn[0][1] + 1.0).abs() < 1e-15 && (turn[1][0] - 1.0).abs() < 1e-15 && local(&turn) < 1e-29);
    let stretched = |height: f64| {
        let mut fit = TangentFit::new();
        for b in [[1.0, height], [1.0, -height], [-1.0, height], [-1.0, -height]] {
            fit.add(b, b, 1.0);
        }
        fit.jacobian().map(|jacobian| local(&jacobian))
    };
    // The condition of the moments is 1 / height^2.
    assert_eq!((stretched(0.2001).is_ok(), stretched(0.1999)), (true, Err(Unfit::IllConditioned)));
    assert_eq!((stretched(0.0), stretched(f64::NAN)), (Err(Unfit::IllConditioned), Err(Unfit::IllConditioned)));
    assert_eq!(weight([3.0, 0.0], 2.0), (-0.5f64).exp());
}

#[test]
fn pairs_without_a_path() {
    let infinity = f64::INFINITY;
    let relative = Relative::with_spacing(1.0);
    for deviation in [absolute as fn(f64, f64) -> Deviation<f64>, |a, b| Relative::with_spacing(1.0).deviation(a, b)] {
        assert_eq!(deviation(infinity, 5.0), Deviation::Violated);
        assert_eq!(deviation(5.0, infinity), Deviation::Violated);
        assert_eq!(deviation(1.0, infinity), Deviation::Violated);
        assert_eq!(deviation(infinity, infinity), Deviation::Skipped);
        assert_eq!(deviation(f64::NAN, 5.0), Deviation::Violated);
        assert_eq!(deviation(5.0, -1.0), Deviation::Violated);
    }
    assert_eq!(relative.deviation(2.9, 5.0), Deviation::Skipped);
    assert_eq!(relative.deviation(3.0, 5.0), Deviation::Value(0.5));
    assert_eq!(relative.deviation(5.0, 3.0), Deviation::Value(0.5));
    let unguarded = Relative { floor: 0.0, shortest: 0.0 };
    assert_eq!(unguarded.deviation(0.0, 0.0), Deviation::Skipped);
    assert_eq!(unguarded.deviation(1.0, 0.0), Deviation::Violated);
}

#[test]
fn sums() {
    let mut summary = Summary::new(0.2);
    assert_eq!((summary.mean(), summary.largest(), summary.fraction_within()), (None, None, None));
    for (deviation, weight) in [
        (Deviation::Value(0.1), 2.0),
        (Deviation::Skipped, 5.0),
        (Deviation::Value(0.5), 1.0),
        (Deviation::Violated, 1.0),
        (Deviation::Value(0.5), 0.0),
        (Deviation::Value(f64::NAN), 1.0),
    ] {
        summary.add(deviation, weight);
    }
    assert!((summary.mean().unwrap() - 0.7 / 3.0).abs() < 1e-15);
    assert_eq!((summary.largest(), summary.counts()), (Some((0.5, 2)), [6, 1]));
    assert_eq!((summary.fraction_within(), summary.fraction_violated()), (Some(0.4), Some(0.4)));
    // A million small values in f32: without compensation the mean would be off by 1e-3.
    let mut many = Summary::<f32>::new(1.0);
    (0..1_000_000).for_each(|_| many.add(Deviation::Value(0.1), 0.7));
    assert!((many.mean().unwrap() / 0.1 - 1.0).abs() < 3e-7 && many.fraction_within() == Some(1.0));
}

#[test]
fn tolerances_convert() {
    assert!((local_of_relative(0.2f64) - 0.32).abs() < 1e-15 && (relative_of_local(0.32f64) - 0.2).abs() < 1e-15);
    // A map within the relative tolerance keeps the local one, to first order.
    let scaled = |s: f64| local(&[[s, 0.0], [0.0, s]]);
    assert!((scaled(1.001) / local_of_relative(0.001) - 1.0).abs() < 2e-3);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    #[test]
    fn singular_values_as_by_another_library(entries in proptest::collection::vec(-1.0f64..1.0, 4)) {
        let other = nalgebra::Matrix2::from_row_slice(&entries);
        let jacobian = [[entries[0], entries[1]], [entries[2], entries[3]]];
        let found = Distortion::of(&jacobian);
        let values = other.singular_values();
        let bound = 4.0 * f64::EPSILON * values[0];
        prop_assert!((found.longest - values[0]).abs() <= bound && (found.shortest.abs() - values[1]).abs() <= bound);
        prop_assert!((found.longest * found.shortest - other.determinant()).abs() < 1e-14);
        let off = other.transpose() * other - nalgebra::Matrix2::identity();
        prop_assert!((local(&jacobian) - off.norm_squared()).abs() < 1e-14);
    }

    /// The measures of a linear map are found from triangles and from samples, wherever these lie.
    #[test]
    fn linear_maps_are_found(
        entries in proptest::collection::vec(-2.0f64..2.0, 4),
        points in proptest::collection::vec(-1.0f64..1.0, 12),
        turn in -3.0f64..3.0,
    ) {
        let applied = |[x, y]: [f64; 2]| [entries[0] * x + entries[1] * y, entries[2] * x + entries[3] * y];
        let expected = Distortion::of(&[[entries[0], entries[1]], [entries[2], entries[3]]]);
        let (u, v) = ([points[0], points[1]], [points[2], points[3]]);
        let area = u[0] * v[1] - u[1] * v[0];
        if !(area.abs() > 0.05 && expected.shortest.abs() > 0.05) {
            return Ok(());
        }
        let planar = Distortion::of(&jacobian([u, v], [applied(u), applied(v)]).unwrap());
        prop_assert!((planar.longest - expected.longest).abs() < 1e-12 && (planar.shortest - expected.shortest).abs() < 1e-12);
        // In space, turned: lengths alone, so without the sign.
        let (s, c) = turn.sin_cos();
        let lifted = |[x, y]: [f64; 2]| [c * x + 3.0, y - 1.0, s * x];
        let from = Metric::of_corners([lifted([0.0; 2]), lifted(u), lifted(v)]);
        let to = Metric::of_corners([lifted([0.0; 2]), lifted(applied(u)), lifted(applied(v))]);
        let spatial = Distortion::of(&from.jacobian_to(&to).unwrap());
        prop_assert!((spatial.longest - expected.longest).abs() < 1e-10 && (spatial.shortest - expected.shortest.abs()).abs() < 1e-10);
        // By lengths.
        let length = |[x, y]: [f64; 2]| x.hypot(y);
        let by_lengths = |u: [f64; 2], v: [f64; 2]| Metric::of_lengths(length(u), length(v), length([u[0] - v[0], u[1] - v[1]]));
        let lengths = Distortion::of(&by_lengths(u, v).jacobian_to(&by_lengths(applied(u), applied(v))).unwrap());
        prop_assert!((lengths.longest - expected.longest).abs() < 1e-10 && (lengths.shortest - expected.shortest.abs()).abs() < 1e-10);
        let mut fit = TangentFit::new();
        for b in points.chunks_exact(2) {
            let b = [b[0], b[1]];
            fit.add(b, applied(b), weight(b, 1.0));
        }
        if let Ok(found) = fit.jacobian() {
            for (row, expected) in found.iter().flatten().zip(&entries) {
                prop_assert!((row - expected).abs() < 1e-12);
            }
        }
    }
}
