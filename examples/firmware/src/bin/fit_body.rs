//! Stack, code and scratch of the fit of a body to landmarks: shape and posture.
#![no_std]
#![no_main]

use habitus_core::fit::fit_landmarks_req;
use habitus_core::format::Model;
use habitus_core::generator::Generator;
use habitus_core::quantise::F32;
use habitus_firmware::{board, cases, console, entry, include_model};

entry!(run);

fn run() {
    let Ok(model) = Model::open(include_model!("../../models/body.hab")) else { board::exit(1) };
    let Ok(body) = model.skinned::<F32<'_>>() else { board::exit(1) };
    let memory = board::memory();
    let Ok(targets) = cases::targets(&model, &body, 1, memory) else { board::exit(1) };
    let (report, stack) = board::stack_used(|| cases::fitted(&model, &body, &targets, memory));
    let Ok(report) = report else { board::exit(1) };
    console::text("distance of the landmarks, mm: ");
    console::real(report.rms);
    console::text(" after iterations: ");
    console::number(report.iterations);
    console::line("");
    let scratch = fit_landmarks_req(body.identity_dim(), body.pose_dim(), cases::fit_options(&model).frame);
    console::measure("stack", stack);
    console::measure("scratch", scratch.and(body.state_req(true)).f32_bytes() as u32);
    if !(report.rms < 1.0) {
        board::exit(1);
    }
}
