//! Measurements of the kernels: the same run holds ours, the machine's limit, and plain C++ over the same layout.
#![forbid(unsafe_code)]

pub mod peer;
pub mod workload;
