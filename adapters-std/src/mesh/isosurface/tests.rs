//! Tests of the isosurface: counted topology, areas and volumes, every combination of corners, unknown samples.

use super::*;
use crate::mesh::{Topology, field::Grid};
use proptest::prelude::*;

/// Vertices less edges plus faces.
fn euler(mesh: &Mesh) -> i64 {
    let edges = Topology::new(mesh.positions.len(), &mesh.faces).edges().len();
    mesh.positions.len() as i64 - edges as i64 + mesh.faces.len() as i64
}

fn doubled_normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let [a, b, c] = [a, b, c].map(glam::DVec3::from_array);
    (b - a).cross(c - a).to_array()
}

fn area_and_volume(mesh: &Mesh) -> (f64, f64) {
    let corners = (0..mesh.faces.len()).map(|face| mesh.triangle(face));
    corners.fold((0.0, 0.0), |(area, volume), corners| {
        let normal = glam::DVec3::from_array(doubled_normal(corners));
        (area + 0.5 * normal.length(), volume + glam::DVec3::from_array(corners[0]).dot(normal) / 6.0)
    })
}

/// Every vertex is used, every edge has at most two triangles, run in opposite directions, and the triangles at each
/// vertex form one ring or one fan.
fn assert_manifold(mesh: &Mesh, closed: bool) {
    let topology = Topology::new(mesh.positions.len(), &mesh.faces);
    for edge in topology.edges() {
        assert!(edge.faces.len() == 2 || (!closed && edge.faces.len() == 1), "{edge:?}");
        let [a, b] = edge.vertices;
        let runs_up = |&face: &u32| {
            let f = mesh.faces[face as usize];
            (0..3).any(|k| f[k] == a && f[(k + 1) % 3] == b)
        };
        assert!(edge.faces.len() == 1 || runs_up(&edge.faces[0]) != runs_up(&edge.faces[1]), "{edge:?}");
    }
    for vertex in 0..mesh.positions.len() as u32 {
        let faces = topology.faces_of_vertex(vertex);
        assert!(!faces.is_empty(), "vertex {vertex} has no triangle");
        let mut reached = vec![faces[0]];
        let mut next = 0;
        while next < reached.len() {
            for edge in topology.edges_of_face(reached[next]) {
                let edge = &topology.edges()[edge as usize];
                let others =
                    edge.faces.iter().filter(|face| edge.vertices.contains(&vertex) && !reached.contains(face));
                let others: Vec<u32> = others.copied().collect();
                reached.extend(others);
            }
            next += 1;
        }
        assert_eq!(reached.len(), faces.len(), "vertex {vertex} joins separate fans");
    }
}

fn smallest_doubled_area(mesh: &Mesh) -> f64 {
    let areas = (0..mesh.faces.len()).map(|face| glam::DVec3::from_array(doubled_normal(mesh.triangle(face))).length());
    areas.fold(f64::INFINITY, f64::min)
}

fn sphere(spacing: f64) -> Field {
    let grid = Grid::around([-1.0; 3], [1.0; 3], spacing, 2.0 * spacing).unwrap();
    Field::sampled(grid, |[x, y, z]| (x * x + y * y + z * z).sqrt() - 1.0).unwrap()
}

#[test]
fn a_sphere_has_its_area_volume_and_genus() {
    let errors = [0.1, 0.05].map(|spacing| {
        let mesh = isosurface(&sphere(spacing), 0.0, Border::Open).unwrap();
        assert_manifold(&mesh, true);
        assert_eq!(euler(&mesh), 2);
        let (area, volume) = area_and_volume(&mesh);
        let pi = std::f64::consts::PI;
        [(area / (4.0 * pi) - 1.0).abs(), (volume / (4.0 / 3.0 * pi) - 1.0).abs()]
    });
    // Below (spacing / radius)^2, and of second order.
    assert!(errors[0].iter().all(|e| *e < 0.01), "{errors:?}");
    assert!((0..2).all(|k| errors[1][k] < errors[0][k] / 3.0), "{errors:?}");
}

#[test]
fn a_torus_has_genus_one() {
    let (large, small) = (1.0, 0.4);
    let grid = Grid::around([-1.4, -1.4, -0.4], [1.4, 1.4, 0.4], 0.07, 0.1).unwrap();
    let torus = |[x, y, z]: [f64; 3]| ((x.hypot(y) - large).hypot(z)) - small;
    let mesh = isosurface(&Field::sampled(grid, torus).unwrap(), 0.0, Border::Open).unwrap();
    assert_manifold(&mesh, true);
    assert_eq!(euler(&mesh), 0);
    let (area, volume) = area_and_volume(&mesh);
    let pi = std::f64::consts::PI;
    assert!((area / (4.0 * pi * pi * large * small) - 1.0).abs() < 0.01, "{area}");
    assert!((volume / (2.0 * pi * pi * large * small * small) - 1.0).abs() < 0.015, "{volume}");
}

#[test]
fn samples_on_the_surface_give_no_degenerate_triangle() {
    // All values are integers: most of the surface passes through samples.
    let grid = Grid { origin: [0.0; 3], spacing: 1.0, size: [6; 3] };
    let field = Field::sampled(grid, |[x, y, z]| (x - 2.0).abs() + (y - 2.0).abs() + (z - 3.0).abs() - 2.0).unwrap();
    let mesh = isosurface(&field, 0.0, Border::Open).unwrap();
    assert_manifold(&mesh, true);
    assert_eq!(euler(&mesh), 2);
    assert!(smallest_doubled_area(&mesh) >= 0.5 * END * END, "{}", smallest_doubled_area(&mesh));
    // The octahedron |x| + |y| + |z| = 2 has the volume 4/3 * 8.
    assert!((area_and_volume(&mesh).1 / (32.0 / 3.0) - 1.0).abs() < 0.02, "{}", area_and_volume(&mesh).1);
}

#[test]
fn a_closed_border_caps_what_an_open_one_cuts() {
    let grid = Grid { origin: [0.0; 3], spacing: 1.0, size: [4, 5, 6] };
    let all_inside = Field::sampled(grid, |_| -1.0).unwrap();
    assert!(isosurface(&all_inside, 0.0, Border::Open).unwrap().positions.is_empty());
    let solid = isosurface(&all_inside, 0.0, Border::Closed).unwrap();
    assert_manifold(&solid, true);
    // The caps lie just outside the box of samples; its edges and corners are cut off.
    let (inner, outer) = (3.0 * 4.0 * 5.0, (3.0 + 2.0 * END) * (4.0 + 2.0 * END) * (5.0 + 2.0 * END));
    assert!((inner..outer).contains(&area_and_volume(&solid).1), "{}", area_and_volume(&solid).1);
    let half = Field::sampled(grid, |[_, _, z]| z - 2.25).unwrap();
    let sheet = isosurface(&half, 0.0, Border::Open).unwrap();
    assert_manifold(&sheet, false);
    assert!(sheet.positions.iter().all(|p| p[2] == 2.25) && area_and_volume(&sheet).0 == 12.0);
    assert_eq!(euler(&isosurface(&half, 0.0, Border::Closed).unwrap()), 2);
}

#[test]
fn infinite_samples_put_the_vertex_in_the_middle_or_at_the_finite_end() {
    let grid = Grid { origin: [0.0; 3], spacing: 1.0, size: [2; 3] };
    let plane = |low, high| {
        let field = Field::sampled(grid, |[_, _, z]| if z < 0.5 { low } else { high }).unwrap();
        isosurface(&field, 0.0, Border::Open).unwrap().positions[0][2]
    };
    assert_eq!(plane(f64::NEG_INFINITY, f64::INFINITY), 0.5);
    assert_eq!(plane(-1.0, f64::INFINITY), END);
    assert_eq!(plane(f64::NEG_INFINITY, 1.0), 1.0 - END);
    // The difference of the two values overflows, then that of the level, too.
    assert!((0.0..=1.0).contains(&plane(-f64::MAX, f64::MAX)));
    let field = Field::sampled(grid, |[_, _, z]| if z < 0.5 { -f64::MAX } else { f64::MAX }).unwrap();
    assert_eq!(isosurface(&field, 0.5 * f64::MAX, Border::Open).unwrap().positions[0][2], 0.75);
}

#[test]
fn refusals_say_what_to_give() {
    let mut field = sphere(0.5);
    let said = |field: &Field, level| isosurface(field, level, Border::Open).unwrap_err().to_string();
    assert!(said(&field, f64::NAN).contains("finite"));
    field.values.pop();
    assert!(said(&field, 0.0).contains("give one each"));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let field = sphere(0.11);
    let with = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| isosurface(&field, 0.01, Border::Closed).unwrap())
    };
    assert_eq!(with(1), with(3));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Noise makes all 256 cases beside one another; a tenth of the samples is unknown, a tenth exactly on the surface.
    #[test]
    fn any_field_gives_a_manifold(seeds in proptest::collection::vec(0u8..=255, 6 * 5 * 7), unknown in any::<bool>()) {
        let grid = Grid { origin: [0.0; 3], spacing: 1.0, size: [6, 5, 7] };
        let value = |seed: u8| match seed {
            0..25 if unknown => f64::NAN,
            25..50 => 0.0,
            _ => f64::from(seed) - 150.5,
        };
        let field = Field { grid, values: seeds.into_iter().map(value).collect() };
        for border in [Border::Open, Border::Closed] {
            let mesh = isosurface(&field, 0.0, border).unwrap();
            assert_manifold(&mesh, border == Border::Closed && !unknown);
            prop_assert!(mesh.faces.is_empty() || smallest_doubled_area(&mesh) > 1e-6);
        }
    }
}
