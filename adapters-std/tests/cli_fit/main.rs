//! `habitus fit` as a user meets it.

mod landmarks;
mod outputs;
mod refusals;
mod scans;
mod work;
