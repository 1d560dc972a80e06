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
/// Bytes of a text.
pub const MAX_TEXT: u32 = 1 << 20;
/// Magnitude of a coefficient. With weights of at most [`MAX_WEIGHT`] no sum of terms can overflow an `f32`.
pub const MAX_COEFFICIENT: f32 = 1e12;
/// Magnitude of a weight that the generators accept.
pub const MAX_WEIGHT: f32 = 1e9;
