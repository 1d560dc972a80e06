//! Procedural shapes, for tests and for a first acquaintance without data.

mod face_colour;
pub mod face_grid;
pub mod face_motion;
pub mod face_shape;
mod face_surface;
pub mod faces;
pub mod population_files;
mod profile;
pub mod scanner;

pub use faces::{FaceOptions, FacePopulation};
