//! What a fit writes, and that a user can make the fitted mesh again from what it says.

use habitus::io::mesh as mesh_files;
use serde_json::Value;

use crate::program::{habitus, json};
use crate::work::{mean_distance, work};

fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// All formats hold the same mesh.
#[test]
fn every_format_holds_the_fitted_mesh() {
    let work = work();
    let (scan, landmarks) = (work.path("scans/scan_00.ply"), work.triples("formats.txt", |p| p));
    let model = work.path("face.hab");
    let written = |name: &str| {
        let output = work.path(name);
        let object = json(&["fit", &model, &scan, "--landmarks", &landmarks, "-o", &output]);
        assert_eq!(object["output"], output);
        mesh_files::read(output).expect("a mesh")
    };
    let ply = written("fit.ply");
    assert_eq!((ply.faces == work.truth.faces, ply.normals.len()), (true, ply.positions.len()));
    assert_eq!(written("fit.npy").positions, ply.positions);
    let obj = written("fit.obj");
    assert_eq!((obj.positions, obj.faces), (ply.positions.clone(), ply.faces.clone()));
    // GLB is in metres and single precision.
    let glb = written("fit.glb");
    assert_eq!(glb.faces, ply.faces);
    let apart = mean_distance(&glb.positions, &ply.positions);
    assert!(apart < 1e-3, "{apart}");
}

/// Weights, unit and placement of the JSON make the fitted mesh again through `habitus generate`.
#[test]
fn the_figures_make_the_fitted_mesh_again() {
    let work = work();
    let (object, vertices) = work.plain();
    let joined = |key: &str| numbers(&object[key]).iter().map(|t| format!("{t:?}")).collect::<Vec<_>>().join(",");
    let (identity, expression) = (joined("identity_deviations"), joined("expression_deviations"));
    let again = work.path("again.npy");
    let model = work.path("face.hab");
    json(&["generate", &model, "--identity", &identity, "--expression", &expression, "-o", &again]);
    let placement = &object["placement"];
    let (scale, translation) = (placement["scale"].as_f64().expect("a number"), numbers(&placement["translation"]));
    let rows: Vec<Vec<f64>> = placement["rotation"].as_array().expect("rows").iter().map(numbers).collect();
    let placed = |p: &[f64; 3]| -> [f64; 3] {
        std::array::from_fn(|r| scale * (0..3).map(|c| rows[r][c] * p[c]).sum::<f64>() + translation[r])
    };
    let generated = mesh_files::read(again).expect("a cloud").positions;
    let apart = mean_distance(&generated.iter().map(placed).collect::<Vec<_>>(), vertices);
    assert!(apart < 1e-4, "{apart}");
    assert!((scale - 1.0).abs() < 1e-6, "{scale}");
}

/// The parameters alone make the fitted mesh again, in the unit and frame of the scan or in those of the model.
#[test]
fn the_parameters_make_the_fitted_mesh_again() {
    let work = work();
    let (scan, landmarks, parameters) =
        (work.path("scans/scan_00.ply"), work.triples("parameters.txt", |p| p), work.path("parameters.json"));
    let (object, vertices) = work.fitted(&scan, &landmarks, &["--parameters", &parameters]);
    assert_eq!(object["parameters"], parameters);
    let (again, unplaced, model) = (work.path("placed.npy"), work.path("unplaced.npy"), work.path("face.hab"));
    let made = |output: &str, more: &[&str]| {
        json(&[&["generate", &model, "--parameters", &parameters, "-o", output], more].concat());
        mesh_files::read(output).expect("a cloud").positions
    };
    let apart = mean_distance(&made(&again, &[]), &vertices);
    assert!(apart < 1e-4, "{apart}");
    let middle = |points: &[[f64; 3]]| points.iter().map(|p| p[2]).sum::<f64>() / points.len() as f64;
    let moved = middle(&made(&unplaced, &["--unplaced"])) - middle(&vertices);
    assert!(moved.abs() > 1.0, "{moved}");
    // The whole object says the same.
    let whole = work.text("whole.json", &object.to_string());
    json(&["generate", &model, "--parameters", &whole, "-o", &again]);
    assert!(mean_distance(&mesh_files::read(&again).expect("a cloud").positions, &vertices) < 1e-4);
}

/// Nothing that is read is overwritten, and what cannot be written is told before any work.
#[test]
fn outputs_are_checked_first() {
    let work = work();
    let scan = work.path("scans/scan_00.ply");
    let landmarks = work.triples("kept.txt", |p| p);
    let before = std::fs::read(&scan).expect("read");
    let dotted = work.path("scans/../scans/scan_00.ply");
    let report = work.text("no_folder", "x");
    let new = work.path("not_written.ply");
    for (more, part) in [
        (&["-o", &scan[..]][..], "-o would overwrite an input"),
        (&["-o", &dotted], "-o would overwrite an input"),
        (&["--parameters", &new, "-o", &new], "not_written.ply: the output is a .json file"),
        (&["-o", &new, "--report", &report], "no_folder: is a file; name a folder"),
        (&["-o", &new, "--report", &work.path("none/a/b")], "there is no folder"),
    ] {
        let said = work.refused("face.hab", &scan, &landmarks, more);
        assert!(said.contains(part), "{part}: {said}");
        // Before the scan is even looked at.
        assert!(
            work.refused("face.hab", &work.path("absent.ply"), &landmarks, more).contains(part)
                || more[1].contains("scan_00")
        );
    }
    assert!(!std::path::Path::new(&new).exists());
    assert!(std::fs::read(&scan).expect("read") == before);
}

/// The object has the fields of docs/json.md and no others, and they agree with one another.
#[test]
fn the_object_is_as_documented() {
    let work = work();
    let (object, vertices) = work.plain();
    let document = include_str!("../../../docs/json.md");
    let chapter = document.split("\n## ").find(|chapter| chapter.starts_with("`fit`")).expect("a chapter");
    let first = |line: &str| line.strip_prefix("| `")?.split('|').next().map(str::to_owned);
    let mut documented: Vec<String> = chapter
        .lines()
        .filter_map(first)
        .flat_map(|names| names.split(", ").map(|name| name.trim_matches([' ', '`']).to_owned()).collect::<Vec<_>>())
        .chain(["warnings".to_owned()])
        .collect();
    documented.sort();
    let mut found: Vec<String> = object.as_object().expect("an object").keys().cloned().collect();
    found.sort();
    assert_eq!(found, documented);
    let residuals = numbers(&object["landmark_residuals_mm"]);
    let model_vertices = numbers(&json(&["info", &work.path("face.hab")])["landmarks"]);
    for ((residual, vertex), (name, p)) in residuals.iter().zip(model_vertices).zip(&work.landmarks) {
        let apart = mean_distance(&[vertices[vertex as usize]], &[*p]);
        assert!((residual - apart).abs() < 1e-3, "{name}: {residual} {apart}");
    }
    let coverage = object["coverage_percent"].as_f64().expect("a number");
    assert!((50.0..=100.0).contains(&coverage), "{coverage}");
    let number = |name: &str| object[name].as_f64().expect("a number");
    assert!(number("landmark_residual_mm") < 3.0 && number("scan_distance_median_mm") < 0.6, "{object}");
    assert!(number("scan_distance_median_mm") < number("scan_distance_95_mm"), "{object}");
    assert!(object["points_on_fit"].as_u64().expect("a count") > 1000, "{object}");
    assert!(object["judged_median_mm"].as_f64().expect("a number") < 0.6, "{object}");
    assert!(object["points"].as_u64().expect("a count") > 1000, "{object}");
}

#[test]
fn the_picture_opens() {
    let work = work();
    let (scan, landmarks, png) = (work.path("scans/scan_00.ply"), work.triples("png.txt", |p| p), work.path("fit.png"));
    let (object, _) = work.fitted(&scan, &landmarks, &["--png", &png, "--size", "64"]);
    assert_eq!(object["png"], png);
    let file = std::io::BufReader::new(std::fs::File::open(&png).expect("a file"));
    let mut reader = png::Decoder::new(file).read_info().expect("a picture");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let frame = reader.next_frame(&mut pixels).expect("a picture");
    assert!(frame.width > 3 * 64 && frame.height > 3 * 64, "{} x {}", frame.width, frame.height);
    let background = pixels[..3].to_vec();
    let drawn = pixels.chunks_exact(3).filter(|pixel| *pixel != background).count();
    assert!(drawn > 2000, "{drawn} pixels");
}

/// Any number of threads writes the same bytes.
#[test]
fn threads_do_not_change_a_byte() {
    let work = work();
    let (scan, landmarks, model) =
        (work.path("scans/scan_00.ply"), work.triples("threads.txt", |p| p), work.path("face.hab"));
    let made = |threads: &str| {
        let (ply, png) = (work.path(&format!("t{threads}.ply")), work.path(&format!("t{threads}.png")));
        let arguments = ["fit", &model, &scan, "--landmarks", &landmarks, "-o", &ply, "--png", &png, "--size", "64"];
        let output = habitus(&[&arguments[..], &["--threads", threads, "--json"]].concat());
        let mut object: Value = serde_json::from_slice(&output.stdout).expect("an object");
        for key in ["seconds", "output", "png"] {
            object[key] = Value::Null;
        }
        (object, std::fs::read(ply).expect("read"), std::fs::read(png).expect("read"))
    };
    assert!(made("1") == made("4"));
}

/// A copy of the model in fewer bytes finds the same face, but for what its storage costs.
#[test]
fn quantised_models_are_fitted_too() {
    let work = work();
    let (scan, landmarks) = (work.path("scans/scan_00.ply"), work.triples("quantised.txt", |p| p));
    let (_, expected) = work.plain();
    for (storage, limit) in [("f16", 0.05), ("i8", 0.3)] {
        let (model, output) = (work.path(&format!("face-{storage}.hab")), work.path(&format!("fit-{storage}.npy")));
        json(&["quantise", &work.path("face.hab"), "--as", storage, "-o", &model]);
        json(&["fit", &model, &scan, "--landmarks", &landmarks, "-o", &output]);
        let found = mesh_files::read(output).expect("a cloud").positions;
        let apart = mean_distance(&found, expected);
        assert!(apart < limit, "{storage}: {apart} mm");
    }
}
