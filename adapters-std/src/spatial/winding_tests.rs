//! Winding numbers against the sum over all triangles, and on clouds.

use super::*;
use crate::spatial::samples::{bumpy_sphere, lattice_faces, lattice_positions, wild_positions};
use proptest::prelude::*;

fn exactly(positions: &[[f64; 3]], faces: &[[u32; 3]], p: [f64; 3]) -> f64 {
    let triangle = |face: &[u32; 3]| face.map(|v| DVec3::from_array(positions[v as usize]));
    faces.iter().map(|face| solid_angle(p.into(), &triangle(face))).sum::<f64>() / SPHERE
}

/// Positions in and around the unit cube, in no pattern.
fn spread(n: usize, scale: f64) -> Vec<[f64; 3]> {
    let at = |i: usize, step: f64| ((i as f64 * step).fract() * 2.0 - 1.0) * scale;
    (1..=n).map(|i| [at(i, 0.819_172_513), at(i, 0.671_043_606), at(i, 0.549_700_477)]).collect()
}

#[test]
fn numbers_of_a_closed_and_of_an_open_surface_are_near_the_exact_sum() {
    let (positions, faces) = bumpy_sphere(24);
    for (faces, is_closed) in [(&faces[..], true), (&faces[..faces.len() * 3 / 4], false)] {
        let tree = WindingTree::of_mesh(&positions, faces).expect("faces fit");
        let queries = spread(500, 1.6);
        let (mut largest, mut n_inside) = (0.0_f64, 0);
        for (&p, number) in queries.iter().zip(tree.at_all(&queries)) {
            assert_eq!(number.to_bits(), tree.at(p).to_bits());
            let exact = exactly(&positions, faces, p);
            largest = largest.max((number - exact).abs());
            n_inside += usize::from(exact > 0.5);
            assert!(!is_closed || exact.abs() < 1e-9 || (exact - 1.0).abs() < 1e-9);
        }
        println!("largest error, closed {is_closed}: {largest:.5}");
        assert!(largest > 0.0 && largest < 0.01, "{largest}");
        assert!((50..250).contains(&n_inside), "{n_inside}");
    }
}

proptest! {
    #[test]
    fn numbers_of_any_triangles_are_near_the_exact_sum(positions in lattice_positions(), faces in lattice_faces(), p in prop::array::uniform3(-5.3_f64..5.3)) {
        let tree = WindingTree::of_mesh(&positions, &faces).expect("faces fit");
        let (number, exact) = (tree.at(p), exactly(&positions, &faces, p));
        prop_assert!((number - exact).abs() < 0.02, "{number} {exact}");
        for scale in [1e-60, 1e60] {
            let scaled: Vec<[f64; 3]> = positions.iter().map(|p| p.map(|x| x * scale)).collect();
            let tree = WindingTree::of_mesh(&scaled, &faces).expect("faces fit");
            let number = tree.at(p.map(|x| x * scale));
            prop_assert!((number - exact).abs() < 0.02, "{scale}: {number} {exact}");
        }
    }
}

proptest! {
    #[test]
    fn numbers_of_triangles_of_all_sizes_are_near_the_exact_sum(positions in wild_positions(), faces in lattice_faces(), p in prop::array::uniform3(-5.3_f64..5.3), stretch in prop_oneof![Just(1.0), Just(1e-6), Just(1e5), Just(1e12), Just(1e69)]) {
        let p = p.map(|x| x * stretch);
        let tree = WindingTree::of_mesh(&positions, &faces).expect("faces fit");
        let (number, exact) = (tree.at(p), exactly(&positions, &faces, p));
        prop_assert!((number - exact).abs() < 0.02, "{number} {exact}");
    }

    #[test]
    fn numbers_on_the_surface_are_numbers(positions in lattice_positions(), faces in lattice_faces(), p in prop::array::uniform3(-3_i8..4)) {
        let tree = WindingTree::of_mesh(&positions, &faces).expect("faces fit");
        let number = tree.at(p.map(f64::from));
        prop_assert!(number.abs() <= 0.5 * faces.len() as f64 + 0.02, "{number}");
    }
}

/// The middles of the faces, their normals and areas.
fn cloud(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> (Vec<[f64; 3]>, Vec<[f64; 3]>, Vec<f64>) {
    let triangles = faces.iter().map(|face| face.map(|v| DVec3::from_array(positions[v as usize])));
    let (mut points, mut normals, mut areas) = (Vec::new(), Vec::new(), Vec::new());
    for [a, b, c] in triangles {
        let normal = (b - a).cross(c - a);
        points.push(((a + b + c) / 3.0).to_array());
        normals.push((normal * 7.0).to_array());
        areas.push(normal.length() / 2.0);
    }
    (points, normals, areas)
}

#[test]
fn a_cloud_tells_inside_from_outside() {
    let (positions, faces) = bumpy_sphere(24);
    let (points, normals, areas) = cloud(&positions, &faces);
    let tree = WindingTree::of_points(&points, &normals, &areas).expect("a sound cloud");
    let queries = spread(500, 1.6);
    let mut largest = 0.0_f64;
    for (&p, number) in queries.iter().zip(tree.at_all(&queries)) {
        let dipole = |((point, normal), area): ((&[f64; 3], &[f64; 3]), &f64)| {
            let r = DVec3::from_array(*point) - DVec3::from_array(p);
            DVec3::from_array(unit(*normal)).dot(r) * area / r.length().powi(3) / SPHERE
        };
        let exact: f64 = points.iter().zip(&normals).zip(&areas).map(dipole).sum();
        largest = largest.max((number - exact).abs());
        let nearest = points.iter().map(|q| DVec3::from_array(*q).distance(p.into())).fold(f64::INFINITY, f64::min);
        if nearest > 0.1 {
            assert!((number - exactly(&positions, &faces, p)).abs() < 0.02, "{number} {nearest}");
        }
    }
    println!("largest error of a cloud: {largest:.5}");
    assert!(largest > 0.0 && largest < 0.01, "{largest}");
    assert!(tree.at(points[3]).is_finite());
}

#[test]
fn equal_points_and_surfaces_without_area_have_numbers() {
    let points = vec![[1.0, 2.0, 3.0]; 40];
    let tree = WindingTree::of_points(&points, &[[0.0, 0.0, 2.0]; 40], &[0.5; 40]).expect("a sound cloud");
    assert_eq!(tree.at([1.0, 2.0, 3.0]), 0.0);
    assert!((tree.at([1.0, 2.0, -7.0]) - 20.0 / 100.0 / SPHERE).abs() < 1e-7);
    let tree = WindingTree::of_mesh(&[[1.0; 3]], &[[0; 3]; 40]).expect("faces fit");
    assert_eq!((tree.at([1.0; 3]), tree.at([2.0; 3])), (0.0, 0.0));
}

#[test]
fn no_thread_changes_a_bit() {
    let (positions, faces) = bumpy_sphere(48);
    let queries = spread(2000, 1.6);
    let numbers = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().expect("threads");
        let all = pool.install(|| WindingTree::of_mesh(&positions, &faces).expect("faces fit").at_all(&queries));
        all.into_iter().map(f64::to_bits).collect::<Vec<_>>()
    };
    assert_eq!(numbers(1), numbers(3));
}

#[test]
fn what_is_no_surface_is_refused() {
    let message = |result: Result<WindingTree, Error>| result.expect_err("refused").to_string();
    let (zero, up) = ([0.0; 3], [0.0, 0.0, 1.0]);
    assert!(message(WindingTree::of_mesh(&[zero], &[])).contains("no triangle to wind around"));
    assert!(message(WindingTree::of_mesh(&[zero], &[[0, 0, 1]])).contains("names vertex 1"));
    assert!(message(WindingTree::of_mesh(&[[f64::NAN; 3]], &[[0; 3]])).contains("vertex 0 of face 0"));
    assert!(message(WindingTree::of_points(&[], &[], &[])).contains("0 points to wind around"));
    assert!(message(WindingTree::of_points(&[zero], &[], &[1.0])).contains("0 normals and 1 areas"));
    for (position, normal, area) in
        [([0.0, 1e71, 0.0], up, 1.0), (zero, [f64::INFINITY; 3], 1.0), (zero, up, -1.0), (zero, up, f64::NAN)]
    {
        assert!(message(WindingTree::of_points(&[position], &[normal], &[area])).contains("point 0 is at"));
    }
    let tree = WindingTree::of_points(&[zero], &[up], &[1.0]).expect("a sound cloud");
    assert!(tree.at([f64::NAN, 0.0, 0.0]).is_nan() && tree.at([1e71, 0.0, 0.0]).is_nan());
}
