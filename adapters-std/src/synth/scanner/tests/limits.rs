//! What the scanner refuses, and that it survives the rest.

use super::*;
use crate::spatial::samples::{lattice_faces, lattice_positions};
use proptest::prelude::*;

fn refused(subject: &Mesh, options: &ScanOptions) -> String {
    match scanned(subject, options) {
        Err(Error::Input(problem)) => problem,
        other => panic!("not refused: {other:?}"),
    }
}

#[test]
fn subjects_that_cannot_be_scanned_are_told_why() {
    let options = faultless(2.0);
    let cloud = Mesh { faces: Vec::new(), ..plane(50.0, 0.0) };
    assert!(refused(&cloud, &options).contains("give a mesh with triangles"));
    assert!(refused(&Mesh::default(), &options).contains("without vertices"));
    assert!(refused(&plane(2e6, 0.0), &options).contains("unit"));
    assert!(refused(&plane(20_000.0, 0.0), &options).contains("pixels of 2 mm: at most 16777216"));
    let mut behind = plane(50.0, 0.0);
    behind.faces.iter_mut().for_each(|face| face.reverse());
    let said = refused(&behind, &options);
    assert!(said.contains("no ray returned from a mesh 141.4214 mm across, 25") && said.contains("behind"), "{said}");
    // In metres.
    let metres = Mesh { positions: plane(0.09, 0.0).positions, ..plane(1.0, 0.0) };
    assert!(refused(&metres, &options).contains("a mesh 0.2546 mm across cannot be scanned"));
    let many = ScanOptions { views: vec![Viewpoint::FRONT; 5], ..faultless(0.055) };
    assert!(refused(&plane(90.0, 0.0), &many).contains("fewer views"));
    let eye = |distance| ScanOptions { projection: Projection::Perspective { distance }, ..faultless(2.0) };
    assert!(refused(&ball(40.0, 4), &eye(40.0)).contains("give at least 103.9 mm"));
    assert!(scanned(&ball(40.0, 4), &eye(104.0)).is_ok());
}

#[test]
fn options_that_no_scanner_has_are_named() {
    type Spoil = fn(&mut ScanOptions);
    let cases: [(Spoil, &str); 16] = [
        (|o| o.views.clear(), "0 viewpoints"),
        (|o| o.views = vec![Viewpoint::FRONT; 256], "256 viewpoints"),
        (|o| o.views[0].yaw_deg = f64::NAN, "yaw"),
        (|o| o.views[0].pitch_deg = 91.0, "pitch"),
        (|o| o.projection = Projection::Perspective { distance: -1.0 }, "distance of the eye in mm is -1"),
        (|o| o.pixel = 0.0, "pixel in mm is 0"),
        (|o| o.noise = -0.1, "noise in mm is -0.1"),
        (|o| o.smooth_noise = f64::INFINITY, "smooth noise"),
        (|o| o.smooth_length = 0.1, "length of the smooth noise"),
        (|o| o.grazing_deg = 90.5, "grazing rays"),
        (|o| o.holes = 10_001, "10001 holes"),
        (|o| o.hole_radius = [5.0, 4.0], "largest radius of a hole in mm is 4: give a number from 5"),
        (|o| o.outliers = 1.5, "share of outliers"),
        (|o| o.longest_edge = 0.5, "longest edge"),
        (|o| o.calibration_turn_deg = -1.0, "turn of the calibration"),
        (|o| o.placement_shift = f64::NAN, "shift of the placement"),
    ];
    for (spoil, named) in cases {
        let mut options = ScanOptions::default();
        spoil(&mut options);
        let said = refused(&ball(40.0, 4), &options);
        assert!(said.contains(named) && said.contains("give"), "{said}");
    }
}

fn any_options() -> impl Strategy<Value = ScanOptions> {
    let view = (-400.0..400.0, -90.0..=90.0).prop_map(|(yaw_deg, pitch_deg)| Viewpoint { yaw_deg, pitch_deg });
    let projection = prop_oneof![
        Just(Projection::Orthographic),
        (1.0..40.0).prop_map(|distance| Projection::Perspective { distance })
    ];
    let chances = (any::<[bool; 4]>(), any::<u64>(), 0.0..=90.0, 0.0..=1.0_f64, 0_usize..4, 0_usize..4);
    (prop::collection::vec(view, 1..4), projection, 0.2..3.0, [0.0..2.0, 0.0..2.0, 0.0..2.0], chances).prop_map(
        |(views, projection, pixel, [noise, smooth_noise, calibration_shift], chances)| {
            let ([two_sided, floor, triangles, shuffle], seed, grazing_deg, outliers, holes, blobs) = chances;
            ScanOptions {
                views,
                projection,
                pixel,
                noise,
                smooth_noise,
                smooth_length: 5.0,
                grazing_deg,
                two_sided,
                holes,
                hole_radius: [0.0, 2.0],
                outliers,
                outlier_reach: 3.0,
                floor,
                blobs,
                blob_radius: [0.0, 3.0],
                calibration_turn_deg: 1.0,
                calibration_shift,
                triangles,
                longest_edge: 4.0,
                shuffle,
                placement_turn_deg: 30.0,
                placement_shift: 10.0,
                seed,
            }
        },
    )
}

proptest! {
    #[test]
    fn scans_of_anything_fit_together(
        positions in lattice_positions(),
        faces in lattice_faces(),
        options in any_options(),
    ) {
        let subject = Mesh { positions, faces, ..Mesh::default() };
        let scan = match scanned(&subject, &options) {
            Ok(scan) => scan,
            Err(error) => {
                prop_assert!(matches!(error, Error::Input(_)));
                return Ok(());
            }
        };
        prop_assert!(scan.mesh.check().is_ok());
        let n = scan.mesh.positions.len();
        prop_assert_eq!(scan.truth.len(), n);
        let [surface, clutter, outliers] = [Label::Surface, Label::Clutter, Label::Outlier].map(|of| scan.count(of));
        prop_assert_eq!(surface + clutter + outliers, n);
        prop_assert_eq!(scan.views.iter().map(|view| view.points).sum::<usize>(), n);
        for (at, label) in scan.truth.iter().zip(values(&scan, 0)) {
            prop_assert_eq!(at.is_some(), *label == 0.0);
            if let Some(at) = at {
                prop_assert!((at.barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                prop_assert!(at.barycentric.iter().all(|part| *part >= -1e-9) && (at.face as usize) < subject.faces.len());
            }
        }
        let bare = ScanOptions { noise: 0.0, smooth_noise: 0.0, ..options };
        let bare = ScanOptions { calibration_turn_deg: 0.0, calibration_shift: 0.0, ..bare };
        // Without noise points lie on the subject, but for what a face seen nearly from its edge leaves of the digits.
        let exact = scanned(&subject, &bare).expect("as before");
        prop_assert!(exact.errors(&subject).into_iter().all(|error| error < 1e-6));
        prop_assert_eq!(exact.truth, scan.truth);
    }
}
