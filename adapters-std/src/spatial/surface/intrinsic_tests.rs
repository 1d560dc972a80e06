use super::super::shapes::{cone, cylinder, icosphere, square};
use super::*;
use crate::spatial::samples::bumpy_sphere;
use proptest::prelude::*;

/// Areas kept, all edges Delaunay, sides glued in pairs of equal length and opposite direction, sound triangles.
fn check(mesh: &Mesh) -> usize {
    let before = IntrinsicTriangulation::of_mesh(mesh).expect("a manifold");
    let mut after = before.clone();
    let flips = after.flip_to_delaunay().expect("flips end");
    let (old, new) = (before.total_area(), after.total_area());
    assert!((old - new).abs() < 1e-9 * old, "{old} {new}");
    assert!((old - mesh.area()).abs() < 1e-9 * old);
    for face in 0..after.n_faces() as u32 {
        for side in 0..3 {
            let Some((other, place)) = after.across(face, side) else { continue };
            assert_eq!(after.across(other, place), Some((face, side)));
            assert_eq!(after.lengths()[face as usize][side], after.lengths()[other as usize][place]);
            let (here, there) = (after.faces()[face as usize], after.faces()[other as usize]);
            assert_eq!((here[side], here[(side + 1) % 3]), (there[(place + 1) % 3], there[place]));
            assert!(face == other || after.cotangent(face, side) + after.cotangent(other, place) > -1e-9);
        }
    }
    let boundary = |t: &IntrinsicTriangulation| t.twins.iter().filter(|&&twin| twin == NONE).count();
    assert_eq!(boundary(&before), boundary(&after));
    flips
}

#[test]
fn shapes_become_delaunay_and_keep_their_area() {
    assert_eq!(check(&icosphere(3)), 0);
    assert_eq!(check(&square(5)), 0);
    // Long in one direction, so that diagonals are flipped; a sharp cone, whose apex no edge reaches but its own.
    let mut long = square(6);
    long.positions.iter_mut().for_each(|p| *p = [p[0] + 3.0 * p[1], p[1], 0.0]);
    assert!(check(&long) > 20);
    let mut skewed = cylinder(9, 5);
    skewed.positions.iter_mut().for_each(|p| p[1] *= 0.05);
    check(&skewed);
    check(&cone(3, 0.2));
    let (positions, faces) = bumpy_sphere(9);
    let mut flat = Mesh { positions, faces, ..Mesh::default() };
    check(&flat);
    flat.positions.iter_mut().for_each(|p| p[1] *= 0.1);
    assert!(check(&flat) > 0);
}

#[test]
fn a_diagonal_is_flipped_to_the_shorter_one() {
    // A rhombus with its long diagonal.
    let positions = vec![[-2.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
    let mesh = Mesh { positions, faces: vec![[0, 1, 2], [1, 0, 3]], ..Mesh::default() };
    let mut triangulation = IntrinsicTriangulation::of_mesh(&mesh).expect("a manifold");
    assert_eq!(triangulation.flip_to_delaunay().expect("ends"), 1);
    assert_eq!(triangulation.faces(), [[3, 1, 2], [2, 0, 3]]);
    assert!((triangulation.lengths()[0][2] - 2.0).abs() < 1e-15);
    assert_eq!(triangulation.across(0, 2), Some((1, 2)));
}

#[test]
fn needles_are_lengthened_by_what_they_lack() {
    let positions = vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1e-7, 0.0], [1.0, -1.0, 0.0]];
    let mesh = Mesh { positions, faces: vec![[0, 1, 2], [1, 0, 3]], ..Mesh::default() };
    let mut triangulation = IntrinsicTriangulation::of_mesh(&mesh).expect("a manifold");
    let mean = (2.0 + 1.0 + 1.0 + 2.0 * 2.0_f64.sqrt()) / 5.0;
    let amount = triangulation.mollify(1e-5);
    assert!((amount - 1e-5 * mean).abs() < 1e-12, "{amount}");
    for &[a, b, c] in triangulation.lengths() {
        assert!((a + b - c).min(b + c - a).min(c + a - b) >= 1e-5 * mean * (1.0 - 1e-9));
    }
    assert_eq!(IntrinsicTriangulation::of_mesh(&icosphere(1)).expect("a manifold").mollify(1e-5), 0.0);
    assert!(IntrinsicTriangulation::delaunay(&mesh).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_terrain_becomes_delaunay(heights in prop::collection::vec(-2.0..2.0_f64, 49), shear in -5.0..5.0_f64) {
        let mut terrain = square(6);
        for (p, height) in terrain.positions.iter_mut().zip(heights) {
            *p = [p[0] + shear * p[1], p[1], height];
        }
        check(&terrain);
    }
}
