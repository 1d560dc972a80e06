//! Stack, code and scratch of the fit of the first two levels of a wavelet model to landmarks.
#![no_std]
#![no_main]

use habitus_core::fit::fit_wavelet_req;
use habitus_core::format::Model;
use habitus_core::quantise::F32;
use habitus_firmware::{board, cases, console, entry, include_model};

entry!(run);

fn run() {
    let Ok(model) = Model::open(include_model!("../../models/wavelet.hab")) else { board::exit(1) };
    let Ok(generator) = model.wavelet::<F32<'_>>() else { board::exit(1) };
    let memory = board::memory();
    let Ok(targets) = cases::targets(&model, &generator, 1, memory) else { board::exit(1) };
    let (report, stack) = board::stack_used(|| cases::wavelet_fitted(&model, &generator, &targets, 2, memory));
    let Ok(report) = report else { board::exit(1) };
    console::text("distance of the landmarks, mm: ");
    console::real(report.start_rms);
    console::text(", after the fit ");
    console::real(report.rms);
    console::line("");
    let landmarks = model.landmarks().map_or(0, |landmarks| landmarks.len());
    console::measure("stack", stack);
    console::measure("scratch", fit_wavelet_req(&generator, landmarks, &(0..2)).f32_bytes() as u32);
    if !(report.rms < 0.5 * report.start_rms) {
        board::exit(1);
    }
}
