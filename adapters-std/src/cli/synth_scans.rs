//! `habitus synth scans`: simulated raw scans of meshes, with their truth.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::clean_frame::unit;
use super::measure_distance::positive;
use super::{Console, Outputs, shown};
use crate::Error;
use crate::io::mesh as mesh_files;
use crate::spatial::frame_recovery::Unit;
use crate::synth::scanner::files::{ScanFolder, scan_names};
use crate::synth::scanner::{Projection, ScanOptions, Viewpoint, scanned};

/// A scan of fewer points looks like one in another unit.
const FEW: usize = 500;

/// Arguments of `synth scans`.
#[derive(Debug, Args)]
pub(super) struct ScansArgs {
    /// Meshes, y up, one scan of each
    #[arg(required = true, value_name = "MESH")]
    inputs: Vec<PathBuf>,
    /// Folder to write: scan_00.ply ..., truth_00.ply ..., truth_face_00.npy ..., truth_barycentric_00.npy ..., scans.json
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Unit of the meshes, and of the scans; all other lengths are in mm
    #[arg(long, default_value = "mm", value_name = "mm|cm|m|in|ft", value_parser = unit)]
    unit: Unit,
    /// Seed of the first scan, one more for each further
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Views, evenly spread over the arc
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=255))]
    views: u16,
    /// Arc of the views about the vertical axis, the front (+z) in its middle; 360: all around
    #[arg(long, default_value_t = 90.0, value_name = "DEGREES", value_parser = positive)]
    arc: f64,
    /// A viewpoint of your own, several times: turn to the subject's left and height above the horizon, degrees
    #[arg(long = "from", value_name = "YAW,PITCH", value_parser = pair, allow_hyphen_values = true, conflicts_with_all = ["views", "arc"])]
    from: Vec<[f64; 2]>,
    /// Rays run from an eye so far from the middle of the mesh, mm [default: in parallel]
    #[arg(long, value_name = "MM", value_parser = positive)]
    eye: Option<f64>,
    /// Width of a pixel, mm [default: 1.8]
    #[arg(long, value_name = "MM", value_parser = positive)]
    pixel: Option<f64>,
    /// Start from a scanner without noise, gaps, flying points and errors of calibration
    #[arg(long)]
    faultless: bool,
    /// Standard deviation of each pixel's own noise along the ray, mm [default: 0.33]
    #[arg(long, value_name = "MM")]
    noise: Option<f64>,
    /// Standard deviation of the noise that neighbours share, mm [default: 0.3]
    #[arg(long, value_name = "MM")]
    smooth_noise: Option<f64>,
    /// Distance over which they share it, mm [default: 25]
    #[arg(long, value_name = "MM", value_parser = positive)]
    smooth_length: Option<f64>,
    /// Rays that meet the surface at more than this angle from its normal are lost, 0 to 90 [default: 74]
    #[arg(long, value_name = "DEGREES")]
    grazing: Option<f64>,
    /// See faces from behind too
    #[arg(long)]
    two_sided: bool,
    /// Round holes [default: 5]
    #[arg(long, value_name = "N")]
    holes: Option<u16>,
    /// Smallest and largest radius of the holes, mm [default: 4,12]
    #[arg(long, value_name = "MM,MM", value_parser = pair)]
    hole_radius: Option<[f64; 2]>,
    /// Share of flying points, 0 to 1 [default: 0.001]
    #[arg(long, value_name = "SHARE")]
    outliers: Option<f64>,
    /// They are at most so far from the surface, mm [default: 30]
    #[arg(long, value_name = "MM")]
    outlier_reach: Option<f64>,
    /// Put a floor under the mesh
    #[arg(long)]
    floor: bool,
    /// Put so many blobs around the mesh
    #[arg(long, default_value_t = 0, value_name = "N")]
    blobs: u16,
    /// Smallest and largest radius of the blobs, mm [default: 8,25]
    #[arg(long, value_name = "MM,MM", value_parser = pair)]
    blob_radius: Option<[f64; 2]>,
    /// By how much each view after the first is misplaced [default: 0.1,0.15]
    #[arg(long, value_name = "DEGREES,MM", value_parser = pair)]
    calibration: Option<[f64; 2]>,
    /// Turn and move each scan at random by at most this [default: 0,0]
    #[arg(long, value_name = "DEGREES,MM", value_parser = pair)]
    place: Option<[f64; 2]>,
    /// Points without triangles
    #[arg(long)]
    cloud: bool,
    /// Triangles have no edge of so many pixels [default: 5]
    #[arg(long, value_name = "PIXELS", value_parser = positive, conflicts_with = "cloud")]
    longest_edge: Option<f64>,
    /// Leave the points in the order of the pixels
    #[arg(long)]
    in_order: bool,
}

fn pair(text: &str) -> Result<[f64; 2], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[a, b]) if a.is_finite() && b.is_finite() => Ok([a, b]),
        _ => Err(format!("{text:?} is not two numbers with a comma between them")),
    }
}

impl ScansArgs {
    fn options(&self) -> ScanOptions {
        let base = if self.faultless { ScanOptions::faultless() } else { ScanOptions::default() };
        let views = if self.from.is_empty() {
            Viewpoint::on_arc(usize::from(self.views), self.arc)
        } else {
            self.from.iter().map(|&[yaw_deg, pitch_deg]| Viewpoint { yaw_deg, pitch_deg }).collect()
        };
        let [calibration_turn_deg, calibration_shift] =
            self.calibration.unwrap_or([base.calibration_turn_deg, base.calibration_shift]);
        let [placement_turn_deg, placement_shift] =
            self.place.unwrap_or([base.placement_turn_deg, base.placement_shift]);
        ScanOptions {
            views,
            projection: self.eye.map_or(base.projection, |distance| Projection::Perspective { distance }),
            pixel: self.pixel.unwrap_or(base.pixel),
            noise: self.noise.unwrap_or(base.noise),
            smooth_noise: self.smooth_noise.unwrap_or(base.smooth_noise),
            smooth_length: self.smooth_length.unwrap_or(base.smooth_length),
            grazing_deg: self.grazing.unwrap_or(base.grazing_deg),
            two_sided: self.two_sided,
            holes: self.holes.map_or(base.holes, usize::from),
            hole_radius: self.hole_radius.unwrap_or(base.hole_radius),
            outliers: self.outliers.unwrap_or(base.outliers),
            outlier_reach: self.outlier_reach.unwrap_or(base.outlier_reach),
            floor: self.floor,
            blobs: usize::from(self.blobs),
            blob_radius: self.blob_radius.unwrap_or(base.blob_radius),
            calibration_turn_deg,
            calibration_shift,
            triangles: !self.cloud,
            longest_edge: self.longest_edge.unwrap_or(base.longest_edge),
            shuffle: !self.in_order,
            placement_turn_deg,
            placement_shift,
            seed: self.seed,
        }
    }
}

pub(super) fn run(args: &ScansArgs, console: &Console) -> Result<(), Error> {
    let mut options = args.options();
    options.check()?;
    let n = args.inputs.len();
    let inputs = args.inputs.iter().map(PathBuf::as_path);
    Outputs::beside(inputs).folder("-o", Some(&args.output), scan_names(n)).check()?;
    let mut folder = ScanFolder::new(&args.output, args.unit, n)?;
    let mut progress = console.progress("scanning");
    let mut text = String::new();
    for (number, input) in args.inputs.iter().enumerate() {
        options.seed = args.seed.wrapping_add(number as u64);
        let mut subject = mesh_files::read(input)?;
        subject.positions.iter_mut().flatten().for_each(|x| *x *= args.unit.millimetres());
        let scan = scanned(&subject, &options).map_err(|error| match error {
            Error::Input(problem) => Error::Input(format!("{}: {problem}", input.display())),
            other => other,
        })?;
        folder.add(&scan, &subject, input, &options)?;
        progress(number + 1, n);
        if scan.truth.len() < FEW {
            let n = scan.truth.len();
            console.warn(&format!("{}: {n} points alone: are unit and pixel right?", input.display()));
        }
        let record = &folder.records()[number];
        let _ = writeln!(
            text,
            "{}: {}, {} points ({} clutter, {} outliers), {} triangles, mean error {:.3} mm",
            args.output.join(record["file"].as_str().unwrap_or_default()).display(),
            input.display(),
            record["points"],
            record["labels"]["clutter"],
            record["labels"]["outlier"],
            record["triangles"],
            record["distance_to_truth_mm"]["mean"].as_f64().unwrap_or(f64::NAN),
        );
    }
    folder.finish()?;
    let file = args.output.join("scans.json");
    let _ = writeln!(text, "written: {} (simulated)", file.display());
    console.result(
        &text,
        json!({
            "output": shown(&args.output),
            "simulated": true,
            "unit": args.unit.symbol(),
            "scans": folder.records(),
        }),
    )
}
