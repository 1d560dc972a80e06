//! What the scanner is told: where it stands, how fine and how faulty it is, what else is in the room.

use glam::DVec3;
use serde::Serialize;

use crate::Error;

/// From where a range image is taken, seen from the middle of the subject.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Viewpoint {
    /// Turn to the subject's left (from +z to +x) about the vertical axis, degrees.
    pub yaw_deg: f64,
    /// Height above the horizon, degrees; 90 is straight above.
    pub pitch_deg: f64,
}

impl Viewpoint {
    /// Straight ahead of the subject.
    pub const FRONT: Viewpoint = Viewpoint { yaw_deg: 0.0, pitch_deg: 0.0 };

    /// The viewpoint in this direction from the subject, of any length; [`Viewpoint::FRONT`] for one without length.
    pub fn towards([x, y, z]: [f64; 3]) -> Self {
        let yaw_deg = x.atan2(z).to_degrees();
        Viewpoint { yaw_deg, pitch_deg: y.atan2(x.hypot(z)).to_degrees() }
    }

    /// `n` viewpoints on the horizon, evenly spread over an arc of this many degrees with the front in its middle; over the whole
    /// circle from 360 on, the first in front.
    pub fn on_arc(n: usize, arc_deg: f64) -> Vec<Self> {
        let yaw = |k: usize| match n {
            0 | 1 => 0.0,
            _ if arc_deg >= 360.0 => 360.0 * k as f64 / n as f64,
            _ => arc_deg * (k as f64 / (n - 1) as f64 - 0.5),
        };
        (0..n).map(|k| Viewpoint { yaw_deg: yaw(k), pitch_deg: 0.0 }).collect()
    }

    /// Unit vectors to the right and up in the image, and from the subject to the scanner.
    pub(super) fn axes(&self) -> [DVec3; 3] {
        let (sy, cy) = self.yaw_deg.to_radians().sin_cos();
        let (sp, cp) = self.pitch_deg.to_radians().sin_cos();
        [DVec3::new(cy, 0.0, -sy), DVec3::new(-sp * sy, cp, -sp * cy), DVec3::new(cp * sy, sp, cp * cy)]
    }
}

/// How the scanner's rays run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Projection {
    /// All in parallel.
    Orthographic,
    /// From one eye.
    Perspective {
        /// Of the eye from the middle of the subject's box, mm.
        #[serde(rename = "distance_mm")]
        distance: f64,
    },
}

/// A scanner and its room. Lengths are in mm, angles in degrees.
///
/// The defaults make scans of faces like the simulated ones of the shared data: see docs/scanner.md.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScanOptions {
    /// One range image is taken from each, 1 to 255.
    pub views: Vec<Viewpoint>,
    /// How the rays run.
    pub projection: Projection,
    /// Width of a pixel; in perspective that at the middle of the subject.
    #[serde(rename = "pixel_mm")]
    pub pixel: f64,
    /// Standard deviation of the noise along the ray that each pixel has of its own.
    #[serde(rename = "noise_sigma_mm")]
    pub noise: f64,
    /// Standard deviation of the noise along the ray that neighbouring pixels share.
    #[serde(rename = "smooth_noise_sigma_mm")]
    pub smooth_noise: f64,
    /// Distance between pixels at which little of the smooth noise is shared.
    #[serde(rename = "smooth_noise_length_mm")]
    pub smooth_length: f64,
    /// Largest angle between the ray and the normal of what it meets at which something returns, 0 to 90.
    pub grazing_deg: f64,
    /// Whether faces return rays that come from behind them; else they only stop them.
    pub two_sided: bool,
    /// Number of holes: balls about random points of the scan in which nothing returns, in any view.
    pub holes: usize,
    /// Smallest and largest radius of a hole.
    #[serde(rename = "hole_radius_mm")]
    pub hole_radius: [f64; 2],
    /// Share of the returns that are flying points instead, 0 to 1.
    pub outliers: f64,
    /// Flying points lie at most so far before or behind the surface.
    #[serde(rename = "outlier_reach_mm")]
    pub outlier_reach: f64,
    /// Whether there is a floor at the lowest point of the subject.
    pub floor: bool,
    /// Number of blobs around the subject, which hide what is behind them.
    pub blobs: usize,
    /// Smallest and largest mean radius of a blob.
    #[serde(rename = "blob_radius_mm")]
    pub blob_radius: [f64; 2],
    /// By this angle each view after the first is turned about a random axis through the middle of the subject.
    pub calibration_turn_deg: f64,
    /// By this length each view after the first is then moved in a random direction.
    #[serde(rename = "calibration_shift_mm")]
    pub calibration_shift: f64,
    /// Whether neighbouring pixels become triangles; else the scan is a cloud.
    pub triangles: bool,
    /// No triangle has an edge so many pixels long: there the depth jumps.
    #[serde(rename = "longest_edge_pixels")]
    pub longest_edge: f64,
    /// Whether the points are put in random order; else they are in the order of the pixels.
    pub shuffle: bool,
    /// The whole scan is turned by a random angle up to this about a random axis through the middle of the subject.
    pub placement_turn_deg: f64,
    /// The whole scan is then moved in a random direction by a random length up to this.
    #[serde(rename = "placement_shift_mm")]
    pub placement_shift: f64,
    /// Decides everything random.
    pub seed: u64,
}

impl Default for ScanOptions {
    fn default() -> Self {
        ScanOptions {
            views: vec![Viewpoint::FRONT],
            projection: Projection::Orthographic,
            pixel: 1.8,
            noise: 0.33,
            smooth_noise: 0.3,
            smooth_length: 25.0,
            grazing_deg: 74.0,
            two_sided: false,
            holes: 5,
            hole_radius: [4.0, 12.0],
            outliers: 0.001,
            outlier_reach: 30.0,
            floor: false,
            blobs: 0,
            blob_radius: [8.0, 25.0],
            calibration_turn_deg: 0.1,
            calibration_shift: 0.15,
            triangles: true,
            longest_edge: 5.0,
            shuffle: true,
            placement_turn_deg: 0.0,
            placement_shift: 0.0,
            seed: 1,
        }
    }
}

impl ScanOptions {
    /// Without noise, gaps, flying points, errors of calibration and a placement of its own; points in the order of the pixels.
    pub fn faultless() -> Self {
        ScanOptions {
            noise: 0.0,
            smooth_noise: 0.0,
            grazing_deg: 90.0,
            holes: 0,
            outliers: 0.0,
            calibration_turn_deg: 0.0,
            calibration_shift: 0.0,
            shuffle: false,
            ..ScanOptions::default()
        }
    }

    /// Whether every number is one that a scanner can have.
    ///
    /// # Errors
    /// [`Error::Input`] names the first that is not, and what is expected.
    pub fn check(&self) -> Result<(), Error> {
        if !(1..=255).contains(&self.views.len()) {
            return Err(Error::input(format!("{} viewpoints: give 1 to 255", self.views.len())));
        }
        if let Projection::Perspective { distance } = self.projection {
            expect("distance of the eye in mm", distance, 1e-3, 1e6)?;
        }
        for view in &self.views {
            expect("yaw of a viewpoint in degrees", view.yaw_deg, -1e6, 1e6)?;
            expect("pitch of a viewpoint in degrees", view.pitch_deg, -90.0, 90.0)?;
        }
        for (what, count) in [("holes", self.holes), ("blobs", self.blobs)] {
            if count > 10_000 {
                return Err(Error::input(format!("{count} {what}: give at most 10000")));
            }
        }
        for (what, [low, high]) in [("hole", self.hole_radius), ("blob", self.blob_radius)] {
            expect(&format!("smallest radius of a {what} in mm"), low, 0.0, 1e6)?;
            expect(&format!("largest radius of a {what} in mm"), high, low, 1e6)?;
        }
        for (what, value, low, high) in [
            ("pixel in mm", self.pixel, 1e-3, 1e6),
            ("noise in mm", self.noise, 0.0, 1e5),
            ("smooth noise in mm", self.smooth_noise, 0.0, 1e5),
            ("length of the smooth noise in mm", self.smooth_length, self.pixel, 1e6),
            ("limit of grazing rays in degrees", self.grazing_deg, 0.0, 90.0),
            ("share of outliers", self.outliers, 0.0, 1.0),
            ("reach of outliers in mm", self.outlier_reach, 0.0, 1e5),
            ("turn of the calibration in degrees", self.calibration_turn_deg, 0.0, 180.0),
            ("shift of the calibration in mm", self.calibration_shift, 0.0, 1e6),
            ("longest edge in pixels", self.longest_edge, 1.0, 1e6),
            ("turn of the placement in degrees", self.placement_turn_deg, 0.0, 180.0),
            ("shift of the placement in mm", self.placement_shift, 0.0, 1e6),
        ] {
            expect(what, value, low, high)?;
        }
        Ok(())
    }
}

fn expect(what: &str, value: f64, low: f64, high: f64) -> Result<(), Error> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(Error::input(format!("the {what} is {value}: give a number from {low} to {high}")))
}
