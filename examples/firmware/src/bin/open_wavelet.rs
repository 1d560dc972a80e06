//! Stack and code of "open a wavelet model, evaluate it by ranges".
#![no_std]
#![no_main]

use habitus_core::format::Model;
use habitus_core::quantise::F32;
use habitus_firmware::{entry, include_model, measured};

entry!(run);

fn run() {
    let bytes = include_model!("../../models/wavelet.hab");
    measured::open_evaluate(bytes, include_model!("../../models/wavelet.mean"), Model::wavelet::<F32<'_>>);
}
