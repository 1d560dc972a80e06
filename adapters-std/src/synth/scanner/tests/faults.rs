//! Faults have the sizes that are asked for.

use super::*;

/// The error along the ray of each point of a plane at z = 0 that is seen from the front.
fn depths(options: &ScanOptions) -> Vec<f64> {
    let scan = scanned(&plane(200.0, 0.0), options).unwrap();
    scan.mesh.positions.iter().map(|p| p[2]).collect()
}

/// Product-moment correlation of each value with that `lag` behind.
fn correlation(values: &[f64], lag: usize) -> f64 {
    let (mean, sigma) = moments(values.iter().copied());
    let products = values.iter().zip(&values[lag..]).map(|(a, b)| (a - mean) * (b - mean));
    moments(products).0 / (sigma * sigma)
}

#[test]
fn noise_has_its_standard_deviation_and_pixels_their_own() {
    for (seed, sigma) in [(1, 0.33), (2, 2.0)] {
        let noise = depths(&ScanOptions { noise: sigma, seed, ..faultless(1.0) });
        let (mean, found) = moments(noise.iter().copied());
        assert!(noise.len() > 150_000 && mean.abs() < 0.01 * sigma, "{mean}");
        assert!((found / sigma - 1.0).abs() < 0.01, "{found} for {sigma}");
        assert!(correlation(&noise, 1).abs() < 0.01);
    }
}

#[test]
fn smooth_noise_has_its_standard_deviation_and_neighbours_share_it() {
    let mut all = Vec::new();
    for seed in 1..=4 {
        let options = ScanOptions { smooth_noise: 0.4, smooth_length: 10.0, seed, ..faultless(1.0) };
        all.push(depths(&options));
    }
    let (_, sigma) = moments(all.iter().flatten().copied());
    assert!((sigma / 0.4 - 1.0).abs() < 0.05, "{sigma}");
    // A cubic B-spline: 0.98 at a tenth of a knot, nothing from four knots on.
    assert!(all.iter().all(|of| correlation(of, 1) > 0.97 && correlation(of, 50).abs() < 0.1));
}

#[test]
fn noise_runs_along_the_ray() {
    for projection in [Projection::Orthographic, Projection::Perspective { distance: 500.0 }] {
        let view = Viewpoint { yaw_deg: 30.0, pitch_deg: 20.0 };
        let options = ScanOptions { noise: 1.0, views: vec![view], projection, ..faultless(2.0) };
        let subject = ball(40.0, 16);
        let scan = scanned(&subject, &options).unwrap();
        for (p, at) in scan.mesh.positions.iter().zip(&scan.truth) {
            let truth = DVec3::from_array(at.unwrap().position(&subject));
            let ray = match projection {
                Projection::Orthographic => view.axes()[2],
                // The ball's middle is the origin.
                Projection::Perspective { distance } => (view.axes()[2] * distance - truth).normalize(),
            };
            assert!((DVec3::from_array(*p) - truth).cross(ray).length() < 1e-9);
        }
    }
}

#[test]
fn views_after_the_first_are_misplaced_by_what_is_asked() {
    let subject = ball(40.0, 16);
    for seed in 1..20 {
        let options = ScanOptions {
            views: vec![Viewpoint::FRONT; 3],
            calibration_turn_deg: 0.7,
            calibration_shift: 1.3,
            seed,
            ..faultless(4.0)
        };
        let scan = scanned(&subject, &options).unwrap();
        assert_eq!(scan.views[0].calibration, Similarity::IDENTITY);
        assert_ne!(scan.views[1].calibration, scan.views[2].calibration);
        for view in &scan.views[1..] {
            let r = view.calibration.rotation;
            let angle = ((r[0][0] + r[1][1] + r[2][2] - 1.0) / 2.0).acos().to_degrees();
            assert!((angle - 0.7).abs() < 1e-6, "{angle}");
            // The middle of the subject, here the origin, is moved alone.
            assert!((DVec3::from_array(view.calibration.point([0.0; 3])).length() - 1.3).abs() < 1e-9);
        }
        for ((p, at), view) in scan.mesh.positions.iter().zip(&scan.truth).zip(values(&scan, 1)) {
            let placed = scan.views[*view as usize].calibration.point(at.unwrap().position(&subject));
            assert!((DVec3::from_array(*p) - DVec3::from_array(placed)).length() < 1e-9);
        }
    }
}

#[test]
fn the_scan_lies_where_its_placement_says() {
    let subject = moved(ball(40.0, 16), [100.0, 20.0, 3.0]);
    let place = |seed| {
        let options = ScanOptions { placement_turn_deg: 180.0, placement_shift: 500.0, seed, ..faultless(3.0) };
        let scan = scanned(&subject, &options).unwrap();
        assert!(scan.errors(&subject).into_iter().all(|error| error < 1e-9));
        let from = DVec3::from_array(scan.placement.point([100.0, 20.0, 3.0])) - DVec3::new(100.0, 20.0, 3.0);
        assert!(from.length() <= 500.0);
        from.length()
    };
    let (mean, _) = moments((1..60).map(place));
    assert!((mean - 250.0).abs() < 60.0, "uniform from 0 to 500: {mean}");
}

#[test]
fn holes_are_empty_balls_and_all_else_is_as_without_them() {
    let subject = ball(40.0, 16);
    let whole = scanned(&subject, &ScanOptions { noise: 0.2, ..faultless(1.0) }).unwrap();
    let options = ScanOptions { noise: 0.2, holes: 6, hole_radius: [3.0, 9.0], ..faultless(1.0) };
    let scan = scanned(&subject, &options).unwrap();
    let inside = |at: &Option<SurfacePoint>| {
        let place = DVec3::from_array(at.unwrap().position(&subject));
        scan.holes.iter().any(|hole| (place - DVec3::from_array(hole.centre)).length() < hole.radius)
    };
    assert_eq!(scan.holes.len(), 6);
    assert!(scan.holes.iter().all(|hole| (3.0..=9.0).contains(&hole.radius)));
    let left: Vec<[f64; 3]> =
        whole.mesh.positions.iter().zip(&whole.truth).filter(|(_, at)| !inside(at)).map(|(p, _)| *p).collect();
    assert_eq!(scan.mesh.positions, left);
    assert_eq!(scan.views[0].in_holes, whole.truth.len() - left.len());
    assert!(scan.views[0].in_holes > 100);
}

#[test]
fn flying_points_have_their_share_and_reach() {
    let options = ScanOptions { outliers: 0.02, outlier_reach: 15.0, ..faultless(1.0) };
    let scan = scanned(&plane(200.0, 0.0), &options).unwrap();
    let n = scan.truth.len() as f64;
    let flying: Vec<usize> = (0..scan.truth.len()).filter(|&point| values(&scan, 0)[point] == 2.0).collect();
    assert!((flying.len() as f64 / n - 0.02).abs() < 4.0 * (0.02 * 0.98 / n).sqrt(), "{}", flying.len());
    assert_eq!(flying.len(), scan.count(Label::Outlier));
    assert!(scan.truth.iter().enumerate().all(|(point, at)| at.is_none() == flying.binary_search(&point).is_ok()));
    let reach = flying.iter().map(|&point| scan.mesh.positions[point][2].abs()).fold(0.0, f64::max);
    assert!((14.9..=15.0).contains(&reach), "{reach}");
    assert!(scan.errors(&plane(200.0, 0.0)).into_iter().all(|error| error < 1e-9));
}

#[test]
fn clutter_is_seen_hides_and_is_no_part_of_the_subject() {
    let (subject, view) = (ball(40.0, 24), Viewpoint { yaw_deg: 0.0, pitch_deg: 40.0 });
    let options = ScanOptions { views: vec![view], floor: true, ..faultless(1.0) };
    let floor = scanned(&subject, &options).unwrap();
    let on_floor = |scan: &Scan| values(scan, 0).iter().filter(|label| **label == 1.0).count();
    assert!(on_floor(&floor) > 500);
    for ((p, at), label) in floor.mesh.positions.iter().zip(&floor.truth).zip(values(&floor, 0)) {
        assert_eq!(at.is_none(), *label == 1.0);
        assert!(at.is_some() || (p[1] + 40.0).abs() < 1e-9, "the floor is at the lowest point");
    }
    let alone = scanned(&subject, &ScanOptions { floor: false, ..options.clone() }).unwrap();
    assert_eq!(floor.count(Label::Surface), alone.truth.len(), "a floor hides nothing from above");
    let options = ScanOptions { blobs: 30, floor: false, ..options };
    let blobs = scanned(&subject, &options).unwrap();
    assert!(blobs.count(Label::Clutter) > 500);
    assert!(blobs.count(Label::Surface) < alone.truth.len());
}

#[test]
fn the_seed_decides_on_any_number_of_threads() {
    let subject = ball(40.0, 16);
    let scan = |seed, threads| {
        let options = ScanOptions {
            views: Viewpoint::on_arc(3, 90.0),
            pixel: 1.0,
            blobs: 5,
            floor: true,
            placement_turn_deg: 90.0,
            placement_shift: 100.0,
            seed,
            ..ScanOptions::default()
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| scanned(&subject, &options).unwrap())
    };
    let first = scan(5, 1);
    assert!(first.mesh.positions.len() > 5000);
    assert_eq!(first, scan(5, 3));
    assert_ne!(first.mesh.positions, scan(6, 3).mesh.positions);
}
