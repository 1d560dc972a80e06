//! `habitus fit` as a user meets it.

mod landmarks;
mod outputs;
// These tests need a part of it.
#[allow(dead_code)]
#[path = "../program/mod.rs"]
mod program;
mod refusals;
mod scans;
mod work;
