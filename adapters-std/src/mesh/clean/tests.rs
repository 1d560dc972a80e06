//! Small meshes with one fault each, and what holds for any mesh.

use proptest::prelude::*;

use super::*;
use crate::mesh::topology::EdgeClass;
use crate::mesh::{Attribute, Scalar};

fn cleaned(mesh: &Mesh) -> Cleaned {
    clean(mesh, &CleanOptions::default()).expect("something is left")
}

fn mesh(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> Mesh {
    Mesh { positions: positions.to_vec(), faces: faces.to_vec(), ..Mesh::default() }
}

/// A tetrahedron with outward faces and a corner at `at`.
fn tetrahedron(at: [f64; 3], size: f64) -> Mesh {
    let [x, y, z] = at;
    mesh(&[at, [x + size, y, z], [x, y + size, z], [x, y, z + size]], &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
}

/// Both meshes in one.
fn both(one: &Mesh, other: &Mesh) -> Mesh {
    let n = one.positions.len() as u32;
    let faces = other.faces.iter().map(|face| face.map(|vertex| vertex + n));
    mesh(&[&one.positions[..], &other.positions].concat(), &[&one.faces[..], &faces.collect::<Vec<_>>()].concat())
}

/// A sheet of `n x n` squares of size 1 at height `z`, facing `+z`.
fn sheet(n: u32, z: f64) -> Mesh {
    let positions: Vec<[f64; 3]> =
        (0..=n).flat_map(|y| (0..=n).map(move |x| [f64::from(x), f64::from(y), z])).collect();
    let at = |x: u32, y: u32| y * (n + 1) + x;
    let faces: Vec<[u32; 3]> = (0..n)
        .flat_map(|y| (0..n).map(move |x| (x, y)))
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    mesh(&positions, &faces)
}

#[test]
fn a_sound_mesh_stays_as_it_is() {
    let mut mesh = both(&tetrahedron([0.0; 3], 1.0), &tetrahedron([5.0; 3], 2.0));
    mesh.colours = vec![[1, 2, 3]; 8];
    let result = cleaned(&mesh);
    assert_eq!(result.mesh, mesh);
    assert!(result.report.is_unchanged() && result.report.changes().is_empty());
    assert_eq!(result.old_of_vertex, (0..8).collect::<Vec<u32>>());
    assert_eq!(result.vertex_of_old, (0..8).map(Some).collect::<Vec<_>>());
    let [large, small] = &result.report.components[..] else { panic!("two components") };
    assert_eq!((large.first_face, small.first_face, large.genus, large.euler), (4, 0, Some(0), 2));
    assert!((large.volume.expect("closed") - 8.0 / 6.0).abs() < 1e-12);
}

#[test]
fn what_is_not_finite_goes_with_its_faces() {
    let mut broken = both(&tetrahedron([0.0; 3], 1.0), &tetrahedron([5.0; 3], 2.0));
    broken.positions[5][1] = f64::NAN;
    broken.normals = vec![[0.0, f64::INFINITY, 0.0]; 8];
    let result = cleaned(&broken);
    assert_eq!(result.report.non_finite_vertices.examples, [5]);
    assert_eq!(result.report.non_finite_faces.examples, [4, 5, 7]);
    assert_eq!(result.vertex_of_old[5], None);
    assert_eq!(result.old_of_face, [0, 1, 2, 3, 6]);
    assert_eq!(result.report.non_finite_normals.count, 7);
    result.mesh.check().expect("finite");
    let cloud = mesh(&[[0.0; 3], [f64::INFINITY, 0.0, 0.0], [1.0; 3], [0.0; 3]], &[]);
    let result = cleaned(&cloud);
    assert_eq!(result.vertex_of_old, [Some(0), None, Some(1), Some(0)]);
}

#[test]
fn welding_keeps_the_first_and_names_conflicts() {
    let mut soup = mesh(
        &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1e-9], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        &[[0, 1, 2], [3, 4, 5]],
    );
    let values = vec![0.0, 1.0, 2.0, 1.0, 0.0, 3.0];
    soup.attributes = vec![Attribute { name: "label".into(), scalar: Scalar::U8, values }];
    let result = cleaned(&soup);
    assert_eq!(result.mesh.faces, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(result.mesh.positions[1], [1.0, 0.0, 0.0]);
    assert_eq!(result.mesh.attributes[0].values, [0.0, 1.0, 2.0, 0.0]);
    assert_eq!(result.vertex_of_old, [0, 1, 2, 1, 3, 2].map(Some));
    assert_eq!(result.report.conflicts, [Conflict { name: "label".into(), vertices: 1 }]);
    let apart = clean(&soup, &CleanOptions { weld: Some(0.0), ..CleanOptions::default() }).expect("clean");
    // Now the two faces have but a vertex in common, which is no connection.
    assert_eq!((&apart.mesh, apart.twins), (&soup, vec![vec![2, 5]]));
}

#[test]
fn faces_that_are_none_are_dropped() {
    let mut broken = tetrahedron([0.0; 3], 1.0);
    broken.positions.push([0.5, 0.0, 0.0]);
    // A vertex twice, three in a row, the same again, and its back.
    broken.faces.extend([[0, 0, 1], [0, 4, 1], [2, 1, 0], [0, 1, 2], [3, 2, 0]]);
    let report = cleaned(&broken).report;
    assert_eq!(report.repeated_index_faces.examples, [4]);
    assert_eq!(report.zero_area_faces.examples, [5]);
    assert_eq!(report.duplicate_faces.examples, [6, 8]);
    assert_eq!(report.opposite_faces.examples, [7]);
    assert_eq!(report.orphaned_vertices.examples, [4]);
    assert_eq!((report.after.vertices, report.after.faces), (4, 4));
}

#[test]
fn bow_ties_are_parted_and_their_copies_are_twins() {
    let bow_tie = mesh(
        &[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, -1.0, 0.0]],
        &[[0, 1, 2], [0, 3, 4]],
    );
    let result = cleaned(&bow_tie);
    assert_eq!(result.mesh.faces, [[0, 1, 2], [5, 3, 4]]);
    assert_eq!(result.twins, [[0, 5]]);
    assert_eq!(result.old_of_vertex[5], 0);
    assert_eq!(result.report.non_manifold_vertices.examples, [0]);
    assert_eq!(result.report.components.len(), 2);
    let again = cleaned(&result.mesh);
    assert!(again.report.is_unchanged() && again.mesh == result.mesh);
    // What is parted in memory is still known to lie at one place.
    assert_eq!(again.twins, [[0, 5]]);
}

#[test]
fn an_edge_with_three_faces_is_cut() {
    let fin = mesh(
        &[[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        &[[0, 2, 1], [0, 1, 3], [0, 1, 4]],
    );
    let result = cleaned(&fin);
    assert_eq!(result.report.non_manifold_edges.examples, [[0, 1]]);
    assert_eq!((result.report.paired_edges, result.report.added_vertices, result.report.components.len()), (0, 4, 3));
}

#[test]
fn bodies_that_touch_along_an_edge_are_two_again() {
    // Two tetrahedra with the edge (0, 1) in common.
    let touching = mesh(
        &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
        &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [0, 4, 1], [0, 1, 5], [0, 5, 4], [1, 4, 5]],
    );
    let result = cleaned(&touching);
    assert_eq!((result.report.paired_edges, result.report.added_vertices), (1, 2));
    let genera: Vec<_> = result.report.components.iter().map(|c| (c.genus, c.boundary_loops)).collect();
    assert_eq!(genera, [(Some(0), 0); 2]);
    assert_eq!(result.twins.len(), 2);
}

#[test]
fn sheets_that_touch_in_one_surface_are_paired_by_their_angle() {
    // Two roofs, ridge to ridge, joined at their far ends by further faces so that they are one patch.
    let (x, y) = (4.0, 1.0);
    let positions = [
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [x, y, 0.5],
        [-x, y, 0.5],
        [x, -y, 0.5],
        [-x, -y, 0.5],
        [2.0 * x, 0.0, 0.5],
        [x, 2.0 * y, 3.0],
        [x, -2.0 * y, 3.0],
    ];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 1, 4], [0, 5, 1], [2, 0, 6], [0, 4, 6]];
    let result = cleaned(&mesh(&positions, &faces));
    assert_eq!((result.report.non_manifold_edges.count, result.report.paired_edges), (1, 1));
    let topology = Topology::new(result.mesh.positions.len(), &result.mesh.faces);
    let mate = |face: u32| {
        let shared = topology.edges_of_face(face).into_iter().map(|edge| &topology.edges()[edge as usize]);
        shared.flat_map(|edge| edge.faces.to_vec()).filter(|&other| other != face).collect::<Vec<_>>()
    };
    // Both upper faces, both lower faces; not the upper right with the lower right.
    assert!(mate(0).contains(&1) && mate(2).contains(&3) && !mate(0).contains(&2));
}

#[test]
fn faces_agree_and_closed_components_look_outwards() {
    let mut turned = tetrahedron([0.0; 3], 1.0);
    turned.faces[2].swap(0, 1);
    let result = cleaned(&turned);
    assert_eq!(result.report.turned_faces.examples, [2]);
    assert!(result.mesh.signed_volume() > 0.0);
    let mut inside_out = tetrahedron([0.0; 3], 1.0);
    inside_out.faces.iter_mut().for_each(|face| face.swap(0, 1));
    let result = cleaned(&inside_out);
    assert_eq!((result.report.turned_faces.count, result.report.components_turned_outward), (4, 1));
    let mut open = sheet(2, 0.0);
    open.faces[5].swap(0, 1);
    assert_eq!(cleaned(&open).report.turned_faces.examples, [5]);
}

#[test]
fn a_moebius_strip_is_left_and_reported() {
    let at = |i: f64, side: f64| {
        let angle = std::f64::consts::TAU * i / 12.0;
        let reach = 3.0 + side * (angle / 2.0).cos();
        [reach * angle.cos(), reach * angle.sin(), side * (angle / 2.0).sin()]
    };
    let positions: Vec<[f64; 3]> = (0..12).flat_map(|i| [at(f64::from(i), -1.0), at(f64::from(i), 1.0)]).collect();
    let corner = |i: u32, side: u32| if i < 12 { 2 * i + side } else { 1 - side };
    let faces: Vec<[u32; 3]> = (0..12)
        .flat_map(|i| {
            let [a, b, c, d] = [corner(i, 0), corner(i + 1, 0), corner(i + 1, 1), corner(i, 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let strip = mesh(&positions, &faces);
    let result = cleaned(&strip);
    assert_eq!(result.report.unorientable_components.examples, [0]);
    assert_eq!((result.report.components[0].genus, result.report.components[0].boundary_loops), (None, 1));
    assert_eq!(result.mesh, strip);
}

#[test]
fn a_stray_vertex_is_a_spike() {
    let mut pulled = sheet(8, 0.0);
    pulled.positions[40] = [4.0, 4.0, 60.0];
    let result = cleaned(&pulled);
    assert_eq!((result.report.spikes.count, result.report.long_faces.count), (6, 0));
    assert_eq!(result.report.orphaned_vertices.examples, [40]);
    assert_eq!(result.report.components[0].boundary_loops, 2);
}

#[test]
fn bridges_between_layers_are_spikes() {
    // A step: two sheets 30 apart that a band joins along one border.
    let n = 6;
    let upper = sheet(n, 30.0);
    let mut step = both(&upper, &sheet(n, 0.0));
    let shift = upper.positions.len() as u32;
    step.positions[shift as usize..].iter_mut().for_each(|p| p[0] += 6.5);
    let band = step.faces.len();
    for y in 0..n {
        let [a, b] = [y * (n + 1) + n, (y + 1) * (n + 1) + n];
        let [c, d] = [shift + y * (n + 1), shift + (y + 1) * (n + 1)];
        step.faces.extend([[a, c, b], [b, c, d]]);
    }
    let result = cleaned(&step);
    assert_eq!(result.report.spikes.count, 2 * n as usize);
    assert_eq!(result.mesh.faces, step.faces[..band]);
    let kept = clean(&step, &CleanOptions { spike_factor: f64::INFINITY, ..CleanOptions::default() }).expect("clean");
    assert_eq!(kept.mesh, step);
}

#[test]
fn long_faces_of_sound_surfaces_stay() {
    // A tall cylinder of few faces with fine ends, closed and open; its sides are thin, long and smooth.
    let (n, height) = (24u32, 40.0);
    let ring = |radius: f64, z: f64| {
        (0..n).map(move |i| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            [radius * angle.cos(), radius * angle.sin(), z]
        })
    };
    let mut positions = Vec::new();
    for z in [0.0, height] {
        for k in 1..=4 {
            positions.extend(ring(f64::from(k), z));
        }
        positions.push([0.0, 0.0, z]);
    }
    let cap = 4 * n + 1;
    let mut faces = Vec::new();
    for i in 0..n {
        let j = (i + 1) % n;
        for (shift, turned) in [(0, true), (cap, false)] {
            let mut face =
                |[a, b, c]: [u32; 3]| faces.push(if turned { [a, c, b] } else { [a, b, c] }.map(|v| v + shift));
            face([4 * n, i, j]);
            for k in 0..3 {
                face([k * n + i, (k + 1) * n + i, (k + 1) * n + j]);
                face([k * n + i, (k + 1) * n + j, k * n + j]);
            }
        }
        let [a, b] = [3 * n + i, 3 * n + j];
        faces.extend([[a, b, b + cap], [a, b + cap, a + cap]]);
    }
    let cylinder = mesh(&positions, &faces);
    let result = cleaned(&cylinder);
    assert_eq!((result.report.spikes.count, result.report.long_faces.count), (0, 2 * n as usize));
    assert_eq!(result.mesh, cylinder);
    let cup = mesh(&positions, &faces.iter().copied().filter(|f| f.iter().any(|&v| v < cap)).collect::<Vec<_>>());
    let result = cleaned(&cup);
    assert_eq!(result.report.spikes.count, 0);
    assert_eq!(result.report.unreferenced_vertices.count, (3 * n + 1) as usize);
}

#[test]
fn debris_is_named_and_goes_only_when_asked() {
    let both = both(&tetrahedron([0.0; 3], 100.0), &tetrahedron([500.0; 3], 1.0));
    let result = cleaned(&both);
    assert_eq!((result.report.n_debris(), result.report.after.faces), (1, 8));
    for keep in [Keep::Largest, Keep::Share(0.01), Keep::Share(2.0)] {
        let result = clean(&both, &CleanOptions { keep, ..CleanOptions::default() }).expect("clean");
        assert_eq!(result.report.removed_components.examples, [4]);
        assert_eq!((result.report.removed_component_faces, result.report.after.vertices), (4, 4));
    }
}

#[test]
fn loose_vertices_stay_when_they_are_data() {
    let mut loose = tetrahedron([0.0; 3], 1.0);
    loose.positions.extend([[7.0; 3], [7.0; 3]]);
    assert_eq!(cleaned(&loose).report.removed_unreferenced, 2);
    let options = CleanOptions { keep_unreferenced: true, ..CleanOptions::default() };
    let result = clean(&loose, &options).expect("clean");
    assert_eq!((&result.mesh, result.report.unreferenced_vertices.count), (&loose, 2));
}

#[test]
fn a_vertex_without_measure_does_not_make_the_rest_small() {
    // 3.4e38 is what some programs write where they saw nothing.
    let mut marked = sheet(6, 0.0);
    marked.positions[24] = [3.4e38; 3];
    let report = cleaned(&marked).report;
    assert_eq!(report.welded_vertices.count, 0);
    assert!((report.scale - 30.0_f64.sqrt()).abs() < 1.0, "{}", report.scale);
    // Two of its six faces have corners that cannot be told apart from there.
    assert_eq!((report.spikes.count, report.zero_area_faces.count, report.after.vertices), (4, 2, 48));
}

#[test]
fn outliers_of_clouds_are_named() {
    let mut cloud = mesh(&sheet(9, 0.0).positions, &[]);
    cloud.positions.extend([[5.0, 5.0, 30.0], [5.0, 5.0, 0.0]]);
    let result = cleaned(&cloud);
    assert_eq!((result.report.outliers.examples.as_slice(), result.report.welded_vertices.count), (&[100][..], 1));
    assert_eq!(result.report.after.vertices, 101);
    let options = CleanOptions { remove_outliers: true, ..CleanOptions::default() };
    let result = clean(&cloud, &options).expect("clean");
    assert_eq!(
        (result.report.removed_outliers, result.vertex_of_old[100], result.vertex_of_old[101]),
        (1, None, Some(55))
    );
}

#[test]
fn the_largest_coordinates_are_cleaned_like_others() {
    let whole = cleaned(&tetrahedron([0.0; 3], 1.0)).report;
    let large = cleaned(&tetrahedron([0.0; 3], 1e70)).report;
    assert_eq!((large.after, large.is_unchanged()), (whole.after, true));
    assert!((large.scale / whole.scale / 1e70 - 1.0).abs() < 1e-12, "{}", large.scale);
}

#[test]
fn what_cannot_be_cleaned_is_refused() {
    let message = |mesh: &Mesh, options: &CleanOptions| clean(mesh, options).expect_err("refused").to_string();
    let plain = CleanOptions::default();
    assert!(message(&Mesh::default(), &plain).contains("without vertices"));
    assert!(message(&mesh(&[[0.0; 3]], &[[0, 0, 1]]), &plain).contains("face 0 names"));
    let point = mesh(&[[1.0; 3]; 3], &[[0, 1, 2]]);
    assert_eq!(
        message(&point, &plain),
        "nothing is left of the 1 faces: 1 faces with a vertex twice removed (0); 3 vertices without a face that is left \
         removed (0, 1, 2); convert it as a cloud, or scan again"
    );
    assert!(
        message(&mesh(&[[f64::NAN; 3]], &[]), &plain).starts_with("nothing is left of the 1 points: 1 vertices with")
    );
    let mut far = tetrahedron([0.0; 3], 1.0);
    far.positions[3] = [1e39; 3];
    let welded = message(&far, &plain);
    assert!(welded.contains("vertices within 5.137e12 were welded: give a smaller distance (--weld)"), "{welded}");
    assert!(welded.contains("or remove the vertices that are far"), "{welded}");
    far.positions[3] = [0.0, -1.1e70, 0.0];
    let beyond = "vertex 3 is at [0.0, -1.1e70, 0.0]: coordinates must be at most 1e70; remove the vertex";
    assert_eq!(message(&far, &plain), beyond);
    far.faces.clear();
    assert_eq!(message(&far, &plain), beyond);
    for options in [
        CleanOptions { weld: Some(-1.0), ..plain.clone() },
        CleanOptions { weld: Some(f64::INFINITY), ..plain.clone() },
        CleanOptions { spike_factor: f64::NAN, ..plain.clone() },
        CleanOptions { keep: Keep::Share(-0.5), ..plain.clone() },
    ] {
        assert!(message(&point, &options).contains("give 0 or more"));
    }
}

/// A mesh full of faults: few places, so that vertices coincide, faces repeat and edges have many faces.
fn any_broken() -> impl Strategy<Value = Mesh> {
    let coordinate = prop_oneof![
        12 => (0i8..4).prop_map(f64::from),
        2 => (0i8..4).prop_map(|x| f64::from(x) + 1e-8),
        1 => -1e3..1e3,
        1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, 1e30, 3.4e38, 1e70, 5e-324, -0.0]),
    ];
    let vertex = 0u32..24;
    (
        prop::collection::vec([coordinate.clone(), coordinate.clone(), coordinate], 24),
        prop::collection::vec([vertex.clone(), vertex.clone(), vertex], 0..70),
        prop::collection::vec(0u8..3, 24),
    )
        .prop_map(|(positions, faces, labels)| {
            let values = labels.into_iter().map(f64::from).collect();
            let attributes = vec![Attribute { name: "label".into(), scalar: Scalar::U8, values }];
            Mesh { positions, faces, attributes, ..Mesh::default() }
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_mesh_becomes_an_oriented_manifold_and_stays_one(
        mesh in any_broken(), keep in prop::sample::select(vec![Keep::All, Keep::Largest, Keep::Share(0.2)]),
        keep_unreferenced in any::<bool>(), weld in prop::sample::select(vec![None, Some(0.0), Some(0.5)]),
    ) {
        let options = CleanOptions { keep, keep_unreferenced, weld, ..CleanOptions::default() };
        let Ok(result) = clean(&mesh, &options) else { return Ok(()) };
        result.mesh.check().expect("it fits together");
        // The maps agree with the meshes.
        for (new, &old) in result.old_of_vertex.iter().enumerate() {
            prop_assert_eq!(result.mesh.positions[new], mesh.positions[old as usize]);
            prop_assert_eq!(result.mesh.attributes[0].values[new], mesh.attributes[0].values[old as usize]);
        }
        prop_assert_eq!(result.vertex_of_old.len(), mesh.positions.len());
        let n = result.mesh.positions.len() as u32;
        prop_assert!(result.vertex_of_old.iter().flatten().all(|&new| new < n));
        prop_assert_eq!(result.old_of_face.len(), result.mesh.faces.len());
        let topology = Topology::new(result.mesh.positions.len(), &result.mesh.faces);
        prop_assert_eq!(topology.count(EdgeClass::NonManifold), 0);
        prop_assert!(topology.non_manifold_vertices().is_empty());
        for component in topology.components().all.iter().filter(|component| component.is_orientable) {
            prop_assert_eq!(component.n_inconsistent_edges, 0);
        }
        let again = clean(&result.mesh, &options).expect("something is left");
        prop_assert_eq!(&again.mesh, &result.mesh);
        prop_assert!(again.report.is_unchanged(), "{:?}", again.report.changes());
        prop_assert_eq!(again.report.changes(), Vec::<String>::new());
    }
}
