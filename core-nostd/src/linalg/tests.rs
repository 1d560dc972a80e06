//! Singular values and polar factors over conditions, ranks and scales.

use super::polar::{Nearest, Polar, polar};
use super::svd3::*;
use crate::Error;
use crate::rotation::axis_angle::{Matrix3, product, rotation_matrix};
use crate::testing::cases;
use proptest::prelude::*;
use std::vec::Vec;

type Wide = Matrix3<f64>;

fn size(a: &Wide) -> f64 {
    a.iter().flatten().map(|x| x * x).sum::<f64>().sqrt()
}

fn minus(a: &Wide, b: &Wide) -> Wide {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[i][j] - b[i][j]))
}

fn determinant(a: &Wide) -> f64 {
    dot(&cross(a[0], a[1]), &a[2])
}

fn off_orthogonal(a: &Wide) -> f64 {
    size(&minus(&product(a, &transposed(a)), &identity()))
}

/// Errors in units of eps: residual, orthogonality of the factors, and those of the polar factors.
fn errors(a: &Wide, eps: f64, found: &Svd3<f64>, polar: &Polar<f64>) -> [f64; 4] {
    let scale = a.iter().flatten().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    let scale = if scale > 0.0 { scale } else { 1.0 };
    let scaled = a.map(|row| row.map(|x| x / scale));
    let us = found.u.map(|row| [0, 1, 2].map(|k| row[k] * (found.singular[k] / scale)));
    let stretch = polar.stretch.map(|row| row.map(|x| x / scale));
    let unit = eps * size(&scaled).max(if size(&scaled) > 0.0 { 0.0 } else { 1.0 });
    assert!(
        found.singular[0] >= found.singular[1] && found.singular[1] >= found.singular[2] && found.singular[2] >= 0.0
    );
    assert!((determinant(&found.v) - 1.0).abs() < 1e-4 && (determinant(&polar.rotation) - 1.0).abs() < 1e-4);
    assert!(stretch == transposed(&stretch));
    [
        size(&minus(&product(&us, &transposed(&found.v)), &scaled)) / unit,
        off_orthogonal(&found.u).max(off_orthogonal(&found.v)) / eps,
        size(&minus(&product(&polar.rotation, &stretch), &scaled)) / unit,
        off_orthogonal(&polar.rotation) / eps,
    ]
}

fn errors_f64(a: &Wide) -> [f64; 4] {
    errors(a, f64::EPSILON, &svd3(a).unwrap(), &polar(a).unwrap())
}

/// The same in f32, measured in f64.
fn errors_f32(a: &Wide) -> [f64; 4] {
    let narrow = a.map(|row| row.map(|x| x as f32));
    let wide = |m: Matrix3<f32>| m.map(|row| row.map(f64::from));
    let (found, polar) = (svd3(&narrow).unwrap(), polar(&narrow).unwrap());
    let found = Svd3 { u: wide(found.u), singular: found.singular.map(f64::from), v: wide(found.v) };
    let polar = Polar { rotation: wide(polar.rotation), stretch: wide(polar.stretch), nearest: polar.nearest };
    errors(&wide(narrow), f64::from(f32::EPSILON), &found, &polar)
}

fn within(found: [f64; 4]) -> bool {
    found.iter().all(|&error| error <= 16.0)
}

#[test]
fn known_values() {
    let found = svd3(&[[0.0, 2.0, 0.0], [0.0, 0.0, -3.0], [1.0, 0.0, 0.0]]).unwrap();
    assert_eq!(found.singular, [3.0, 2.0, 1.0]);
    // The determinant is negative: U reflects.
    assert_eq!((determinant(&found.u), determinant(&found.v)), (-1.0, 1.0));
    let found = polar(&[[-2.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 0.5]]).unwrap();
    assert_eq!(found.rotation, [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(found.stretch, [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.5]]);
}

#[test]
fn ranks() {
    let zero = svd3(&[[0.0f32; 3]; 3]).unwrap();
    assert_eq!((zero.singular, zero.rank(0.0), zero.u, zero.v), ([0.0; 3], 0, identity(), identity()));
    let outer = |a: [f64; 3], b: [f64; 3]| a.map(|x| b.map(|y| x * y));
    let one = outer([1.0, -2.0, 0.5], [0.3, 0.1, 0.7]);
    assert!(svd3(&one).unwrap().rank(1e-14) == 1 && within(errors_f64(&one)) && within(errors_f32(&one)));
    // Exactly of rank 1: two columns become exact zeros.
    let exact = outer([1.0, 2.0, -1.0], [1.0, -1.0, 0.0]);
    assert!(svd3(&exact).unwrap().rank(1e-15) == 1 && within(errors_f64(&exact)));
    let two = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];
    assert!(svd3(&two).unwrap().rank(1e-14) == 2 && within(errors_f64(&two)) && within(errors_f32(&two)));
    assert_ne!(polar(&two).unwrap().nearest, Nearest::Open);
}

#[test]
fn which_rotations_are_open() {
    let diagonal = |x, y, z| polar(&[[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]).map(|found| found.nearest);
    assert_eq!(diagonal(3.0, 2.0, 1.0), Ok(Nearest::Rotation));
    assert_eq!(diagonal(3.0, 2.0, 0.0), Ok(Nearest::Rotation));
    assert_eq!(diagonal(3.0, 2.0, -1.0), Ok(Nearest::OfReflection));
    assert_eq!(diagonal(3.0, 1.0, -1.0), Ok(Nearest::Open));
    assert_eq!(diagonal(-1.0, -1.0, -1.0), Ok(Nearest::Open));
    assert_eq!(diagonal(3.0, 0.0, 0.0), Ok(Nearest::Open));
    assert_eq!(diagonal(0.0, 0.0, 0.0), Ok(Nearest::Open));
    assert_eq!(diagonal(1.0, f64::NAN, 0.0), Err(Error::NotFinite { index: 4 }));
    assert_eq!(diagonal(f64::INFINITY, 0.0, 0.0), Err(Error::NotFinite { index: 0 }));
    assert_eq!(svd3(&[[f32::MAX; 3]; 3]), Err(Error::NotFinite { index: 9 }));
}

#[test]
fn graded_columns_keep_their_relative_accuracy() {
    let turn = rotation_matrix([0.4, -1.1, 0.7]);
    let graded: Wide = turn.map(|[x, y, z]: [f64; 3]| [x * 1e3, y * 1e-7, z * 1e-17]);
    for (found, expected) in svd3(&graded).unwrap().singular.iter().zip([1e3f64, 1e-7, 1e-17]) {
        assert!((found / expected - 1.0).abs() < 8.0 * f64::EPSILON);
    }
}

/// Singular values of every kind between two rotations.
fn built(turns: &[f64], singular: [f64; 3], scale: f64) -> Wide {
    let (left, right) =
        (rotation_matrix([turns[0], turns[1], turns[2]]), rotation_matrix([turns[3], turns[4], turns[5]]));
    product(&left.map(|row| [0, 1, 2].map(|k| row[k] * singular[k])), &right).map(|row| row.map(|x| x * scale))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    #[test]
    fn random_matrices(
        turns in proptest::collection::vec(-3.0f64..3.0, 6),
        condition in 0.0f64..12.0,
        middle in 0.0f64..1.0,
        kind in 0usize..5,
        power in -290i32..290,
        power_f32 in -30i32..30,
    ) {
        let last = 10f64.powf(-condition);
        let near = 1.0 + middle * 1e-9;
        let singular = match kind {
            0 => [1.0, last.powf(middle), last],
            1 => [near, 1.0, last],
            2 => [1.0, near * last, last],
            3 => [near, 1.0, -1.0],
            _ => [1.0, last, 0.0],
        };
        let found = errors_f64(&built(&turns, singular, 10f64.powi(power)));
        prop_assert!(within(found), "{found:?}");
        let found = errors_f32(&built(&turns, singular, 10f64.powi(power_f32)));
        prop_assert!(within(found), "f32 {found:?}");
        // A value is known to a few eps of the largest.
        let values = svd3(&built(&turns, singular, 1.0)).unwrap().singular;
        let mut expected = singular.map(f64::abs);
        expected.sort_by(|a, b| b.total_cmp(a));
        for (value, expected) in values.iter().zip(expected) {
            prop_assert!((value - expected).abs() < 16.0 * f64::EPSILON);
        }
    }

    #[test]
    fn agrees_with_another_library(entries in proptest::collection::vec(-1.0f64..1.0, 9)) {
        let a: Wide = [0, 1, 2].map(|i| [0, 1, 2].map(|j| entries[3 * i + j]));
        let other = nalgebra::Matrix3::from_row_slice(&entries).singular_values();
        for (found, expected) in svd3(&a).unwrap().singular.iter().zip(other.iter()) {
            prop_assert!((found - expected).abs() < 16.0 * f64::EPSILON);
        }
        // No rotation near the polar factor is nearer.
        let nearest = polar(&a).unwrap().rotation;
        let distance = size(&minus(&a, &nearest));
        for axis in 0..6 {
            let mut turn = [0.0; 3];
            turn[axis % 3] = if axis < 3 { 0.01 } else { -0.01 };
            prop_assert!(size(&minus(&a, &product(&nearest, &rotation_matrix(turn)))) >= distance - 1e-14);
        }
    }

    #[test]
    fn never_panics(entries in proptest::collection::vec(any::<f32>(), 9)) {
        let a: Matrix3<f32> = [0, 1, 2].map(|i| [0, 1, 2].map(|j| entries[3 * i + j]));
        let finite = entries.iter().all(|x| x.is_finite());
        let too_large = svd3(&a) == Err(Error::NotFinite { index: 9 });
        prop_assert!(polar(&a).is_ok() || !finite || too_large);
    }
}

/// The largest errors over many matrices: `cargo test -p habitus-core svd3 -- --ignored --nocapture`.
#[test]
#[ignore = "prints the figures of the documentation"]
fn figures() {
    let mut stream = crate::testing::Stream::new(5);
    let (mut worst, mut worst_f32) = ([0.0f64; 4], [0.0f64; 4]);
    for round in 0..200_000 {
        let turns: Vec<f64> = stream.take(6).iter().map(|&x| 3.0 * f64::from(x)).collect();
        let last = 10f64.powf(-6.0 - 6.0 * f64::from(stream.next()));
        let singular =
            [[1.0, last.sqrt(), last], [1.0, 1.0 + 1e-12, last], [1.0, last, -last], [1.0, 0.0, 0.0]][round % 4];
        let a = built(&turns, singular, 1.0);
        for (worst, found) in worst.iter_mut().zip(errors_f64(&a)).chain(worst_f32.iter_mut().zip(errors_f32(&a))) {
            *worst = worst.max(found);
        }
    }
    std::println!(
        "residual, orthogonality, polar residual, polar orthogonality in eps: f64 {worst:.1?}, f32 {worst_f32:.1?}"
    );
}
