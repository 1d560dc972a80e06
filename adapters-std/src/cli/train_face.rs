//! `habitus train face`: a multilinear face model from registered shapes.

use std::fmt::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::{Console, Outputs, shown};
use crate::Error;
use crate::face::hooi::HooiOptions;
use crate::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use crate::face::remainder::{N_COMPONENTS, remainder};
use crate::face::tensor::ShapeTensor;
use crate::face::training_data::{Template, expression_names, tensor};
use crate::io::model::{ModelSource, hab};
use crate::measure::vertex_error::{MeanError, mean_vertex_distances};
use crate::register::gpa::{GpaOptions, align_in_place};

/// Arguments of `train face`.
#[derive(Debug, Args)]
pub(super) struct FaceArgs {
    /// Tensor of identity x expression x vertex x 3 in mm, NPY or NPZ (array "tensor"); or a collection text file with one mesh per shape
    data: PathBuf,
    /// Identity weights of the model [default: as many as hold --energy]
    #[arg(long, value_name = "N")]
    identity_dim: Option<usize>,
    /// Expression weights of the model [default: as many as hold --energy]
    #[arg(long, value_name = "M")]
    expression_dim: Option<usize>,
    /// Share of each mode's variation that is kept where no dimension is given
    #[arg(long, default_value_t = 0.98, value_name = "SHARE")]
    energy: f64,
    /// Rigid alignment of the shapes before training
    #[arg(long, value_enum, default_value_t = Align::Gpa)]
    align: Align,
    /// Tucker decomposition: hosvd, or hosvd refined by hooi
    #[arg(long, value_enum, default_value_t = Tucker::Hosvd)]
    tucker: Tucker,
    /// Mesh in the topology of the shapes, or its triangles as NPY [m, 3]
    #[arg(long, value_name = "MESH|TRIANGLES.npy")]
    template: Option<PathBuf>,
    /// Landmarks: JSON with landmarks13 (vertices) and landmarks13_names, or a labelled list of points on the template
    #[arg(long, value_name = "FILE.json|txt")]
    landmarks: Option<PathBuf>,
    /// Vertex of the other side for each vertex, NPY of n entries
    #[arg(long, value_name = "FILE.npy")]
    mirror: Option<PathBuf>,
    /// Names of the expressions: JSON with "expressions", or a text file with one name per line
    #[arg(long, value_name = "FILE")]
    expressions: Option<PathBuf>,
    /// Principal components of what the model misses of faces left out of the training, stored for `habitus fit`; 0: none
    #[arg(long, default_value_t = N_COMPONENTS, value_name = "N", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(0..=10_000))]
    remainder: usize,
    /// A sentence on the origin and licence of the data, stored in the model
    #[arg(long, value_name = "TEXT", default_value = "")]
    provenance: String,
    /// The model file to write (.hab)
    #[arg(short, long, value_name = "FILE.hab")]
    output: PathBuf,
}

/// Rigid alignment before training.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Align {
    /// As given.
    None,
    /// Group-wise: all shapes to their mean, without scale.
    Gpa,
}

impl Align {
    /// What was done, in words.
    pub fn words(self) -> &'static str {
        match self {
            Align::None => "aligned as given",
            Align::Gpa => "aligned by generalised Procrustes analysis",
        }
    }
}

/// Tucker decomposition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Tucker {
    /// Higher-order singular value decomposition.
    Hosvd,
    /// The same, refined by alternating eigenproblems.
    Hooi,
}

impl Tucker {
    /// What was done, in words.
    fn words(self) -> &'static str {
        match self {
            Tucker::Hosvd => "decomposed by higher-order SVD",
            Tucker::Hooi => "decomposed by higher-order SVD and orthogonal iteration",
        }
    }
}

/// Reading, aligning, decomposing, measuring, leaving out, writing.
const STAGES: usize = 6;

pub(super) fn run(args: &FaceArgs, console: &Console) -> Result<(), Error> {
    super::expect_extension(&args.output, "hab")?;
    let optional = [&args.template, &args.landmarks, &args.mirror, &args.expressions];
    let inputs = optional.into_iter().flatten().chain([&args.data]).map(PathBuf::as_path);
    Outputs::beside(inputs).file("-o", Some(&args.output)).check()?;
    let mut progress = console.progress("training");
    let mut shapes = tensor(&args.data)?;
    progress(1, STAGES);
    let template =
        Template::read(&shapes, args.template.as_deref(), args.landmarks.as_deref(), args.mirror.as_deref())?;
    let names = expression_names(args.expressions.as_deref(), shapes.n_expressions())?;
    if template.faces.is_empty() {
        console.warn(
            "no --template: the model will have no triangles, so it can give points (NPY) but no meshes or pictures",
        );
    }
    if template.landmarks.is_empty() {
        console.warn("no --landmarks: the model will have no landmarks, so it cannot be fitted to landmarks");
    }
    if args.align == Align::Gpa {
        let len = shapes.shape_len();
        align_in_place(shapes.data_mut(), len, &GpaOptions::default())?;
    }
    let size =
        |dim: Option<usize>, cap: usize| dim.map_or(ModeSize::Energy { share: args.energy, cap }, ModeSize::Dimension);
    progress(2, STAGES);
    if let Some(sentence) = unlikely_size(&shapes) {
        console.warn(&sentence);
    }
    let options = HosvdOptions {
        identity: size(args.identity_dim, 100),
        expression: size(args.expression_dim, 10),
        hooi: (args.tucker == Tucker::Hooi).then(HooiOptions::default),
    };
    let trained = hosvd(&shapes, &options)?;
    progress(3, STAGES);
    for warning in &trained.warnings {
        console.warn(&warning.to_string());
    }
    let model = trained.model;
    let errors = mean_vertex_distances(shapes.data(), &model.training_shapes()?, shapes.shape_len());
    let error = MeanError::of(&errors).ok_or_else(|| Error::Internal("no training shapes".into()))?;
    progress(4, STAGES);
    let missed = remainder(&shapes, [model.identity.dim, model.expression.dim], args.remainder)?;
    progress(5, STAGES);

    let mut source = ModelSource::of_multilinear(&model);
    source.faces = template.faces;
    source.landmarks = template.landmarks;
    source.landmark_names = template.landmark_names;
    source.mirror = template.mirror;
    source.pose_names = names;
    let n_components = missed.components.len() / shapes.shape_len();
    source.remainder = missed.components;
    source.provenance = provenance(args, &shapes);
    hab::write(&source, &args.output)?;
    progress(STAGES, STAGES);

    let (identity, expression) = (&model.identity, &model.expression);
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{}: {} vertices, {} identity weights ({:.2} % of the variation of {} identities), {} expression weights ({:.2} % of {} expressions)",
        args.output.display(),
        shapes.n_vertices(),
        identity.dim,
        100.0 * identity.energy_kept(),
        identity.count,
        expression.dim,
        100.0 * expression.energy_kept(),
        expression.count,
    );
    let _ = writeln!(
        text,
        "training vertex error: mean {:.4} mm, largest mean of a shape {:.4} mm",
        error.mean, error.largest
    );
    if n_components > 0 {
        let _ = writeln!(
            text,
            "faces left out: the model misses {:.3} mm (root mean square), all but {:.3} mm of it in the {n_components} components of the remainder",
            missed.rms, missed.rms_left
        );
    }
    console.result(
        &text,
        json!({
            "model": shown(&args.output),
            "vertices": shapes.n_vertices(),
            "identities": identity.count,
            "expressions": expression.count,
            "identity_dim": identity.dim,
            "expression_dim": expression.dim,
            "identity_energy_percent": 100.0 * identity.energy_kept(),
            "expression_energy_percent": 100.0 * expression.energy_kept(),
            "training_error_mean_mm": error.mean,
            "training_error_largest_mean_mm": error.largest,
            "remainder_components": n_components,
            "remainder_rms_mm": missed.rms,
            "remainder_rms_left_mm": missed.rms_left,
        }),
    )
}

/// Heights of a face mask that are taken for millimetres without a word.
const PLAUSIBLE_HEIGHT_MM: std::ops::RangeInclusive<f64> = 60.0..=600.0;

/// A sentence when the first shape is no face in millimetres: readers take every number as millimetres.
fn unlikely_size(shapes: &ShapeTensor) -> Option<String> {
    let heights = shapes.shape(0, 0).iter().skip(1).step_by(3);
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), &y| (low.min(y), high.max(y)));
    let height = high - low;
    (!PLAUSIBLE_HEIGHT_MM.contains(&height)).then(|| {
        format!(
            "the first shape is {height:.3} high; lengths are taken as millimetres and y as up, so convert the data first if they are in another \
             unit or frame"
        )
    })
}

/// The text that the model carries.
fn provenance(args: &FaceArgs, shapes: &ShapeTensor) -> String {
    let data = args.data.file_name().unwrap_or_default().to_string_lossy();
    let mut text = format!(
        "habitus {} train face; data {data}: {} identities, {} expressions, {} vertices; {}, {}",
        env!("CARGO_PKG_VERSION"),
        shapes.n_identities(),
        shapes.n_expressions(),
        shapes.n_vertices(),
        args.align.words(),
        args.tucker.words(),
    );
    if !args.provenance.is_empty() {
        let _ = write!(text, "\n{}", args.provenance);
    }
    text
}
