//! Geodesics, frames and areas of meshes against shapes whose geometry is known.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DQuat, DVec3, EulerRot};
use proptest::prelude::*;

use super::super::shapes::{cone, cylinder, icosphere, square};
use super::super::{Location, Stop, Surface, SurfacePoint, total_area, wrapped};
use super::MeshSurface;
use crate::mesh::Mesh;
use crate::spatial::samples::bumpy_sphere;

fn surface(mesh: &Mesh) -> MeshSurface {
    MeshSurface::new(mesh).expect("an oriented manifold")
}

fn place(surface: &MeshSurface, at: &Location) -> DVec3 {
    DVec3::from_array(surface.position(at).expect("a location of this surface"))
}

/// The angle at `at` of the tangent direction closest to a direction in space.
fn angle_towards(surface: &MeshSurface, at: &Location, direction: DVec3) -> f64 {
    let [x, y] = surface.frame_at(at).expect("a frame").coordinates(direction.to_array());
    y.atan2(x)
}

#[test]
fn a_square_has_the_geometry_of_the_plane() {
    let surface = surface(&square(8));
    assert!((total_area(&surface) - 1.0).abs() < 1e-12);
    assert_eq!(surface.n_components(), 1);
    let is_rim = |sample: u32| [sample % 9, sample / 9].iter().any(|&k| k == 0 || k == 8);
    assert!((0..81).all(|sample| surface.is_boundary(sample) == is_rim(sample)));
    for sample in (0..81).filter(|&sample| !is_rim(sample)) {
        assert!((surface.total_angle(sample) - TAU).abs() < 1e-12);
        let frame = surface.frame(sample);
        let here = place(&surface, &surface.sample(sample));
        for edge in surface.neighbours(sample) {
            let there = place(&surface, &surface.sample(edge.j));
            assert!((edge.length - here.distance(there)).abs() < 1e-14);
            let [x, y] = frame.coordinates((there - here).to_array());
            assert!(wrapped(edge.angle_i - y.atan2(x)).abs() < 1e-12, "{sample}: {edge:?}");
            // In the plane transport is the rotation between the frames.
            let [x, y] = surface.frame(edge.j).coordinates(frame.u);
            assert!(is_rim(edge.j) || wrapped(edge.transport() - y.atan2(x)).abs() < 1e-12);
        }
    }
}

#[test]
fn paths_on_a_square_are_straight_and_end_at_its_rim() {
    let surface = surface(&square(8));
    let from = surface.locate([0.31, 0.42, 0.0]);
    for step in 0..36 {
        let towards = DVec3::new((f64::from(step) * 0.31).cos(), (f64::from(step) * 0.31).sin(), 0.0);
        let angle = angle_towards(&surface, &from, towards);
        let trace = surface.trace(&from, angle, 0.3);
        let end = place(&surface, &from) + towards * 0.3;
        assert!((trace.stopped, trace.length) == (None, 0.3), "{trace:?}");
        assert!(place(&surface, &trace.end).distance(end) < 1e-13);
        assert!(wrapped(angle + trace.turn - angle_towards(&surface, &trace.end, towards)).abs() < 1e-12);
        let stopped = surface.trace(&from, angle, 3.0);
        let rim = place(&surface, &stopped.end);
        assert_eq!(stopped.stopped, Some(Stop::Boundary));
        assert!([rim.x, rim.y].iter().any(|x| x.abs() < 1e-12 || (x - 1.0).abs() < 1e-12), "{rim}");
        assert!((rim.distance(place(&surface, &from)) - stopped.length).abs() < 1e-12);
    }
    // Along the lines of the grid a path goes through vertices, and along the rim as well.
    for (vertex, end) in [(9 * 3 + 3, [7.0 / 8.0, 3.0 / 8.0, 0.0]), (1, [5.0 / 8.0, 0.0, 0.0])] {
        let from = surface.sample(vertex);
        let edge = surface.neighbours(vertex).iter().find(|edge| edge.j == vertex + 1).expect("the next in the row");
        let trace = surface.trace(&from, edge.angle_i, 0.5);
        assert_eq!(trace.stopped, None);
        assert!(place(&surface, &trace.end).distance(DVec3::from_array(end)) < 1e-13, "{trace:?}");
    }
}

#[test]
fn a_path_along_an_edge_turns_by_its_transport() {
    let (positions, faces) = bumpy_sphere(6);
    let surface = surface(&Mesh { positions, faces, ..Mesh::default() });
    for sample in 0..surface.n_samples() as u32 {
        for edge in surface.neighbours(sample) {
            let trace = surface.trace(&surface.sample(sample), edge.angle_i, edge.length);
            assert_eq!((trace.end, trace.stopped), (surface.sample(edge.j), None));
            assert!(wrapped(trace.turn - edge.transport()).abs() < 1e-9);
        }
    }
}

#[test]
fn the_sphere_has_its_area_and_great_circles_return() {
    for (level, tolerance) in [(3, 1.2e-2), (4, 3e-3)] {
        let surface = surface(&icosphere(level));
        let area = total_area(&surface) / (4.0 * PI);
        assert!((1.0 - tolerance..1.0).contains(&area), "{area}");
        assert_eq!((0..surface.n_samples() as u32).filter(|&sample| surface.is_boundary(sample)).count(), 0);
        let (mut worst, mut turn) = (0.0_f64, 0.0_f64);
        for (k, start) in [[0.3, 0.5, 0.8], [-0.7, 0.1, 0.2], [0.0, 0.0, 1.0]].into_iter().enumerate() {
            let from = surface.locate(start);
            for step in 0..8 {
                let angle = 0.1 + f64::from(step) * 0.7 + k as f64;
                let trace = surface.trace(&from, angle, TAU * area.sqrt());
                assert_eq!(trace.stopped, None);
                worst = worst.max(place(&surface, &trace.end).distance(place(&surface, &from)) / surface.spacing());
                // Back at about the start, in the frame of some face: compared in space.
                let ahead = |at: &Location, angle: f64| {
                    let frame = surface.frame_at(at).expect("a frame");
                    DVec3::from_array(frame.vector([angle.cos(), angle.sin()]))
                };
                turn = turn.max(ahead(&from, angle).angle_between(ahead(&trace.end, angle + trace.turn)));
            }
        }
        println!("level {level}: great circles end {worst:.3} h beside their start, turned by {turn:.4}");
        assert!(worst < 1.0 && turn < 0.1, "{worst} {turn}");
    }
}

#[test]
fn transport_round_an_octant_turns_by_its_curvature() {
    let surface = surface(&icosphere(5));
    // Turned, since along the axes the sides are lines of vertices, whose curvature is then wholly on one side of them.
    let rotation = DQuat::from_euler(EulerRot::XYZ, 0.3, 0.5, 0.7);
    let corners = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| surface.locate((rotation * axis).to_array()));
    let mut turn = 0.0;
    for side in 0..3 {
        let (from, to) = (corners[side], corners[(side + 1) % 3]);
        let chord = place(&surface, &to) - place(&surface, &from);
        // A great circle ends near the corner; a short path leads there.
        let long = surface.trace(&from, angle_towards(&surface, &from, chord), FRAC_PI_2);
        let [x, y] = surface.local_log(&long.end, &to, 3.0 * surface.spacing()).expect("a way");
        let trace = surface.trace(&long.end, y.atan2(x), x.hypot(y));
        assert!(place(&surface, &trace.end).distance(place(&surface, &to)) < 1e-9);
        turn += long.turn;
        // The frames at the end of this and the start of the next side are those of one place, if not of one face.
        let frame = |at: &Location| surface.frame_at(at).expect("a frame");
        let [x, y] = frame(&to).coordinates(frame(&trace.end).u);
        turn += trace.turn + y.atan2(x);
    }
    println!("octant: turned by {:.5} of pi/2", wrapped(turn) / FRAC_PI_2);
    // Counter-clockwise round positive curvature turns counter-clockwise.
    assert!((wrapped(turn) - FRAC_PI_2).abs() < 0.01 * FRAC_PI_2, "{turn}");
}

#[test]
fn a_cylinder_unrolls() {
    let (n, rows) = (40, 12);
    let surface = surface(&cylinder(n, rows));
    // Of the prism: the flat sides are chords.
    let round = f64::from(2 * n) * (PI / f64::from(n)).sin();
    let from = surface.locate([0.0, 0.5, 1.0]);
    let start = place(&surface, &from);
    for (across, up) in [(0.4, 0.3), (-2.0, 0.1), (1.0, -0.45), (round, 0.25), (2.0 * round, 0.0)] {
        let (across, up): (f64, f64) = (across, up);
        let angle = angle_towards(&surface, &from, DVec3::new(across, up, 0.0));
        let trace = surface.trace(&from, angle, across.hypot(up));
        assert_eq!(trace.stopped, None);
        let end = place(&surface, &trace.end);
        let unrolled = end.x.atan2(end.z).rem_euclid(TAU) * f64::from(n) / TAU;
        // A share of a chord is not quite that share of the angle.
        let (whole, part) = (unrolled.floor(), unrolled.fract());
        let half = PI / f64::from(n);
        let part = 0.5 + ((2.0 * part - 1.0) * half).tan() / half.tan() / 2.0;
        let expected = (across / round * f64::from(n)).rem_euclid(f64::from(n));
        let apart = (whole + part - expected).abs();
        assert!(apart.min(f64::from(n) - apart) < 1e-9, "{unrolled} {expected}");
        assert!((end.y - start.y - up).abs() < 1e-12);
    }
}

#[test]
fn a_path_through_the_apex_of_a_cone_halves_its_angle() {
    for (n, angle) in [(7, 0.5), (8, 0.25), (5, 1.1)] {
        let surface = surface(&cone(n, angle));
        assert!((surface.total_angle(0) - f64::from(n) * angle).abs() < 1e-12);
        // From a point of the first edge towards the apex and as far beyond.
        let from = surface.locate((place(&surface, &surface.sample(1)) * 0.6).to_array());
        let trace = surface.trace(&from, angle_towards(&surface, &from, -place(&surface, &from)), 1.0);
        assert_eq!(trace.stopped, None);
        let end = place(&surface, &trace.end);
        assert!((end.length() - 0.4).abs() < 1e-9);
        // Opposite: half the number of faces away.
        let middle = if n % 2 == 0 {
            place(&surface, &surface.sample(1 + n / 2))
        } else {
            place(&surface, &surface.sample(1 + n / 2)) + place(&surface, &surface.sample(2 + n / 2))
        };
        assert!(end.normalize().distance(middle.normalize()) < 1e-9, "{end} {middle}");
    }
}

#[test]
fn the_logarithm_leads_where_it_should() {
    let (positions, faces) = bumpy_sphere(10);
    let surface = surface(&Mesh { positions, faces, ..Mesh::default() });
    let (mut exact, mut worst, mut longest) = (0, 0.0_f64, 0.0_f64);
    for step in 0..2000_u32 {
        let turn = f64::from(step);
        let from = surface.locate([(1.7 * turn).sin(), (0.9 * turn).cos(), (2.3 * turn + 1.0).sin()]);
        let length = (0.1 + turn % 29.0 / 10.0) * surface.spacing();
        let to = surface.trace(&from, turn, length).end;
        let [x, y] = surface.local_log(&from, &to, 2.0 * length).expect("a way");
        let end = surface.trace(&from, y.atan2(x), x.hypot(y)).end;
        let missed = place(&surface, &end).distance(place(&surface, &to)) / length;
        exact += u32::from(missed < 1e-8);
        worst = worst.max(missed);
        longest = longest.max((x.hypot(y) / length - 1.0).abs());
    }
    println!(
        "logarithm: {exact} of 2000 exact, missed by at most {worst:.3} of the length, which differs by at most {longest:.3}"
    );
    assert!(exact >= 1990 && worst < 0.1 && longest < 0.1, "{exact} {worst} {longest}");
}

#[test]
fn repeated_paths_have_the_same_bits_and_every_path_ends() {
    let surface = surface(&icosphere(2));
    let from = surface.locate([0.2, 0.3, -0.9]);
    assert_eq!(surface.trace(&from, 0.7, 5e3), surface.trace(&from, 0.7, 5e3));
    let foreign = SurfacePoint { face: u32::MAX, barycentric: [1.0, 0.0, 0.0] };
    for (from, angle, length) in [
        (from, f64::NAN, 1.0),
        (from, 0.0, f64::INFINITY),
        (Location::Mesh(foreign), 0.0, 1.0),
        (Location::Mesh(SurfacePoint { face: 0, barycentric: [f64::NAN; 3] }), 0.0, 1.0),
        (Location::Cloud(super::super::CloudPoint { anchor: 0, offset: [0.0; 2] }), 0.0, 1.0),
    ] {
        assert_eq!(surface.trace(&from, angle, length).stopped, Some(Stop::NoStart));
    }
    assert_eq!(surface.position(&Location::Mesh(foreign)), None);
    assert_eq!(surface.local_log(&from, &Location::Mesh(foreign), 1.0), None);
    assert_eq!(surface.local_log(&from, &from, 1.0), Some([0.0; 2]));
}

#[test]
fn what_is_no_oriented_manifold_is_refused_with_the_remedy() {
    let message = |spoil: fn(&mut Mesh)| {
        let mut mesh = square(2);
        spoil(&mut mesh);
        MeshSurface::new(&mesh).expect_err("must fail").to_string()
    };
    for (spoil, expected) in [
        ((|m| m.faces[0].swap(0, 1)) as fn(&mut Mesh), "disagree about the outside"),
        (|m| m.faces.push([0, 4, 5]), "has 3 faces"),
        (|m| m.positions.push([9.0; 3]), "vertex 9 has no face"),
        (|m| m.positions[4] = m.positions[0], "has no area"),
        (|m| m.faces.retain(|face| face.contains(&0) || face.contains(&8)), "alone"),
    ] {
        let message = message(spoil);
        assert!(message.contains(expected) && message.contains("`habitus clean`"), "{message}");
    }
    assert!(message(|m| m.faces.clear()).contains("at least one face"));
}

#[test]
fn components_are_counted_by_their_first_vertices() {
    let mut mesh = square(1);
    let far: Vec<[f64; 3]> = mesh.positions.iter().map(|p| [p[0], p[1], 5.0]).collect();
    mesh.positions.extend(far);
    mesh.faces = vec![[4, 5, 7], [4, 7, 6], [0, 1, 3], [0, 3, 2]];
    let surface = surface(&mesh);
    assert_eq!((0..8).map(|sample| surface.component(sample)).collect::<Vec<_>>(), [0, 0, 0, 0, 1, 1, 1, 1]);
    // Places on two sheets have no path between them.
    let [low, high] = [surface.locate([0.3, 0.4, 0.0]), surface.locate([0.3, 0.4, 5.0])];
    assert_eq!(surface.local_log(&low, &high, 10.0), None);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn forward_and_back_again_is_where_it_began(
        start in prop::array::uniform3(-1.0..1.0_f64), angle in -PI..PI, length in 0.0..3.0_f64,
    ) {
        let (positions, faces) = bumpy_sphere(8);
        let surface = surface(&Mesh { positions, faces, ..Mesh::default() });
        let from = surface.locate(start);
        let there = surface.trace(&from, angle, length);
        prop_assert_eq!(there.stopped, None);
        let back = surface.trace(&there.end, angle + there.turn + PI, length);
        prop_assert!(place(&surface, &back.end).distance(place(&surface, &from)) < 1e-8);
        prop_assert!(back.turn.is_finite());
        let backwards = surface.trace(&there.end, angle + there.turn, -length);
        prop_assert!(place(&surface, &backwards.end).distance(place(&surface, &back.end)) < 1e-8);
    }
    #[test]
    fn every_path_on_odd_terrain_ends_on_it(
        heights in prop::collection::vec(-2.0..2.0_f64, 49),
        shear in prop_oneof![Just(0.0), Just(1e3), Just(1e6)],
        squeeze in prop_oneof![Just(1.0), Just(1e-6), Just(1e-9)],
        (x, y) in (0.01..0.99_f64, 0.01..0.99_f64), angle in -PI..PI, length in prop_oneof![0.0..3.0_f64, 0.0..1e5_f64],
    ) {
        let mut terrain = square(6);
        for (p, height) in terrain.positions.iter_mut().zip(heights) {
            *p = [p[0] + shear * p[1], squeeze * p[1], height * squeeze];
        }
        let surface = surface(&terrain);
        let from = surface.locate([x + shear * y, squeeze * y, 0.0]);
        let trace = surface.trace(&from, angle, length);
        prop_assert!(place(&surface, &trace.end).is_finite() && trace.turn.is_finite());
        prop_assert!(trace.length >= 0.0 && trace.length <= length);
        prop_assert!(trace.stopped.is_some() || trace.length == length);
    }
}
