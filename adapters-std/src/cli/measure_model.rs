//! `habitus measure model`: compactness, generalization, specificity, and errors on unseen faces.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use habitus_core::format::{Kind, Mode};
use serde_json::{Value, json};

use super::info::energy_percent;
use super::train_face::{Align, Tucker};
use super::{Console, Outputs, shown};
use crate::Error;
use crate::face::hooi::HooiOptions;
use crate::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use crate::face::multilinear::MultilinearModel;
use crate::face::tensor::ShapeTensor;
use crate::face::training_data::{Template, tensor};
use crate::io;
use crate::io::model::{ModelSource, hab, opened};
use crate::measure::compactness::{ModeCompactness, compactness};
use crate::measure::curves::{Curves, curve_sizes, described};
use crate::measure::kernel_fit::unseen_error_through_kernel;
use crate::measure::unseen::unseen_error;
use crate::measure::vertex_error::{MeanError, mean_vertex_distances};
use crate::register::gpa::{GpaOptions, align_each, align_in_place};
use crate::report::model_page::ModelReport;
use crate::report::page::Page;

/// Arguments of `measure model`.
#[derive(Debug, Args)]
pub(super) struct ModelArgs {
    /// Training data as for `train face`, from which models of the sizes --dims are trained; or the file of a bilinear face model (.hab)
    data: PathBuf,
    /// Unseen faces in the same topology; of a model file they are fitted through the kernel
    #[arg(long, value_name = "DATA")]
    test: Option<PathBuf>,
    /// Sizes to train and measure, identity x expression weights [default: one that holds 98 % of each mode's variation]
    #[arg(long, value_name = "NxM,...", value_delimiter = ',', value_parser = size)]
    dims: Vec<(usize, usize)>,
    /// Rigid alignment before training; unseen faces are then aligned to the mean
    #[arg(long, value_enum, default_value_t = Align::Gpa)]
    align: Align,
    /// Tucker decomposition
    #[arg(long, value_enum, default_value_t = Tucker::Hosvd)]
    tucker: Tucker,
    /// Random faces per point of the specificity curves
    #[arg(long, default_value_t = 1000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    samples: u32,
    /// Seed of the random faces
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Leave the generalization and specificity curves out, which take nearly all of the time (20 s for 600 shapes of 2800 vertices on two cores)
    #[arg(long)]
    no_curves: bool,
    /// Write a page for a browser: plots, tables, pictures and meshes of the mean and of what the weights do, of the first of --dims
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// The triangles of training data for the pictures of --report, as for `train face`; without them points are drawn
    #[arg(long, value_name = "FILE", requires = "report")]
    template: Option<PathBuf>,
}

/// `20x10`.
fn size(text: &str) -> Result<(usize, usize), String> {
    let parsed = text.split_once('x').and_then(|(n, m)| Some((n.trim().parse().ok()?, m.trim().parse().ok()?)));
    parsed.ok_or_else(|| format!("{text:?} is no size; write identity x expression weights, such as 20x10"))
}

pub(super) fn run(args: &ModelArgs, console: &Console) -> Result<(), Error> {
    let inputs = [Some(&args.data), args.test.as_ref(), args.template.as_ref()].into_iter().flatten();
    let names = ["index.html", "figures.json"];
    Outputs::beside(inputs.map(PathBuf::as_path)).folder("--report", args.report.as_deref(), names).check()?;
    if args.data.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("hab")) {
        return of_file(args, console);
    }
    let mut shapes = tensor(&args.data)?;
    let mut unseen = args.test.as_deref().map(tensor).transpose()?;
    if let Some(unseen) = &unseen
        && unseen.n_vertices() != shapes.n_vertices()
    {
        return Err(Error::input(format!(
            "the test shapes have {} vertices, the training shapes {}; give shapes in one topology",
            unseen.n_vertices(),
            shapes.n_vertices()
        )));
    }
    if args.align == Align::Gpa {
        let len = shapes.shape_len();
        let mean = align_in_place(shapes.data_mut(), len, &GpaOptions::default())?.mean;
        if let Some(unseen) = &mut unseen {
            align_each(unseen.data_mut(), len, &mean)?;
        }
    }
    let mut text = format!(
        "{}: {} identities x {} expressions, {} vertices, {}\n\n",
        args.data.display(),
        shapes.n_identities(),
        shapes.n_expressions(),
        shapes.n_vertices(),
        args.align.words()
    );
    let mut object = json!({
        "identities": shapes.n_identities(),
        "expressions": shapes.n_expressions(),
        "vertices": shapes.n_vertices(),
    });
    // Read first: a file that is not there should not cost the minutes of the curves.
    let template = Template::read(&shapes, args.template.as_deref(), None, None)?;
    let model = sizes(args, &shapes, unseen.as_ref(), &mut text, &mut object, console)?;
    let mut measured = None;
    if shapes.n_identities() < 2 && !args.no_curves {
        console.warn("generalization leaves one identity out and the data hold one, so the curves are left out");
    } else if !args.no_curves {
        measured = Some(curves(args, &shapes, &mut text, &mut object, console)?);
    }
    if let Some(folder) = &args.report {
        let mut source = ModelSource::of_multilinear(&model);
        source.faces = template.faces;
        let bytes = hab::bytes(&source)?;
        let all = compactness(&model);
        let page = ModelReport {
            model: &opened(&bytes, &args.data)?,
            name: &file_name(args),
            compactness: [&all.identity.percent, &all.expression.percent],
            curves: measured.as_ref(),
            figures: &object,
        }
        .page()?;
        written(&page, folder, &mut text, &mut object)?;
    }
    console.result(&text, object)
}

fn file_name(args: &ModelArgs) -> String {
    args.data.file_name().unwrap_or(args.data.as_os_str()).to_string_lossy().into_owned()
}

fn written(page: &Page, folder: &Path, text: &mut String, object: &mut Value) -> Result<(), Error> {
    page.write(folder)?;
    let _ = writeln!(text, "\n{}: written", folder.join("index.html").display());
    object["report"] = shown(folder).into();
    Ok(())
}

/// Figures of a model file: what its weights hold, and the error on unseen faces.
fn of_file(args: &ModelArgs, console: &Console) -> Result<(), Error> {
    if args.template.is_some() {
        return Err(Error::input("--template is for training data; a model file has its own triangles"));
    }
    if !args.dims.is_empty() {
        return Err(Error::input(
            "--dims trains models of several sizes and needs training data; a model file has its own size",
        ));
    }
    let bytes = io::file_bytes(&args.data)?;
    let model = opened(&bytes, &args.data)?;
    let kind = model.header().kind;
    if kind != Kind::Bilinear {
        return Err(Error::input(format!(
            "{}: it holds a model of the kind {kind:?}; the measures here are those of bilinear face models, of which this is none: see what it holds \
             with habitus info",
            args.data.display()
        )));
    }
    let energies = [Mode::Identity, Mode::Pose].map(|mode| energy_percent(&model, mode));
    if energies.iter().all(Vec::is_empty) && args.test.is_none() && args.report.is_none() {
        return Err(Error::input(format!(
            "{}: the file does not hold the spectra of its training data, so there is nothing to tell; give unseen faces with --test, or the training \
             data instead of the file",
            args.data.display()
        )));
    }
    let mut text = format!("{}\n", args.data.display());
    let mut object = json!({
        "vertices": model.header().n_vertices,
        "identity_dim": model.header().identity_dim,
        "pose_dim": model.header().pose_dim,
    });
    let modes = [("identity", model.header().identity_dim), ("pose", model.header().pose_dim)];
    for ((name, dim), energy) in modes.into_iter().zip(&energies) {
        let kept = (dim as usize).checked_sub(1).and_then(|last| energy.get(last)).copied();
        object[format!("{name}_energy_percent")] = kept.into();
        if let Some(kept) = kept {
            let _ = writeln!(text, "{dim} {name} weights hold {kept:.3} % of the mode's variation");
        }
    }
    if let Some(path) = &args.test {
        let unseen = tensor(path)?;
        let align = args.align == Align::Gpa;
        let error = unseen_error_through_kernel(&model, &unseen, align, &mut console.progress("fits"))?;
        let _ = writeln!(
            text,
            "unseen error through the kernel: {:.4} +- {:.4} mm (standard error) over {} faces",
            error.mean, error.standard_error, error.count
        );
        object["unseen_error_mean_mm"] = error.mean.into();
        object["unseen_error_standard_error_mm"] = error.standard_error.into();
    }
    if let Some(folder) = &args.report {
        let [identity, expression] = &energies;
        let page = ModelReport {
            model: &model,
            name: &file_name(args),
            compactness: [identity, expression],
            curves: None,
            figures: &object,
        }
        .page()?;
        written(&page, folder, &mut text, &mut object)?;
    }
    console.result(&text, object)
}

/// Trains every size and measures it; the compactness comes with the first, which is returned.
fn sizes(
    args: &ModelArgs,
    shapes: &ShapeTensor,
    unseen: Option<&ShapeTensor>,
    text: &mut String,
    object: &mut Value,
    console: &Console,
) -> Result<MultilinearModel, Error> {
    let hooi = (args.tucker == Tucker::Hooi).then(HooiOptions::default);
    let mut options: Vec<HosvdOptions> = args
        .dims
        .iter()
        .map(|&(identity, expression)| HosvdOptions {
            identity: ModeSize::Dimension(identity),
            expression: ModeSize::Dimension(expression),
            hooi,
        })
        .collect();
    if options.is_empty() {
        options.push(HosvdOptions { hooi, ..HosvdOptions::default() });
    }
    let mut rows = Vec::new();
    let mut first = None;
    let mut progress = console.progress("sizes");
    for (done, options) in options.iter().enumerate() {
        progress(done, args.dims.len());
        let model = hosvd(shapes, options)?.model;
        let (identity, expression) = (model.identity.dim, model.expression.dim);
        if done == 0 {
            let all = compactness(&model);
            object["compactness"] = json!({
                "identity_percent": all.identity.percent,
                "expression_percent": all.expression.percent,
                "identity_trace_mm2": all.identity.trace,
                "expression_trace_mm2": all.expression.trace,
                "variance_per_shape_mm2": all.identity.variance_per_shape,
                "energy": all.energy,
            });
            let _ = writeln!(text, "compactness (share of each mode's variation, %)");
            for (name, mode) in [("identity", &all.identity), ("expression", &all.expression)] {
                let _ = writeln!(text, "  {name}: {}", shares(mode));
            }
            let _ = writeln!(
                text,
                "  variance per shape {:.1} mm^2, energy {:.4}\n",
                all.identity.variance_per_shape, all.energy
            );
            let _ = writeln!(
                text,
                "| size | training error, mm | unseen error, mm | identity energy, % | expression energy, % |\n|---|---|---|---|---|"
            );
        }
        let errors = mean_vertex_distances(shapes.data(), &model.training_shapes()?, shapes.shape_len());
        let training = MeanError::of(&errors).ok_or_else(|| Error::Internal("no training shapes".into()))?;
        let test = unseen.map(|unseen| unseen_error(&model, unseen)).transpose()?;
        let energy = [model.identity.energy_kept(), model.expression.energy_kept()].map(|share| 100.0 * share);
        let _ = writeln!(
            text,
            "| {identity} x {expression} | {:.4} | {} | {:.3} | {:.3} |",
            training.mean,
            test.map_or("-".into(), |error| format!("{:.4}", error.mean)),
            energy[0],
            energy[1],
        );
        rows.push(json!({
            "identity_dim": identity,
            "expression_dim": expression,
            "training_error_mean_mm": training.mean,
            "unseen_error_mean_mm": test.map(|error| error.mean),
            "unseen_error_standard_error_mm": test.map(|error| error.standard_error),
            "identity_energy_percent": energy[0],
            "expression_energy_percent": energy[1],
        }));
        first.get_or_insert(model);
    }
    progress(args.dims.len(), args.dims.len());
    object["sizes"] = rows.into();
    first.ok_or_else(|| Error::Internal("no size was trained".into()))
}

fn shares(mode: &ModeCompactness) -> String {
    let shown = curve_sizes(mode.percent.len()).into_iter().map(|k| format!("{k}: {:.2}", mode.percent[k - 1]));
    shown.collect::<Vec<_>>().join(", ")
}

fn curves(
    args: &ModelArgs,
    shapes: &ShapeTensor,
    text: &mut String,
    object: &mut Value,
    console: &Console,
) -> Result<Curves, Error> {
    let found = Curves::of(
        shapes,
        args.samples as usize,
        args.seed,
        &mut console.progress("generalization"),
        &mut console.progress("specificity"),
    )?;
    for (name, title, curve) in found.named() {
        let points: Vec<String> = curve
            .iter()
            .map(|point| format!("{}: {:.3} +- {:.3}", point.dim, point.error.mean, point.error.standard_error))
            .collect();
        let _ = writeln!(text, "\n{title}, mm (+- standard error)\n  {}", points.join(", "));
        object[name] = described(curve);
    }
    Ok(found)
}
