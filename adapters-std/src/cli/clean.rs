//! `habitus clean`: a mesh or cloud made sound, and a table of what is wrong with many.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};

use super::clean_frame::{FrameArgs, restored};
use super::clean_normals::NormalsArgs;
use super::{Console, Outputs, expect_extension, shown};
use crate::Error;
use crate::io::atomic;
use crate::io::mesh::{
    MeshFile, MorphTarget, NonFinite, ReadOptions, Skin, WriteOptions, expect_written, read_file, write_file,
};
use crate::mesh::{CleanOptions, CleanReport, Cleaned, Keep, clean};

/// Arguments of `clean`.
#[derive(Debug, Args)]
pub(super) struct CleanArgs {
    /// Meshes or clouds; several without -o: one line for each
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    /// The cleaned mesh; without it nothing is written
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Vertices at most so far apart become one, in the unit of the file; 0: equal positions alone [default: 1e-7 of the
    /// root of the area, or of the extent of a cloud]
    #[arg(long, value_name = "DISTANCE")]
    weld: Option<f64>,
    /// Components that stay: all, largest, or those with at least this share of the area
    #[arg(long, default_value = "all", value_name = "all|largest|SHARE", value_parser = keep)]
    keep: Keep,
    /// Components with less than this share of the area are called debris
    #[arg(long, default_value_t = 0.01, value_name = "SHARE")]
    debris: f64,
    /// Only faces with an edge so many times longer than the median can be spikes; inf: no spike is removed
    #[arg(long, default_value_t = 10.0, value_name = "FACTOR")]
    spike_factor: f64,
    /// Let vertices without faces stay
    #[arg(long)]
    keep_unreferenced: bool,
    /// Points of a cloud whose neighbours are on average so many times farther than the median point's are outliers
    #[arg(long, default_value_t = 4.0, value_name = "FACTOR")]
    outlier_factor: f64,
    /// Remove the outliers of a cloud, which else are only reported
    #[arg(long)]
    remove_outliers: bool,
    #[command(flatten)]
    normals: NormalsArgs,
    #[command(flatten)]
    frame: FrameArgs,
    /// Write everything that was found and changed, with the old number of each vertex and face
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
}

fn keep(text: &str) -> Result<Keep, String> {
    match text {
        "all" => Ok(Keep::All),
        "largest" => Ok(Keep::Largest),
        _ => match text.parse() {
            Ok(share) if (0.0..=1.0).contains(&share) => Ok(Keep::Share(share)),
            _ => Err("give all, largest, or a share between 0 and 1".into()),
        },
    }
}

pub(super) fn run(args: &CleanArgs, console: &Console) -> Result<(), Error> {
    let options = CleanOptions {
        weld: args.weld,
        spike_factor: args.spike_factor,
        keep: args.keep,
        debris: args.debris,
        keep_unreferenced: args.keep_unreferenced,
        outlier_factor: args.outlier_factor,
        remove_outliers: args.remove_outliers,
    };
    if let Some(report) = &args.report {
        expect_extension(report, "json")?;
    }
    args.output.as_deref().map(expect_written).transpose()?;
    let inputs = args.inputs.iter().map(PathBuf::as_path).chain(args.frame.template());
    Outputs::beside(inputs).file("-o", args.output.as_deref()).file("--report", args.report.as_deref()).check()?;
    if let [input] = &args.inputs[..] {
        return one(input, args, &options, console);
    }
    if args.output.is_some() || args.report.is_some() || args.normals.is_given() || args.frame.is_given() {
        return Err(Error::input(
            "several inputs give a table; for -o, --report, --normals or --template give one input",
        ));
    }
    table(&args.inputs, &options, console)
}

/// Cleans one file; writes it where asked.
fn one(input: &Path, args: &CleanArgs, options: &CleanOptions, console: &Console) -> Result<(), Error> {
    let (file, mut cleaned) = cleaned(input, options, console)?;
    let mut text = format!("{}: {}", input.display(), described(&cleaned.report));
    let mut object = object(input, &cleaned.report);
    // Before there are other normals: those turned outwards would not tell a scan from its mirror image.
    let frame = of(input, args.frame.of(&cleaned.mesh, console))?;
    if args.normals.is_given() {
        let (normals, line, found) = of(input, args.normals.of(&cleaned.mesh, console))?;
        cleaned.mesh.normals = normals;
        text += &line;
        object["normals"] = found;
    }
    if let Some((_, line, found)) = &frame {
        text += line;
        object["frame"] = found.clone();
    }
    if let Some(output) = &args.output {
        let file = carried(file, &cleaned);
        let file = match &frame {
            Some((frame, ..)) => restored(file, frame),
            None => file,
        };
        for left_out in write_file(output, &file, &WriteOptions::default())? {
            console.warn(&format!("{}: not written: {left_out}", output.display()));
        }
        let _ = writeln!(text, "written: {}", output.display());
    }
    if let Some(path) = &args.report {
        let Cleaned { report, old_of_vertex, old_of_face, twins, .. } = &cleaned;
        let whole = json!({
            "input": shown(input),
            "report": report,
            "old_of_vertex": old_of_vertex,
            "old_of_face": old_of_face,
            "twins": twins,
        });
        atomic::write(path, whole.to_string().as_bytes())?;
    }
    object["output"] = args.output.as_deref().map(shown).into();
    console.result(&text, object)
}

/// One line for each file; those that cannot be cleaned are warnings, unless no other is left.
fn table(inputs: &[PathBuf], options: &CleanOptions, console: &Console) -> Result<(), Error> {
    let mut rows = vec![COLUMNS.map(str::to_owned).to_vec()];
    let mut objects = Vec::new();
    for input in inputs {
        match cleaned(input, options, console) {
            Ok((_, cleaned)) => {
                rows.push(row(input, &cleaned.report));
                objects.push(object(input, &cleaned.report));
            }
            Err(error) => {
                console.warn(&error.to_string());
                objects.push(json!({ "input": shown(input), "error": error.to_string() }));
            }
        }
    }
    if rows.len() == 1 {
        return Err(Error::input(format!("none of the {} inputs can be cleaned", inputs.len())));
    }
    console.result(&aligned(&rows), json!({ "files": objects }))
}

fn cleaned(input: &Path, options: &CleanOptions, console: &Console) -> Result<(MeshFile, Cleaned), Error> {
    let file = read_file(input, &ReadOptions { non_finite: NonFinite::Keep })?;
    for left_out in &file.left_out {
        console.warn(&format!("{}: not kept: {left_out}", input.display()));
    }
    let cleaned = of(input, clean(&file.mesh, options))?;
    Ok((file, cleaned))
}

/// The result of work on a file, whose name an error of its content lacks.
fn of<T>(input: &Path, result: Result<T, Error>) -> Result<T, Error> {
    result.map_err(|error| match error {
        Error::Input(problem) => Error::Input(format!("{}: {problem}", input.display())),
        other => other,
    })
}

/// The file with the cleaned mesh, its morph targets and joints led to the new vertices.
fn carried(file: MeshFile, cleaned: &Cleaned) -> MeshFile {
    let old = || cleaned.old_of_vertex.iter().map(|&old| old as usize);
    let morphs = file.morphs.into_iter().map(|morph| MorphTarget {
        displacements: old().filter_map(|old| morph.displacements.get(old).copied()).collect(),
        name: morph.name,
    });
    let skin = file.skin.map(|skin| Skin {
        influences: old().map(|old| skin.influences.get(old).cloned().unwrap_or_default()).collect(),
        joints: skin.joints,
    });
    MeshFile { mesh: cleaned.mesh.clone(), morphs: morphs.collect(), skin, left_out: Vec::new() }
}

/// The report for programs: with the input's name, and clauses for people.
fn object(input: &Path, report: &CleanReport) -> Value {
    let mut object = json!(report);
    object["input"] = shown(input).into();
    object["changes"] = report.changes().into();
    object["remarks"] = report.remarks().into();
    object["unchanged"] = report.is_unchanged().into();
    object
}

/// The report for people.
fn described(report: &CleanReport) -> String {
    let (before, after) = (report.before, report.after);
    let mut text =
        format!("{} vertices, {} faces; cleaned: {}, {}\n", before.vertices, before.faces, after.vertices, after.faces);
    let (changes, remarks) = (report.changes(), report.remarks());
    if changes.is_empty() {
        text += "nothing to change\n";
    }
    for (heading, clauses) in [("changed", changes), ("found and left", remarks)] {
        for clause in clauses {
            let _ = writeln!(text, "{heading}: {clause}");
        }
    }
    let _ = writeln!(text, "scale {:.6}, vertices within {:.3e} welded", report.scale, report.weld_distance);
    for component in report.components.iter().take(LISTED) {
        let genus = component.genus.map_or("not orientable".into(), |genus| format!("genus {genus}"));
        let volume = component.volume.map_or(String::new(), |volume| format!(", volume {volume:.6e}"));
        let _ = writeln!(
            text,
            "component: {:.2} % of the area, {} vertices, {} faces, {} boundary loops, {genus}{volume}{}",
            100.0 * component.area_share,
            component.vertices,
            component.faces,
            component.boundary_loops,
            if component.is_debris { ", debris" } else { "" }
        );
    }
    if report.components.len() > LISTED {
        let _ = writeln!(text, "and {} smaller components", report.components.len() - LISTED);
    }
    text
}

/// Components that are listed for people.
const LISTED: usize = 12;

const COLUMNS: [&str; 22] = [
    "file",
    "vertices",
    "faces",
    "->vertices",
    "->faces",
    "not finite",
    "loose",
    "welded",
    "repeated",
    "flat",
    "duplicate",
    "opposite",
    "edges cut",
    "fans parted",
    "turned",
    "spikes",
    "long kept",
    "components",
    "debris",
    "loops",
    "genus",
    "outliers",
];

fn row(input: &Path, report: &CleanReport) -> Vec<String> {
    let loops: usize = report.components.iter().map(|component| component.boundary_loops).sum();
    let genus: u64 = report.components.iter().filter_map(|component| component.genus).sum();
    let counts = [
        report.before.vertices,
        report.before.faces,
        report.after.vertices,
        report.after.faces,
        report.non_finite_vertices.count,
        report.unreferenced_vertices.count,
        report.welded_vertices.count,
        report.repeated_index_faces.count,
        report.zero_area_faces.count,
        report.duplicate_faces.count,
        report.opposite_faces.count,
        report.non_manifold_edges.count,
        report.non_manifold_vertices.count,
        report.turned_faces.count,
        report.spikes.count,
        report.long_faces.count,
        report.components.len(),
        report.n_debris(),
        loops,
        genus as usize,
        report.outliers.count,
    ];
    std::iter::once(shown(input)).chain(counts.iter().map(usize::to_string)).collect()
}

/// The rows as columns: the first to the left, the others to the right.
fn aligned(rows: &[Vec<String>]) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..COLUMNS.len()).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let _ = write!(text, "{:<width$}", row[0], width = widths[0]);
        for (cell, width) in row.iter().zip(&widths).skip(1) {
            let _ = write!(text, "  {cell:>width$}");
        }
        text.push('\n');
    }
    text
}
