//! Models that a developer's command makes from the shared data, until the training commands of the library make better ones.

pub mod body;
pub mod face;
pub mod wavelet;
