//! Distances that can be told in advance.

use super::*;

/// A square of side 2 at height `z`, of `n` by `n` cells, its front up.
fn square(z: f64, n: u32) -> Mesh {
    let positions = (0..(n + 1) * (n + 1)).map(|k| {
        let along = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
        [along(k % (n + 1)), along(k / (n + 1)), z]
    });
    let faces = (0..n * n).map(|k| k / n * (n + 1) + k % n);
    let faces = faces.flat_map(|v| [[v, v + 1, v + n + 2], [v, v + n + 2, v + n + 1]]).collect();
    Mesh { positions: positions.collect(), faces, ..Mesh::default() }
}

/// An octahedron whose faces are divided `times` times, on the sphere of this radius.
fn sphere(radius: f64, times: u32) -> Mesh {
    let mut triangles: Vec<[DVec3; 3]> = Vec::new();
    for k in 0..8_u32 {
        let signs = [0, 1, 2].map(|bit| if k >> bit & 1 == 0 { 1.0 } else { -1.0 });
        let corners = [DVec3::X * signs[0], DVec3::Y * signs[1], DVec3::Z * signs[2]];
        let outward = signs.iter().product::<f64>() > 0.0;
        triangles.push(if outward { corners } else { [corners[1], corners[0], corners[2]] });
    }
    for _ in 0..times {
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let [d, e, f] = [a + b, b + c, c + a].map(DVec3::normalize);
                [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
            })
            .collect();
    }
    let positions = triangles.iter().flatten().map(|corner| (*corner * radius).to_array()).collect();
    let faces = (0..triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    welded(&Mesh { positions, faces, ..Mesh::default() })
}

/// One vertex for each place.
fn welded(mesh: &Mesh) -> Mesh {
    let bits = |vertex: u32| mesh.positions[vertex as usize].map(|x| (x + 0.0).to_bits());
    let mut first = std::collections::BTreeMap::new();
    let mut kept = Vec::new();
    for vertex in 0..mesh.positions.len() as u32 {
        first.entry(bits(vertex)).or_insert_with(|| {
            kept.push(vertex);
            kept.len() as u32 - 1
        });
    }
    mesh.rearranged(&kept, mesh.faces.iter().map(|face| face.map(|vertex| first[&bits(vertex)])).collect())
}

use glam::DVec3;

fn close(a: f64, b: f64, bound: f64) {
    assert!((a - b).abs() <= bound, "{a} is not {b} within {bound}");
}

#[test]
fn parallel_squares_are_everywhere_as_far_as_their_planes() {
    let (low, high) = (square(0.0, 4), square(0.75, 3));
    for options in [
        DistanceOptions::default(),
        DistanceOptions { samples: 50, ..DistanceOptions::default() },
        DistanceOptions { area_weighted: true, ..DistanceOptions::default() },
    ] {
        let distance = surface_distance(&low, &high, &options).unwrap();
        for direction in [&distance.a_to_b, &distance.b_to_a] {
            let all = &direction.all;
            for figure in [all.mean, all.rms, all.median, all.quantile_90, all.quantile_99, all.largest] {
                close(figure, 0.75, 1e-12);
            }
            assert_eq!(all.within, [(0.5, 0.0), (1.0, 1.0), (2.0, 1.0), (5.0, 1.0), (10.0, 1.0)]);
        }
        // The low square lies behind the high one.
        close(distance.a_to_b.all.signed_mean.unwrap(), -0.75, 1e-12);
        close(distance.b_to_a.all.signed_mean.unwrap(), 0.75, 1e-12);
        close(distance.chamfer_mean(), 0.75, 1e-12);
        close(distance.hausdorff(), 0.75, 1e-12);
    }
}

#[test]
fn what_lies_beyond_the_boundary_is_reported_apart() {
    // Nine vertices over a square of half the size: eight of them are closest to its rim.
    let mut small = square(0.0, 2);
    small.positions.iter_mut().for_each(|p| *p = [p[0] / 2.0, p[1] / 2.0, 0.0]);
    let large = square(0.0, 2);
    let found = surface_distance(&large, &small, &DistanceOptions::default()).unwrap();
    assert_eq!((found.a_to_b.all.count, found.a_to_b.at_boundary), (9, 8));
    assert_eq!(found.a_to_b.inner.as_ref().map(|inner| (inner.count, inner.largest)), Some((1, 0.0)));
    close(found.a_to_b.all.largest, 0.5_f64.sqrt(), 1e-12);
    assert_eq!((found.b_to_a.at_boundary, found.b_to_a.all.largest), (0, 0.0));
    close(found.hausdorff(), 0.5_f64.sqrt(), 1e-12);
}

#[test]
fn a_sphere_and_a_larger_one_differ_by_their_radii() {
    let (inner, outer) = (sphere(50.0, 3), sphere(53.0, 3));
    let found = surface_distance(&inner, &outer, &DistanceOptions::default()).unwrap();
    // Facets of this division lie at most 0.6 % of the radius below the sphere.
    close(found.a_to_b.all.mean, 3.0, 0.3);
    close(found.b_to_a.all.mean, 3.0, 1e-9);
    close(found.b_to_a.all.signed_mean.unwrap(), 3.0, 1e-9);
    assert!(found.a_to_b.all.signed_mean.unwrap() < -2.7);
    assert_eq!((found.a_to_b.at_boundary, found.b_to_a.at_boundary), (0, 0));
}

#[test]
fn identical_shapes_have_no_distance() {
    for shape in [sphere(7.0, 2), Mesh { faces: Vec::new(), ..square(1.0, 5) }] {
        let found = surface_distance(&shape, &shape, &DistanceOptions::default()).unwrap();
        assert!(found.hausdorff() < 1e-12, "{found:?}");
        close(found.a_to_b.all.within[0].1, 1.0, 1e-12);
    }
}

#[test]
fn clouds_are_points_and_have_no_sides() {
    let mesh = square(0.0, 4);
    let cloud = Mesh { positions: vec![[0.1, 0.2, 3.0], [0.5, -0.25, 1.0]], ..Mesh::default() };
    let found =
        surface_distance(&cloud, &mesh, &DistanceOptions { samples: 10, ..DistanceOptions::default() }).unwrap();
    assert_eq!(found.a_to_b.all.count, 2);
    close(found.a_to_b.all.mean, 2.0, 1e-12);
    close(found.a_to_b.all.median, 1.0, 1e-12);
    close(found.a_to_b.all.rms, 5.0_f64.sqrt(), 1e-12);
    close(found.a_to_b.all.signed_mean.unwrap(), 2.0, 1e-12);
    assert_eq!((found.b_to_a.all.count, found.b_to_a.all.signed_mean), (10, None));
    assert!(found.b_to_a.all.mean > 1.0);
}

#[test]
fn area_weights_count_a_densely_sampled_part_no_more() {
    // Two squares, one of 200 triangles at height 1 and one of 2 at height 3 beside it, over a wide floor.
    let mut mesh = square(1.0, 10);
    let offset = mesh.positions.len() as u32;
    let far = square(3.0, 1);
    mesh.positions.extend(far.positions.iter().map(|p| [p[0] + 2.0, p[1], p[2]]));
    mesh.faces.extend(far.faces.iter().map(|face| face.map(|vertex| vertex + offset)));
    // No face uses it: it is no part of the mesh.
    mesh.positions.push([0.0, 0.0, 900.0]);
    let floor =
        Mesh { positions: square(0.0, 1).positions.iter().map(|p| p.map(|x| 9.0 * x)).collect(), ..square(0.0, 1) };
    let mean = |options: DistanceOptions| surface_distance(&mesh, &floor, &options).unwrap().a_to_b.all.mean;
    let options = DistanceOptions::default();
    close(mean(options.clone()), (121.0 + 12.0) / 125.0, 1e-12);
    close(mean(DistanceOptions { area_weighted: true, ..options.clone() }), 2.0, 1e-12);
    close(mean(DistanceOptions { samples: 1000, ..options }), 2.0, 1e-9);
}

#[test]
fn shapes_that_cannot_be_measured_are_named() {
    let sound = square(0.0, 2);
    let refused =
        |a: &Mesh, b: &Mesh, options: DistanceOptions| surface_distance(a, b, &options).unwrap_err().to_string();
    let empty = refused(&sound, &Mesh::default(), DistanceOptions::default());
    assert!(empty.contains("the second shape: a mesh without vertices"), "{empty}");
    let mut broken = sound.clone();
    broken.positions[3][1] = f64::NAN;
    let message = refused(&broken, &sound, DistanceOptions::default());
    assert!(message.contains("the first shape: the position of vertex 3"), "{message}");
    let flat = Mesh { faces: vec![[0, 1, 2]], ..sound.clone() };
    for options in [
        DistanceOptions { samples: 5, ..DistanceOptions::default() },
        DistanceOptions { area_weighted: true, ..DistanceOptions::default() },
    ] {
        assert!(refused(&flat, &sound, options).contains("the first shape: its faces have no area"));
    }
}

#[test]
fn other_units_are_suspected() {
    let body = square(0.0, 1);
    let scaled = |factor: f64| {
        let positions = body.positions.iter().map(|p| p.map(|x| factor * x)).collect();
        Mesh { positions, ..body.clone() }
    };
    assert_eq!(unit_factor(&scaled(1100.0), &body), Some(1000.0));
    assert_eq!(unit_factor(&scaled(0.04), &body), Some(1.0 / 25.4));
    assert_eq!(unit_factor(&scaled(9.0), &body), Some(10.0));
    assert_eq!(unit_factor(&scaled(2.0), &body), None);
    assert_eq!(unit_factor(&scaled(0.0), &body), None);
    assert_eq!(unit_factor(&Mesh::default(), &body), None);
}
