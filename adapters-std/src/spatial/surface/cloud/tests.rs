//! Neighbourhoods, areas, borders and paths of clouds of shapes whose geometry is known.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::LazyLock;

use glam::DVec3;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::shapes::{icosphere, spiral_sphere};
use super::super::{CloudPoint, Location, MeshSurface, Stop, Surface, SurfacePoint, Trace, total_area, wrapped};
use super::CloudSurface;
use crate::mesh::Mesh;

fn surface(cloud: &Mesh) -> CloudSurface {
    CloudSurface::new(cloud).expect("an oriented cloud")
}

fn place(surface: &dyn Surface, at: &Location) -> DVec3 {
    DVec3::from_array(surface.position(at).expect("a location of this surface"))
}

/// A point for each cell of a grid of `n` by `n` on the unit square at this height, up to `jitter` of a cell from its centre.
fn sheet(n: u32, height: f64, normal: f64, jitter: f64) -> Mesh {
    let mut random = ChaCha8Rng::seed_from_u64(height.to_bits());
    let mut mesh = Mesh::default();
    for cell in 0..n * n {
        let mut at = |k: u32| (f64::from(k) + 0.5 + jitter * random.random_range(-1.0..1.0)) / f64::from(n);
        let (x, y) = (at(cell % n), at(cell / n));
        mesh.positions.push([x, y, height]);
        mesh.normals.push([0.0, 0.0, normal]);
    }
    mesh
}

fn both(mut one: Mesh, other: &Mesh) -> Mesh {
    one.positions.extend_from_slice(&other.positions);
    one.normals.extend_from_slice(&other.normals);
    one
}

/// Points spread over the unit sphere by chance.
fn random_sphere(n: usize, seed: u64) -> Mesh {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let point = || {
        let (y, turn): (f64, f64) = (random.random_range(-1.0..1.0), random.random_range(0.0..TAU));
        let radius = (1.0 - y * y).sqrt();
        [radius * turn.cos(), y, radius * turn.sin()]
    };
    let positions: Vec<[f64; 3]> = std::iter::repeat_with(point).take(n).collect();
    Mesh { normals: positions.clone(), positions, ..Mesh::default() }
}

fn n_boundary(surface: &dyn Surface) -> usize {
    (0..surface.n_samples() as u32).filter(|&sample| surface.is_boundary(sample)).count()
}

#[test]
fn spheres_have_their_area_and_no_border() {
    let spiral = surface(&spiral_sphere(3000));
    let area = total_area(&spiral) / (4.0 * PI);
    println!(
        "spiral: area {area:.5} of 4 pi, h {:.4} of sqrt(area / n)",
        spiral.spacing() / (4.0 * PI / 3000.0_f64).sqrt()
    );
    assert!((area - 1.0).abs() < 0.01, "{area}");
    assert_eq!((n_boundary(&spiral), spiral.n_components()), (0, 1));
    assert!((spiral.spacing() / (4.0 * PI / 3000.0_f64).sqrt() - 1.0).abs() < 0.15);
    for sample in 0..3000 {
        let here = place(&spiral, &spiral.sample(sample));
        for edge in spiral.neighbours(sample) {
            let arc = here.angle_between(place(&spiral, &spiral.sample(edge.j)));
            assert!((edge.length / arc - 1.0).abs() < 1e-4, "{} {arc}", edge.length);
        }
    }
    let scattered = surface(&random_sphere(3000, 1));
    let (area, n) = (total_area(&scattered) / (4.0 * PI), n_boundary(&scattered));
    println!("scattered: area {area:.5} of 4 pi, {n} of 3000 points on a false border");
    assert!((area - 1.0).abs() < 0.03, "{area}");
    assert!(n < 15, "{n}");
    assert_eq!(scattered.n_components(), 1);
}

#[test]
fn a_sheet_has_its_area_and_its_border() {
    let n = 40;
    for jitter in [0.0, 0.2, 0.4] {
        let cloud = sheet(n, 0.0, 1.0, jitter);
        let surface = surface(&cloud);
        let area = total_area(&surface);
        // The points of the outer cells are half a cell from the rim, or a little more or less.
        let covered = (1.0 - 1.0 / f64::from(n)).powi(2);
        assert!((area / covered - 1.0).abs() < 0.02, "{area} {covered}");
        let border = f64::from(n).recip();
        let mut missed = 0;
        for (sample, p) in cloud.positions.iter().enumerate() {
            let rim = [p[0], p[1], 1.0 - p[0], 1.0 - p[1]].into_iter().fold(1.0, f64::min);
            let found = surface.is_boundary(sample as u32);
            missed += usize::from(rim < border && !found);
            assert!(!found || rim < 2.0 * border, "{p:?} is inside");
        }
        println!(
            "jitter {jitter}: area {:.4}, {missed} of {} points of the outer row not on the border",
            area / covered,
            4 * n - 4
        );
        assert!(missed <= 4 * n as usize / 20, "{missed}");
    }
}

#[test]
fn sheets_one_or_two_spacings_apart_are_not_joined() {
    let n = 30;
    for gap in [1.0, 1.5, 2.0] {
        for normal in [-1.0, 1.0] {
            // Layers that face the same way are told apart by the steepness of what joins them alone.
            for jitter in [0.0, 0.25].into_iter().filter(|_| normal < 0.0 || gap >= 1.5) {
                let low = sheet(n, 0.0, 1.0, jitter);
                let high = sheet(n, gap / f64::from(n), normal, jitter);
                let surface = surface(&both(low, &high));
                assert_eq!(surface.n_components(), 2, "gap {gap}, normals {normal}, jitter {jitter}");
                let middle = 0.5 / f64::from(n);
                let [low, high] = [0, n * n].map(|first| surface.sample(first + n * n / 2 + n / 2));
                assert_eq!(surface.local_log(&low, &high, 20.0 * middle), None);
                // A path stays on its sheet.
                let trace = surface.trace(&low, 0.3, 0.3);
                assert_eq!(trace.stopped, None);
                assert!(place(&surface, &trace.end).z.abs() < 1e-12);
            }
        }
    }
}

#[test]
fn great_circles_return_and_an_octant_turns_by_its_curvature() {
    for (name, cloud) in [("spiral", spiral_sphere(3000)), ("scattered", random_sphere(3000, 2))] {
        let surface = surface(&cloud);
        let (mut worst, mut turn) = (0.0_f64, 0.0_f64);
        for step in 0..12 {
            let from = surface.sample(step * 240);
            let angle = f64::from(step) * 0.6;
            let trace = surface.trace(&from, angle, TAU);
            assert_eq!((trace.stopped, trace.length), (None, TAU));
            worst = worst.max(place(&surface, &trace.end).distance(place(&surface, &from)) / surface.spacing());
            let ahead = |at: &Location, angle: f64| {
                DVec3::from_array(surface.frame_at(at).expect("a frame").vector([angle.cos(), angle.sin()]))
            };
            turn = turn.max(ahead(&from, angle).angle_between(ahead(&trace.end, angle + trace.turn)));
        }
        let corners = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| surface.locate(axis.to_array()));
        let mut octant = 0.0;
        for side in 0..3 {
            let (from, to) = (corners[side], corners[(side + 1) % 3]);
            let [x, y] = surface.local_log(&from, &to, 3.0).expect("a way of a quarter turn");
            let trace = surface.trace(&from, y.atan2(x), x.hypot(y));
            let frame = |at: &Location| surface.frame_at(at).expect("a frame");
            let [x, y] = frame(&to).coordinates(frame(&trace.end).u);
            octant += trace.turn + y.atan2(x);
        }
        let octant = wrapped(octant) / FRAC_PI_2;
        println!(
            "{name}: great circles end {worst:.3} h beside their start, turned by {turn:.4}; octant {octant:.5} of pi / 2"
        );
        assert!(worst < 1.0 && turn < 0.05, "{worst} {turn}");
        assert!((octant - 1.0).abs() < 0.01, "{octant}");
    }
}

#[test]
fn paths_on_a_sheet_are_straight_and_stop_at_its_border() {
    let surface = surface(&sheet(40, 0.0, 1.0, 0.3));
    let from = surface.locate([0.4, 0.55, 0.3]);
    assert!(place(&surface, &from).distance(DVec3::new(0.4, 0.55, 0.0)) < 1e-12);
    let frame = surface.frame_at(&from).expect("a frame");
    for step in 0..24 {
        let angle = f64::from(step) * 0.27;
        let ahead = DVec3::from_array(frame.vector([angle.cos(), angle.sin()]));
        let trace = surface.trace(&from, angle, 0.3);
        assert_eq!(trace.stopped, None);
        assert!(place(&surface, &trace.end).distance(place(&surface, &from) + ahead * 0.3) < 1e-12);
        let stopped = surface.trace(&from, angle, 2.0);
        assert_eq!(stopped.stopped, Some(Stop::Boundary));
        let end = place(&surface, &stopped.end);
        let outside = [-end.x, -end.y, end.x - 1.0, end.y - 1.0].into_iter().fold(f64::NEG_INFINITY, f64::max)
            / surface.spacing();
        assert!(outside > 0.0 && outside < 2.0, "{outside}");
        assert!((end.distance(place(&surface, &from)) - stopped.length).abs() < 1e-9);
    }
}

#[test]
fn mesh_and_cloud_find_the_same_places() {
    let sphere = icosphere(4);
    let (mesh, cloud) = (MeshSurface::new(&sphere).expect("a mesh"), surface(&sphere));
    let h = mesh.spacing();
    let (mut apart, mut ends) = (0.0_f64, 0.0_f64);
    for step in 0..50 {
        let turn = f64::from(step);
        let p = DVec3::new((1.7 * turn).sin(), (0.9 * turn).cos(), (2.3 * turn + 1.0).sin()).normalize()
            * (0.99 + 0.0004 * turn);
        let [on_mesh, on_cloud] = [mesh.locate(p.to_array()), cloud.locate(p.to_array())];
        apart = apart.max(place(&mesh, &on_mesh).distance(place(&cloud, &on_cloud)));
        // The same direction in space leads to the same place.
        let ahead = p.any_orthogonal_vector();
        let walk = |surface: &dyn Surface, from: &Location| {
            let [x, y] = surface.frame_at(from).expect("a frame").coordinates(ahead.to_array());
            place(surface, &surface.trace(from, y.atan2(x), 5.0 * h).end)
        };
        ends = ends.max(walk(&mesh, &on_mesh).distance(walk(&cloud, &on_cloud)));
    }
    println!("mesh and cloud: places {:.4} h apart, ends of 5 h paths {:.4} h", apart / h, ends / h);
    assert!(apart < 0.05 * h && ends < 0.06 * h, "{apart} {ends}");
    // The same samples have about the same areas and neighbours.
    for sample in 0..mesh.n_samples() as u32 {
        assert!((mesh.area(sample) / cloud.area(sample) - 1.0).abs() < 0.02);
        for edge in mesh.neighbours(sample) {
            assert!(cloud.neighbours(sample).iter().any(|other| other.j == edge.j));
        }
    }
}

#[test]
fn neighbours_are_symmetric_and_in_order() {
    let surface = surface(&random_sphere(500, 3));
    for sample in 0..500 {
        let around = surface.neighbours(sample);
        assert_eq!(around[0].j, around.iter().map(|edge| edge.j).min().expect("neighbours"));
        assert_eq!(around[0].angle_i, 0.0);
        for edge in around {
            let back = surface.neighbours(edge.j).iter().find(|other| other.j == sample).expect("both are neighbours");
            assert_eq!(back.length, edge.length);
            assert!(
                (back.angle_i - edge.angle_j).abs() < 1e-12
                    && wrapped(back.transport() + edge.transport()).abs() < 1e-9
            );
        }
    }
    let weights: Vec<f64> = surface.triangles().iter().map(|triangle| triangle.weight).collect();
    assert!(weights.iter().all(|&w| w == 1.0 / 3.0 || w == 2.0 / 3.0 || w == 1.0));
    assert!(surface.triangles().windows(2).all(|pair| pair[0].points != pair[1].points));
}

#[test]
fn repeated_paths_have_the_same_bits_and_odd_ones_do_not_begin() {
    let surface = surface(&spiral_sphere(300));
    let from = surface.locate([0.2, 0.3, -0.9]);
    assert_eq!(surface.trace(&from, 0.7, 40.0), surface.trace(&from, 0.7, 40.0));
    let anchor = |anchor: u32, x: f64| Location::Cloud(CloudPoint { anchor, offset: [x, 0.0] });
    for (from, angle, length) in [
        (from, f64::NAN, 1.0),
        (from, 0.0, f64::INFINITY),
        (from, 0.0, 1e30),
        (anchor(300, 0.0), 0.0, 1.0),
        (anchor(0, f64::NAN), 0.0, 1.0),
        (anchor(0, 5.0), 0.0, 1.0),
        (Location::Mesh(SurfacePoint { face: 0, barycentric: [1.0, 0.0, 0.0] }), 0.0, 1.0),
    ] {
        assert_eq!(surface.trace(&from, angle, length).stopped, Some(Stop::NoStart));
    }
    for p in [[f64::NAN; 3], [1e300, 0.0, 0.0], [5.0, 5.0, 5.0], [0.0; 3]] {
        assert!(place(&surface, &surface.locate(p)).is_finite());
    }
}

#[test]
fn any_number_of_threads_makes_the_same_surface() {
    let cloud = random_sphere(2000, 7);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let surface = pool.install(|| surface(&cloud));
        let (areas, spacings) = (surface.areas.clone(), surface.spacings.clone());
        (surface.edges.clone(), surface.triangles.clone(), areas, spacings, surface.trace(&surface.sample(7), 0.4, 3.0))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn what_is_no_surface_is_refused_with_the_remedy() {
    let message = |spoil: fn(&mut Mesh)| {
        let mut cloud = spiral_sphere(50);
        spoil(&mut cloud);
        CloudSurface::new(&cloud).expect_err("must fail").to_string()
    };
    assert!(message(|m| m.normals.clear()).contains("`habitus clean --normals`"));
    assert!(message(|m| m.normals[3] = [0.0; 3]).contains("normal of point 3"));
    assert!(message(|m| m.positions[7] = m.positions[5]).contains("at one place"));
    assert!(message(|m| m.positions[7][0] = f64::NAN).contains("not finite"));
    let alone = message(|m| {
        m.positions.truncate(1);
        m.normals.truncate(1);
    });
    assert!(alone.contains("no point of the cloud has a neighbour"), "{alone}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn forward_and_back_again_and_the_logarithm(start in 0_u32..2000, angle in -PI..PI, steps in 0.3..10.0_f64) {
        static SPHERE: LazyLock<CloudSurface> = LazyLock::new(|| surface(&spiral_sphere(2000)));
        let h = SPHERE.spacing();
        let path = there_and_back(&SPHERE, start, angle, steps * h).expect("no border on a sphere");
        prop_assert!(path.returned < 0.01 * steps * h, "{} h after {steps}", path.returned / h);
        prop_assert!(path.shot < 0.01 * h, "{} h", path.shot / h);
        prop_assert!(path.stretch.abs() < 0.02, "{}", path.stretch);
        prop_assert!(path.turned.abs() < 0.05, "{}", path.turned);
    }
}

/// Random points leave gaps, a few of which count as borders: a path ends there and nowhere else, and beside them the surface has small
/// jumps. So what holds of all paths over even points holds of most over random ones.
#[test]
fn paths_over_random_points_mostly_lead_back() {
    let surface = surface(&random_sphere(2000, 5));
    let h = surface.spacing();
    let borders: Vec<DVec3> =
        (0..2000).filter(|&p| surface.is_boundary(p)).map(|p| surface.points[p as usize]).collect();
    let (mut ended, mut found) = (0, Vec::new());
    let n_paths = 2000;
    for path in 0..n_paths {
        // Angles and lengths that fill their ranges evenly (golden ratio and its square).
        let share = |step: f64| (f64::from(path) * step).fract();
        let (angle, steps) =
            (PI * (2.0 * share(0.618_033_988_749_895) - 1.0), 0.3 + 9.7 * share(0.754_877_666_246_693));
        match there_and_back(&surface, path, angle, steps * h) {
            Ok(path) => found.push((path.returned / (steps * h), path.shot / h, path.stretch.abs(), path.turned.abs())),
            Err(trace) => {
                assert_eq!(trace.stopped, Some(Stop::Boundary));
                let end = place(&surface, &trace.end);
                let nearest = borders.iter().map(|border| end.distance(*border)).fold(f64::INFINITY, f64::min);
                assert!(nearest < 2.0 * h, "stopped {} h from any border", nearest / h);
                ended += 1;
            }
        }
    }
    let share_of = |ok: fn(&(f64, f64, f64, f64)) -> bool| {
        found.iter().filter(|path| ok(path)).count() as f64 / f64::from(n_paths)
    };
    let returned = share_of(|path| path.0 < 0.01);
    let shot = share_of(|path| path.1 < 0.01 && path.2 < 0.02 && path.3 < 0.05);
    println!("{n_paths} paths: {ended} ended, {returned} lead back, {shot} found by the logarithm");
    assert!(ended <= 10 && returned > 0.99 && shot > 0.99, "{ended}, {returned}, {shot}");
}

/// What a path to a place, back again, and by the logarithm once more misses.
struct ThereAndBack {
    /// How far from its start the way back ended.
    returned: f64,
    /// How far from its end the path of the logarithm ended.
    shot: f64,
    /// How much longer the logarithm is, as a share.
    stretch: f64,
    /// The angle between the logarithm and the first direction.
    turned: f64,
}

/// The path, or the trace that ended before its length.
fn there_and_back(surface: &CloudSurface, start: u32, angle: f64, length: f64) -> Result<ThereAndBack, Trace> {
    let whole = |trace: Trace| if trace.stopped.is_some() { Err(trace) } else { Ok(trace) };
    let from = surface.sample(start);
    let there = whole(surface.trace(&from, angle, length))?;
    let back = whole(surface.trace(&there.end, angle + there.turn, -length))?;
    let [x, y] = surface.local_log(&from, &there.end, 1.5 * length).expect("a way");
    let end = surface.trace(&from, y.atan2(x), x.hypot(y)).end;
    Ok(ThereAndBack {
        returned: place(surface, &back.end).distance(place(surface, &from)),
        shot: place(surface, &end).distance(place(surface, &there.end)),
        stretch: x.hypot(y) / length - 1.0,
        turned: wrapped(y.atan2(x) - angle),
    })
}
