//! Measurements: the same run holds ours, the machine's limit where it is known, and programs of others over the same data.
#![forbid(unsafe_code)]

pub mod evaluation;
pub mod geometry;
pub mod peer;
pub mod samples;
pub mod workload;
