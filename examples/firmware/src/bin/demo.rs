//! A complete small program to copy: a face model in flash is opened, evaluated piece by piece, and fitted to
//! landmarks. No heap; the only buffers are the ones seen here.
#![no_std]
#![no_main]

use habitus_core::Error;
use habitus_core::fit::{FitOptions, Frame, fit_landmarks};
use habitus_core::format::{Mode, Model};
use habitus_core::generator::{Generator, Weights};
use habitus_core::prior::Prior;
use habitus_core::rotation::similarity::Similarity;
use habitus_core::solve::levenberg_marquardt::Limits;
use habitus_firmware::{board, console, entry, include_model};

entry!(run);

/// The weights of the model below, fixed when the program is compiled so that arrays can hold them.
const IDENTITY: usize = 6;
const EXPRESSION: usize = 4;
const LANDMARKS: usize = 13;

fn run() {
    if let Err(error) = demo() {
        console::text("error ");
        console::number(error.code() as u32);
        console::line("");
        board::exit(1);
    }
}

fn demo() -> Result<(), Error> {
    // 1. Open the file where it lies: checked once, nothing is copied.
    let model = Model::open(include_model!("../../models/face.hab"))?;
    let face = model.bilinear()?;
    say("vertices: ", face.vertex_count());
    say("identity weights: ", face.identity_dim());
    say("expression weights: ", face.pose_dim());

    // 2. Evaluate it 64 vertices at a time: the whole mesh never has to fit into memory.
    let weights = Weights { identity: &[0.20, -0.13, 0.05, 0.08, -0.04, 0.10], pose: &[0.35, -0.30, 0.20, 0.10] };
    let (mut piece, mut lowest, mut highest) = ([0.0; 3 * 64], f32::MAX, f32::MIN);
    let mut from = 0;
    while from < face.vertex_count() {
        let to = (from + 64).min(face.vertex_count());
        let Some(out) = piece.get_mut(..3 * (to - from)) else { break };
        face.evaluate(weights, from..to, out)?;
        for [_, y, _] in out.as_chunks::<3>().0 {
            (lowest, highest) = (lowest.min(*y), highest.max(*y));
        }
        from = to;
    }
    console::text("height of this face, mm: ");
    console::real(highest - lowest);
    console::line("");

    // 3. Measure its landmarks somewhere else in space, as a camera would...
    let camera = Similarity::IDENTITY.moved([0.1, 0.4, -0.2], [25.0, -40.0, 600.0], 0.0);
    let mut measured = [None; LANDMARKS];
    let at = face.begin(weights, false, &mut [])?;
    for (position, vertex) in measured.iter_mut().zip(model.landmarks().iter().flat_map(|all| all.iter())) {
        *position = face.vertex_unchecked(at, vertex as usize).map(|point| camera.applied(point));
    }

    // 4. ... and find weights and placement again from them alone.
    let prior = |mode| model.gaussian(mode).map_or(Prior::None, |gaussian| Prior::Gaussian(gaussian, 1.0));
    let options = FitOptions {
        frame: Frame::Rigid,
        place: true,
        identity_prior: prior(Mode::Identity),
        pose_prior: prior(Mode::Pose),
        noise: 0.2,
        limits: Limits::default(),
    };
    let (mut identity, mut expression) = ([0.0; IDENTITY], [0.0; EXPRESSION]);
    let mut placement = Similarity::IDENTITY;
    let memory = board::memory();
    let report =
        fit_landmarks(&model, &face, &measured, &options, &mut identity, &mut expression, &mut placement, memory)?;
    console::text("distance of the landmarks after the fit, mm: ");
    console::real(report.rms);
    console::line("");
    say("iterations: ", report.iterations as usize);
    console::text("identity found:");
    identity.iter().for_each(show);
    console::text("\nexpression found:");
    expression.iter().for_each(show);
    console::line("");
    Ok(())
}

fn show(weight: &f32) {
    console::text(" ");
    console::real(*weight);
}

fn say(what: &str, count: usize) {
    console::text(what);
    console::number(count as u32);
    console::line("");
}
