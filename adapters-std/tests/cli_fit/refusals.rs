//! What cannot be fitted is refused with status 1 and a sentence that names the remedy.

use std::path::Path;

use habitus::io::npy;
use habitus::mesh::Mesh;
use habitus_core::format::{Model, SectionId, SectionSource, write, written_len};

use crate::work::{Work, train, work};

fn scan(work: &Work) -> String {
    work.path("scans/scan_00.ply")
}

fn contains(said: &str, parts: &[&str]) {
    parts.iter().for_each(|part| assert!(said.contains(part), "{part:?} in {said}"));
}

#[test]
fn landmarks_that_cannot_place_the_scan_are_refused() {
    let work = work();
    let refused = |file: &str| work.refused("face.hab", &scan(work), file, &[]);
    let all: Vec<usize> = (0..13).collect();
    contains(&refused(&work.labelled("three.txt", &[0, 3, 4])), &["scan_00.ply", "3 landmarks", "at least 4"]);
    contains(
        &refused(&work.text("twelve.txt", &"1 2 3\n".repeat(12))),
        &["twelve.txt", "12 landmarks without names", "the model has 13", "labelled list"],
    );
    let text = std::fs::read_to_string(work.labelled("names.txt", &all)).expect("read");
    let renamed = all.iter().fold(text.clone(), |text, &k| text.replace(&work.landmarks[k].0, &format!("mark{k}")));
    contains(
        &refused(&work.text("names.txt", &renamed)),
        &["none of the landmarks (mark0", "nose_tip", "name them so"],
    );
    let exchanged = text.replace("left", "L").replace("right", "left").replace('L', "right");
    contains(&refused(&work.text("exchanged.txt", &exchanged)), &["left and right", "left is the subject's left"]);
    // One that lies 60 mm off is named.
    let chin = work.landmarks[12].1;
    let off = work.triples("off.txt", |p| if p == chin { [p[0], p[1], p[2] + 60.0] } else { p });
    contains(&refused(&off), &["the landmark chin is", "mark it anew, or leave it out"]);
    // A kilometre off, also one of five.
    let wild = work.triples("wild.txt", |p| if p == chin { [p[0] + 1e6, p[1], p[2]] } else { p });
    contains(&refused(&wild), &["the landmark chin is 1.000e6 mm from where the others", "leave it out"]);
    let five = std::fs::read_to_string(work.labelled("five.txt", &[0, 3, 4, 8, 12])).expect("read");
    let far = five.replace(&format!("{:?} ", chin[0]), &format!("{:?} ", chin[0] + 1e6));
    contains(&refused(&work.text("five.txt", &far)), &["the landmark chin is 1.000e6 mm", "leave it out"]);
    // Eyes of which the corners were exchanged.
    let eyes = text.replace("left_eye", "L").replace("right_eye", "left_eye").replace('L', "right_eye");
    contains(
        &refused(&work.text("eyes.txt", &eyes)),
        &["right_eye_outer and left_eye_outer", "right_eye_inner and left_eye_inner", "seem to be exchanged"],
    );
    // In one place and on a line.
    contains(&refused(&work.triples("place.txt", |_| [1.0; 3])), &["landmarks do not place the scan", "on a line"]);
    contains(&refused(&work.triples("line.txt", |p| [p[0], 0.0, 0.0])), &["landmarks do not place the scan"]);
    // 20 m away, with the right size.
    contains(
        &refused(&work.triples("far.txt", |p| [p[0] + 2e4, p[1], p[2]])),
        &["no point of the scan lies within", "in the frame and unit"],
    );
    // Those of a giant.
    contains(
        &refused(&work.triples("giant.txt", |p| p.map(|x| 5.0 * x))),
        &["the unit of the scan cannot be told", "in inches", "--unit"],
    );
    contains(&refused(&work.path("none.txt")), &["none.txt", "cannot be read"]);
}

#[test]
fn landmark_files_that_do_not_fit_are_refused() {
    let work = work();
    let refused = |file: &str| work.refused("face.hab", &scan(work), file, &[]);
    let n = work.scan.positions.len();
    let json = format!(
        "{{\"landmarks4\": [0, 1, 2, {n}], \"landmarks4_names\": [\"nose_tip\", \"chin\", \"subnasal\", \"left_mouth_corner\"]}}"
    );
    contains(
        &refused(&work.text("beyond.json", &json)),
        &["beyond.json", &format!("left_mouth_corner is vertex {n}"), "is the file for this mesh?"],
    );
    let values: Vec<f64> = work.landmarks.iter().flat_map(|(_, p)| *p).collect();
    let rows = work.path("refused.npy");
    npy::write_f64(&rows, &[1, 13, 3], &values).expect("written");
    contains(&refused(&format!("{rows}:1")), &["refused.npy", "no row 1, the array has 1"]);
    contains(&refused(&rows), &["name one, such as", "refused.npy:0"]);
    let infinite: Vec<f64> = values.iter().enumerate().map(|(k, &x)| if k == 7 { f64::INFINITY } else { x }).collect();
    npy::write_f64(&rows, &[1, 13, 3], &infinite).expect("written");
    contains(
        &refused(&format!("{rows}:0")),
        &["refused.npy: the landmark left_eye_inner is not finite", "leave it out"],
    );
    npy::write_f64(&rows, &[1, 13, 3], &[f64::NAN; 39]).expect("written");
    contains(&refused(&format!("{rows}:0")), &["0 landmarks", "at least 4"]);
    contains(&refused(&work.text("text_nan.txt", "1 2 3\n4 nan 5\n")), &["text_nan.txt, line 2", "\"nan\""]);
}

#[test]
fn scans_that_are_none_are_refused() {
    let work = work();
    let landmarks = work.triples("refusals.txt", |p| p);
    let refused = |scan: &str| work.refused("face.hab", scan, &landmarks, &[]);
    let header =
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    contains(&refused(&work.text("empty.ply", header)), &["empty.ply, line 3", "there is no vertex in it"]);
    contains(&refused(&work.path("none.ply")), &["none.ply", "cannot be read"]);
    contains(&refused(&work.text("scan.xyz", "1 2 3")), &["scan.xyz", "ply"]);
    let nan = header.replace("vertex 0", "vertex 1") + "0 nan 0\n";
    contains(&refused(&work.text("nan.ply", &nan)), &["nan.ply", "habitus clean"]);
    // A ball where the face should be, and a single point.
    let middle = work.landmarks[4].1;
    let ball = (0..4000).map(|k| {
        let (z, turn) = (1.0 - (2 * k + 1) as f64 / 4000.0, 2.399_963 * f64::from(k));
        let r = (1.0 - z * z).sqrt();
        std::array::from_fn(|axis| middle[axis] + 60.0 * [r * turn.cos(), r * turn.sin(), z][axis])
    });
    let said = refused(&work.mesh("ball.ply", &Mesh { positions: ball.collect(), ..Mesh::default() }));
    contains(&said, &["ball.ply", "is it a scan of the model's kind"]);
    let said = refused(&work.mesh("point.ply", &Mesh { positions: vec![middle], ..Mesh::default() }));
    contains(&said, &["point.ply", "1 points of the scan lie within", "too few for a fit"]);
}

#[test]
fn models_without_what_a_fit_needs_are_refused() {
    let work = work();
    let landmarks = work.triples("models.txt", |p| p);
    let folder = work.path("");
    for (without, file, parts) in [
        ("--landmarks", "unmarked.hab", ["no landmarks", "train it with --landmarks"]),
        ("--template", "points.hab", ["no triangles", "train it with --template"]),
    ] {
        train(Path::new(&folder), &[without], file);
        contains(&work.refused(file, &scan(work), &landmarks, &[]), &parts);
    }
    let bytes = std::fs::read(work.path("face.hab")).expect("read");
    let model = Model::open(&bytes).expect("a model");
    let statistics = SectionId::IdentityMean as u32..=SectionId::PosePrecision as u32;
    let sections: Vec<_> = model.sections().iter().filter(|section| !statistics.contains(&section.id)).collect();
    let sources: Vec<_> = sections.iter().map(SectionSource::from_section).collect();
    let mut out = vec![0; written_len(&sources).expect("a length")];
    std::fs::write(work.path("bare.hab"), write(model.header(), &sources, &mut out).expect("written"))
        .expect("written");
    contains(
        &work.refused("bare.hab", &scan(work), &landmarks, &[]),
        &["does not say how its weights are distributed", "train it with this program"],
    );
    contains(&work.refused("scans/scan_00.ply", &scan(work), &landmarks, &[]), &["scan_00.ply"]);
    let body = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/firmware/models/body.hab");
    std::fs::copy(body, work.path("body.hab")).expect("copied");
    contains(
        &work.refused("body.hab", &scan(work), &landmarks, &[]),
        &["body.hab: the model is of the kind Skinned", "bilinear models, which habitus train face makes"],
    );
}

/// Outputs of another kind are refused before the fit, which would be in vain.
#[test]
fn outputs_of_unknown_kinds_are_refused() {
    let work = work();
    let landmarks = work.triples("outputs.txt", |p| p);
    // The model is not even read.
    let refused = |more: &[&str]| work.refused("none.hab", "none.ply", &landmarks, more);
    contains(&refused(&["-o", "fitted.xyz"]), &["fitted.xyz", "ply"]);
    contains(&refused(&["--png", "fit.jpg"]), &["fit.jpg", ".png file"]);
}
