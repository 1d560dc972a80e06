//! Instructions of an evaluation, per vertex, and of a fit, per iteration: every kind and storage. Needs `-icount shift=6` of QEMU.
#![no_std]
#![no_main]

use core::hint::black_box;
use habitus_core::Error;
use habitus_core::format::Model;
use habitus_core::generator::wavelet::{Multiscale, Stored};
use habitus_core::generator::{Generator, LANES, NUMBERS};
use habitus_core::quantise::{F16, F32, I8, Storage};
use habitus_core::workspace::Workspace;
use habitus_firmware::{board, cases, console, entry, include_model};

entry!(run);

fn run() {
    if !is_counted() {
        console::line("time is not that of instructions: run it with -icount shift=6");
        board::exit(1);
    }
    let memory = board::memory();
    let counted = summed::<F32<'_>>(
        "f32",
        include_model!("../../models/small.hab"),
        include_model!("../../models/linear.hab"),
        memory,
    )
    .and_then(|()| {
        summed::<F16<'_>>(
            "f16",
            include_model!("../../models/small-f16.hab"),
            include_model!("../../models/linear-f16.hab"),
            memory,
        )
    })
    .and_then(|()| {
        summed::<I8<'_>>(
            "i8",
            include_model!("../../models/small-i8.hab"),
            include_model!("../../models/linear-i8.hab"),
            memory,
        )
    })
    .and_then(|()| body::<F32<'_>>("f32", include_model!("../../models/body.hab"), memory))
    .and_then(|()| body::<F16<'_>>("f16", include_model!("../../models/body-f16.hab"), memory))
    .and_then(|()| body::<I8<'_>>("i8", include_model!("../../models/body-i8.hab"), memory))
    .and_then(|()| wavelet::<F32<'_>>("f32", include_model!("../../models/wavelet.hab"), memory))
    .and_then(|()| wavelet::<F16<'_>>("f16", include_model!("../../models/wavelet-f16.hab"), memory))
    .and_then(|()| wavelet::<I8<'_>>("i8", include_model!("../../models/wavelet-i8.hab"), memory));
    if let Err(error) = counted {
        console::text("error ");
        console::number(error.code() as u32);
        console::line("");
        board::exit(1);
    }
}

/// Whether loops of three lengths take what instructions take: the same for each turn.
fn is_counted() -> bool {
    let turns = |count: u32| {
        let ((), taken) = board::instructions(|| (0..count).for_each(|turn| _ = black_box(turn)));
        taken
    };
    let [one, two, three] = [turns(1600), turns(3200), turns(4800)];
    one >= 1600 && two.wrapping_sub(one) == three.wrapping_sub(two)
}

fn summed<'a, S: Storage<'a>>(
    storage: &str,
    bilinear: &'a [u8],
    linear: &'a [u8],
    memory: &mut [f32],
) -> Result<(), Error> {
    let model = Model::open(bilinear)?;
    let generator = model.bilinear_in::<S>()?;
    evaluation(["bilinear", storage], &generator, &generator, memory)?;
    fit(["bilinear", storage], &model, &generator, memory)?;
    let model = Model::open(linear)?;
    let generator = model.linear::<S>()?;
    evaluation(["linear", storage], &generator, &generator, memory)?;
    fit(["linear", storage], &model, &generator, memory)
}

fn body<'a, S: Storage<'a>>(storage: &str, bytes: &'a [u8], memory: &mut [f32]) -> Result<(), Error> {
    let model = Model::open(bytes)?;
    let generator = model.skinned::<S>()?;
    evaluation(["skinned", storage], &generator, &generator, memory)?;
    fit(["skinned", storage], &model, &generator, memory)
}

fn wavelet<'a, S: Storage<'a>>(storage: &str, bytes: &'a [u8], memory: &mut [f32]) -> Result<(), Error> {
    let model = Model::open(bytes)?;
    let generator: Multiscale<Stored<'a, S>> = model.wavelet::<S>()?;
    // Derivatives are dense: by the weights of level 0 alone.
    let coarse = generator.with_levels(0, generator.whole_grid().levels())?;
    evaluation(["wavelet", storage], &generator, &coarse, memory)?;
    let targets = cases::targets(&model, &generator, 1, memory)?;
    let (report, taken) = board::instructions(|| cases::wavelet_fitted(&model, &generator, &targets, 2, memory));
    report_count(["wavelet", storage], "pass", taken, report?.passes);
    Ok(())
}

/// Counts what begins an evaluation, the value of a vertex, and the value with the derivatives by all weights of `linearised`; of whole blocks.
fn evaluation<G: Generator>(name: [&str; 2], generator: &G, linearised: &G, memory: &mut [f32]) -> Result<(), Error> {
    let (at, _) = cases::begun(generator, 1.0, false, memory)?;
    let mut range = [0.0; 3 * cases::RANGE];
    let vertices = (generator.vertex_count() / LANES * LANES).min(cases::RANGE);
    let out = range.get_mut(..3 * vertices).ok_or(Error::Empty)?;
    let (result, taken) = board::instructions(|| generator.evaluate_at(at, 0..vertices, out));
    result?;
    report_count(name, "value", taken, vertices as u32);

    let (at, rest) = cases::begun(linearised, 1.0, true, memory)?;
    let mut pieces = Workspace::new(rest);
    let jacobian = pieces.take(NUMBERS * linearised.dim())?;
    let mut value = [0.0; NUMBERS];
    let (result, taken) = board::instructions(|| linearised.linearise_at(at, 0..1, &mut value, jacobian));
    result?;
    report_count(name, "linearised", taken, LANES as u32);
    if generator.state_req(false).numbers() > 0 {
        let (begun, taken) = board::instructions(|| cases::begun(generator, 1.0, false, memory).map(|_| ()));
        begun?;
        report_count(name, "begin", taken, 1);
    }
    Ok(())
}

fn fit(name: [&str; 2], model: &Model<'_>, generator: &impl Generator, memory: &mut [f32]) -> Result<(), Error> {
    let targets = cases::targets(model, generator, 1, memory)?;
    let (report, taken) = board::instructions(|| cases::fitted(model, generator, &targets, memory));
    report_count(name, "iteration", taken, report?.iterations);
    Ok(())
}

/// Prints the instructions of one of so many, rounded.
fn report_count([kind, storage]: [&str; 2], what: &str, taken: u32, of: u32) {
    console::text("@count_");
    for part in [kind, "_", storage, "_"] {
        console::text(part);
    }
    console::text(what);
    console::text(" ");
    console::number((taken + of / 2) / of.max(1));
    console::line("");
}
