//! The slow reference: every kernel once more, in plain vectors and loops, from the documentation of the core alone.
//!
//! It allocates where it likes, knows no blocks and no workspaces and shares no code with the core. Because the documentation
//! fixes the formula and the order of every sum, it gives the same bits; where it does not, one of the three is wrong.

#![forbid(unsafe_code)]
// Indices are what the formulas are written in.
#![allow(clippy::needless_range_loop)]

pub mod bilinear;
pub mod cholesky;
pub mod eigen;
pub mod fit;
pub mod generator;
pub mod isometry;
pub mod lbfgsb;
pub mod levenberg_marquardt;
pub mod linear;
pub mod model_file;
pub mod multiscale;
pub mod normal_equations;
pub mod number;
pub mod placement;
pub mod prior;
pub mod procrustes;
pub mod qr;
pub mod quaternion;
pub mod skeleton;
pub mod skin_file;
pub mod skinned;
pub mod storage;
pub mod stored_bilinear;
pub mod svd3;
pub mod wavelet;
pub mod wavelet_fit;

/// What a kernel refuses: code of the error and its two numbers (zero where it has fewer).
pub type Refusal = [u32; 3];
