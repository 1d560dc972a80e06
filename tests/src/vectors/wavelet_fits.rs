//! Fits of wavelet models by levels.

use super::fit::{Kind, everywhere, placement, sample_fields, start, word};
use super::models::Models;
use super::text::{Case, File};
use super::wavelet_models::WaveModel;
use crate::reference::normal_equations::{Frame, Sample};
use crate::reference::placement::Placement;
use crate::reference::wavelet_fit::{Options, fit};

pub fn fits(file: &mut File, models: &Models) {
    let [halves, many] = ["wave_45_f16", "wave_81_i8"].map(|name| models.wave(name));
    let (coarse, fine, few) = (many.at_levels(1, 2), many.at_levels(0, 1), halves.at_levels(1, 2));
    let every = |step: usize, wave: &WaveModel| -> Vec<Option<Sample>> {
        of_vertices(wave).into_iter().step_by(step).collect()
    };
    let start = Placement::identity();
    for (wave, what, samples, frame, [identity, pose], kappa, omega, levels, passes, from) in [
        (&coarse, "landmarks", every(7, &coarse), Frame::Similarity, [true, true], 1.0, 0.0, 0..2, 2, start),
        (&coarse, "pulled", every(7, &coarse), Frame::Rigid, [true, true], f32::INFINITY, 0.5, 0..1, 3, start),
        (&coarse, "points", every(3, &coarse), Frame::Fixed, [true, true], 0.5, 0.01, 1..2, 1, placement()),
        (&fine, "normals", with_normals(&fine), Frame::Fixed, [true, false], 1.5, 0.1, 0..1, 2, placement()),
        (halves, "pose", every(3, halves), Frame::Rigid, [false, true], 2.0, 0.05, 0..3, 1, start),
        (&few, "identity", every(7, &few), Frame::Similarity, [true, false], 0.25, 0.0, 0..2, 1, start),
    ] {
        let spread = |mode: usize, free: bool| wave.spreads[mode].as_ref().filter(|_| free);
        let options = Options { frame, spreads: [spread(0, identity), spread(1, pose)], kappa, omega, levels, passes };
        fitted(file, wave, what, &samples, &options, &from);
    }
    refusals(file, &fine);
}

/// A shape of the model, moved, with noise, at every vertex but one.
fn of_vertices(wave: &WaveModel) -> Vec<Option<Sample>> {
    let mut samples = everywhere(&wave.model, Kind::Vertices);
    samples[3] = None;
    samples
}

/// The same with the distances along normals alone, here and there.
fn with_normals(wave: &WaveModel) -> Vec<Option<Sample>> {
    let normals = everywhere(&wave.model, Kind::Normals);
    let points = of_vertices(wave);
    normals
        .into_iter()
        .zip(points)
        .enumerate()
        .map(|(k, (normal, point))| if k % 3 == 0 { point } else { normal })
        .collect()
}

/// Weights at their means.
fn means(wave: &WaveModel) -> [Vec<f32>; 2] {
    let (di, dp) = wave.model.generator.dims();
    let mean = |mode: usize, dim: usize| {
        wave.spreads[mode].as_ref().map_or(vec![0.0; dim], |spread| spread.mean[..dim].to_vec())
    };
    [mean(0, di), mean(1, dp)]
}

fn begun<'f>(
    file: &'f mut File,
    wave: &WaveModel,
    what: &str,
    samples: &[Option<Sample>],
    options: &Options<'_>,
    from: &Placement<f32>,
) -> Case<'f> {
    let [x, y] = means(wave);
    let name = format!("{}_{what}_{}", wave.model.label(), word(options.frame));
    let mut case = start(file, "fit_wavelet", &wave.model, &name, &x, &y, options.frame, from);
    sample_fields(&mut case, samples);
    case.integers("free", options.spreads.map(|spread| u32::from(spread.is_some())))
        .number("kappa", options.kappa)
        .number("omega", options.omega)
        .integers("fitted_levels", [options.levels.start as u32, options.levels.end as u32])
        .integer("passes", options.passes as usize);
    case
}

fn fitted(
    file: &mut File,
    wave: &WaveModel,
    what: &str,
    samples: &[Option<Sample>],
    options: &Options<'_>,
    from: &Placement<f32>,
) {
    let [x, y] = means(wave);
    let found = fit(&wave.multiscale, samples, options, &x, &y, from).expect("points that determine the placement");
    begun(file, wave, what, samples, options, from)
        .integers("passes_reached", [found.passes, found.reached])
        .numbers("rms_start", &[found.rms, found.start_rms])
        .numbers("identity_fitted", &found.identity)
        .numbers("pose_fitted", &found.pose)
        .numbers("placement_fitted", &found.placement.numbers());
}

fn refusals(file: &mut File, wave: &WaveModel) {
    let few: Vec<Option<Sample>> = of_vertices(wave).into_iter().step_by(5).collect();
    let good = Options {
        frame: Frame::Rigid,
        spreads: [wave.spreads[0].as_ref(), wave.spreads[1].as_ref()],
        kappa: 1.0,
        omega: 0.0,
        levels: 0..1,
        passes: 1,
    };
    for (what, options, refusal) in [
        ("no_box", Options { kappa: 0.0, ..good.clone() }, [104, 1, 0]),
        ("no_pull", Options { omega: f32::NAN, ..good.clone() }, [104, 2, 0]),
        ("no_levels", Options { levels: 1..1, ..good.clone() }, [104, 3, 0]),
        ("no_passes", Options { passes: 0, ..good.clone() }, [104, 3, 0]),
        ("no_such_level", Options { levels: 0..2, ..good.clone() }, [102, 1, 1]),
    ] {
        begun(file, wave, what, &few, &options, &placement()).error(refusal);
    }
    let mut between = few.clone();
    between[1].as_mut().expect("a sample").barycentric = [0.5, 0.5, 0.0];
    for (what, samples, refusal) in [
        ("between_vertices", &between, [106, 1, 0]),
        ("nothing", &vec![None; 2], [105, 0, 0]),
        ("two_points", &few[1..3].to_vec(), [403, 0, 0]),
    ] {
        begun(file, wave, what, samples, &good, &placement()).error(refusal);
    }
}
