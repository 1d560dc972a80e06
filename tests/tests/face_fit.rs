//! Fits of raw face scans against their truth.

mod face_fit_scoring;

use face_fit_scoring::simulated::Simulated;
use face_fit_scoring::{Score, Shared, print_table};
use habitus::register::scan_fit::{ScanFitOptions, fit_scan};
use habitus::spatial::PointTree;
use habitus::spatial::frame_recovery::Unit;
use habitus_tests::random::Random;
use std::time::Instant;

/// The scans without glasses and hair.
const CLEAN: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 10, 11];

#[test]
fn shared_scans_are_fitted() {
    let Some(dir) = habitus_tests::data::dir_or_skip("shared_scans_are_fitted") else { return };
    let shared = Shared::read(&dir);
    // Size, projection of the truth, the most that is accepted (mean over the clean scans, mm).
    for (size, best, bar) in [((20, 10), 1.04, 1.45), ((59, 10), 0.64, 1.15)] {
        // The larger model's fits take a minute in a debug build; `cargo xtask nightly` has them.
        if cfg!(debug_assertions) && size != (20, 10) {
            continue;
        }
        let bytes = shared.model(size);
        let model = habitus_core::format::Model::open(&bytes).expect("a model");
        let mut scores: Vec<Score> = Vec::new();
        for k in 0..12 {
            let clock = Instant::now();
            let scan = &shared.scans[k];
            let fit = fit_scan(&model, scan, &shared.landmarks(k), &ScanFitOptions::default()).expect("a fit");
            let seconds = clock.elapsed().as_secs_f64();
            let mut score = shared.score(k, &fit.vertices);
            score.note = format!(
                "{seconds:.2} s, {} points, sigma {:.2}, coverage {:.2}, landmarks {:.1}",
                fit.n_points,
                fit.sigma,
                fit.coverage,
                fit.landmark_residuals.iter().sum::<f64>() / fit.landmark_residuals.len() as f64
            );
            scores.push(score);
        }
        let (mean, median) = print_table(&format!("{size:?}"), &scores, best);
        assert!(mean <= bar, "clean mean {mean} mm at {size:?}, at most {bar}");
        for k in [8, 9] {
            let ratio = scores[k].mean / median;
            assert!(ratio <= 1.25, "scan {k:02} at {size:?}: {ratio} of the clean median, at most 1.25");
        }
    }
}

/// What is done to scan and landmarks before the fit.
fn motion(p: [f64; 3], scale: f64) -> [f64; 3] {
    // Half a turn about a vertical axis 5 m aside: its own inverse, and the scan is 10 m away.
    [-p[0] + 10_000.0, p[1], -p[2]].map(|x| x * scale)
}

/// The mean error over the clean scans with disturbed landmarks, landmarks missing, moved scans, scans in metres.
#[test]
#[ignore = "long in a debug build"]
fn fits_stand_disturbed_landmarks_and_moved_scans() {
    let Some(dir) = habitus_tests::data::dir_or_skip("fits_stand_disturbed_landmarks_and_moved_scans") else { return };
    let shared = Shared::read(&dir);
    for size in [(20, 10), (59, 10)] {
        let bytes = shared.model(size);
        let model = habitus_core::format::Model::open(&bytes).expect("a model");
        let mut random = Random::new(7);
        let cases = [
            "as given",
            "landmarks disturbed by 5 mm",
            "5 of 13 missing",
            "turned and moved by 10 m",
            "in metres",
            "declared metres",
        ];
        let mut means = Vec::new();
        for case in cases {
            let mut sum = 0.0;
            for k in CLEAN {
                let mut scan = shared.scans[k].clone();
                let mut landmarks = shared.landmarks(k);
                let mut options = ScanFitOptions::default();
                match case {
                    "landmarks disturbed by 5 mm" => landmarks.iter_mut().flatten().for_each(|p| {
                        let direction: [f64; 3] = std::array::from_fn(|_| random.normal());
                        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
                        *p = std::array::from_fn(|axis| p[axis] + 5.0 * direction[axis] / length);
                    }),
                    "5 of 13 missing" => {
                        for step in 0..5 {
                            landmarks[(k + 5 * step) % 13] = None;
                        }
                    }
                    _ => {}
                }
                let moved = case.starts_with("turned");
                let scale = if case.ends_with("metres") { 0.001 } else { 1.0 };
                if moved || scale != 1.0 {
                    let place = |p: [f64; 3]| if moved { motion(p, scale) } else { p.map(|x| x * scale) };
                    scan.positions.iter_mut().for_each(|p| *p = place(*p));
                    landmarks.iter_mut().flatten().for_each(|p| *p = place(*p));
                }
                if case == "declared metres" {
                    options.unit = Some(Unit::Metre);
                }
                let fit = fit_scan(&model, &scan, &landmarks, &options).expect("a fit");
                let back = |p: &[f64; 3]| if moved { motion(*p, 1.0) } else { p.map(|x| x / scale) };
                let vertices: Vec<[f64; 3]> = fit.vertices.iter().map(back).collect();
                sum += shared.score(k, &vertices).mean;
            }
            means.push(sum / CLEAN.len() as f64);
            println!("{size:?}, {case}: clean mean {:.3} mm", sum / CLEAN.len() as f64);
        }
        assert!(means[1] < 1.1 * means[0] && means[2] < 1.1 * means[0], "{means:?}");
        assert!(means[3..].iter().all(|mean| (mean - means[0]).abs() < 0.05 * means[0]), "{means:?}");
    }
}

/// What is no face is refused, with the reason.
#[test]
fn other_things_are_refused() {
    let Some(dir) = habitus_tests::data::dir_or_skip("other_things_are_refused") else { return };
    let shared = Shared::read(&dir);
    let bytes = shared.model((59, 10));
    let model = habitus_core::format::Model::open(&bytes).expect("a model");
    let mean = shared.mean_landmarks();
    for file in
        ["meshes/cat.ply", "meshes/cube.ply", "bodies/scans/scan_00.ply", "meshes/spot.ply", "meshes/sphere.ply"]
    {
        let scan = habitus::io::mesh::read(dir.join(file)).expect("a mesh");
        let (low, high) = scan.bounding_box().expect("a box");
        let (from, to) = bounds(&mean);
        let scaled =
            |p: &[f64; 3]| std::array::from_fn(|a| low[a] + (p[a] - from[a]) / (to[a] - from[a]) * (high[a] - low[a]));
        let in_box: Vec<[f64; 3]> = mean.iter().map(scaled).collect();
        let tree = PointTree::new(&scan.positions).expect("points");
        let picked: Vec<[f64; 3]> = in_box.iter().map(|&p| scan.positions[tree.nearest(p).index as usize]).collect();
        for (how, points) in [("in its box", in_box), ("picked on it", picked)] {
            // Also in the unit in which its landmarks are as large as those of a face, so that the size alone does not tell.
            let size = spread(&mean) / spread(&points);
            for scale in [1.0, size] {
                let mut scan = scan.clone();
                scan.positions.iter_mut().for_each(|p| *p = p.map(|x| x * scale));
                let landmarks: Vec<_> = points.iter().map(|p| Some(p.map(|x| x * scale))).collect();
                let found = fit_scan(&model, &scan, &landmarks, &ScanFitOptions::default());
                println!(
                    "{file}, {how}, times {scale:.3}: {}",
                    match &found {
                        Ok(fit) => format!(
                            "ACCEPTED {:.2} {:.2} {:.1} {:.1}",
                            fit.coverage, fit.median, fit.identity_energy, fit.pose_energy
                        ),
                        Err(error) => error.to_string(),
                    }
                );
                assert!(found.is_err(), "{file}, {how}, times {scale}");
            }
        }
    }
}

/// Landmarks whose left and right are exchanged are refused, each time; so are too few.
#[test]
fn exchanged_sides_are_refused() {
    let Some(dir) = habitus_tests::data::dir_or_skip("exchanged_sides_are_refused") else { return };
    let shared = Shared::read(&dir);
    let bytes = shared.model((20, 10));
    let model = habitus_core::format::Model::open(&bytes).expect("a model");
    for k in 0..12 {
        let mut landmarks = shared.landmarks(k);
        for [a, b] in [[0, 3], [1, 2], [5, 6], [8, 9]] {
            landmarks.swap(a, b);
        }
        let error = fit_scan(&model, &shared.scans[k], &landmarks, &ScanFitOptions::default())
            .expect_err("refused")
            .to_string();
        assert!(error.contains("left and right"), "{k}: {error}");
        landmarks.iter_mut().skip(3).for_each(|landmark| *landmark = None);
        let error = fit_scan(&model, &shared.scans[k], &landmarks, &ScanFitOptions::default())
            .expect_err("refused")
            .to_string();
        assert!(error.contains("at least 4"), "{error}");
    }
}

fn bounds(points: &[[f64; 3]]) -> ([f64; 3], [f64; 3]) {
    let fold =
        |f: fn(f64, f64) -> f64| points.iter().skip(1).fold(points[0], |b, p| std::array::from_fn(|a| f(b[a], p[a])));
    (fold(f64::min), fold(f64::max))
}

/// Root mean square distance from the mean.
fn spread(points: &[[f64; 3]]) -> f64 {
    let n = points.len() as f64;
    let mean: [f64; 3] = std::array::from_fn(|a| points.iter().map(|p| p[a]).sum::<f64>() / n);
    (points.iter().map(|p| (0..3).map(|a| (p[a] - mean[a]).powi(2)).sum::<f64>()).sum::<f64>() / n).sqrt()
}

/// The figures on which the defaults were chosen: `cargo test -p habitus-tests --test face_fit simulated -- --ignored --nocapture`.
#[test]
#[ignore = "long in a debug build"]
fn simulated_scans_are_fitted() {
    let Some(dir) = habitus_tests::data::dir_or_skip("simulated_scans_are_fitted") else { return };
    let shared = Shared::read(&dir);
    let scans = Simulated::all(&dir, &shared, shared.landmark_vertices());
    for size in [(20, 10), (59, 10)] {
        let bytes = shared.model(size);
        let model = habitus_core::format::Model::open(&bytes).expect("a model");
        let score = |scan: &Simulated| {
            let fit = fit_scan(&model, &scan.scan, &scan.landmarks, &ScanFitOptions::default()).expect("a fit");
            scan.score(&shared, &fit.vertices)
        };
        let scores: Vec<(bool, Score)> = scans.iter().map(|scan| (scan.has_hair, score(scan))).collect();
        for hair in [false, true] {
            let of: Vec<&Score> = scores.iter().filter(|(has_hair, _)| *has_hair == hair).map(|(_, s)| s).collect();
            let mean = |number: fn(&Score) -> f64| of.iter().map(|s| number(s)).sum::<f64>() / of.len() as f64;
            println!(
                "simulated {size:?}, {}: mean {:.3}, 95 % {:.3}, hidden {:.3} ({:.2} of the vertices)",
                if hair { "with hair" } else { "clean" },
                mean(|s| s.mean),
                mean(|s| s.q95),
                mean(|s| s.hidden),
                mean(|s| s.hidden_share)
            );
        }
    }
}
