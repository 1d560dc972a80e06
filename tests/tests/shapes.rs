//! Decimation, and bodies made anew from their signed distances. Normals of clouds are in `cloud_normals.rs`.

use habitus::io::mesh;
use habitus::mesh::decimation::{DecimationOptions, decimated};
use habitus::mesh::{Mesh, Topology};
use habitus::spatial::{Inside, TriangleTree, remeshed};
use habitus_tests::data::dir_or_skip;

/// Vertices less edges plus faces of a closed mesh; a failure when it is not closed.
fn euler_of_closed(mesh: &Mesh) -> i64 {
    let topology = Topology::new(mesh.positions.len(), &mesh.faces);
    assert!(topology.edges().iter().all(|edge| edge.faces.len() == 2), "every edge has two faces");
    mesh.positions.len() as i64 - topology.edges().len() as i64 + mesh.faces.len() as i64
}

fn volume(mesh: &Mesh) -> f64 {
    let corner = |face: usize| {
        let [a, b, c] = mesh.triangle(face);
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
    };
    (0..mesh.faces.len()).map(corner).sum()
}

#[test]
fn a_body_of_5000_faces_is_still_that_body() {
    let Some(data) = dir_or_skip("a_body_of_5000_faces_is_still_that_body") else { return };
    let body = mesh::read(data.join("bodies/model/average_body.ply")).expect("the average body");
    let start = std::time::Instant::now();
    let result = decimated(&body, &DecimationOptions::to_faces(5000)).expect("a closed mesh");
    let seconds = start.elapsed().as_secs_f64();
    let deviation = result.deviation(&body).expect("both have faces");
    let volumes = volume(&result.mesh) / volume(&body);
    println!(
        "{} -> {} faces in {seconds:.3} s ({:.0} faces/s); error {:.3} mm; {deviation:.3?}; volume {volumes:.5}",
        body.faces.len(),
        result.mesh.faces.len(),
        body.faces.len() as f64 / seconds,
        result.largest_error
    );
    assert_eq!(result.mesh.faces.len(), 5000);
    assert_eq!((euler_of_closed(&body), euler_of_closed(&result.mesh)), (2, 2));
    // In mm; the mean edge is about 25.
    assert!(deviation.of_original[0] < 0.5 && deviation.of_decimated[0] < 0.5, "{deviation:?}");
    assert!(deviation.of_original[1] < 3.0 && deviation.of_decimated[1] < 3.0, "{deviation:?}");
    assert!((volumes - 1.0).abs() < 0.002, "{volumes}");
}

/// Mean and largest distance of the positions from the mesh.
fn mean_and_largest(positions: &[[f64; 3]], mesh: &Mesh) -> [f64; 2] {
    let surface = TriangleTree::new(&mesh.positions, &mesh.faces).expect("a mesh");
    let distances: Vec<f64> = surface.closest_all(positions).iter().map(|closest| closest.distance).collect();
    [distances.iter().sum::<f64>() / distances.len() as f64, distances.iter().copied().fold(0.0, f64::max)]
}

#[test]
fn bodies_come_back_from_their_signed_distances() {
    let Some(data) = dir_or_skip("bodies_come_back_from_their_signed_distances") else { return };
    // Arms and legs that stick together make handles; number 15 loses one.
    for (name, spacing) in [("glued_06_arms_down", 9.0), ("glued_06_arms_down", 4.5), ("glued_15_legs_together", 4.5)] {
        let body = mesh::read(data.join(format!("bodies/posed/{name}.ply"))).expect("a body");
        let start = std::time::Instant::now();
        let back = remeshed(&body, spacing, Inside::Winding).expect("a closed mesh");
        let seconds = start.elapsed().as_secs_f64();
        let (there, here) = (mean_and_largest(&back.positions, &body), mean_and_largest(&body.positions, &back));
        let cells = |distances: [f64; 2]| distances.map(|distance| distance / spacing);
        let euler = [euler_of_closed(&body), euler_of_closed(&back)];
        println!(
            "{name} at {spacing} mm: {} -> {} faces in {seconds:.2} s; in cells: new from old {:.3?}, old from new {:.3?}; \
             volume {:.5}; Euler numbers {euler:?}",
            body.faces.len(),
            back.faces.len(),
            cells(there),
            cells(here),
            volume(&back) / volume(&body)
        );
        assert!(name != "glued_06_arms_down" || euler[0] == euler[1]);
        assert!(there[0] < 0.02 * spacing && there[1] < 0.5 * spacing, "{there:?}");
        assert!(here[0] < 0.1 * spacing, "{here:?}");
        assert!((volume(&back) / volume(&body) - 1.0).abs() < 0.005);
    }
}
