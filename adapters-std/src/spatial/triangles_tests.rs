use super::*;
use crate::spatial::samples::{bumpy_sphere, lattice_faces, lattice_positions, wild_positions};
use proptest::prelude::*;

/// The face, from every triangle in turn, and its squared distance.
fn slowly(positions: &[[f64; 3]], faces: &[[u32; 3]], p: [f64; 3]) -> (u32, f64) {
    let squared = |face: &[u32; 3]| on_triangle(p.into(), &face.map(|v| positions[v as usize].into())).squared;
    faces.iter().enumerate().fold((0, f64::INFINITY), |best, (index, face)| {
        if squared(face) < best.1 { (index as u32, squared(face)) } else { best }
    })
}

proptest! {
    #[test]
    fn the_closest_is_that_of_every_triangle_in_turn(
        positions in lattice_positions(),
        faces in lattice_faces(),
        queries in prop::collection::vec(prop::array::uniform3(-6_i8..7), 1..20),
        (scale, shift) in prop_oneof![Just((1.0, 0.0)), Just((0.1, 1e7)), Just((1e-60, 0.0)), Just((1e60, 0.0)), Just((1e-9, 1.0))],
    ) {
        let placed = |p: [f64; 3]| p.map(|x| x * scale + shift);
        let positions: Vec<[f64; 3]> = positions.into_iter().map(placed).collect();
        let queries: Vec<[f64; 3]> = queries.into_iter().map(|p| placed(p.map(f64::from))).collect();
        let tree = TriangleTree::new(&positions, &faces).expect("faces fit");
        let found: Vec<Closest> = queries.iter().map(|&p| tree.closest(p)).collect();
        for (&p, closest) in queries.iter().zip(&found) {
            let (face, squared) = slowly(&positions, &faces, p);
            prop_assert_eq!((closest.face, closest.distance), (face, squared.sqrt()));
            prop_assert!(closest.normal.iter().chain(&closest.barycentric).all(|x| x.is_finite()));
            for hint in [0, faces.len() as u32 / 2, u32::MAX] {
                prop_assert_eq!(&tree.closest_from(p, hint), closest);
            }
            prop_assert_eq!(tree.closest_within(p, closest.distance), Some(*closest));
            prop_assert_eq!(tree.closest_within(p, closest.distance * (1.0 - 1e-12) - 1e-300), None);
        }
        prop_assert_eq!(&tree.closest_all(&queries), &found);
        prop_assert_eq!(&tree.closest_all_from(&queries, &[0, 1, 2]), &found);
    }
}

proptest! {
    #[test]
    fn the_closest_of_triangles_of_all_sizes_is_that_of_every_triangle_in_turn(
        positions in wild_positions(),
        faces in lattice_faces(),
        queries in prop::collection::vec(prop::array::uniform3(-6_i8..7), 1..20),
        stretch in prop_oneof![Just(1.0), Just(1e-6), Just(1e5), Just(1e12), Just(1e69)],
    ) {
        let queries: Vec<[f64; 3]> = queries.into_iter().map(|p| p.map(|x| f64::from(x) * stretch)).collect();
        let tree = TriangleTree::new(&positions, &faces).expect("faces fit");
        let found = tree.closest_all(&queries);
        for (&p, closest) in queries.iter().zip(&found) {
            let (face, squared) = slowly(&positions, &faces, p);
            prop_assert_eq!((closest.face, closest.distance), (face, squared.sqrt()));
            prop_assert_eq!(&tree.closest_from(p, 0), closest);
            let [u, v, w] = closest.barycentric;
            prop_assert!([u, v, w].iter().all(|x| (0.0..=1.0).contains(x)) && (u + v + w - 1.0).abs() < 1e-14);
            prop_assert!(closest.signed_distance(p).is_finite());
        }
    }
}

#[test]
fn a_surface_of_many_faces_and_any_number_of_threads() {
    let (positions, faces) = bumpy_sphere(40);
    let queries: Vec<[f64; 3]> = (0..400)
        .map(|i| [0.37, 0.61, 0.83].map(|step: f64| 3.0 * (step * f64::from(i) + 0.1).fract() - 1.5))
        .chain(positions.iter().step_by(97).map(|p| p.map(|x| x * 1.01)))
        .chain(positions.iter().step_by(101).copied())
        .collect();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let tree = TriangleTree::new(&positions, &faces).expect("faces fit");
            (tree.closest_all(&queries), tree)
        })
    };
    let (found, tree) = on(1);
    assert_eq!(found, on(3).0);
    for (&p, closest) in queries.iter().zip(&found) {
        assert_eq!((closest.face, closest.distance), {
            let (face, squared) = slowly(&positions, &faces, p);
            (face, squared.sqrt())
        });
        assert_eq!(*closest, tree.closest(p));
        assert!(!closest.on_boundary);
    }
    assert!(tree.n_bytes() > 150 * faces.len() && tree.n_bytes() < 260 * faces.len(), "{}", tree.n_bytes());
}

#[test]
fn pseudo_normals_tell_the_side_at_every_vertex_and_edge() {
    let (positions, faces) = bumpy_sphere(10);
    let tree = TriangleTree::new(&positions, &faces).expect("faces fit");
    for face in &faces {
        let [a, b, _] = face.map(|v| positions[v as usize]);
        for on in [a, std::array::from_fn(|k| 0.5 * (a[k] + b[k]))] {
            for (scale, outside) in [(1.001, true), (0.999, false)] {
                let p = on.map(|x| x * scale);
                assert_eq!(tree.signed_distance(p) > 0.0, outside, "{p:?}");
            }
        }
    }
}

#[test]
fn the_end_of_the_surface_is_told() {
    // A square of two triangles.
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let tree = TriangleTree::new(&positions, &[[0, 1, 2], [0, 2, 3]]).expect("faces fit");
    let at = |p| {
        let closest = tree.closest(p);
        (closest.face, closest.feature, closest.on_boundary)
    };
    assert_eq!(at([0.5, -1.0, 0.0]), (0, Feature::Edge(0), true));
    assert_eq!(at([0.5, 0.5, 1.0]), (0, Feature::Edge(2), false));
    assert_eq!(at([0.7, 0.5, 1.0]), (0, Feature::Face, false));
    assert_eq!(at([-1.0, 2.0, 1.0]), (1, Feature::Vertex(2), true));
    assert_eq!(at([-1.0, -1.0, 1.0]), (0, Feature::Vertex(0), true));
    let closest = tree.closest([0.25, 0.5, 2.0]);
    assert_eq!((closest.point, closest.distance, closest.normal), ([0.25, 0.5, 0.0], 2.0, [0.0, 0.0, 1.0]));
    assert_eq!(closest.barycentric, [0.5, 0.25, 0.25]);
    assert_eq!((closest.signed_distance([0.25, 0.5, 2.0]), tree.signed_distance([0.25, 0.5, -2.0])), (2.0, -2.0));
}

#[test]
fn what_is_no_position_has_no_closest_point() {
    let tree = TriangleTree::new(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]).expect("a face");
    for spoilt in [f64::NAN, f64::INFINITY, 1e80] {
        let p = [0.0, spoilt, 0.0];
        assert!(tree.closest(p).distance.is_nan() && tree.closest_all(&[p])[0].distance.is_nan());
        assert_eq!(tree.closest_within(p, f64::INFINITY), None);
    }
    assert_eq!(tree.closest_within([0.0; 3], f64::NAN), None);
    assert_eq!(tree.closest_within([0.0; 3], -1.0), None);
    assert_eq!(tree.closest_within([0.0; 3], 0.0).map(|closest| closest.face), Some(0));
    assert_eq!(tree.closest_all(&[]), []);
}

#[test]
fn faces_that_do_not_fit_are_named() {
    let message = |positions: &[[f64; 3]], faces: &[[u32; 3]]| {
        TriangleTree::new(positions, faces).expect_err("must fail").to_string()
    };
    assert!(message(&[[0.0; 3]], &[]).contains("no triangle"));
    assert!(message(&[[0.0; 3]; 3], &[[0, 1, 2], [0, 3, 1]]).contains("face 1 names vertex 3"));
    assert!(message(&[[0.0; 3], [0.0, f64::NAN, 0.0]], &[[0, 0, 1]]).contains("vertex 1 of face 0"));
    assert!(message(&[[0.0; 3], [1e71, 0.0, 0.0]], &[[0, 0, 1]]).contains("at most 1e70"));
}
