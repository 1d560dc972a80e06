//! What is seen: raster, occlusion, grazing rays, triangles.

use super::*;
use crate::spatial::TriangleTree;

#[test]
fn a_plane_gives_its_raster() {
    let (subject, options) = (plane(50.0, 7.0), faultless(2.0));
    let scan = scanned(&subject, &options).unwrap();
    assert!((49 * 49..=51 * 51).contains(&scan.truth.len()), "{}", scan.truth.len());
    for pair in scan.mesh.positions.windows(2) {
        let step: [f64; 3] = std::array::from_fn(|axis| pair[1][axis] - pair[0][axis]);
        // The next pixel of the row, or the first of the next row.
        assert!((step[0] - 2.0).abs() < 1e-9 || (step[1] - 2.0).abs() < 1e-9, "{step:?}");
        assert!(step[2].abs() < 1e-9);
    }
    assert!(scan.errors(&subject).into_iter().all(|error| error < 1e-9));
    assert_eq!(scan.errors(&subject).len(), scan.truth.len());
    let names: Vec<&str> = scan.mesh.attributes.iter().map(|attribute| &attribute.name[..]).collect();
    assert_eq!(names, ["label", "view"]);
    assert_eq!(scan.count(Label::Surface), scan.truth.len());
    scan.mesh.check().unwrap();
}

#[test]
fn pixels_of_an_eye_grow_with_the_distance() {
    // The middle of the box is at z = 0; in front pixels are narrower by 350 / 400.
    let subject = together(plane(50.0, 50.0), plane(40.0, -50.0));
    let options = ScanOptions { projection: Projection::Perspective { distance: 400.0 }, ..faultless(1.0) };
    let scan = scanned(&subject, &options).unwrap();
    for pair in scan.mesh.positions.windows(2) {
        let step: [f64; 3] = std::array::from_fn(|axis| pair[1][axis] - pair[0][axis]);
        assert!((step[0] - 0.875).abs() < 1e-9 || (step[1] - 0.875).abs() < 1e-9, "{step:?}");
    }
    assert!(scan.mesh.positions.iter().all(|p| (p[2] - 50.0).abs() < 1e-9), "what is behind is hidden");
}

#[test]
fn what_is_hidden_is_missing() {
    let subject = together(plane(60.0, 0.0), moved(ball(20.0, 24), [0.0, 0.0, 50.0]));
    let scan = scanned(&subject, &faultless(1.5)).unwrap();
    let (on_plane, on_ball): (Vec<_>, Vec<_>) = scan.mesh.positions.iter().partition(|p| p[2] < 1.0);
    let from_axis = |p: &[f64; 3]| p[0].hypot(p[1]);
    assert!(on_plane.iter().all(|p| from_axis(p) > 19.95), "the shadow of the ball is a disk of its radius");
    assert!(on_ball.iter().all(|p| from_axis(p) < 20.0 && p[2] > 49.9), "only its front");
    let area = on_plane.len() as f64 * 1.5 * 1.5;
    let truth = 120.0 * 120.0 - std::f64::consts::PI * 400.0;
    assert!((area / truth - 1.0).abs() < 0.02, "all else is seen: {area} of {truth}");
}

#[test]
fn nothing_stands_between_a_point_and_its_scanner() {
    let subject = together(ball(20.0, 16), moved(ball(12.0, 12), [22.0, 8.0, 15.0]));
    let tree = TriangleTree::new(&subject.positions, &subject.faces).unwrap();
    let views = vec![
        Viewpoint { yaw_deg: 40.0, pitch_deg: -15.0 },
        Viewpoint { yaw_deg: -130.0, pitch_deg: 60.0 },
        Viewpoint::towards([1.0, 2.0, 3.0]),
    ];
    let scan = scanned(&subject, &ScanOptions { views: views.clone(), ..faultless(1.0) }).unwrap();
    for (p, view) in scan.mesh.positions.iter().zip(values(&scan, 1)) {
        let to_scanner = views[*view as usize].axes()[2];
        let start = DVec3::from_array(*p) + 1e-6 * to_scanner;
        assert_eq!(tree.first_hit(start.to_array(), to_scanner.to_array(), f64::INFINITY), None);
    }
    assert!(scan.views.iter().all(|view| view.points > 500));
}

#[test]
fn grazing_rays_are_lost() {
    for limit in [30.0_f64, 60.0, 74.0] {
        let options = ScanOptions { grazing_deg: limit, ..faultless(0.5) };
        let subject = ball(50.0, 64);
        let scan = scanned(&subject, &options).unwrap();
        for at in scan.truth.iter().flatten() {
            let [a, b, c] = subject.triangle(at.face as usize).map(DVec3::from_array);
            let angle = (b - a).cross(c - a).normalize().z.acos().to_degrees();
            assert!(angle <= limit + 1e-9, "{angle}");
        }
        let area = scan.truth.len() as f64 * 0.25;
        let truth = std::f64::consts::PI * (50.0 * limit.to_radians().sin()).powi(2);
        assert!((area / truth - 1.0).abs() < 0.02, "{limit}: {area} of {truth}");
        assert!(scan.views[0].grazing > 0);
    }
}

#[test]
fn faces_from_behind_stop_rays_and_return_them_only_where_asked() {
    let mut subject = plane(50.0, 0.0);
    subject.faces[0].reverse();
    let scan = scanned(&subject, &faultless(2.0)).unwrap();
    assert!(scan.truth.iter().flatten().all(|at| at.face == 1));
    assert!(scan.views[0].from_behind > 1000);
    let both = scanned(&subject, &ScanOptions { two_sided: true, ..faultless(2.0) }).unwrap();
    assert_eq!(both.truth.len(), scan.truth.len() + scan.views[0].from_behind);
}

#[test]
fn triangles_face_the_scanner_and_end_where_the_depth_jumps() {
    let subject = together(plane(50.0, 0.0), plane(20.0, 30.0));
    let view = Viewpoint { yaw_deg: 20.0, pitch_deg: 10.0 };
    let options = ScanOptions { views: vec![view], shuffle: true, ..faultless(2.0) };
    let scan = scanned(&subject, &options).unwrap();
    assert!(scan.mesh.faces.len() > 3000);
    for face in 0..scan.mesh.faces.len() {
        let corners = scan.mesh.triangle(face).map(DVec3::from_array);
        let [a, b, c] = corners;
        assert!((b - a).cross(c - a).dot(view.axes()[2]) > 0.0);
        assert!(corners.iter().all(|p| p.z > 15.0) || corners.iter().all(|p| p.z < 15.0), "{corners:?}");
    }
    // A plane seen from the front alone: two triangles for each four pixels.
    let scan = scanned(&plane(50.0, 0.0), &faultless(2.0)).unwrap();
    let [x, y] = [0, 1].map(|axis| {
        let mut of: Vec<i64> = scan.mesh.positions.iter().map(|p| (p[axis] * 1e3).round() as i64).collect();
        of.sort_unstable();
        of.dedup();
        of.len()
    });
    assert_eq!((scan.truth.len(), scan.mesh.faces.len()), (x * y, 2 * (x - 1) * (y - 1)));
    assert!(scanned(&subject, &ScanOptions { triangles: false, ..options }).unwrap().mesh.faces.is_empty());
}

#[test]
fn viewpoints_lie_where_their_angles_say() {
    let near = |a: DVec3, b: [f64; 3]| (a - DVec3::from_array(b)).length() < 1e-12;
    assert!(near(Viewpoint::FRONT.axes()[2], [0.0, 0.0, 1.0]));
    assert!(near(Viewpoint { yaw_deg: 90.0, pitch_deg: 0.0 }.axes()[2], [1.0, 0.0, 0.0]), "the subject's left");
    assert!(near(Viewpoint { yaw_deg: 10.0, pitch_deg: 90.0 }.axes()[2], [0.0, 1.0, 0.0]));
    for direction in [[1.0, 2.0, 3.0], [-4.0, 0.5, -1.0], [0.0, -3.0, 0.1]] {
        let [right, up, back] = Viewpoint::towards(direction).axes();
        assert!(near(back, DVec3::from_array(direction).normalize().to_array()));
        assert!(near(right.cross(up), back.to_array()) && right.y.abs() < 1e-12 && up.y >= 0.0);
    }
    let yaws = |n, arc| Viewpoint::on_arc(n, arc).iter().map(|view| view.yaw_deg).collect::<Vec<_>>();
    assert_eq!(yaws(1, 90.0), [0.0]);
    assert_eq!(yaws(3, 90.0), [-45.0, 0.0, 45.0]);
    assert_eq!(yaws(4, 360.0), [0.0, 90.0, 180.0, 270.0]);
}
