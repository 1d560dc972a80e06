//! Solvers: closed form and iterative, all on the caller's memory and with a bounded number of steps.

pub mod levenberg_marquardt;
pub mod procrustes;
