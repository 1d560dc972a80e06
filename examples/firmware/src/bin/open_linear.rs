//! Stack and code of "open a linear model, evaluate it by ranges".
#![no_std]
#![no_main]

use habitus_core::format::Model;
use habitus_core::quantise::F32;
use habitus_firmware::{entry, include_model, measured};

entry!(run);

fn run() {
    let bytes = include_model!("../../models/linear.hab");
    measured::open_evaluate(bytes, include_model!("../../models/linear.mean"), Model::linear::<F32<'_>>);
}
