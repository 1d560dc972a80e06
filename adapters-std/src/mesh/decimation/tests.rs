//! Tests of the decimation: topology, shape, boundaries, attributes, hostile meshes.

use super::*;
use crate::mesh::field::{Field, Grid};
use crate::mesh::isosurface::{Border, isosurface};
use crate::mesh::{Attribute, Scalar, Topology};
use proptest::prelude::*;

/// A flat grid of `n x n` squares of side 1.
fn sheet(n: u32) -> Mesh {
    let place = |k: u32| [f64::from(k % (n + 1)), f64::from(k / (n + 1)), 0.0];
    let square = |k: u32| {
        let a = k / n * (n + 1) + k % n;
        [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
    };
    Mesh {
        positions: (0..(n + 1) * (n + 1)).map(place).collect(),
        faces: (0..n * n).flat_map(square).collect(),
        ..Mesh::default()
    }
}

fn torus() -> Mesh {
    let grid = Grid::around([-14.0, -14.0, -4.0], [14.0, 14.0, 4.0], 0.8, 1.0).unwrap();
    let field = Field::sampled(grid, |[x, y, z]| (x.hypot(y) - 10.0).hypot(z) - 4.0).unwrap();
    isosurface(&field, 0.0, Border::Open).unwrap()
}

fn edges(mesh: &Mesh) -> Vec<crate::mesh::topology::Edge> {
    Topology::new(mesh.positions.len(), &mesh.faces).edges().to_vec()
}

fn euler(mesh: &Mesh) -> i64 {
    mesh.positions.len() as i64 - edges(mesh).len() as i64 + mesh.faces.len() as i64
}

fn area(mesh: &Mesh) -> f64 {
    let areas =
        (0..mesh.faces.len()).map(|face| 0.5 * doubled_normal(mesh.triangle(face).map(DVec3::from_array)).length());
    areas.sum()
}

#[test]
fn a_torus_stays_closed_and_of_its_genus() {
    let original = torus();
    let result = decimated(&original, &DecimationOptions::to_faces(original.faces.len() / 8)).unwrap();
    let mesh = &result.mesh;
    mesh.check().unwrap();
    assert!(mesh.faces.len() <= original.faces.len() / 8);
    assert!(edges(mesh).iter().all(|edge| edge.faces.len() == 2));
    assert_eq!(euler(mesh), 0);
    assert_eq!((result.n_degenerate, result.n_fixed), (0, 0));
    let deviation = result.deviation(&original).unwrap();
    // A radius of 4 and edges of about 2.5: the sagitta is 0.2.
    assert!(deviation.of_original[0] < 0.05 && deviation.of_original[1] < 0.3, "{deviation:?}");
    assert!(deviation.of_decimated[1] < 0.3, "{deviation:?}");
    let nearest = |(old, &new): (&[f64; 3], &u32)| {
        DVec3::from_array(*old).distance(DVec3::from_array(mesh.positions[new as usize]))
    };
    assert!(original.positions.iter().zip(&result.vertex_of).map(nearest).fold(0.0, f64::max) < 6.0);
}

#[test]
fn a_flat_sheet_keeps_its_outline_at_no_error() {
    let original = sheet(12);
    let result = decimated(&original, &DecimationOptions::to_error(1e-9)).unwrap();
    assert!(result.mesh.faces.len() < 30, "{}", result.mesh.faces.len());
    assert!((area(&result.mesh) - 144.0).abs() < 1e-6, "{}", area(&result.mesh));
    assert!(result.largest_error <= 1e-9);
    assert_eq!(euler(&result.mesh), 1);
    for corner in [[0.0, 0.0, 0.0], [12.0, 0.0, 0.0], [0.0, 12.0, 0.0], [12.0, 12.0, 0.0]] {
        let near = |p: &[f64; 3]| DVec3::from_array(*p).distance(DVec3::from_array(corner)) < 1e-3;
        assert!(result.mesh.positions.iter().any(near), "{corner:?}");
    }
}

#[test]
fn the_error_bound_is_kept() {
    let original = torus();
    let coarse = decimated(&original, &DecimationOptions::to_error(0.1)).unwrap();
    let fine = decimated(&original, &DecimationOptions::to_error(0.01)).unwrap();
    assert!(coarse.largest_error <= 0.1 && fine.largest_error <= 0.01);
    assert!(coarse.mesh.faces.len() < fine.mesh.faces.len() && fine.mesh.faces.len() < original.faces.len());
}

#[test]
fn what_belongs_to_vertices_is_carried() {
    let mut original = sheet(8);
    let along: Vec<f64> = original.positions.iter().map(|p| p[0]).collect();
    original.normals = vec![[0.0, 0.0, 1.0]; along.len()];
    original.colours = along.iter().map(|x| [(x * 20.0) as u8, 7, 255]).collect();
    let label = along.iter().map(|x| f64::from(*x > 4.0)).collect();
    original.attributes = vec![
        Attribute { name: "x".into(), scalar: Scalar::F64, values: along },
        Attribute { name: "label".into(), scalar: Scalar::U8, values: label },
    ];
    let result = decimated(&original, &DecimationOptions::to_faces(40)).unwrap().mesh;
    result.check().unwrap();
    assert!(result.faces.len() <= 40 && result.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]));
    for (vertex, p) in result.positions.iter().enumerate() {
        // New places are near the edges, whose values vary linearly.
        let x = result.attributes[0].values[vertex];
        assert!((x - p[0]).abs() < 0.01, "{vertex} {p:?} {x}");
        assert!((f64::from(result.colours[vertex][0]) - 20.0 * p[0]).abs() < 1.0);
        assert!([0.0, 1.0].contains(&result.attributes[1].values[vertex]));
        assert_eq!(result.colours[vertex][1..], [7, 255]);
    }
}

#[test]
fn small_closed_shapes_and_parts_that_are_no_manifold_stay() {
    let positions: Vec<[f64; 3]> =
        vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [9.0, 9.0, 9.0]];
    let mesh = |faces: Vec<[u32; 3]>| Mesh { positions: positions.clone(), faces, ..Mesh::default() };
    let tetrahedron = mesh(vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
    let lone = mesh(vec![[0, 1, 2]]);
    let three_at_an_edge = mesh(vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]]);
    for (original, n_fixed) in [(&tetrahedron, 0), (&lone, 0), (&three_at_an_edge, 2)] {
        let result = decimated(original, &DecimationOptions::to_faces(0)).unwrap();
        assert_eq!((&result.mesh, result.n_fixed), (original, n_fixed));
        assert_eq!(result.vertex_of, [0, 1, 2, 3, 4, 5]);
    }
    let twice = mesh(vec![[0, 1, 2], [3, 3, 4]]);
    let result = decimated(&twice, &DecimationOptions::to_faces(0)).unwrap();
    assert_eq!((result.n_degenerate, result.mesh.faces.len()), (1, 1));
}

/// A cone whose tip has many faces, open at its foot.
#[test]
fn a_vertex_of_many_faces_takes_no_long() {
    let n = 2000_u32;
    let foot = (0..n).map(|k| {
        let turn = f64::from(k) / f64::from(n) * std::f64::consts::TAU;
        [turn.cos(), 0.0, turn.sin()]
    });
    let positions = [[0.0, 1.0, 0.0]].into_iter().chain(foot).collect();
    let original = Mesh { positions, faces: (0..n).map(|k| [0, (k + 1) % n + 1, k + 1]).collect(), ..Mesh::default() };
    let begin = std::time::Instant::now();
    let result = decimated(&original, &DecimationOptions::to_faces(50)).unwrap();
    println!("{n} faces at a vertex: {:.3} s", begin.elapsed().as_secs_f64());
    assert_eq!((result.mesh.faces.len(), result.n_fixed, euler(&result.mesh)), (50, 0, 1));
    assert_eq!(result.mesh.positions[0], [0.0, 1.0, 0.0]);
}

#[test]
fn refusals_say_what_to_give() {
    let said = |mesh: &Mesh, options| decimated(mesh, &options).unwrap_err().to_string();
    let cloud = Mesh { faces: Vec::new(), ..sheet(2) };
    assert!(said(&cloud, DecimationOptions::to_faces(3)).contains("without faces"));
    assert!(said(&sheet(2), DecimationOptions::to_error(f64::NAN)).contains("at least 0"));
    assert!(said(&Mesh::default(), DecimationOptions::to_faces(3)).contains("without vertices"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Faces between any vertices, at places that often coincide: no panic, and edges of more than two faces are not made.
    #[test]
    fn any_faces_are_survived(
        places in proptest::collection::vec(proptest::array::uniform3(0u8..4), 12),
        faces in proptest::collection::vec(proptest::array::uniform3(0u32..12), 1..40),
        target in 0usize..20,
    ) {
        let positions = places.into_iter().map(|p| p.map(f64::from)).collect();
        let original = Mesh { positions, faces, ..Mesh::default() };
        let crowded = |mesh: &Mesh| edges(mesh).iter().filter(|edge| edge.faces.len() > 2).count();
        let result = decimated(&original, &DecimationOptions::to_faces(target)).unwrap();
        result.mesh.check().unwrap();
        prop_assert!(crowded(&result.mesh) <= crowded(&original));
        prop_assert!(result.vertex_of.iter().all(|&v| (v as usize) < result.mesh.positions.len()));
    }

    /// Rough closed surfaces keep their topology, whatever the target.
    #[test]
    fn topology_is_kept(seeds in proptest::collection::vec(-1.0..1.0f64, 216), target in 0usize..60) {
        let grid = Grid { origin: [0.0; 3], spacing: 1.0, size: [6; 3] };
        let original = isosurface(&Field { grid, values: seeds }, 0.0, Border::Closed).unwrap();
        prop_assume!(!original.faces.is_empty());
        let result = decimated(&original, &DecimationOptions::to_faces(target)).unwrap().mesh;
        prop_assert_eq!(euler(&result), euler(&original));
        prop_assert!(edges(&result).iter().all(|edge| edge.faces.len() == 2));
    }

    /// A flat sheet with a hole whose inner vertices are displaced within the plane: nothing turns over, and outlines stay
    /// where only flat places may go.
    #[test]
    fn flat_faces_do_not_turn_over(steps in proptest::collection::vec(proptest::array::uniform2(-0.45..0.45f64), 81), target in 0usize..60) {
        let mut original = sheet(8);
        original.faces.retain(|face| !face.iter().all(|vertex| [30, 31, 39, 40].contains(vertex)));
        for (p, [dx, dy]) in original.positions.iter_mut().zip(steps) {
            if (1.0..8.0).contains(&p[0]) && (1.0..8.0).contains(&p[1]) {
                // Half the width of a square at most in all: no face is turned over to begin with.
                (p[0], p[1]) = (p[0] + 0.5 * dx, p[1] + 0.5 * dy);
            }
        }
        for options in [DecimationOptions::to_faces(target), DecimationOptions::to_error(1e-9)] {
            let result = decimated(&original, &options).unwrap();
            let normal = |face| doubled_normal(result.mesh.triangle(face).map(DVec3::from_array));
            prop_assert!((0..result.mesh.faces.len()).all(|face| normal(face).z > 0.0));
            let loops = |mesh: &Mesh| Topology::new(mesh.positions.len(), &mesh.faces).boundary_loops().len();
            prop_assert_eq!((euler(&result.mesh), loops(&result.mesh)), (0, 2));
            prop_assert!(result.largest_error <= options.max_error);
            if options.max_error < 1.0 {
                let change = area(&result.mesh) - area(&original);
                prop_assert!(change.abs() < 1e-6, "{change}");
                prop_assert!(result.mesh.faces.len() < 60, "{}", result.mesh.faces.len());
            }
        }
    }

    /// Rough open surfaces stay manifolds with as many boundary loops, and agree about the outside.
    #[test]
    fn boundaries_are_kept(seeds in proptest::collection::vec(-1.0..1.0f64, 216), target in 0usize..60) {
        let grid = Grid { origin: [0.0; 3], spacing: 1.0, size: [6; 3] };
        let values = seeds.into_iter().map(|seed| if seed > 0.9 { f64::NAN } else { seed }).collect();
        let original = isosurface(&Field { grid, values }, 0.0, Border::Open).unwrap();
        prop_assume!(!original.faces.is_empty());
        let result = decimated(&original, &DecimationOptions::to_faces(target)).unwrap().mesh;
        let [before, after] = [&original, &result].map(|mesh| Topology::new(mesh.positions.len(), &mesh.faces));
        prop_assert_eq!(euler(&result), euler(&original));
        prop_assert_eq!(after.boundary_loops().len(), before.boundary_loops().len());
        prop_assert!(after.non_manifold_vertices().is_empty());
        use crate::mesh::topology::EdgeClass::{Inconsistent, NonManifold};
        prop_assert_eq!((after.count(Inconsistent), after.count(NonManifold)), (0, 0));
    }
}
