//! Stack, code and scratch of the landmark fit.
#![no_std]
#![no_main]

use habitus_core::fit::fit_landmarks_req;
use habitus_core::format::Model;
use habitus_firmware::{board, cases, console, entry, include_model};

entry!(run);

fn run() {
    let bytes = include_model!("../../models/small.hab");
    let Ok(model) = Model::open(bytes) else { board::exit(1) };
    let Ok(generator) = model.bilinear() else { board::exit(1) };
    let memory = board::memory();
    let Ok(targets) = cases::targets(&model, &generator, 1, memory) else { board::exit(1) };
    let (report, stack) = board::stack_used(|| cases::fitted(&model, &generator, &targets, memory));
    let Ok(report) = report else { board::exit(1) };
    console::text("distance of the landmarks, mm: ");
    console::real(report.rms);
    console::text(" after iterations: ");
    console::number(report.iterations);
    console::line("");
    console::measure("stack", stack);
    console::measure("scratch", fit_landmarks_req(4, 3, cases::fit_options(&model).frame).f32_bytes() as u32);
    // The targets are the model's own: what is left comes from the priors.
    if !(report.rms < 1.0) {
        board::exit(1);
    }
}
