//! The wavelet transform, and wavelet models: all that is asked of bilinear ones, by levels and windows.

use super::files::{forged, opened, patched};
use super::fit::{Kind, Order, few_fits, normal_equations};
use super::generator::{evaluate, linearised_block, linearised_vertex, prepared, start, weights};
use super::models::{Model, Models};
use super::stream::Stream;
use super::text::{Case, File};
use super::wavelet_fits::fits;
use crate::reference::normal_equations::Frame;
use crate::reference::number::Number;
use crate::reference::wavelet::{Grid, Wavelet, analyse_line, analysis, lines_of, synthesis};

pub fn text(models: &Models) -> String {
    let mut file = File::new("The wavelet transform; wavelet models in every storage, by levels and windows.");
    for wavelet in Wavelet::ALL {
        for samples in [3, 5, 19, 41] {
            step::<f32>(&mut file, wavelet, samples);
        }
        step::<f64>(&mut file, wavelet, 9);
        // Rows come in by eight: a level of nine coarse rows, and one of few long ones.
        for (base, levels, components) in [
            ([2, 2], 0, 1),
            ([2, 2], 1, 2),
            ([3, 2], 2, 1),
            ([4, 3], 1, 1),
            ([2, 9], 1, 1),
            ([9, 2], 1, 1),
            ([2, 2], 3, 1),
        ] {
            transform::<f32>(&mut file, &Grid { base, levels }, wavelet, components);
        }
        transform::<f64>(&mut file, &Grid { base: [3, 2], levels: 2 }, wavelet, 1);
        lines::<f32>(&mut file, &Grid { base: [3, 2], levels: 2 }, wavelet, &[0, 5, 8, 14, 17, 30]);
        lines::<f64>(&mut file, &Grid { base: [2, 3], levels: 2 }, wavelet, &[1, 7, 44]);
    }
    transform_refusals(&mut file);
    for wave in models.waves() {
        evaluate(&mut file, &wave.model);
        opened(&mut file, &wave.model);
    }
    of_models(&mut file, models);
    fits(&mut file, models);
    refusals(&mut file, models);
    file.text()
}

fn word(wavelet: Wavelet) -> String {
    format!("{wavelet:?}").to_lowercase()
}

/// `f32` or `f64`.
fn precision<R: Number>() -> String {
    format!("f{}", 8 * size_of::<R>())
}

fn grid_of(grid: &Grid) -> [u32; 3] {
    [grid.base[0], grid.base[1], grid.levels].map(|count| count as u32)
}

fn step<R: Number>(file: &mut File, wavelet: Wavelet, count: usize) {
    let name = format!("{}_{count}", word(wavelet));
    let samples: Vec<R> = Stream::of(&name).numbers(count, 10.0);
    let mut line = samples.clone();
    analyse_line(wavelet, &mut line);
    let (coarse, detail): (Vec<&R>, Vec<&R>) =
        (line.iter().step_by(2).collect(), line.iter().skip(1).step_by(2).collect());
    let mut back = line.clone();
    crate::reference::wavelet::synthesise_line(wavelet, &mut back);
    file.case(&format!("wavelet_step_{}", precision::<R>()), &name)
        .word("wavelet", &word(wavelet))
        .numbers("samples", &samples)
        .numbers("coarse", coarse)
        .numbers("detail", detail)
        .numbers("back", &back);
}

fn start_transform<'f>(file: &'f mut File, kernel: &str, name: &str, grid: &Grid, wavelet: Wavelet) -> Case<'f> {
    let mut case = file.case(kernel, name);
    case.integers("grid", grid_of(grid)).word("wavelet", &word(wavelet));
    case
}

fn transform<R: Number>(file: &mut File, grid: &Grid, wavelet: Wavelet, components: usize) {
    let [width, height, levels] = grid_of(grid);
    let name = format!("{}_{width}_{height}_{levels}", word(wavelet));
    let samples: Vec<Vec<R>> = {
        let mut stream = Stream::of(&name);
        (0..components).map(|_| stream.numbers(grid.len(), 10.0)).collect()
    };
    let coefficients: Vec<Vec<R>> = samples.iter().map(|plane| analysis(grid, wavelet, plane)).collect();
    let kernel = format!("wavelet_analysis_{}", precision::<R>());
    start_transform(file, &kernel, &name, grid, wavelet).rows("samples", &samples).rows("coefficients", &coefficients);
    for level in 0..=grid.levels {
        // The finest, and of one grid all.
        if level < grid.levels && grid.base != [3, 2] {
            continue;
        }
        let out: Vec<Vec<R>> = coefficients.iter().map(|plane| synthesis(grid, wavelet, level, plane)).collect();
        let kernel = format!("wavelet_synthesis_{}", precision::<R>());
        let (w, h) = (grid.width(level), grid.height(level));
        // Nothing; the corners; a cross; whatever is inside.
        let mut windows =
            vec![[0, w, 0, h], [1, 1, 0, h], [0, 1, 0, 1], [w - 1, w, h - 1, h], [w / 2, w / 2 + 1, 0, h]];
        windows.extend([[0, w, h / 3, h / 3 + 1], [w / 3, w - w / 3, h / 3, h - h / 3]]);
        start_transform(file, &kernel, &format!("{name}_level_{level}"), grid, wavelet)
            .integer("level", level)
            .integers("windows", windows.into_iter().flatten().map(|bound| bound as u32))
            .rows("coefficients", &coefficients)
            .rows("out", &out);
    }
}

fn lines<R: Number>(file: &mut File, grid: &Grid, wavelet: Wavelet, coefficients: &[usize]) {
    let nodes = grid.nodes();
    let (mut supports, mut values) = (Vec::new(), Vec::new());
    for &coefficient in coefficients {
        for line in lines_of::<R>(grid, wavelet, &nodes[coefficient]) {
            let there: Vec<usize> = (0..line.len()).filter(|&k| line[k] != R::of(0.0)).collect();
            let (first, last) = (there[0], there[there.len() - 1]);
            supports.extend([first as u32, last as u32 + 1]);
            values.extend(line[first..=last].to_vec());
        }
    }
    let [width, height, levels] = grid_of(grid);
    let name = format!("{}_{width}_{height}_{levels}", word(wavelet));
    start_transform(file, &format!("wavelet_lines_{}", precision::<R>()), &name, grid, wavelet)
        .integers("of", coefficients.iter().map(|&coefficient| coefficient as u32))
        .integers("supports", supports)
        .numbers("values", &values);
}

fn transform_refusals(file: &mut File) {
    let samples = [1.0f32; 9];
    for (name, grid, refusal) in [
        ("narrow", [1, 2, 1], [104, 0, 0]),
        ("flat", [2, 1, 1], [104, 1, 0]),
        ("fine", [2, 2, 21], [310, 21, 20]),
        ("other_count", [2, 2, 2], [101, 25, 9]),
    ] {
        file.case("wavelet_analysis_f32", name)
            .integers("grid", grid)
            .word("wavelet", "cubic")
            .numbers("samples", &samples)
            .error(refusal);
    }
    for (name, level, windows, refusal) in [
        ("no_level", 2, [0, 1, 0, 1], [102, 2, 2]),
        ("beyond", 1, [0, 4, 0, 1], [102, 4, 3]),
        ("reversed", 1, [0, 1, 2, 1], [102, 2, 3]),
    ] {
        file.case("wavelet_synthesis_f32", name)
            .integers("grid", [2, 2, 1])
            .word("wavelet", "cubic")
            .integer("level", level)
            .integers("windows", windows)
            .numbers("coefficients", &samples)
            .error(refusal);
    }
}

/// Levels, windows, derivatives, prepared forms and fits through [`Generator`](crate::reference::generator::Generator).
fn of_models(file: &mut File, models: &Models) {
    let [six, small, bytes, halves, many] =
        ["wave_6", "wave_15", "wave_25_i8", "wave_45_f16", "wave_81_i8"].map(|name| models.wave(name));
    for (wave, levels) in
        [(small, [[0, 1], [1, 0]]), (bytes, [[1, 2], [0, 1]]), (halves, [[2, 1], [0, 2]]), (many, [[1, 1], [0, 0]])]
    {
        for [detail, resolution] in levels {
            evaluate(file, &wave.at_levels(detail, resolution).model);
        }
    }
    for (wave, columns, rows) in [
        (bytes, [1, 3], [2, 5]),
        (halves, [0, 5], [8, 9]),
        (&many.at_levels(0, 2), [4, 5], [4, 5]),
        (&many.at_levels(1, 2), [5, 9], [0, 6]),
    ] {
        evaluate(file, &wave.in_window(columns, rows).model);
    }
    for wave in [six, small] {
        linearised_vertex(file, &wave.model, 4);
    }
    linearised_vertex(file, &bytes.at_levels(1, 2).model, 12);
    linearised_vertex(file, &halves.at_levels(1, 2).in_window([1, 4], [0, 7]).model, 20);
    linearised_vertex(file, &many.at_levels(0, 2).model, 33);
    linearised_block(file, &six.model, 0);
    linearised_block(file, &bytes.at_levels(0, 2).model, 1);
    linearised_block(file, &halves.at_levels(0, 1).model, 0);
    for identity_fixed in [true, false] {
        prepared(file, &six.model, identity_fixed, 0, 1);
        prepared(file, &small.at_levels(0, 1).model, identity_fixed, 0, 1);
        prepared(file, &bytes.at_levels(0, 2).model, identity_fixed, 1, 2);
        prepared(file, &halves.at_levels(0, 2).in_window([1, 5], [1, 7]).model, identity_fixed, 1, 2);
    }
    let coarse = bytes.at_levels(0, 2);
    normal_equations(file, &coarse.model, 9, Kind::Mixed, Order::Scattered, Frame::Rigid);
    few_fits(file, &coarse.model);
}

fn refusals(file: &mut File, models: &Models) {
    let model = &models.wave("wave_15").model;
    let (x, y) = weights(model);
    let nan: Vec<f32> = y.iter().enumerate().map(|(k, &y)| if k == 7 { f32::NAN } else { y }).collect();
    for (what, x, y, ranges, refusal) in [
        ("short_identity", &x[..29], &y[..], [0, 15], [101, 30, 29]),
        ("short_pose", &x[..], &y[..1], [0, 15], [101, 30, 1]),
        ("nan", &x[..], &nan[..], [0, 15], [103, 37, 0]),
        ("beyond", &x[..], &y[..], [3, 16], [102, 16, 15]),
    ] {
        start(file, "evaluate", model, what, x, y).integers("ranges", ranges).error(refusal);
    }
    for (what, field, numbers, refusal) in [
        ("no_detail", "levels", vec![2, 1], [102, 2, 2]),
        ("no_resolution", "levels", vec![0, 3], [102, 3, 2]),
        ("window_beyond", "window", vec![0, 6, 0, 1], [102, 6, 5]),
        ("no_window", "window", vec![2, 2, 0, 1], [105, 0, 0]),
    ] {
        start(file, "evaluate", model, what, &x, &y).integers(field, numbers).integers("ranges", [0, 1]).error(refusal);
    }
    let body = models.named("body_17");
    let (x, y) = weights(body);
    start(file, "evaluate", body, "levels", &x, &y)
        .integers("levels", [0, 0])
        .integers("ranges", [0, 1])
        .error([502, 4, 3]);
    let place = |model: &Model, id: u32| {
        let position = model.sections.iter().position(|section| section.id == id).expect("a section of the model");
        let entry = 64 + 64 * position;
        let offset: [u8; 8] = model.bytes[entry + 32..entry + 40].try_into().expect("eight bytes");
        u64::from_le_bytes(offset) as usize
    };
    for (name, id, at, bytes, refusal) in [
        ("wave_narrow", 31, 0, 1u32.to_le_bytes(), [309, 31, 0]),
        ("wave_many_levels", 31, 8, 11u32.to_le_bytes(), [309, 31, 2]),
        ("wave_no_such_transform", 31, 12, 2u32.to_le_bytes(), [309, 31, 3]),
        ("wave_scale", 7, 4, 0f32.to_le_bytes(), [309, 7, 1]),
        ("wave_mean", 9, 8, f32::NAN.to_le_bytes(), [309, 9, 2]),
    ] {
        let at = place(model, id) + at;
        let changes: Vec<(usize, u8)> = bytes.iter().enumerate().map(|(k, &byte)| (at + k, byte)).collect();
        patched(file, model, name, &forged(model, &changes), refusal);
    }
}
