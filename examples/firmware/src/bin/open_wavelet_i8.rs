//! Stack and code of "open a wavelet model stored in bytes, evaluate it by ranges".
#![no_std]
#![no_main]

use habitus_core::format::Model;
use habitus_core::quantise::I8;
use habitus_firmware::{entry, include_model, measured};

entry!(run);

fn run() {
    let bytes = include_model!("../../models/wavelet-i8.hab");
    measured::open_evaluate(bytes, include_model!("../../models/wavelet-i8.mean"), Model::wavelet::<I8<'_>>);
}
