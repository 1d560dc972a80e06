//! Models of full size in PSRAM, evaluated and fitted in 64 KiB: a body of 6404 vertices and 20 components by ranges, a face of 30 + 7 weights fitted
//! to 13 landmarks, the first two levels of a wavelet model fitted likewise. Built where the developer's models are (feature `large`).
#![no_std]
#![no_main]

use habitus_core::Error;
use habitus_core::fit::{fit_landmarks_req, fit_wavelet_req};
use habitus_core::format::Model;
use habitus_core::generator::Generator;
use habitus_core::quantise::F32;
use habitus_firmware::{board, cases, console, entry, include_model};

entry!(run);

/// A file of the folder that the variable `HABITUS_MODELS` names when this is compiled.
macro_rules! developers {
    ($name:literal) => {
        include_model!(concat!(env!("HABITUS_MODELS"), "/", $name))
    };
}

fn run() {
    let memory = board::memory();
    if let Err(error) = body(memory).and_then(|()| face(memory)).and_then(|()| wavelet(memory)) {
        console::text("error ");
        console::number(error.code() as u32);
        console::line("");
        board::exit(1);
    }
}

/// The body by ranges: the mean of all coordinates is a host's, bit by bit.
fn body(memory: &mut [f32]) -> Result<(), Error> {
    let model = Model::open(developers!("body20.hab"))?;
    let body = model.skinned::<F32<'_>>()?;
    let ((mean, taken), stack) = board::stack_used(|| board::instructions(|| cases::mean_by_ranges(&body, memory)));
    say("body, vertices: ", body.vertex_count());
    say("components: ", body.identity_dim());
    console::text("mean of x + y + z, mm: ");
    expect(mean?, *developers!("body20.mean"));
    console::measure("count_body_vertex", taken / (body.vertex_count() as u32).max(1));
    console::measure("stack_body", stack);
    console::measure("scratch_body", 4 * (body.dim() + body.state_req(false).numbers()) as u32);
    Ok(())
}

/// The face fitted: the distance that is left is a host's.
fn face(memory: &mut [f32]) -> Result<(), Error> {
    let model = Model::open(developers!("face30.hab"))?;
    let face = model.bilinear()?;
    let targets = cases::targets(&model, &face, 0, memory)?;
    let ((report, taken), stack) =
        board::stack_used(|| board::instructions(|| cases::fitted(&model, &face, &targets, memory)));
    let report = report?;
    say("face, identity weights: ", face.identity_dim());
    say("expression weights: ", face.pose_dim());
    say("landmarks: ", targets.iter().flatten().count());
    say("iterations: ", report.iterations as usize);
    console::text("distance of the landmarks after the fit, mm: ");
    expect(report.rms, *developers!("face30.rms"));
    let scratch = fit_landmarks_req(face.identity_dim(), face.pose_dim(), cases::fit_options(&model).frame);
    console::measure("count_face_iteration", taken / report.iterations.max(1));
    console::measure("stack_face", stack);
    console::measure("scratch_face", scratch.f32_bytes() as u32);
    Ok(())
}

/// Levels 0 and 1 of the wavelet model fitted; with every further level the memory runs out at some point, and the error says how much is wanted.
fn wavelet(memory: &mut [f32]) -> Result<(), Error> {
    let model = Model::open(developers!("face-cubic.hab"))?;
    let whole = model.wavelet::<F32<'_>>()?;
    let landmarks = model.landmarks().map_or(0, |landmarks| landmarks.len());
    say("wavelet model, vertices: ", whole.vertex_count());
    let targets = cases::measured(developers!("face-cubic.landmarks"));
    let ((report, taken), stack) =
        board::stack_used(|| board::instructions(|| cases::wavelet_fitted(&model, &whole, &targets, 2, memory)));
    let report = report?;
    console::text("distance of the landmarks, mm: ");
    console::real(report.start_rms);
    console::text(", after the fit of levels 0 and 1 ");
    expect(report.rms, *developers!("face-cubic.rms"));
    console::measure("count_wavelet_pass", taken / report.passes.max(1));
    console::measure("stack_wavelet", stack);
    console::measure("scratch_wavelet", fit_wavelet_req(&whole, landmarks, &(0..2)).f32_bytes() as u32);
    for levels in 2..=whole.whole_grid().levels() + 1 {
        let need = cases::wavelet_need(&whole, landmarks, levels)?;
        console::text("levels: ");
        console::number(levels as u32);
        say(", bytes for weights and scratch: ", 4 * need);
        // The fit says so, too.
        let fits = match cases::wavelet_fitted(&model, &whole, &targets, levels, memory) {
            Ok(_) => true,
            Err(Error::WorkspaceTooSmall { .. }) => false,
            Err(error) => return Err(error),
        };
        if fits != (need <= memory.len()) {
            console::line("the fit wants another amount");
            board::exit(1);
        }
    }
    Ok(())
}

/// Prints a number and ends the program when it is not a host's.
fn expect(found: f32, bits: [u8; 4]) {
    console::real(found);
    console::line("");
    if found.to_le_bytes() != bits {
        console::line("another result than the host's");
        board::exit(1);
    }
}

fn say(what: &str, count: usize) {
    console::text(what);
    console::number(count as u32);
    console::line("");
}
