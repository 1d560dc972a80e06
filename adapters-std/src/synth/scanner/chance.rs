//! What the scanner leaves to chance: streams of random numbers of which each purpose has its own, smooth fields, rigid motions.

use glam::{DMat3, DVec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::register::rigid::Similarity;

/// For what random numbers are drawn. One purpose does not disturb another: without holes, say, the noise is the same.
#[derive(Debug, Clone, Copy)]
pub(super) enum Purpose {
    Clutter,
    Holes,
    Placement,
    Order,
    /// Of the view of this index.
    Raster(usize),
    Calibration(usize),
    Noise(usize),
    SmoothNoise(usize),
    Outliers(usize),
}

pub(super) fn stream(seed: u64, purpose: Purpose) -> ChaCha12Rng {
    let number = match purpose {
        Purpose::Clutter => 0,
        Purpose::Holes => 1,
        Purpose::Placement => 2,
        Purpose::Order => 3,
        Purpose::Raster(view) => 8 * (view + 1),
        Purpose::Calibration(view) => 8 * (view + 1) + 1,
        Purpose::Noise(view) => 8 * (view + 1) + 2,
        Purpose::SmoothNoise(view) => 8 * (view + 1) + 3,
        Purpose::Outliers(view) => 8 * (view + 1) + 4,
    };
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    random.set_stream(number as u64);
    random
}

/// A standard normal deviate.
pub(super) fn normal(random: &mut ChaCha12Rng) -> f64 {
    StandardNormal.sample(random)
}

/// A uniform number between the two.
pub(super) fn between(random: &mut ChaCha12Rng, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * random.random::<f64>()
}

/// A direction, uniform on the sphere.
pub(super) fn direction(random: &mut ChaCha12Rng) -> DVec3 {
    let z = between(random, [-1.0, 1.0]);
    let (sin, cos) = between(random, [0.0, std::f64::consts::TAU]).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

/// A turn by this angle about a random axis through `centre`, then a move by this length in a random direction.
pub(super) fn motion(random: &mut ChaCha12Rng, centre: DVec3, angle: f64, length: f64) -> Similarity {
    let (axis, towards) = (direction(random), direction(random));
    if angle == 0.0 && length == 0.0 {
        return Similarity::IDENTITY;
    }
    let rotation = DMat3::from_axis_angle(axis, angle);
    let translation = centre - rotation * centre + towards * length;
    let rows = rotation.transpose();
    Similarity {
        scale: 1.0,
        rotation: [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.to_array()),
        translation: translation.to_array(),
    }
}

/// A stationary Gaussian field over the image plane with variance 1 everywhere: a cubic B-spline with normal deviates at its knots,
/// divided by the root of the sum of its squared weights.
#[derive(Debug)]
pub(super) struct SmoothField {
    knots: Vec<f64>,
    n_columns: usize,
    n_rows: usize,
}

impl SmoothField {
    /// A field for coordinates from 0 to these, in distances of the knots.
    pub fn over([width, height]: [f64; 2], random: &mut ChaCha12Rng) -> Self {
        let (n_columns, n_rows) = (width as usize + 4, height as usize + 4);
        SmoothField { knots: (0..n_columns * n_rows).map(|_| normal(random)).collect(), n_columns, n_rows }
    }

    /// The value at this place.
    pub fn at(&self, [x, y]: [f64; 2]) -> f64 {
        let (column, across) = weights(x, self.n_columns);
        let (row, along) = weights(y, self.n_rows);
        let (mut sum, mut squares) = (0.0, 0.0);
        for (j, wy) in along.into_iter().enumerate() {
            for (i, wx) in across.into_iter().enumerate() {
                sum += wx * wy * self.knots[(row + j) * self.n_columns + column + i];
                squares += (wx * wy) * (wx * wy);
            }
        }
        sum / squares.sqrt()
    }
}

/// The first of four knots that count at `x`, and the weights of the uniform cubic B-spline there.
fn weights(x: f64, n: usize) -> (usize, [f64; 4]) {
    let first = (x.max(0.0) as usize).min(n - 4);
    let t = (x - first as f64).clamp(0.0, 1.0);
    let (s, t2, t3) = (1.0 - t, t * t, t * t * t);
    (
        first,
        [s * s * s / 6.0, (3.0 * t3 - 6.0 * t2 + 4.0) / 6.0, (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0) / 6.0, t3 / 6.0],
    )
}
