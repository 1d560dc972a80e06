//! Tests of normals of clouds: shapes whose normals are known, parts within parts, sheets, clouds without planes.

use super::*;
use crate::spatial::samples::bumpy_sphere;

/// The vertices of a bumpy ball, `scale` times as large and moved, with their normals.
fn ball(scale: f64, shift: f64) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let (positions, faces) = bumpy_sphere(14);
    let mesh = crate::mesh::Mesh { positions, faces, ..Default::default() };
    let placed = mesh.positions.iter().map(|p| [p[0] * scale + shift, p[1] * scale, p[2] * scale]);
    (placed.collect(), mesh.vertex_normals_by_angle())
}

fn around(points: &[[f64; 3]]) -> CloudNormals {
    cloud_normals(points, &CloudNormalOptions::default()).unwrap()
}

/// The part of the normals that point to the side of the others.
fn agreement(normals: &[[f64; 3]], truth: &[[f64; 3]]) -> f64 {
    let agree = |(n, t): &(&[f64; 3], &[f64; 3])| (0..3).map(|axis| n[axis] * t[axis]).sum::<f64>() > 0.0;
    normals.iter().zip(truth).filter(agree).count() as f64 / normals.len() as f64
}

/// A square sheet of 15 times 15 points at height `z`, its points a little uneven.
fn sheet(z: f64) -> Vec<[f64; 3]> {
    (0..225)
        .map(|i| (f64::from(i % 15), f64::from(i / 15)))
        .map(|(x, y)| [x, y, z + 0.01 * (3.0 * x + y).sin()])
        .collect()
}

#[test]
fn a_ball_points_outwards_wherever_it_is_and_however_large() {
    for (scale, shift) in [(1.0, 0.0), (1e-30, 0.0), (1e30, 3e30), (200.0, -5000.0)] {
        let (points, truth) = ball(scale, shift);
        let found = around(&points);
        assert_eq!((found.parts.len(), found.parts[0].n_points, found.n_without_normal), (1, points.len(), 0));
        assert!(found.parts[0].certainty > 0.9, "{:?}", found.parts);
        assert_eq!(agreement(&found.normals, &truth), 1.0);
        let longest = found.normals.iter().map(|n| n.iter().map(|x| x * x).sum::<f64>().sqrt()).fold(0.0, f64::max);
        assert!((longest - 1.0).abs() < 1e-12);
    }
}

#[test]
fn parts_side_by_side_and_within_one_another_are_turned_as_one_body() {
    // A shell around a cavity around a core, and a ball beside them: the cavity's outside is its inner side.
    let (mut points, mut truth) = ball(10.0, 0.0);
    for (scale, shift, sign) in [(5.0, 0.0, -1.0), (2.0, 0.0, 1.0), (4.0, 30.0, 1.0)] {
        let (more, normals) = ball(scale, shift);
        points.extend(more);
        truth.extend(normals.iter().map(|n| n.map(|x| sign * x)));
    }
    let found = around(&points);
    assert_eq!(found.parts.len(), 4);
    assert!(found.parts.iter().all(|part| part.certainty > 0.5), "{:?}", found.parts);
    assert_eq!(agreement(&found.normals, &truth), 1.0);
}

#[test]
fn small_parts_beyond_the_first_are_turned_with_regard_to_those() {
    // One large ball inside of which lie very many small ones, which are matter in matter, and as many outside.
    let (mut points, mut truth) = ball(100.0, 0.0);
    let n_small = 70;
    for number in 0..n_small {
        let (more, normals) = ball(0.5, 140.0 + 10.0 * f64::from(number));
        points.extend(more);
        truth.extend(normals);
    }
    let found = around(&points);
    assert_eq!(found.parts.len(), n_small as usize + 1);
    assert_eq!(agreement(&found.normals, &truth), 1.0);
}

#[test]
fn two_sheets_close_together_are_the_sides_of_a_plate() {
    let points = [sheet(0.0), sheet(7.0)].concat();
    let truth: Vec<[f64; 3]> = (0..450).map(|i| [0.0, 0.0, if i < 225 { -1.0 } else { 1.0 }]).collect();
    let found = around(&points);
    assert_eq!(found.parts.len(), 2);
    assert_eq!(agreement(&found.normals, &truth), 1.0);
    assert!(found.parts.iter().all(|part| part.certainty > 0.3), "{:?}", found.parts);
    // A piece that continues a curved sheet takes its side, though it is flat itself.
    let bowl = |x: f64, y: f64| [x, y, -0.03 * (x * x + y * y)];
    let mut pieces: Vec<[f64; 3]> =
        (0..900).map(|i| bowl(f64::from(i % 30) - 15.0, f64::from(i / 30) - 15.0)).collect();
    pieces.extend((0..100).map(|i| bowl(18.5 + 0.8 * f64::from(i % 10), 0.8 * f64::from(i / 10))));
    let found = around(&pieces);
    assert_eq!(found.parts.len(), 2);
    assert!(found.normals.iter().all(|n| n[2] > 0.0) && found.parts[1].certainty > 0.3, "{:?}", found.parts);
    // A sheet alone has no outside, but for the one that is told.
    assert!(around(&sheet(0.0)).parts[0].certainty < 0.05);
    for z in [-50.0, 50.0] {
        let outside = Outside::Towards([7.0, 7.0, z]);
        let found = cloud_normals(&points, &CloudNormalOptions { outside, ..Default::default() }).unwrap();
        assert!(found.normals.iter().all(|n| n[2] * z > 0.9 * z.abs()));
        assert!(found.parts.iter().all(|part| part.certainty > 0.99), "{:?}", found.parts);
    }
}

#[test]
fn points_without_a_plane_have_no_normal() {
    let line: Vec<[f64; 3]> = (0..40).map(|i| [f64::from(i), 2.0 * f64::from(i), 0.0]).collect();
    for points in [&line[..], &line[..1], &line[..2], &[[3.0; 3]; 50][..]] {
        let found = around(points);
        assert_eq!((found.parts.len(), found.n_without_normal), (0, points.len()));
        assert!(found.normals.iter().all(|n| *n == [0.0; 3]));
    }
    let (mut points, truth) = ball(1.0, 0.0);
    points.extend([[50.0; 3]; 20]);
    let found = around(&points);
    assert_eq!((found.n_without_normal, found.parts.len()), (20, 1));
    assert_eq!(agreement(&found.normals[..truth.len()], &truth), 1.0);
    // Three points have a plane, and each two neighbours.
    let three = around(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert!(three.normals.iter().all(|n| n[2].abs() == 1.0 && n[2] == three.normals[0][2]), "{three:?}");
}

#[test]
fn what_has_no_normals_is_refused() {
    let said = |points: &[[f64; 3]], n_neighbours: usize, outside: Outside| {
        cloud_normals(points, &CloudNormalOptions { n_neighbours, outside }).unwrap_err().to_string()
    };
    assert!(said(&sheet(0.0), 2, Outside::Around).contains("at least 3"));
    assert!(said(&sheet(0.0), usize::MAX, Outside::Around).contains("at most 1000"));
    assert!(said(&sheet(0.0), 16, Outside::Towards([f64::NAN; 3])).contains("finite position"));
    assert!(said(&[], 16, Outside::Around).contains("no point"));
    assert!(said(&[[0.0; 3], [f64::NAN; 3]], 16, Outside::Around).contains("point 1"));
}

#[test]
fn any_number_of_threads_finds_the_same() {
    let (mut points, _) = ball(1.0, 0.0);
    points.extend(sheet(0.2));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| around(&points))
    };
    assert_eq!(on(1), on(3));
}
