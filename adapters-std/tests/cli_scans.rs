//! `habitus synth scans` as a user meets it.

// Each of these tests needs a part of it.
#[allow(dead_code)]
mod program;

use std::path::PathBuf;

use habitus::io::{mesh as mesh_files, npy};
use habitus::mesh::Mesh;
use habitus::mesh::field::{Field, Grid};
use habitus::mesh::isosurface::{Border, isosurface};
use program::{Folder, habitus, json, refused};
use serde_json::Value;

impl Folder {
    /// A ball of radius 40 in a file, its coordinates times `scale`.
    fn ball(&self, name: &str, scale: f64) -> String {
        let grid = Grid::around([-40.0; 3], [40.0; 3], 5.0, 5.0).unwrap();
        let field = Field::sampled(grid, |p| p.iter().map(|x| x * x).sum::<f64>().sqrt() - 40.0).unwrap();
        let mut ball = isosurface(&field, 0.0, Border::Closed).unwrap();
        ball.positions.iter_mut().flatten().for_each(|x| *x *= scale);
        self.write(name, &ball)
    }

    /// The file of a record.
    fn of(&self, scans: &str, record: &Value, key: &str) -> PathBuf {
        self.0.join(scans).join(record[key].as_str().unwrap())
    }
}

/// Distance of each point of the scan from the point of the truth mesh that its files name; none for those without.
fn errors(folder: &Folder, scans: &str, record: &Value) -> Vec<Option<f64>> {
    let scan = mesh_files::read(folder.of(scans, record, "file")).unwrap();
    let truth = mesh_files::read(folder.of(scans, record, "truth")).unwrap();
    let (_, faces) = npy::read_u32(folder.of(scans, record, "truth_face")).unwrap();
    let (shape, coordinates) = npy::read_f64(folder.of(scans, record, "truth_barycentric")).unwrap();
    assert_eq!(shape, [scan.positions.len(), 3]);
    let place = |truth: &Mesh, face: u32, b: &[f64; 3]| -> [f64; 3] {
        let corners = truth.triangle(face as usize);
        std::array::from_fn(|axis| (0..3).map(|k| b[k] * corners[k][axis]).sum())
    };
    let points = scan.positions.iter().zip(faces).zip(coordinates.as_chunks::<3>().0);
    points
        .map(|((p, face), b)| {
            let place = (face != u32::MAX).then(|| place(&truth, face, b))?;
            Some((0..3).map(|axis| (p[axis] - place[axis]).powi(2)).sum::<f64>().sqrt())
        })
        .collect()
}

#[test]
fn scans_come_with_their_truth() {
    let folder = Folder::new("cli_scans", "truth");
    let [ball, out] = [folder.ball("ball.ply", 1.0), folder.path("out")];
    let arguments = ["synth", "scans", &ball, &ball, "-o", &out, "--views", "3", "--pixel", "1", "--outliers", "0.02"];
    let placed = [&arguments[..], &["--place", "180,500", "--floor", "--blobs", "8"]].concat();
    let said = json(&placed);
    let written: Value = serde_json::from_slice(&std::fs::read(folder.0.join("out/scans.json")).unwrap()).unwrap();
    assert_eq!(said["scans"], written["scans"]);
    assert_eq!((&written["simulated"], &written["unit"]), (&true.into(), &"mm".into()));
    let scans = said["scans"].as_array().unwrap();
    assert_eq!(scans.len(), 2);
    for (number, record) in scans.iter().enumerate() {
        assert_eq!(record["options"]["seed"], 1 + number);
        assert_eq!(record["views"].as_array().unwrap().len(), 3);
        let errors = errors(&folder, "out", record);
        assert_eq!(record["points"], errors.len());
        let labels = &record["labels"];
        let none = errors.iter().filter(|error| error.is_none()).count() as u64;
        assert_eq!(labels["clutter"].as_u64().unwrap() + labels["outlier"].as_u64().unwrap(), none);
        assert!(labels["clutter"].as_u64().unwrap() > 0 && labels["outlier"].as_u64().unwrap() > 0);
        let known: Vec<f64> = errors.into_iter().flatten().collect();
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        // The files have single precision.
        assert!((mean - record["distance_to_truth_mm"]["mean"].as_f64().unwrap()).abs() < 1e-3, "{mean}");
        assert!((0.2..0.5).contains(&mean) && known.iter().all(|error| *error < 4.0), "{mean}");
        let scan = mesh_files::read(folder.of("out", record, "file")).unwrap();
        assert_eq!(record["triangles"], scan.faces.len());
        let names: Vec<&str> = scan.attributes.iter().map(|attribute| &attribute.name[..]).collect();
        assert_eq!(names, ["label", "view"]);
    }
    assert_ne!(scans[0]["placement"], scans[1]["placement"]);
    let text = String::from_utf8(habitus(&placed).stdout).unwrap();
    assert!(text.contains("scan_01.ply") && text.contains("simulated"), "{text}");
    // The second is the first of the next seed, with the same bytes on any number of threads.
    let again = folder.path("again");
    let mut second = placed.clone();
    second.remove(3);
    second[4] = &again;
    json(&[&second[..], &["--seed", "2", "--threads", "3"]].concat());
    for (file, same) in [("scan_00.ply", "scan_01.ply"), ("truth_barycentric_00.npy", "truth_barycentric_01.npy")] {
        assert_eq!(
            std::fs::read(folder.0.join("again").join(file)).unwrap(),
            std::fs::read(folder.0.join("out").join(same)).unwrap()
        );
    }
}

#[test]
fn a_scanner_without_faults_sees_the_surface_in_any_unit() {
    let folder = Folder::new("cli_scans", "units");
    for (unit, scale) in [("mm", 1.0), ("cm", 0.1), ("m", 1e-3), ("in", 1.0 / 25.4)] {
        let [ball, out] = [folder.ball(&format!("{unit}.ply"), scale), folder.path(unit)];
        let arguments = ["synth", "scans", &ball, "-o", &out, "--unit", unit, "--faultless", "--pixel", "2", "--cloud"];
        let said = json(&[&arguments[..], &["--from", "-30,10", "--from=150,-40", "--eye", "300"]].concat());
        let record = &said["scans"][0];
        assert_eq!((said["unit"].as_str(), record["triangles"].as_u64()), (Some(unit), Some(0)));
        assert_eq!(record["views"][1]["pitch_deg"], -40.0);
        assert!(record["distance_to_truth_mm"]["largest"].as_f64().unwrap() < 1e-9);
        assert!(errors(&folder, unit, record).into_iter().all(|error| error.is_some_and(|error| error < 1e-5 * scale)));
        assert!((1500..3000).contains(&record["points"].as_u64().unwrap()), "{}", record["points"]);
    }
}

#[test]
fn what_cannot_be_scanned_is_refused_with_the_remedy() {
    let folder = Folder::new("cli_scans", "refused");
    let [ball, metres] = [folder.ball("ball.ply", 1.0), folder.ball("metres.ply", 1e-3)];
    let out = folder.path("out");
    let scan =
        |input: &str, more: &[&str], status| refused(&[&["synth", "scans", input, "-o", &out], more].concat(), status);
    let said = scan(&metres, &[], 1);
    assert!(said.contains("metres.ply") && said.contains("tell its unit"), "{said}");
    assert!(scan(&ball, &["--pixel", "0.001"], 1).contains("at most 16777216"));
    assert!(scan(&ball, &["--eye", "30"], 1).contains("give at least"));
    assert!(scan(&ball, &["--outliers", "2"], 1).contains("share of outliers is 2: give a number from 0 to 1"));
    assert!(scan(&ball, &["--hole-radius", "9,4"], 1).contains("largest radius of a hole"));
    assert!(scan(&folder.path("none.ply"), &[], 1).contains("cannot be read"));
    for wrong in [&["--from", "1,2,3"][..], &["--views", "0"], &["--from", "0,0", "--views", "2"], &["--unit", "mile"]]
    {
        scan(&ball, wrong, 2);
    }
    // Few points are a sign of a wrong unit.
    let said = json(&["synth", "scans", &ball, "-o", &out, "--pixel", "10"]);
    assert!(said["warnings"][0].as_str().unwrap().contains("are unit and pixel right?"));
}
