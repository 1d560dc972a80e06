//! Tests of sampled distances: known distances, bands, holes, and surfaces that come back as isosurfaces.

use super::*;
use crate::spatial::samples::bumpy_sphere;

const PSEUDO_NORMAL: SignedDistanceOptions = SignedDistanceOptions { inside: Inside::PseudoNormal, band: None };
const WINDING: SignedDistanceOptions = SignedDistanceOptions { inside: Inside::Winding, band: None };

fn sphere(n: usize) -> Mesh {
    let (positions, faces) = bumpy_sphere(n);
    let positions = positions.iter().map(|&p| crate::mesh::unit(p)).collect();
    Mesh { positions, faces, ..Mesh::default() }
}

/// The torus of radii 1 and 0.4, `2 n` times `n` quads.
fn torus(n: u32) -> Mesh {
    let turn = |i: u32, n: u32| (f64::from(i) / f64::from(n) * std::f64::consts::TAU).sin_cos();
    let at = |i: u32, j: u32| {
        let ((sin, cos), (height, out)) = (turn(i, 2 * n), turn(j, n));
        [(1.0 + 0.4 * out) * cos, (1.0 + 0.4 * out) * sin, 0.4 * height]
    };
    let index = |i: u32, j: u32| i % (2 * n) * n + j % n;
    let corners = || (0..2 * n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let quad = |(i, j): (u32, u32)| {
        let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    Mesh {
        positions: corners().map(|(i, j)| at(i, j)).collect(),
        faces: corners().flat_map(quad).collect(),
        ..Mesh::default()
    }
}

fn grid_of(mesh: &Mesh, spacing: f64) -> Grid {
    let (low, high) = mesh.bounding_box().unwrap();
    Grid::around(low, high, spacing, 2.0 * spacing).unwrap()
}

/// Mean and largest distance of the positions from the mesh.
fn mean_and_largest(positions: &[[f64; 3]], mesh: &Mesh) -> [f64; 2] {
    let closest = TriangleTree::new(&mesh.positions, &mesh.faces).unwrap().closest_all(positions);
    let sum: f64 = closest.iter().map(|closest| closest.distance).sum();
    [sum / closest.len() as f64, closest.iter().map(|closest| closest.distance).fold(0.0, f64::max)]
}

#[test]
fn distances_from_a_sphere_are_those_known() {
    let mesh = sphere(40);
    for options in [PSEUDO_NORMAL, WINDING] {
        let field = signed_distances(&mesh, grid_of(&mesh, 0.11), &options).unwrap();
        for (index, value) in field.values.iter().enumerate() {
            let [nx, ny, _] = field.grid.size;
            let p = field.grid.position([index % nx, index / nx % ny, index / nx / ny]);
            let expected = p.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0;
            assert!((value - expected).abs() < 1e-3, "{p:?} {value} {expected}");
        }
    }
}

#[test]
fn a_band_leaves_near_distances_and_cuts_the_others() {
    let mesh = torus(24);
    for inside in [Inside::PseudoNormal, Inside::Winding] {
        let grid = grid_of(&mesh, 0.03);
        let whole = signed_distances(&mesh, grid, &SignedDistanceOptions { inside, band: None }).unwrap();
        for band in [0.01, 0.05, 0.2] {
            let cut = signed_distances(&mesh, grid, &SignedDistanceOptions { inside, band: Some(band) }).unwrap();
            let expected: Vec<f64> = whole.values.iter().map(|value| value.clamp(-band, band)).collect();
            assert_eq!(cut.values, expected);
        }
    }
}

#[test]
fn surfaces_come_back_closed_with_their_genus() {
    for (mesh, genus) in [(sphere(30), 0), (torus(40), 1)] {
        let spacing = 0.05;
        for inside in [Inside::PseudoNormal, Inside::Winding] {
            let back = remeshed(&mesh, spacing, inside).unwrap();
            let components = Topology::new(back.positions.len(), &back.faces).components().all;
            assert_eq!(components.len(), 1);
            assert!(components[0].is_closed() && components[0].genus() == Ok(genus));
            let (there, here) = (mean_and_largest(&back.positions, &mesh), mean_and_largest(&mesh.positions, &back));
            println!(
                "genus {genus}, {inside:?}: in cells {:.4?} and {:.4?}",
                there.map(|d| d / spacing),
                here.map(|d| d / spacing)
            );
            // On radii of at least 0.4 an edge as long as the diagonal of a cube leaves the surface by 3/8 spacing^2 / 0.4, or
            // 0.05 cells, and the edges of the mesh are 0.03 cells below the surface.
            assert!(there[0] < 0.01 * spacing && there[1] < 0.03 * spacing, "{there:?}");
            assert!(here[0] < 0.04 * spacing && here[1] < 0.08 * spacing, "{here:?}");
        }
    }
}

#[test]
fn a_hole_is_closed_by_the_winding_number_and_refused_by_the_normal() {
    let mut mesh = sphere(20);
    mesh.faces.retain(|face| face.iter().any(|&v| mesh.positions[v as usize][1] < 0.9));
    let grid = grid_of(&mesh, 0.1);
    let message = signed_distances(&mesh, grid, &PSEUDO_NORMAL).unwrap_err().to_string();
    assert!(message.contains("edges have one face") && message.contains("winding numbers"), "{message}");
    assert!(check_closed(&mesh).is_err() && check_closed(&sphere(2)).is_ok());
    let back = remeshed(&mesh, 0.1, Inside::Winding).unwrap();
    let components = Topology::new(back.positions.len(), &back.faces).components().all;
    assert!(components.len() == 1 && components[0].is_closed() && components[0].genus() == Ok(0), "{components:?}");
}

#[test]
fn what_has_no_distances_is_refused() {
    let mesh = sphere(3);
    let grid = grid_of(&mesh, 0.5);
    let said = |mesh: &Mesh, grid: Grid, band: Option<f64>| {
        signed_distances(mesh, grid, &SignedDistanceOptions { inside: Inside::PseudoNormal, band })
            .unwrap_err()
            .to_string()
    };
    for band in [0.0, -1.0, f64::NAN] {
        assert!(said(&mesh, grid, Some(band)).contains("above 0"));
    }
    assert!(said(&mesh, Grid { spacing: 0.0, ..grid }, None).contains("spacing"));
    assert!(said(&Mesh { faces: Vec::new(), ..mesh.clone() }, grid, None).contains("no triangle"));
    let cloud = Mesh { faces: Vec::new(), ..mesh.clone() };
    assert!(remeshed(&cloud, 0.1, Inside::Winding).unwrap_err().to_string().contains("no inside"));
    let inside_out = Mesh { faces: mesh.faces.iter().map(|&[a, b, c]| [a, c, b]).collect(), ..mesh.clone() };
    for inside in [Inside::PseudoNormal, Inside::Winding] {
        assert!(remeshed(&inside_out, 0.1, inside).unwrap_err().to_string().contains("outwards"));
    }
    let mut turned = mesh.clone();
    turned.faces[0].swap(0, 1);
    assert!(said(&turned, grid, None).contains("at 3 the two faces disagree"));
}

#[test]
fn any_number_of_threads_finds_the_same() {
    let mesh = torus(16);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| signed_distances(&mesh, grid_of(&mesh, 0.1), &WINDING).unwrap())
    };
    assert_eq!(on(1), on(3));
}
