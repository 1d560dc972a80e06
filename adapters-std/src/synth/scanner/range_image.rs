//! What one view sees: for each pixel where its ray is returned, and as how far the scanner takes that.

use glam::DVec3;
use rand::RngExt;
use rayon::prelude::*;

use super::Label;
use super::camera::Camera;
use super::chance::{Purpose, SmoothField, between, normal, stream};
use super::options::ScanOptions;
use super::room::Room;
use crate::mesh::sampling::SurfacePoint;

/// A ray that came back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Return {
    /// Where it met the room.
    pub met: DVec3,
    /// Where the scanner believes that.
    pub point: DVec3,
    pub label: Label,
    /// The point of the subject; none for what is no part of it.
    pub truth: Option<SurfacePoint>,
}

/// The pixels of a view.
#[derive(Debug)]
pub(super) struct RangeImage {
    pub camera: Camera,
    pub returns: Vec<Option<Return>>,
    /// Rays that met something at a grazing angle, and from behind.
    pub grazing: usize,
    pub from_behind: usize,
}

/// What becomes of a ray.
enum Fate {
    Nothing,
    Grazing,
    FromBehind,
    Returned(Return),
}

impl RangeImage {
    /// What the camera sees, without error.
    pub fn taken(room: &Room<'_>, options: &ScanOptions, camera: Camera) -> Self {
        let least = if options.grazing_deg >= 90.0 { 0.0 } else { options.grazing_deg.to_radians().cos() };
        let fate = |pixel: usize| {
            let (origin, direction) = camera.ray(pixel);
            let Some(hit) = room.first_hit(origin, direction) else { return Fate::Nothing };
            let cosine = -direction.dot(room.normal(hit.face));
            if cosine < 0.0 && !options.two_sided {
                return Fate::FromBehind;
            }
            if !(cosine.abs() >= least) {
                return Fate::Grazing;
            }
            let met = origin + direction * hit.t;
            let is_subject = room.is_subject(hit.face);
            let truth = SurfacePoint { face: hit.face, barycentric: hit.barycentric };
            Fate::Returned(Return {
                met,
                point: met,
                label: if is_subject { Label::Surface } else { Label::Clutter },
                truth: is_subject.then_some(truth),
            })
        };
        let fates: Vec<Fate> = (0..camera.n_pixels()).into_par_iter().with_min_len(64).map(fate).collect();
        let (mut grazing, mut from_behind) = (0, 0);
        let returns = fates.into_iter().map(|fate| match fate {
            Fate::Returned(found) => Some(found),
            Fate::Nothing => None,
            Fate::Grazing => {
                grazing += 1;
                None
            }
            Fate::FromBehind => {
                from_behind += 1;
                None
            }
        });
        let returns = returns.collect();
        RangeImage { camera, returns, grazing, from_behind }
    }

    /// Adds the errors along the rays: noise that each pixel has of its own, noise that neighbours share, flying points.
    ///
    /// Numbers are drawn for every pixel, returned or not, so that one fault does not change another.
    pub fn spoil(&mut self, options: &ScanOptions, index: usize) {
        let mut white = stream(options.seed, Purpose::Noise(index));
        let mut flying = stream(options.seed, Purpose::Outliers(index));
        let last = self.camera.in_image(self.camera.n_pixels() - 1);
        let smooth = (options.smooth_noise > 0.0).then(|| {
            let mut random = stream(options.seed, Purpose::SmoothNoise(index));
            SmoothField::over(last.map(|x| x / options.smooth_length), &mut random)
        });
        for (pixel, found) in self.returns.iter_mut().enumerate() {
            let mut error = options.noise * normal(&mut white);
            let (lot, jump) = (flying.random::<f64>(), between(&mut flying, [-1.0, 1.0]));
            let Some(found) = found else { continue };
            if let Some(smooth) = &smooth {
                error +=
                    options.smooth_noise * smooth.at(self.camera.in_image(pixel).map(|x| x / options.smooth_length));
            }
            if lot < options.outliers {
                error += options.outlier_reach * jump;
                (found.label, found.truth) = (Label::Outlier, None);
            }
            found.point = found.met + self.camera.ray(pixel).1 * error;
        }
    }

    /// The triangles between neighbouring pixels that both returned, in pixels: counter-clockwise seen from the scanner.
    ///
    /// Of four pixels the shorter diagonal divides the square; three give one triangle. Where an edge is longer than allowed the depth
    /// jumps and the triangle is left out.
    pub fn triangles(&self, longest_edge: f64) -> Vec<[usize; 3]> {
        let [columns, rows] = self.camera.size;
        let point = |pixel: usize| self.returns[pixel].map(|found| found.point);
        let joined = |triangle: [usize; 3]| {
            let [Some(a), Some(b), Some(c)] = triangle.map(point) else { return false };
            let pixel = self.camera.pixel_at((a + b + c) / 3.0);
            [a - b, b - c, c - a].iter().all(|edge| edge.length() < longest_edge * pixel)
        };
        let mut triangles = Vec::new();
        for row in 0..rows.saturating_sub(1) {
            for column in 0..columns.saturating_sub(1) {
                let a = row * columns + column;
                let [b, c, d] = [a + 1, a + 1 + columns, a + columns];
                let rising = match [a, b, c, d].map(point) {
                    [Some(a), Some(b), Some(c), Some(d)] => (c - a).length_squared() <= (d - b).length_squared(),
                    [_, None, ..] | [.., None] => true,
                    _ => false,
                };
                let halves = if rising { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                triangles.extend(halves.into_iter().filter(|half| joined(*half)));
            }
        }
        triangles
    }
}
