//! `habitus fit`: from a raw scan and its landmarks to the weights of a model.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use habitus_core::format::{Mode, Model};
use serde_json::{Value, json};

use super::{Console, Outputs, expect_extension, shown};
use crate::Error;
use crate::generate::deviations_of_weights;
use crate::io::landmarks::LandmarkFile;
use crate::io::model::opened;
use crate::io::{self, landmarks_npy};
use crate::mesh::Mesh;
use crate::parameters::{self, Parameters};
use crate::register::scan_fit::{ScanFit, ScanFitOptions, expect_bilinear, fit_scan, in_model_order};
use crate::report::fit_page::{FitReport, PAGE_FILES, marked_names};
use crate::report::fit_shown::{DISTANCE, FitShown};
use crate::report::{Figure, Finish, Image, Scene};
use crate::spatial::frame_recovery::Unit;

/// Arguments of `fit`.
#[derive(Debug, Args)]
pub(super) struct FitArgs {
    /// Model file (.hab), trained with landmarks and triangles
    model: PathBuf,
    /// Raw scan: a mesh or a point cloud
    scan: PathBuf,
    /// Landmarks on the scan: lines "name x y z", labelled list, CSV, xyz triples, JSON with positions or vertices of the scan, or row K of an
    /// array, FILE.npy:K (docs/fit.md)
    #[arg(long, value_name = "FILE")]
    landmarks: PathBuf,
    /// Unit of the scan [default: the one in which its landmarks are as large as the model's]
    #[arg(long, value_enum)]
    unit: Option<UnitName>,
    /// Write the fitted model, in the unit and frame of the scan
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write weights and placement alone, of which `habitus generate --parameters` makes the fitted model again
    #[arg(long, value_name = "FILE.json")]
    parameters: Option<PathBuf>,
    /// Draw scan, fit, and their distance
    #[arg(long, value_name = "FILE.png")]
    png: Option<PathBuf>,
    /// Write a page for a browser: pictures, distances, landmarks, weights, meshes
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Pixels of the longer side of each view in the picture
    #[arg(long, default_value_t = 480, value_name = "PIXELS", value_parser = clap::value_parser!(u16).range(16..=4096))]
    size: u16,
}

/// Units of scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum UnitName {
    Mm,
    Cm,
    M,
    In,
}

impl UnitName {
    fn unit(self) -> Unit {
        match self {
            UnitName::Mm => Unit::Millimetre,
            UnitName::Cm => Unit::Centimetre,
            UnitName::M => Unit::Metre,
            UnitName::In => Unit::Inch,
        }
    }
}

/// Landmarks that are farther from the fit, mm, on average are worth a look; on faces it is about 2.
const USUAL_RESIDUAL: f64 = 4.0;

pub(super) fn run(args: &FitArgs, console: &Console) -> Result<(), Error> {
    args.png.as_deref().map(|path| expect_extension(path, "png")).transpose()?;
    args.parameters.as_deref().map(|path| expect_extension(path, "json")).transpose()?;
    args.output.as_deref().map(io::mesh::expect_written).transpose()?;
    Outputs::beside([&*args.model, &*args.scan, &*landmarks_npy::file(&args.landmarks)])
        .file("-o", args.output.as_deref())
        .file("--png", args.png.as_deref())
        .file("--parameters", args.parameters.as_deref())
        .folder("--report", args.report.as_deref(), PAGE_FILES)
        .check()?;
    let bytes = io::file_bytes(&args.model)?;
    let model = opened(&bytes, &args.model)?;
    expect_bilinear(&model).map_err(|error| match error {
        Error::Input(problem) => Error::Input(format!("{}: {problem}", args.model.display())),
        other => other,
    })?;
    let scan = io::mesh::read(&args.scan)?;
    let landmarks = landmarks(args, &model, &scan, console)?;
    let clock = Instant::now();
    let options = ScanFitOptions { unit: args.unit.map(UnitName::unit), ..ScanFitOptions::default() };
    let fit = fit_scan(&model, &scan, &landmarks, &options).map_err(|error| match error {
        Error::Input(problem) => Error::Input(format!("{}: {problem}", args.scan.display())),
        other => other,
    })?;
    let seconds = clock.elapsed().as_secs_f64();
    let mut fitted = Mesh {
        positions: fit.vertices.clone(),
        faces: model.faces().map(|faces| faces.iter().collect()).unwrap_or_default(),
        ..Mesh::default()
    };
    fitted.normals = fitted.vertex_normals();
    if let Some(path) = &args.output {
        io::mesh::write(path, &fitted)?;
    }
    if let Some(path) = &args.parameters {
        parameters(&model, &fit)?.write(path)?;
    }
    let shown_fit = FitShown::new(&fit, &scan, &fitted)?;
    if let Some(path) = &args.png {
        picture(args, &shown_fit)?.write_png(path)?;
    }
    if fit.landmark_residual > USUAL_RESIDUAL {
        console.warn(&format!(
            "the landmarks are {:.1} mm from those of the fitted model on average, about 2 mm is usual: look at where they are marked, and at the picture (--png)",
            fit.landmark_residual
        ));
    }
    let marked: Vec<bool> = landmarks.iter().map(Option::is_some).collect();
    let mut object = object(args, &model, &fit, &shown_fit, &marked);
    if let Some(folder) = &args.report {
        let report = FitReport {
            model: &model,
            model_name: &file_name(&args.model),
            scan: &scan,
            scan_name: &file_name(&args.scan),
            fit: &fit,
            options: &options,
            fitted: &fitted,
            shown: &shown_fit,
            marked: &marked,
            figures: &object,
        };
        report.page()?.write(folder)?;
    }
    object["seconds"] = seconds.into();
    for (name, path) in
        [("output", &args.output), ("parameters", &args.parameters), ("png", &args.png), ("report", &args.report)]
    {
        object[name] = path.as_deref().map(shown).into();
    }
    console.result(&text(args, &fit, &shown_fit, seconds), object)
}

/// What makes the fitted model again.
fn parameters(model: &Model<'_>, fit: &ScanFit) -> Result<Parameters, Error> {
    let deviations = |mode, weights: &[f32]| {
        let none = || Error::Internal("a model without statistics was fitted".into());
        deviations_of_weights(model, mode, weights).ok_or_else(none)
    };
    Ok(Parameters {
        identity: deviations(Mode::Identity, &fit.identity)?,
        expression: deviations(Mode::Pose, &fit.pose)?,
        placement: Some(fit.placement),
    })
}

/// The landmarks in the order of the model.
fn landmarks(
    args: &FitArgs,
    model: &Model<'_>,
    scan: &Mesh,
    console: &Console,
) -> Result<Vec<Option<[f64; 3]>>, Error> {
    let named = |problem: Error| match problem {
        Error::Input(problem) => Error::Input(format!("{}: {problem}", args.landmarks.display())),
        other => other,
    };
    let file = landmarks_npy::read(&args.landmarks)?;
    let points = match &file {
        LandmarkFile::Points { points, .. } => points.clone(),
        LandmarkFile::Vertices { .. } => {
            let vertices = file.snapped_to(scan).map_err(named)?;
            vertices.iter().map(|snapped| scan.positions[snapped.vertex as usize]).collect()
        }
    };
    let (ordered, unknown) = in_model_order(model, file.names(), &points).map_err(named)?;
    if !unknown.is_empty() {
        console.warn(&format!("the model does not know the landmarks {}; they are not used", unknown.join(", ")));
    }
    Ok(ordered)
}

/// Scan, fit and distance from three sides, in the frame of the model and in millimetres, so that faces look at the viewer.
fn picture(args: &FitArgs, shown: &FitShown) -> Result<Image, Error> {
    let plain = |mesh| Scene { finish: Finish::Even, ..Scene::new([mesh]) };
    let (numbers, mut map) = (shown.map()?, plain(&shown.fitted));
    let colours = numbers.colours();
    map.meshes.iter_mut().for_each(|placed| placed.colours = Some(&colours));
    let caption = distance_told(shown);
    let rows = vec![("scan".to_owned(), plain(&shown.scan)), ("fit".to_owned(), plain(&shown.fitted)), (caption, map)];
    let title = format!("{} fitted to {}", file_name(&args.model), file_name(&args.scan));
    let mut figure = Figure { bar: Some(numbers.bar()), picture_size: args.size.into(), ..Figure::new(title, rows) };
    figure.views.truncate(3);
    Ok(figure.drawn())
}

/// The distance of scan and fit in one line.
fn distance_told(shown: &FitShown) -> String {
    match (shown.distance.median(), shown.distance.quantile(0.95)) {
        (Some(median), Some(most)) => format!("{DISTANCE}: median {median:.2} mm, 95 % within {most:.2} mm"),
        _ => format!("{DISTANCE}: no point is on the fit"),
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn text(args: &FitArgs, fit: &ScanFit, shown: &FitShown, seconds: f64) -> String {
    let mut text = String::new();
    let n_landmarks = fit.landmark_residuals.len();
    let _ = writeln!(text, "{}: fitted in {seconds:.2} s with {} of its points", args.scan.display(), fit.n_points);
    let _ = writeln!(text, "unit: {}", fit.unit.symbol());
    let _ = writeln!(text, "{}", distance_told(shown));
    let _ = writeln!(text, "{:.0} % of the model lies on the scan", 100.0 * fit.coverage);
    let _ = writeln!(text, "landmarks: {n_landmarks}, {:.2} mm from those of the fit (mean)", fit.landmark_residual);
    for path in [&args.output, &args.parameters, &args.png].into_iter().flatten() {
        let _ = writeln!(text, "{}: written", path.display());
    }
    if let Some(folder) = &args.report {
        let _ = writeln!(text, "{}: written", folder.join("index.html").display());
    }
    text
}

fn object(args: &FitArgs, model: &Model<'_>, fit: &ScanFit, shown_fit: &FitShown, marked: &[bool]) -> Value {
    json!({
        "scan": shown(&args.scan),
        "unit": fit.unit.symbol(),
        "identity": fit.identity,
        "expression": fit.pose,
        "identity_deviations": deviations_of_weights(model, Mode::Identity, &fit.identity),
        "expression_deviations": deviations_of_weights(model, Mode::Pose, &fit.pose),
        "placement": parameters::described(&fit.placement),
        "landmarks": marked_names(model, marked),
        "landmark_residuals_mm": fit.landmark_residuals,
        "landmark_residual_mm": fit.landmark_residual,
        "scan_distance_median_mm": shown_fit.distance.median(),
        "scan_distance_mean_mm": shown_fit.distance.mean(),
        "scan_distance_95_mm": shown_fit.distance.quantile(0.95),
        "points_on_fit": shown_fit.distance.sorted.len(),
        "judged_median_mm": fit.median,
        "sigma_mm": fit.sigma,
        "coverage_percent": 100.0 * fit.coverage,
        "points": fit.n_points,
    })
}
