//! Stack and code of "open a bilinear model, evaluate it by ranges".
#![no_std]
#![no_main]

use habitus_core::format::Model;
use habitus_core::quantise::F32;
use habitus_firmware::{entry, include_model, measured};

entry!(run);

fn run() {
    let bytes = include_model!("../../models/small.hab");
    measured::open_evaluate(bytes, include_model!("../../models/small.mean"), Model::bilinear_in::<F32<'_>>);
}
