//! All forms of landmarks say the same.

use habitus::io::npy;
use serde_json::json;

use crate::work::work;

/// Every form of all landmarks gives the same vertices, bit for bit, and the right ones.
#[test]
fn every_form_of_landmarks_gives_the_same_fit() {
    let work = work();
    let scan = work.path("scans/scan_00.ply");
    let (object, expected) = work.plain();
    assert!(work.error(expected) < 0.7, "{}", work.error(expected));
    assert_eq!(object["landmarks"].as_array().expect("names").len(), 13);
    assert_eq!(object["landmarks"][4], "nose_tip");
    assert_eq!(object["landmark_residuals_mm"].as_array().expect("numbers").len(), 13);

    let shuffled: Vec<usize> = (0..13).map(|k| (5 * k + 3) % 13).collect();
    let labelled = work.labelled("shuffled.txt", &shuffled);
    let names: Vec<&str> = work.landmarks.iter().map(|(name, _)| &name[..]).collect();
    let vertices = json!({ "landmarks13": work.vertices, "landmarks13_names": names });
    let vertices = work.text("vertices.json", &vertices.to_string());
    let values: Vec<f64> = work.landmarks.iter().flat_map(|(_, p)| *p).collect();
    let (one, rows) = (work.path("one.npy"), work.path("rows.npy"));
    npy::write_f64(&one, &[13, 3], &values).expect("written");
    npy::write_f64(&rows, &[2, 13, 3], &[vec![0.0; 39], values].concat()).expect("written");
    let rows_of = |separator: &str| -> String {
        let row = |(name, p): &(String, [f64; 3])| {
            format!("{name}{separator}{:?}{separator}{:?}{separator}{:?}\n", p[0], p[1], p[2])
        };
        work.landmarks.iter().map(row).collect()
    };
    let spaced = work.text("spaced.txt", &rows_of(" "));
    let csv = work.text("commas.csv", &format!("name,x,y,z\n{}", rows_of(",").replace("_", " ")));
    let by_name: serde_json::Map<String, serde_json::Value> =
        work.landmarks.iter().map(|(name, p)| (name.clone(), json!(p))).collect();
    let by_name = work.text("by_name.json", &json!(by_name).to_string());
    let list = work.text("list.json", &json!(work.vertices).to_string());
    for form in [labelled, vertices, one, format!("{rows}:1"), spaced, csv, by_name, list] {
        let (same, vertices) = work.fitted(&scan, &form, &[]);
        assert_eq!(vertices, *expected, "{form}");
        assert_eq!(same["landmark_residuals_mm"], object["landmark_residuals_mm"], "{form}");
    }
}

/// A label that is not there and a row of NaN say the same: not marked.
#[test]
fn missing_landmarks_are_left_out_in_every_form() {
    let work = work();
    let scan = work.path("scans/scan_00.ply");
    let missing = [1, 4, 8, 12];
    let there: Vec<usize> = (0..13).filter(|k| !missing.contains(k)).collect();
    let labelled = work.labelled("missing.txt", &there);
    let (object, expected) = work.fitted(&scan, &labelled, &[]);
    assert!(work.error(&expected) < 0.7, "{}", work.error(&expected));
    let names: Vec<&str> = there.iter().map(|&k| &work.landmarks[k].0[..]).collect();
    assert_eq!(object["landmarks"], json!(names));
    let entry = |k: usize| if missing.contains(&k) { [f64::NAN; 3] } else { work.landmarks[k].1 };
    let values: Vec<f64> = (0..13).flat_map(entry).collect();
    let rows = work.path("missing.npy");
    npy::write_f64(&rows, &[1, 13, 3], &values).expect("written");
    assert_eq!(work.fitted(&scan, &format!("{rows}:0"), &[]).1, expected);
}

/// Landmarks that the model does not know are named, and change nothing.
#[test]
fn unknown_names_are_passed_over_with_a_warning() {
    let work = work();
    let scan = work.path("scans/scan_00.ply");
    let all: Vec<usize> = (0..13).collect();
    let text = std::fs::read_to_string(work.labelled("unknown.txt", &all)).expect("read");
    let more = format!("{}left_ear\n1 2 3\n", text.replacen("13", "14", 1));
    let (object, vertices) = work.fitted(&scan, &work.text("unknown.txt", &more), &[]);
    assert_eq!(vertices, work.plain().1);
    assert!(object["warnings"][0].as_str().expect("text").contains("left_ear"), "{}", object["warnings"]);
}
