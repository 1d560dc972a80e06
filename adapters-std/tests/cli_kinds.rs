//! The verbs that take models of every kind and storage, on the small models of the project, as a user meets them.

// These tests need a part of it.
#[allow(dead_code)]
mod program;

use std::path::Path;

use habitus::io::npy;
use program::{Folder, habitus, json, json_and_said, refused};

const KINDS: [&str; 4] = ["small", "linear", "body", "wavelet"];
const STORAGES: [&str; 3] = ["", "-f16", "-i8"];

fn model(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/firmware/models");
    folder.join(format!("{name}.hab")).display().to_string()
}

#[test]
fn every_model_is_exported_for_numpy() {
    let folder = Folder::new("cli_kinds", "npz");
    for kind in KINDS {
        for storage in STORAGES {
            let output = folder.path(&format!("{kind}{storage}.npz"));
            json(&["export", &model(&format!("{kind}{storage}")), "-o", &output]);
            let archive = npy::npz::NpzReader::open(Path::new(&output)).expect("an archive").names();
            let expected = match kind {
                "small" => "core",
                "wavelet" => "coefficients",
                _ => "components",
            };
            assert!(archive.contains(&expected.to_owned()), "{kind}{storage}: {archive:?}");
        }
    }
}

#[test]
fn every_model_shows_its_plain_mean_shape() {
    let folder = Folder::new("cli_kinds", "mean");
    for kind in KINDS {
        for storage in STORAGES {
            let (file, output) = (model(&format!("{kind}{storage}")), folder.path("mean.npy"));
            let said = json(&["generate", &file, "-o", &output]);
            if kind == "linear" {
                assert_eq!(said["expression_deviations"], serde_json::json!([]));
            }
            if kind == "body" {
                assert!(said["expression_deviations"].is_null());
            }
            if kind != "linear" {
                json(&["generate", &file, "-o", &folder.path("mean.ply")]);
                json(&["export", &file, "-o", &folder.path("mean.glb")]);
            }
        }
    }
    let body = model("body");
    assert_eq!(json(&["export", &body, "-o", &folder.path("body.glb")])["morph_targets"], 1 + 3);
    assert!(refused(&["export", &model("linear"), "-o", &folder.path("linear.glb")], 1).contains("no triangles"));
}

/// Without statistics of the angles the identity alone is drawn.
#[test]
fn random_bodies_stand_as_the_mean_does() {
    let folder = Folder::new("cli_kinds", "random");
    let (body, random, again) = (model("body"), folder.path("random.npy"), folder.path("again.npy"));
    let drawn = json(&["generate", &body, "--random", "--seed", "4", "-o", &random]);
    let deviations: Vec<String> =
        drawn["identity_deviations"].as_array().expect("a list").iter().map(|t| t.to_string()).collect();
    assert_eq!(deviations.len(), 3);
    json(&["generate", &body, "--identity", &deviations.join(","), "-o", &again]);
    let (a, b) = (npy::read_f64(&random).expect("an array").1, npy::read_f64(&again).expect("an array").1);
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-3));
    let mean = folder.path("mean.npy");
    json(&["generate", &body, "-o", &mean]);
    assert_ne!(a, npy::read_f64(&mean).expect("an array").1);
    let said = refused(&["generate", &body, "--expression", "0.5", "-o", &again], 1);
    assert!(said.contains("pose weights are distributed") && said.contains("leave them out"), "{said}");
    assert!(refused(&["generate", &model("linear"), "--expression", "0.5", "-o", &again], 1).contains("has 0"));
}

#[test]
fn info_tells_what_the_kind_needs() {
    let text = |name: &str| String::from_utf8(habitus(&["info", &model(name)]).stdout).expect("text");
    for (name, parts) in [
        ("small", vec!["with linear terms (eq. 8.2)"]),
        ("linear", vec!["(eq. 9.1)"]),
        ("body", vec!["(eqs 9.1 to 9.3)", "5 joints, which follow the identity; blends matrices"]),
        ("wavelet", vec!["(eq. 12.1, ch. 15)", "base grid of 5 x 7 and 2 levels above it, cubic transform"]),
        ("body-i8", vec!["coefficients as i8: vertices of random shapes are 0."]),
        ("small-f16", vec!["coefficients as f16"]),
    ] {
        let text = text(name);
        assert!(parts.iter().all(|part| text.contains(part)), "{name}: {text}");
        assert!(name == "small" || name == "small-f16" || !text.contains("8.2"), "{name}: {text}");
    }
    let body = json(&["info", &model("body-i8")]);
    assert_eq!((&body["element"], &body["body"]["joints"]), (&"I8".into(), &5.into()));
    assert_eq!((&body["body"]["blend"], &body["body"]["joints_follow_identity"]), (&"matrices".into(), &true.into()));
    assert_eq!(body["body"]["joint_names"].as_array().expect("names").len(), 5);
    let error = &body["quantisation_error"];
    assert!(error["mean_mm"].as_f64() > Some(0.0) && error["largest_mm"].as_f64() > error["rms_mm"].as_f64());
    let wavelet = json(&["info", &model("wavelet")]);
    assert_eq!(wavelet["grid"], serde_json::json!({ "base": [5, 7], "levels": 2, "transform": "cubic" }));
    assert!(wavelet["quantisation_error"].is_null() && wavelet["body"].is_null());
}

#[test]
fn measure_model_refuses_what_it_has_no_measures_for() {
    for kind in ["linear", "body", "wavelet", "body-f16"] {
        let said = refused(&["measure", "model", &model(kind)], 1);
        assert!(said.contains("bilinear face models") && said.contains(&format!("{kind}.hab")), "{said}");
    }
    let said = refused(&["measure", "model", &model("small")], 1);
    assert!(said.contains("small.hab") && said.contains("give unseen faces with --test"), "{said}");
    // Unseen faces are fitted in every storage, with nearly the same error.
    let folder = Folder::new("cli_kinds", "measure");
    let tensor = folder.path("unseen.npy");
    let (shape, values) = {
        let mean = folder.path("mean.npy");
        json(&["generate", &model("small"), "--identity", "1,-1", "--expression", "0.5", "-o", &mean]);
        npy::read_f64(&mean).expect("an array")
    };
    npy::write_f64(&tensor, &[1, 1, shape[0], 3], &values).expect("written");
    for storage in STORAGES {
        let file = model(&format!("small{storage}"));
        let (found, _) = json_and_said(&["measure", "model", &file, "--test", &tensor, "--align", "none"]);
        let error = found["unseen_error_mean_mm"].as_f64().expect("a number");
        assert!(error < 0.2, "{storage}: {error}");
    }
}
