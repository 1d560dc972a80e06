//! The pages of `habitus demo`, `fit --report` and `measure model --report`: everything they name is there, nothing leads elsewhere, and their
//! figures are those of `figures.json`.

// Each of these tests needs a part of it.
#[allow(dead_code)]
mod program;

use std::collections::HashSet;
use std::path::Path;

use program::{Folder, habitus, json};
use serde_json::Value;

/// The values of an attribute of a page, in order.
fn values<'a>(html: &'a str, attribute: &str) -> Vec<&'a str> {
    let start = format!(" {attribute}=\"");
    html.split(start.as_str()).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

/// Where each figure of a page stands in `figures.json`, and what the page shows.
fn figures(html: &str) -> Vec<(&str, &str)> {
    let cells = html.split("<td data-figure=\"").skip(1);
    cells.filter_map(|rest| rest.split_once("\">").and_then(|(at, rest)| Some((at, rest.split_once('<')?.0)))).collect()
}

/// Checks a page, and returns its text and its `figures.json`.
fn checked(folder: &Path, least_pictures: usize, least_figures: usize) -> (String, Value) {
    let html = std::fs::read_to_string(folder.join("index.html")).unwrap();
    for elsewhere in ["http:", "https:", "//", "url(", "<script", "@import"] {
        assert!(!html.contains(elsewhere), "{}: {elsewhere}", folder.display());
    }
    let (pictures, links) = (values(&html, "src"), values(&html, "href"));
    assert!(pictures.len() >= least_pictures, "{pictures:?}");
    for name in pictures.iter().chain(&links).filter(|name| !name.starts_with("data:")) {
        assert!(folder.join(name).metadata().is_ok_and(|file| file.len() > 50), "{}: {name}", folder.display());
    }
    assert_eq!(pictures.len(), values(&html, "alt").iter().filter(|alt| alt.len() > 5).count(), "{html}");
    let shown: HashSet<&str> = pictures.iter().chain(&links).copied().collect();
    for part in ["pictures", "plots"] {
        for file in std::fs::read_dir(folder.join(part)).unwrap() {
            let name = format!("{part}/{}", file.unwrap().file_name().to_string_lossy());
            assert!(shown.contains(name.as_str()), "{name} is not on the page");
            if name.ends_with(".svg") {
                let svg = std::fs::read_to_string(folder.join(&name)).unwrap();
                assert!(!svg.contains("href") && !svg.contains("url(") && svg.contains("</svg>"), "{name}");
            }
        }
    }
    let told: Value = serde_json::from_slice(&std::fs::read(folder.join("figures.json")).unwrap()).unwrap();
    let figures = figures(&html);
    assert!(figures.len() >= least_figures, "{figures:?}");
    for (at, text) in figures {
        let value = told.pointer(&format!("/{at}")).unwrap_or_else(|| panic!("no {at}: {told}"));
        let decimals = text.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        let number = value.as_f64().map_or("\u{2013}".to_owned(), |number| format!("{number:.decimals$}"));
        assert_eq!(text, number, "{at}");
    }
    (html, told)
}

/// One demonstration serves all, since it takes longest.
#[test]
fn demo_and_reports_are_pages() {
    let Folder(folder) = Folder::new("cli_pages", "");
    let path = |name: &str| folder.join(name).display().to_string();
    let small = ["demo", "--identities", "20", "--unseen", "2", "-o"];
    let mut said = json(&[&small[..], &[&path("demo")]].concat());
    let (html, told) = checked(&folder.join("demo"), 40, 30);
    // What is in other folders stays.
    std::fs::create_dir(folder.join("mine")).unwrap();
    std::fs::write(folder.join("mine/index.html"), "mine").unwrap();
    let refused = program::refused(&["demo", "-o", &path("mine")], 1);
    assert!(refused.contains("the folder is not empty, and no earlier demo was left in it"), "{refused}");
    assert!(html.contains("The population is procedural: no person was scanned."));
    let seconds = said.as_object_mut().unwrap().remove("seconds").unwrap();
    assert_eq!(seconds.as_array().unwrap().len(), 6, "{seconds}");
    assert_eq!(said.as_object_mut().unwrap().remove("warnings"), Some(Value::Array(Vec::new())));
    assert_eq!(said, told);
    assert_eq!(told["procedural"], true);
    let error = |name: &str| told[name].as_f64().unwrap();
    let (mean, landmarks, points) =
        (error("unseen_mean_face_error_mm"), error("unseen_landmark_fit_error_mm"), error("unseen_point_fit_error_mm"));
    let scans = error("unseen_scan_fit_error_mm");
    assert!(landmarks < 0.75 * mean && scans < 0.7 * landmarks && points < 0.9 * scans, "{told}");
    for scan in told["scans"].as_array().unwrap() {
        assert_ne!(scan["points"], told["vertices"], "the scan has a topology of its own");
        assert!(scan["subject_vertices"] != told["vertices"] && scan["landmarks"].as_u64().unwrap() >= 6, "{scan}");
    }
    for name in ["face.hab", "faces.png", "mean_smile.glb", "unseen_0_neutral_point_fit.ply", "unseen_1_smile_scan.ply"]
    {
        assert!(folder.join("demo").join(name).metadata().unwrap().len() > 100, "{name}");
    }

    // The same seed, another number of threads than there are cores: the same bytes.
    json(&[&small[..], &[&path("again"), "--threads", "5"]].concat());
    for name in
        ["figures.json", "index.html", "face.hab", "plots/errors.svg", "pictures/unseen_1_error.png", "faces.png"]
    {
        let [first, second] = ["demo", "again"].map(|run| std::fs::read(folder.join(run).join(name)).unwrap());
        assert!(first == second, "{name} differs");
    }

    let [model, scan, marks] = ["face.hab", "unseen_1_smile_scan.ply", "unseen_1_smile_landmarks.txt"]
        .map(|name| path(&format!("demo/{name}")));
    let mut said = json(&["fit", &model, &scan, "--landmarks", &marks, "--report", &path("fit")]);
    let (html, mut told) = checked(&folder.join("fit"), 12, 15);
    assert!(html.contains("nose_tip") && html.contains("unseen_1_smile_scan.ply"));
    assert_eq!(said["report"], path("fit"));
    let own = ["rounds", "vertices", "scan_points"];
    own.iter().for_each(|name| assert!(told.as_object_mut().unwrap().remove(*name).is_some(), "{name}"));
    for name in ["seconds", "output", "parameters", "png", "report", "warnings"] {
        assert!(said.as_object_mut().unwrap().remove(name).is_some(), "{name}");
    }
    assert_eq!(said, told);
    assert_eq!(told["landmarks"].as_array().unwrap().len(), told["landmark_residuals_mm"].as_array().unwrap().len());

    json(&["measure", "model", &model, "--report", &path("file")]);
    let (html, _) = checked(&folder.join("file"), 20, 2);
    assert!(html.contains("Identity weight") && html.contains("no person was scanned"));
    assert!(html.contains("Generalization and specificity are not shown") && html.contains("weight 1 is not shown"));
}

#[test]
fn training_data_are_measured_on_a_page_with_curves() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli_pages_data");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let path = |name: &str| folder.join(name).display().to_string();
    json(&["synth", "faces", "--identities", "5", "--level", "3", "-o", &path("faces")]);
    let (tensor, template) = (path("faces/tensor.npy"), path("faces/template.ply"));
    let measure = ["measure", "model", &tensor, "--dims", "3x3,5x7", "--samples", "20"];
    let said = json(&[&measure[..], &["--report", &path("page"), "--template", &template]].concat());
    let (html, told) = checked(&folder.join("page"), 20, 8);
    assert!(html.contains("plots/specificity.svg") && html.contains("3 \u{d7} 3"));
    assert_eq!(told["specificity_identity"], said["specificity_identity"]);
    // Without triangles points are drawn.
    json(&["measure", "model", &tensor, "--no-curves", "--report", &path("points")]);
    checked(&folder.join("points"), 15, 3);
    let refused = habitus(&[&measure[..], &["--template", &template]].concat());
    assert_eq!(refused.status.code(), Some(2), "--template serves --report alone");
}
