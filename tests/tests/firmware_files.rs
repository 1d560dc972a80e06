//! The files that the firmware carries: the small model, and what a host computes from it; and the small body and the wavelet model of the examples.
//!
//! After a change that is meant to alter them, `HABITUS_BLESS=1 cargo test --test firmware_files` writes them
//! again; the firmware then shows whether the other target agrees.

use habitus_core::fit::{fit_landmarks, fit_landmarks_req};
use habitus_core::format::Model;
use habitus_core::rotation::similarity::Similarity;
use habitus_tests::{small_body, small_model, small_wavelet};
use std::path::Path;

#[path = "../../examples/firmware/src/cases.rs"]
mod cases;

fn check(name: &str, bytes: &[u8]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/firmware/models").join(name);
    if std::env::var_os("HABITUS_BLESS").is_some() {
        std::fs::write(&path, bytes).expect("the file can be written");
    }
    let known = std::fs::read(&path).expect("the file is part of the project");
    let first = known.iter().zip(bytes).position(|(a, b)| a != b);
    assert!(known == bytes, "{name} differs, first at {first:?}; {} bytes, {} expected", bytes.len(), known.len());
}

#[test]
fn the_firmware_carries_the_small_model() {
    check("small.hab", &small_model::bytes());
}

#[test]
fn the_examples_pose_the_small_body() {
    check("body.hab", &small_body::bytes());
}

#[test]
fn the_examples_fit_the_small_wavelet_model() {
    check("wavelet.hab", &small_wavelet::bytes());
}

#[test]
fn the_firmware_expects_the_mean_of_this_host() {
    let bytes = small_model::bytes();
    let generator = Model::open(&bytes).and_then(|model| model.bilinear()).expect("the model opens");
    let mean = cases::mean_by_ranges(&generator, &mut [0.0; 3 * 64]).expect("it evaluates");
    check("small.mean", &mean.to_le_bytes());
}

/// The fit that the firmware measures, on the host: it finds the face that the landmarks were taken from.
#[test]
fn the_measured_fit_finds_its_face() {
    let bytes = small_model::bytes();
    let model = Model::open(&bytes).expect("the model opens");
    let generator = model.bilinear().expect("it is bilinear");
    let targets: [_; cases::LANDMARKS] = cases::targets(&model, &generator);
    let options = cases::fit_options(&model);
    let (mut identity, mut pose, mut placement) = ([0.0; 4], [0.0; 3], Similarity::IDENTITY);
    let mut memory = vec![0.0; fit_landmarks_req(4, 3, options.frame).numbers()];
    let report =
        fit_landmarks(&model, &generator, &targets, &options, &mut identity, &mut pose, &mut placement, &mut memory)
            .expect("it fits");
    assert!(report.rms < 0.2 && report.iterations < 20, "{report:?}");
}
