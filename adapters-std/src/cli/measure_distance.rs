//! `habitus measure distance`: how far two shapes are apart, in figures, as a coloured mesh and as a picture.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};

use super::{Console, Outputs, expect_extension, shown};
use crate::Error;
use crate::io::mesh as mesh_files;
use crate::measure::distance::{
    Direction, DistanceOptions, DistanceSummary, PointDistance, SurfaceDistance, Target, direction, unit_factor,
};
use crate::mesh::{Attribute, Mesh, Scalar};
use crate::report::{ColourBar, ColourScale, Figure, Finish, Scene, rounded_up};

/// Arguments of `measure distance`.
#[derive(Debug, Args)]
pub(super) struct DistanceArgs {
    /// First shape: a mesh or a cloud
    a: PathBuf,
    /// Second shape, in the same frame and unit
    b: PathBuf,
    /// Measure from N points that are spread evenly over the area of each mesh, not from its vertices
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    samples: Option<u32>,
    /// Seed of these points
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Let vertices count by the area around them
    #[arg(long, conflicts_with = "samples")]
    area_weighted: bool,
    /// Distances for which the share of points within them is told, mm
    #[arg(long, value_name = "MM,...", value_delimiter = ',', default_values_t = [0.5, 1.0, 2.0, 5.0, 10.0], value_parser = positive)]
    within: Vec<f64>,
    /// Colour by signed distance: positive in front of the other surface, negative behind it
    #[arg(long)]
    signed: bool,
    /// Write the first shape with the colour and the distance of every vertex
    #[arg(long, value_name = "FILE.ply")]
    ply: Option<PathBuf>,
    /// Draw both shapes, coloured by their distances
    #[arg(long, value_name = "FILE.png")]
    png: Option<PathBuf>,
    /// Pixels of the longer side of each view in the picture
    #[arg(long, default_value_t = 480, value_name = "PIXELS", value_parser = clap::value_parser!(u16).range(16..=4096))]
    size: u16,
    /// End of the colour scale, mm [default: 90 % of the first shape's points and half of the second's are within it]
    #[arg(long, value_name = "MM", value_parser = positive)]
    max: Option<f64>,
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|number: &f64| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| format!("{text:?} is not a positive number"))
}

pub(super) fn run(args: &DistanceArgs, console: &Console) -> Result<(), Error> {
    for (path, extension) in [(&args.ply, "ply"), (&args.png, "png")] {
        path.as_deref().map(|path| expect_extension(path, extension)).transpose()?;
    }
    let inputs = [&*args.a, &*args.b];
    Outputs::beside(inputs).file("--ply", args.ply.as_deref()).file("--png", args.png.as_deref()).check()?;
    let (a, b) = (mesh_files::read(&args.a)?, mesh_files::read(&args.b)?);
    if args.signed && b.faces.is_empty() {
        return Err(Error::input(format!(
            "{}: a cloud has no front and back; leave --signed out, or give a mesh as the second shape",
            args.b.display()
        )));
    }
    if let Some(factor) = unit_factor(&a, &b) {
        let (more, times) = if factor > 1.0 { ("larger", factor) } else { ("smaller", 1.0 / factor) };
        console.warn(&format!(
            "{} is about {} times {more} than {}: are they in different units?",
            args.a.display(),
            (10.0 * times).round() / 10.0,
            args.b.display()
        ));
    }
    let options = DistanceOptions {
        samples: args.samples.unwrap_or(0) as usize,
        seed: args.seed,
        area_weighted: args.area_weighted,
        thresholds: args.within.clone(),
    };
    let (to_a, to_b) = (of(&args.a, Target::new(&a))?, of(&args.b, Target::new(&b))?);
    let found = SurfaceDistance {
        a_to_b: of(&args.a, direction(&a, &to_b, &options))?,
        b_to_a: of(&args.b, direction(&b, &to_a, &options))?,
    };
    let limit = args.max.unwrap_or_else(|| {
        // The second shape often covers more than the first; its far parts would wash out what the first has to show.
        let [first, second] =
            [&found.a_to_b, &found.b_to_a].map(|direction| direction.inner.as_ref().unwrap_or(&direction.all));
        rounded_up(first.quantile_90.max(second.median))
    });
    let scale = if args.signed { ColourScale::signed(limit) } else { ColourScale::sequential(0.0, limit) };
    let coloured = |from: &Mesh, to: &Target| Coloured::new(to.distances(&from.positions), args.signed, &scale);
    if args.ply.is_some() || args.png.is_some() {
        let of_a = coloured(&a, &to_b);
        if let Some(path) = &args.ply {
            mesh_files::write(path, &of_a.mesh(&a))?;
        }
        if let Some(path) = &args.png {
            let of_b = coloured(&b, &to_a);
            let rows = [(&a, &of_a, &found.a_to_b), (&b, &of_b, &found.b_to_a)];
            let figure = figure([&args.a, &args.b], rows, scale);
            Figure { picture_size: args.size.into(), ..figure }.drawn().write_png(path)?;
        }
    }
    let [ply, png] = [&args.ply, &args.png].map(|path| path.as_deref().map(shown));
    let object = json!({
        "a": shape(&args.a, &a),
        "b": shape(&args.b, &b),
        "a_to_b": described_direction(&found.a_to_b),
        "b_to_a": described_direction(&found.b_to_a),
        "chamfer_mean_mm": found.chamfer_mean(),
        "hausdorff_mm": found.hausdorff(),
        "colour_limit_mm": limit,
        "ply": ply,
        "png": png,
    });
    console.result(&table(args, &a, &b, &found), object)
}

/// The file named in an error about its content.
fn of<T>(path: &Path, outcome: Result<T, Error>) -> Result<T, Error> {
    outcome.map_err(|error| match error {
        Error::Input(problem) => Error::Input(format!("{}: {problem}", path.display())),
        other => other,
    })
}

/// Vertices with their distances and colours. Those that are closest to a boundary have the colour of a missing number.
struct Coloured {
    points: Vec<PointDistance>,
    shown: Vec<f64>,
    signed: bool,
    colours: Vec<[u8; 3]>,
}

impl Coloured {
    fn new(points: Vec<PointDistance>, signed: bool, scale: &ColourScale) -> Self {
        let shown = points.iter().map(|point| if point.at_boundary { f64::NAN } else { value(point, signed) });
        let shown: Vec<f64> = shown.collect();
        Coloured { colours: scale.colours(&shown), points, shown, signed }
    }

    /// The mesh with these colours, and attributes that hold the numbers.
    fn mesh(&self, mesh: &Mesh) -> Mesh {
        let (distance, boundary) = ("distance", "at_boundary");
        let mut attributes = mesh.attributes.clone();
        attributes.retain(|attribute| attribute.name != distance && attribute.name != boundary);
        let values = self.points.iter().map(|point| f64::from(value(point, self.signed) as f32)).collect();
        attributes.push(Attribute { name: distance.into(), scalar: Scalar::F32, values });
        let values = self.points.iter().map(|point| f64::from(u8::from(point.at_boundary))).collect();
        attributes.push(Attribute { name: boundary.into(), scalar: Scalar::U8, values });
        Mesh { colours: self.colours.clone(), attributes, ..mesh.clone() }
    }
}

fn value(point: &PointDistance, signed: bool) -> f64 {
    point.signed.filter(|_| signed).unwrap_or(point.distance)
}

fn figure<'a>(paths: [&Path; 2], rows: [(&'a Mesh, &'a Coloured, &Direction); 2], scale: ColourScale) -> Figure<'a> {
    let names = paths.map(|path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned());
    let scenes = rows.iter().zip([0, 1]).map(|((mesh, coloured, direction), from)| {
        let mut scene = Scene { finish: Finish::Even, ..Scene::new([*mesh]) };
        scene.meshes.iter_mut().for_each(|placed| placed.colours = Some(&coloured.colours));
        let all = &direction.all;
        let digits = decimals(all.largest);
        let caption = format!(
            "{} to {}: mean {:.digits$}, 95 % within {:.digits$}, largest {:.digits$} mm",
            names[from],
            names[1 - from],
            all.mean,
            all.quantile_95,
            all.largest
        );
        (caption, scene)
    });
    let values: Vec<f64> = rows.iter().flat_map(|(_, coloured, _)| coloured.shown.iter().copied()).collect();
    let title = if rows[0].1.signed { "signed, mm" } else { "distance, mm" };
    let mut bar = ColourBar::of(scale, title, &values);
    bar.missing_label = "boundary".into();
    Figure { bar: Some(bar), ..Figure::new(format!("{} and {}", names[0], names[1]), scenes.collect()) }
}

fn shape(path: &Path, mesh: &Mesh) -> Value {
    json!({ "file": shown(path), "vertices": mesh.positions.len(), "faces": mesh.faces.len() })
}

fn described_direction(direction: &Direction) -> Value {
    let mut object = described(&direction.all);
    object["at_boundary"] = direction.at_boundary.into();
    object["without_boundary"] = direction.inner.as_ref().map_or(Value::Null, described);
    object
}

fn described(summary: &DistanceSummary) -> Value {
    let within: Vec<Value> =
        summary.within.iter().map(|(limit, share)| json!({ "limit_mm": limit, "percent": 100.0 * share })).collect();
    json!({
        "points": summary.count,
        "mean_mm": summary.mean,
        "rms_mm": summary.rms,
        "median_mm": summary.median,
        "quantile_90_mm": summary.quantile_90,
        "quantile_95_mm": summary.quantile_95,
        "quantile_99_mm": summary.quantile_99,
        "largest_mm": summary.largest,
        "signed_mean_mm": summary.signed_mean,
        "within": within,
    })
}

fn table(args: &DistanceArgs, a: &Mesh, b: &Mesh, found: &SurfaceDistance) -> String {
    let mut text = String::new();
    for (name, path, mesh) in [("A", &args.a, a), ("B", &args.b, b)] {
        let (n, faces) = (mesh.positions.len(), mesh.faces.len());
        let _ = match faces {
            0 => writeln!(text, "{name}: {}, {n} points", path.display()),
            _ => writeln!(text, "{name}: {}, {n} vertices, {faces} faces", path.display()),
        };
    }
    let digits = decimals(found.hausdorff());
    let _ = writeln!(text, "\n| mm | points | mean | rms | 50 % | 90 % | 95 % | 99 % | largest | signed mean |");
    let _ = writeln!(text, "|---|---|---|---|---|---|---|---|---|---|");
    let mut row = |name: &str, summary: &DistanceSummary| {
        let quantiles = [summary.median, summary.quantile_90, summary.quantile_95, summary.quantile_99];
        let figures = [summary.mean, summary.rms].into_iter().chain(quantiles).chain([summary.largest]);
        let figures: Vec<String> = figures.map(|figure| format!("{figure:.digits$}")).collect();
        let signed = summary.signed_mean.map_or("-".into(), |mean| format!("{mean:+.digits$}"));
        let _ = writeln!(text, "| {name} | {} | {} | {signed} |", summary.count, figures.join(" | "));
    };
    for (name, other, direction) in [("A to B", "B", &found.a_to_b), ("B to A", "A", &found.b_to_a)] {
        row(name, &direction.all);
        if let (Some(inner), 1..) = (&direction.inner, direction.at_boundary) {
            row(&format!("{name}, not at the boundary of {other}"), inner);
        }
    }
    let shares = |summary: &DistanceSummary| {
        let shares = summary.within.iter().map(|(limit, share)| format!("{limit} mm {:.1} %", 100.0 * share));
        shares.collect::<Vec<_>>().join(", ")
    };
    let _ = writeln!(text, "\nwithin, A to B: {}", shares(&found.a_to_b.all));
    let _ = writeln!(text, "within, B to A: {}", shares(&found.b_to_a.all));
    let _ = writeln!(text, "mean of both means (Chamfer): {:.digits$} mm", found.chamfer_mean());
    let _ = writeln!(text, "largest of both (Hausdorff): {:.digits$} mm", found.hausdorff());
    for path in [&args.ply, &args.png].into_iter().flatten() {
        let _ = writeln!(text, "{}: written", path.display());
    }
    text
}

/// Decimals that show about five digits of the largest number of a table.
fn decimals(largest: f64) -> usize {
    if !(largest > 0.0) {
        return 3;
    }
    (5.0 - largest.log10().ceil()).clamp(0.0, 9.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coloured_mesh_carries_the_numbers_of_its_colours() {
        let old = Attribute { name: "distance".into(), scalar: Scalar::U8, values: vec![9.0; 3] };
        let kept = Attribute { name: "label".into(), scalar: Scalar::U8, values: vec![1.0; 3] };
        let mesh = Mesh { positions: vec![[0.0; 3]; 3], attributes: vec![old, kept.clone()], ..Mesh::default() };
        let point =
            |signed: f64, at_boundary| PointDistance { distance: signed.abs(), signed: Some(signed), at_boundary };
        let points = vec![point(-0.1, false), point(2.5, false), point(1.0, true)];
        let scale = ColourScale::signed(2.0);
        let coloured = Coloured::new(points, true, &scale).mesh(&mesh);
        assert_eq!(coloured.colours, [scale.colour(-0.1), scale.above, scale.missing]);
        let names: Vec<&str> = coloured.attributes.iter().map(|attribute| attribute.name.as_str()).collect();
        assert_eq!(names, ["label", "distance", "at_boundary"]);
        assert_eq!(coloured.attributes[0], kept);
        assert_eq!(coloured.attributes[1].values, [f64::from(-0.1_f32), 2.5, 1.0]);
        assert_eq!(coloured.attributes[2].values, [0.0, 0.0, 1.0]);
    }

    #[test]
    fn tables_show_five_digits_of_their_largest_number() {
        assert_eq!([12.3, 0.012, 1500.0, 1e9, 0.0, f64::NAN].map(decimals), [3, 6, 1, 0, 3, 3]);
    }
}
