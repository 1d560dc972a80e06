//! Solvers: closed form and iterative, all on the caller's memory and with a bounded number of steps.

mod bounds;
pub mod lbfgsb;
pub mod levenberg_marquardt;
pub mod procrustes;
