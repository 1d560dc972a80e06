//! Sections on a model for a page: what its weights do, and how good it is.

use habitus_core::format::{Mode, Model};
use rayon::prelude::*;

use super::modes::{DEVIATIONS, ModeShape, mean_shape, sorted_modes};
use super::page::{Block, Download, File, Picture, Section, Strip};
use super::plot::{Curve, CurvePlot, PlotPoint};
use super::portrait::{LINING, PORTRAIT, Portraits};
use super::{ColourBar, ColourScale, rounded_up};
use crate::Error;
use crate::measure::generalization::{CurvePoint, Generalization};
use crate::measure::specificity::Specificity;
use crate::mesh::Mesh;

/// Weights of each mode that are shown.
const SHOWN: usize = 4;

/// What a mode is called on pages and in the names of files.
fn name(mode: Mode) -> &'static str {
    match mode {
        Mode::Identity => "identity",
        Mode::Pose => "expression",
    }
}

/// The mean, the weights that move most at two standard deviations to either side, and these shapes as files.
///
/// # Errors
/// A model without the statistics of its weights; faults of drawing and writing.
pub fn modes(model: &Model<'_>) -> Result<Section, Error> {
    let mean = mean_shape(model)?;
    let shown = [Mode::Identity, Mode::Pose].map(|mode| sorted_modes(model, mode).map(|all| (mode, all)));
    let [identity, pose] = shown;
    let mut shown = [identity?, pose?];
    let absent: Vec<String> = shown.iter().filter_map(|(mode, all)| without_first(*mode, all)).collect();
    shown.iter_mut().for_each(|(_, all)| all.truncate(SHOWN));
    let all = shown.iter().flat_map(|(_, modes)| modes);
    let cells = Portraits::holding(PORTRAIT, all.flat_map(|m| [&m.low, &m.high]).chain([&mean]), Some(LINING));
    let mut mean_picture = Picture::of(&cells.clay(&mean), "pictures/mean.png", "The mean shape", "mean")?;
    // It is written with the first strip alone.
    let mut mean_bytes = mean_picture.file.bytes.take();
    let mut blocks = vec![Block::Text(format!(
        "For each mode the weights that move the surface most, each alone at {DEVIATIONS} standard deviations of the training data below and above \
         its mean. The colours say how far {DEVIATIONS} standard deviations move each point."
    ))];
    if !absent.is_empty() {
        blocks.push(Block::Text(format!(
            "{} The model has no mean of its own: the first weight of each mode stands for it, is nearly the same in all training shapes, and what varies \
             begins with the second.",
            absent.join(" ")
        )));
    }
    let glb = |file: String, mesh: &Mesh| {
        let normals = if mesh.faces.is_empty() { Vec::new() } else { mesh.vertex_normals() };
        let mesh = Mesh { normals, ..mesh.clone() };
        File::glb(format!("meshes/{file}.glb"), &mesh)
    };
    let mut downloads = vec![Download { file: glb("mean".into(), &mean)?, text: "the mean".into() }];
    for (mode, modes) in &shown {
        let all: Vec<f64> = modes.iter().flat_map(|mode| mode.motion.iter().copied()).collect();
        let scale = ColourScale::sequential(0.0, rounded_up(all.iter().copied().fold(0.0, f64::max)));
        let bar = ColourBar::of(scale, "moved by, mm", &all);
        let mode = name(*mode);
        let legend = format!("pictures/{mode}_legend.png");
        let mut legend = Picture::of(&cells.legend(&bar), legend, "Legend of the colours, mm", "")?;
        let strips: Vec<Strip> = modes
            .par_iter()
            .map(|shape| strip(shape, mode, &cells, (&mean_picture, &mean), &scale))
            .collect::<Result<_, _>>()?;
        for (shape, mut strip) in modes.iter().zip(strips) {
            let number = shape.weight + 1;
            strip.legend = Some(legend.clone());
            // Legend and mean are written once.
            legend.file.bytes = None;
            if let (Some(bytes), Some(picture)) = (mean_bytes.take(), strip.pictures.get_mut(1)) {
                picture.file.bytes = Some(bytes);
            }
            blocks.push(Block::Strip(strip));
            for (side, sign, mesh) in [("minus", "\u{2212}", &shape.low), ("plus", "+", &shape.high)] {
                downloads.push(Download {
                    file: glb(format!("{mode}_{number}_{side}"), mesh)?,
                    text: format!("{mode} weight {number} at {sign}{DEVIATIONS} \u{3c3}"),
                });
            }
        }
    }
    blocks.push(Block::Downloads(downloads));
    Ok(Section { title: "What the weights do".into(), blocks })
}

/// Says so where the first weight of a mode is not among those that are shown.
fn without_first(mode: Mode, all: &[ModeShape]) -> Option<String> {
    let place = all.iter().position(|shape| shape.weight == 0).filter(|&place| place >= SHOWN)?;
    let motion = all.get(place)?.mean_motion;
    Some(format!(
        "{} weight 1 is not shown: it moves the surface by only {motion:.1} mm on average.",
        capitalised(name(mode))
    ))
}

fn strip(
    shape: &ModeShape,
    mode: &str,
    cells: &Portraits,
    (mean_picture, mean): (&Picture, &Mesh),
    scale: &ColourScale,
) -> Result<Strip, Error> {
    let number = shape.weight + 1;
    let file = |what: &str| format!("pictures/{mode}_{number}_{what}.png");
    let alt = |what: &str| format!("The mean shape with {mode} weight {number} {what}");
    let (minus, plus) = (format!("\u{2212}{DEVIATIONS} \u{3c3}"), format!("+{DEVIATIONS} \u{3c3}"));
    let map = cells.coloured(mean, &scale.colours(&shape.motion));
    let far = shape.motion.iter().copied().fold(0.0, f64::max);
    Ok(Strip {
        pictures: vec![
            Picture::of(&cells.clay(&shape.low), file("minus"), alt("two standard deviations below"), minus)?,
            mean_picture.clone(),
            Picture::of(&cells.clay(&shape.high), file("plus"), alt("two standard deviations above"), plus)?,
            Picture::of(&map, file("map"), format!("Where {mode} weight {number} moves the surface"), "moved by, mm")?,
        ],
        legend: None,
        caption: format!(
            "{} weight {number}: moves the surface by {:.1} mm on average and by at most {far:.1} mm.",
            capitalised(mode),
            shape.mean_motion
        ),
    })
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// The share of each mode's variation that the first weights hold, %: entry k for k + 1 weights.
///
/// # Errors
/// Faults of drawing.
pub fn compactness_plot(identity: &[f64], expression: &[f64]) -> Result<Picture, Error> {
    let curve = |name: &str, percent: &[f64]| {
        let points = percent.iter().zip(1..).map(|(&y, k)| PlotPoint { x: f64::from(k), y, spread: None });
        Curve { name: name.into(), points: points.collect() }
    };
    let plot = CurvePlot {
        x: "number of weights".into(),
        y: "variation held, %".into(),
        curves: vec![curve("identity", identity), curve("expression", expression)],
        y_range: Some([0.0, 102.0]),
    };
    Ok(Picture::plot(
        plot.svg()?,
        "plots/compactness.svg",
        "Compactness: the share of the variation of each mode that the first weights hold, against their number",
        "Compactness: how much of the variation of the training shapes the first weights of each mode hold. Higher is better.",
    ))
}

/// Generalization and specificity over the number of weights of each mode, with standard errors.
///
/// # Errors
/// Faults of drawing.
pub fn curve_plots(general: &Generalization, specific: &Specificity) -> Result<Vec<Picture>, Error> {
    let curve = |name: &str, points: &[CurvePoint]| {
        let point = |p: &CurvePoint| PlotPoint {
            x: p.dim as f64,
            y: p.error.mean,
            spread: Some(p.error.standard_error).filter(|spread| *spread > 0.0),
        };
        Curve { name: name.into(), points: points.iter().map(point).collect() }
    };
    let plot = |x: &str, curves: Vec<Curve>| {
        let curves = curves.into_iter().filter(|curve| !curve.points.is_empty()).collect();
        CurvePlot { x: x.into(), y: "mean vertex distance, mm".into(), curves, y_range: None }.svg()
    };
    let of_identity = vec![curve("one identity left out", &general.identity)];
    let of_expression = vec![
        curve("one identity left out", &general.expression),
        curve("one expression left out", &general.unseen_expression),
    ];
    let of_random = vec![curve("identity", &specific.identity), curve("expression", &specific.expression)];
    Ok(vec![
        Picture::plot(
            plot("identity weights", of_identity)?,
            "plots/generalization_identity.svg",
            "Generalization: the error on a left-out identity against the number of identity weights",
            "Generalization: every identity is left out in turn and found again by the model of the others, its correspondence known. Lower is better.",
        ),
        Picture::plot(
            plot("expression weights", of_expression)?,
            "plots/generalization_expression.svg",
            "Generalization: the error on a left-out identity or expression against the number of expression weights",
            "Generalization over the weights of expressions; every expression is left out in turn, too. Lower is better.",
        ),
        Picture::plot(
            plot("number of weights", of_random)?,
            "plots/specificity.svg",
            "Specificity: the distance of random shapes of the model from the nearest training shape against the number of weights",
            "Specificity: random shapes of the model, each compared with the nearest training shape. Lower is better, but only together with generalization: more \
             weights allow more different shapes.",
        ),
    ])
}
