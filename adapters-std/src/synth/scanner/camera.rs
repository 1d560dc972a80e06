//! Where the rays of a view run: one through each pixel of a raster that holds the subject.

use glam::DVec3;
use rand::RngExt;

use super::chance::{Purpose, stream};
use super::options::{Projection, ScanOptions};
use super::room::Room;
use crate::Error;

/// Most pixels of a view.
const MOST: f64 = 16_777_216.0;
/// Room around the subject in the image, in multiples of its radius.
const MARGIN: f64 = 0.1;

/// A raster before the subject.
#[derive(Debug, Clone)]
pub(super) struct Camera {
    centre: DVec3,
    right: DVec3,
    up: DVec3,
    back: DVec3,
    projection: Projection,
    /// Where rays in parallel begin, in front of the centre.
    reach: f64,
    pixel: f64,
    /// Coordinates of the first pixel's middle in the plane through the centre.
    first: [f64; 2],
    /// Columns and rows.
    pub size: [usize; 2],
}

impl Camera {
    /// The camera of the view of this index. The raster has a random offset below a pixel.
    ///
    /// # Errors
    /// [`Error::Input`] for an eye that is in or too near to the subject, and for more than 2^24 pixels.
    pub fn of(options: &ScanOptions, index: usize, room: &Room<'_>) -> Result<Self, Error> {
        let [right, up, back] = options.views[index].axes();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in room.corners() {
            let from = p - room.centre;
            let scale = match options.projection {
                Projection::Orthographic => 1.0,
                Projection::Perspective { distance } => {
                    let depth = distance - from.dot(back);
                    // What is nearer than that fills an image of any size.
                    if !(depth > 0.01 * distance) {
                        return Err(Error::input(format!(
                            "an eye {distance} mm from the middle of the subject is in it or touches it: give at least {:.1} mm",
                            1.5 * room.radius
                        )));
                    }
                    distance / depth
                }
            };
            let at = [from.dot(right) * scale, from.dot(up) * scale];
            low = std::array::from_fn(|axis| low[axis].min(at[axis]));
            high = std::array::from_fn(|axis| high[axis].max(at[axis]));
        }
        let pixel = options.pixel;
        let mut random = stream(options.seed, Purpose::Raster(index));
        let offset: [f64; 2] = random.random();
        let margin = MARGIN * room.radius;
        let first = std::array::from_fn(|axis| low[axis] - margin - pixel * offset[axis]);
        let extent: [f64; 2] = std::array::from_fn(|axis| ((high[axis] + margin - first[axis]) / pixel).ceil() + 1.0);
        if !(extent[0] * extent[1] <= MOST) {
            return Err(Error::input(format!(
                "an image of {:.0} x {:.0} pixels of {pixel} mm: at most {MOST} can be scanned; are pixel and mesh in the right unit?",
                extent[0], extent[1]
            )));
        }
        let size = extent.map(|n| n as usize);
        let (centre, projection, reach) = (room.centre, options.projection, room.reach);
        Ok(Camera { centre, right, up, back, projection, reach, pixel, first, size })
    }

    /// The number of pixels.
    pub fn n_pixels(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The coordinates in the image plane, from the first pixel on, mm.
    pub fn in_image(&self, pixel: usize) -> [f64; 2] {
        [(pixel % self.size[0]) as f64 * self.pixel, (pixel / self.size[0]) as f64 * self.pixel]
    }

    /// Where the ray through a pixel begins, and its unit direction.
    pub fn ray(&self, pixel: usize) -> (DVec3, DVec3) {
        let [u, v] = self.in_image(pixel);
        let aim = self.centre + self.right * (self.first[0] + u) + self.up * (self.first[1] + v);
        match self.projection {
            // Nothing is in front of that.
            Projection::Orthographic => (aim + self.back * (self.reach + self.pixel), -self.back),
            Projection::Perspective { distance } => {
                let eye = self.centre + self.back * distance;
                (eye, (aim - eye).normalize())
            }
        }
    }

    /// The width of a pixel at this place.
    pub fn pixel_at(&self, place: DVec3) -> f64 {
        match self.projection {
            Projection::Orthographic => self.pixel,
            Projection::Perspective { distance } => {
                self.pixel * (1.0 - (place - self.centre).dot(self.back) / distance).max(0.0)
            }
        }
    }
}
