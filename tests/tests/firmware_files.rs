//! The files that the firmware carries: small models of every kind and storage, and what a host computes from them.
//!
//! After a change that is meant to alter them, `HABITUS_BLESS=1 cargo test --test firmware_files` writes them
//! again; the firmware then shows whether the other target agrees.

use habitus::io::model::quantise;
use habitus_core::format::{ElementType, Model};
use habitus_core::generator::any::AnyGenerator;
use habitus_tests::{small_body, small_linear, small_model, small_wavelet};
use std::path::Path;

#[path = "../../examples/firmware/src/cases.rs"]
#[allow(dead_code)]
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

/// The small models by name.
fn models() -> [(&'static str, Vec<u8>); 4] {
    [
        ("small", small_model::bytes()),
        ("linear", small_linear::bytes()),
        ("body", small_body::bytes()),
        ("wavelet", small_wavelet::bytes()),
    ]
}

#[test]
fn the_firmware_carries_the_small_models_and_means_of_this_host() {
    for (name, bytes) in models() {
        check(&format!("{name}.hab"), &bytes);
        check(&format!("{name}.mean"), &mean(&bytes).to_le_bytes());
        for (storage, element) in [("f16", ElementType::F16), ("i8", ElementType::I8)] {
            let model = Model::open(&bytes).expect("the model opens");
            let (bytes, _) = quantise(&model, element).expect("it can be quantised");
            check(&format!("{name}-{storage}.hab"), &bytes);
            check(&format!("{name}-{storage}.mean"), &mean(&bytes).to_le_bytes());
        }
    }
}

/// What the programs that open a model compare with.
fn mean(bytes: &[u8]) -> f32 {
    let generator = Model::open(bytes).and_then(|model| model.generator()).expect("the model opens");
    cases::mean_by_ranges(&generator, &mut vec![0.0; 1 << 16]).expect("it evaluates")
}

/// The fits that the firmware measures, on the host: they find the shapes that the landmarks were taken from.
#[test]
fn the_measured_fits_find_their_shapes() {
    for (name, bytes) in models() {
        let model = Model::open(&bytes).expect("the model opens");
        let generator = model.generator().expect("it has a generator");
        let mut memory = vec![0.0; 1 << 16];
        let targets = cases::targets(&model, &generator, 1, &mut memory).expect("it has landmarks");
        let rms = if let AnyGenerator::WaveletF32(generator) = generator {
            let report = cases::wavelet_fitted(&model, &generator, &targets, 2, &mut memory).expect("it fits");
            assert!(report.rms < 0.5 * report.start_rms, "{report:?}");
            report.rms
        } else {
            let report = cases::fitted(&model, &generator, &targets, &mut memory).expect("it fits");
            assert!(report.rms < 0.2 && report.iterations < 60, "{name}: {report:?}");
            report.rms
        };
        println!("{name}: {rms} mm");
    }
}
