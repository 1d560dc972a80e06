//! Limits of every count in a model file; a file beyond them is refused before anything else is read.

/// Vertices.
pub const MAX_VERTICES: u32 = 1 << 24;
/// Identity weights, and pose weights.
pub const MAX_WEIGHTS: u32 = 1024;
/// Sections.
pub const MAX_SECTIONS: u32 = 64;
/// Triangles.
pub const MAX_FACES: u32 = 1 << 25;
/// Landmarks.
pub const MAX_LANDMARKS: u32 = 4096;
/// Rows of starting points, and of a spectrum.
pub const MAX_ROWS: u32 = 1 << 20;
/// Joints of a skeleton.
pub const MAX_JOINTS: u32 = 255;
/// Influences of a vertex that is skinned.
pub const MAX_INFLUENCES: u32 = 8;
/// Levels of a wavelet grid above its base.
pub const MAX_LEVELS: u32 = 10;
/// Bytes of a text.
pub const MAX_TEXT: u32 = 1 << 20;
/// Magnitude of a coefficient. With weights of at most [`MAX_WEIGHT`] no sum of terms can overflow an `f32`.
pub const MAX_COEFFICIENT: f32 = 1e12;
/// Magnitude of a weight that the generators accept.
pub const MAX_WEIGHT: f32 = 1e9;
/// How far the weights of a skinned vertex may sum from 1.
pub const WEIGHT_SUM_TOLERANCE: f32 = 1e-5;
/// How far the square of an axis' length may lie from 1.
pub const AXIS_TOLERANCE: f32 = 1e-4;
