//! What half precision and bytes cost a model: faces of the shared tensor, bodies, and wavelet models of procedural faces, over the 200 seeded shapes of
//! `quantise`.
//!
//! The bounds are what was measured (`docs/numerics.md`), with a tenth more: training is not the same bits everywhere, and the figures have two
//! digits or three.

use habitus::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use habitus::face::training_data;
use habitus::io::model::{ModelSource, QuantisationError, hab, quantise};
use habitus_core::format::{ElementType, Model};
use habitus_core::wavelet::Wavelet;
use habitus_tests::models::{body, wavelet};

/// Mean, root mean square and largest distance of a vertex, mm.
type Cost = [f64; 3];

/// Costs of f16 and i8.
fn costs(what: &str, file: &[u8]) -> [Cost; 2] {
    let model = Model::open(file).unwrap();
    [ElementType::F16, ElementType::I8].map(|element| {
        let (small, QuantisationError { mean_mm, rms_mm, largest_mm }) = quantise(&model, element).unwrap();
        println!(
            "| {what} | {element:?} | {mean_mm:.4} | {rms_mm:.4} | {largest_mm:.4} | {} | {} |",
            file.len(),
            small.len()
        );
        [mean_mm, rms_mm, largest_mm]
    })
}

fn assert_within(costs: [Cost; 2], measured: [Cost; 2]) {
    for (cost, measured) in costs.iter().flatten().zip(measured.iter().flatten()) {
        assert!(*cost <= 1.1 * measured, "{cost} mm, measured was {measured} mm");
        // A cost of nothing would mean that a model is compared with itself.
        assert!(*cost > 0.5 * measured, "{cost} mm, measured was {measured} mm");
    }
}

/// The shared tensor with 40 identity and 10 expression weights.
#[test]
fn faces() {
    let Some(data) = habitus_tests::data::dir_or_skip("quantised faces") else { return };
    let tensor = training_data::tensor(&data.join("faces/tensor_train.npy")).unwrap();
    let options = HosvdOptions { identity: ModeSize::Dimension(40), expression: ModeSize::Dimension(10), hooi: None };
    let model = hosvd(&tensor, &options).unwrap().model;
    let file = hab::bytes(&ModelSource::of_multilinear(&model)).unwrap();
    assert_within(
        costs("faces of the shared tensor, 40 x 10", &file),
        [[0.0014, 0.0019, 0.0216], [0.0126, 0.0172, 0.1611]],
    );
}

/// The developer's bodies of 20 and of 100 components: at most 0.06 mm on average and 0.55 mm anywhere in bytes.
#[test]
fn bodies() {
    let Some(data) = habitus_tests::data::dir_or_skip("quantised bodies") else { return };
    for dim in [20, 100] {
        let [half, bytes] = costs(&format!("body of {dim} components"), &body::file(&data, dim).unwrap());
        for [mean, _, largest] in [half, bytes] {
            assert!(mean > 0.0 && mean <= 0.06 && largest <= 0.55, "{dim} components: {mean} and {largest} mm");
        }
        assert!(half[0] < 0.5 * bytes[0]);
    }
}

/// The developer's models of 40 people, 3 x 3 weights for each of 24 897 coefficients.
#[test]
#[ignore = "long in a debug build"]
fn wavelets() {
    let measured = |kind| costs(&format!("{kind:?} wavelets of procedural faces"), &wavelet::file(40, kind).unwrap());
    let (cubic, bilinear) = (measured(Wavelet::Cubic), measured(Wavelet::Bilinear));
    assert_within(cubic, [[0.0018, 0.0022, 0.0183], [0.0398, 0.0497, 0.6450]]);
    assert_within(bilinear, [[0.0010, 0.0014, 0.0280], [0.0161, 0.0207, 0.2706]]);
}
