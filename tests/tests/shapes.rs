//! Decimation, distance fields, isosurfaces and normals of clouds on real bodies and scans.
use habitus::io::mesh;
use habitus::mesh::decimation::{DecimationOptions, decimated};
use habitus::mesh::{Mesh, Topology};
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
