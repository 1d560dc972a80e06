//! Tests of the frame recovery on small shapes; those on scans are in `tests/tests/frames.rs`.

use super::*;
use crate::mesh::field::{Field, Grid};
use crate::mesh::isosurface::{Border, isosurface};

/// Balls in places without any symmetry, grown together; 190 high.
fn blobs() -> Mesh {
    grown_together(&[
        ([0.0, 0.0, 0.0], 40.0),
        ([0.0, 60.0, 10.0], 30.0),
        ([45.0, 10.0, 0.0], 20.0),
        ([-30.0, -30.0, 25.0], 22.0),
        ([10.0, -55.0, -12.0], 35.0),
    ])
}

fn grown_together(balls: &[([f64; 3], f64)]) -> Mesh {
    let distance = |p: [f64; 3]| {
        let to_ball = |(c, r): &([f64; 3], f64)| (0..3).map(|k| (p[k] - c[k]).powi(2)).sum::<f64>().sqrt() - r;
        balls.iter().map(to_ball).fold(f64::INFINITY, f64::min)
    };
    let grid = Grid::around([-60.0, -95.0, -50.0], [70.0, 95.0, 60.0], 8.0, 8.0).unwrap();
    isosurface(&Field::sampled(grid, distance).unwrap(), 0.0, Border::Closed).unwrap()
}

fn changed(mesh: &Mesh, change: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    Mesh { positions: mesh.positions.iter().map(|p| change(*p)).collect(), ..mesh.clone() }
}

fn recovery(template: &Mesh, scan: &Mesh) -> FrameRecovery {
    FrameTemplate::new(template).unwrap().recovery(scan, &FrameOptions::default()).unwrap()
}

fn refusal(template: &Mesh, scan: &Mesh) -> String {
    recovery(template, scan).frame().unwrap_err().to_string()
}

#[test]
fn unit_and_axes_of_a_turned_scan_are_found() {
    let template = blobs();
    // Stored in inches, lying on its back, turned a little and moved.
    let small = Similarity::IDENTITY.moved([0.1, 0.2, -0.15], [300.0, -20.0, 900.0], 0.0);
    let stored = AxisTurn::all()[17];
    let scan = changed(&template, |p| stored.applied(small.applied(p)).map(|x| x / 25.4));
    let found = recovery(&template, &scan);
    let frame = found.frame().unwrap();
    assert_eq!(frame.unit, Unit::Inch);
    assert_eq!(frame.turn.applied(stored.applied([1.0, 2.0, 3.0])), [1.0, 2.0, 3.0]);
    assert_eq!(frame.handedness, Handedness::ByShape);
    assert!(frame.residual < 1.5, "the points of 20 000 are about 2 mm apart: {}", frame.residual);
    for (stored, original) in scan.positions.iter().zip(&template.positions) {
        let back = frame.motion.applied(*stored);
        assert!((0..3).all(|k| (back[k] - original[k]).abs() < 2.0), "{back:?} {original:?}");
    }
    let restored = frame.restored(&scan);
    let expected = small.applied(template.positions[0]);
    assert!((0..3).all(|k| (restored.positions[0][k] - expected[k]).abs() < 1e-9));
    assert!(found.to_string().contains("unit in; up"), "{found}");
}

#[test]
fn a_mirrored_scan_is_refused() {
    let template = blobs();
    let mirrored = changed(&template, |[x, y, z]| [x, y, -z]);
    let said = refusal(&template, &mirrored);
    assert!(said.contains("mirrored") && said.contains("left"), "{said}");
    // Of a symmetric shape only the normals tell, and nothing when there are none.
    let symmetric = grown_together(&[
        ([0.0, 0.0, 0.0], 40.0),
        ([0.0, 60.0, 10.0], 30.0),
        ([0.0, -55.0, -20.0], 35.0),
        ([45.0, 10.0, 10.0], 20.0),
        ([-45.0, 10.0, 10.0], 20.0),
    ]);
    let mirrored = changed(&symmetric, |[x, y, z]| [-x, y, z]);
    let said = refusal(&symmetric, &mirrored);
    assert!(said.contains("mirrored or inside out"), "{said}");
    let cloud = Mesh { faces: Vec::new(), ..mirrored };
    assert_eq!(recovery(&symmetric, &cloud).frame().unwrap().handedness, Handedness::Unknown);
    assert_eq!(recovery(&symmetric, &symmetric).frame().unwrap().handedness, Handedness::ByNormals);
}

fn ball(end: f64) -> Mesh {
    let grid = Grid::around([-1.0; 3], [1.0; 3], 0.1, 0.1).unwrap();
    isosurface(&Field::sampled(grid, |[x, y, z]| x * x + y * y + z * z - end).unwrap(), 0.0, Border::Closed).unwrap()
}

#[test]
fn a_ball_has_no_axes() {
    // Also laid on itself, where residuals are nothing but the spacing of the points.
    for (template, scan) in [(0.8, 0.9), (0.9, 0.9), (0.7, 0.7), (0.6, 0.6), (0.5, 0.5)] {
        let said = refusal(&ball(template), &ball(scan));
        assert!(said.contains("two rotations fit about as well"), "{template} {scan} {said}");
    }
}

#[test]
fn another_shape_is_refused() {
    let template = blobs();
    let disc = changed(&ball(0.9), |[x, y, z]| [80.0 * x, 4.0 * y, 70.0 * z]);
    let said = refusal(&template, &disc);
    assert!(said.contains("residual") && said.contains("template's kind"), "{said}");
}

#[test]
fn a_size_of_no_unit_or_of_two_is_refused_with_the_sizes() {
    let template = blobs();
    let said = refusal(&template, &changed(&template, |p| p.map(|x| x / 5.0)));
    assert!(said.contains("in none") && said.contains("cm") && said.contains("2.0000"), "{said}");
    let wide = FrameOptions { size_window: [0.3, 3.0], ..FrameOptions::default() };
    let scan = changed(&template, |p| p.map(|x| x / 15.0));
    let prepared = FrameTemplate::new(&template).unwrap();
    let said = prepared.recovery(&scan, &wide).unwrap().frame().unwrap_err().to_string();
    assert!(said.contains("more than one"), "{said}");
    let told = FrameOptions { unit: Some(Unit::Centimetre), ..FrameOptions::default() };
    let scan = changed(&template, |p| p.map(|x| x / 10.0));
    assert_eq!(prepared.recovery(&scan, &told).unwrap().frame().unwrap().unit, Unit::Centimetre);
}

#[test]
fn degenerate_scans_are_errors_or_refusals() {
    let template = FrameTemplate::new(&blobs()).unwrap();
    let cloud =
        |positions: Vec<[f64; 3]>| template.recovery(&Mesh { positions, ..Mesh::default() }, &FrameOptions::default());
    assert!(cloud(vec![]).unwrap_err().to_string().contains("without vertices"));
    assert!(cloud(vec![[1.0; 3]; 9]).unwrap_err().to_string().contains("scan of size 0"));
    assert!(cloud(vec![[0.0; 3], [f64::MAX; 3]]).unwrap_err().to_string().contains("scan of size inf"));
    let line: Vec<[f64; 3]> = (0..200).map(|i| [0.0, f64::from(i), 0.0]).collect();
    assert!(cloud(line).unwrap().frame().is_err());
    assert!(FrameTemplate::new(&Mesh { positions: vec![[0.0; 3]], ..Mesh::default() }).is_err());
}
