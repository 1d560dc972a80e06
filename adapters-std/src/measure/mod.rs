//! How good a model is.

pub mod compactness;
pub mod curves;
pub mod distance;
pub mod generalization;
pub mod kernel_fit;
pub mod scan_distance;
pub mod specificity;
pub mod unseen;
pub mod vertex_error;
