//! Golden vectors: inputs and outputs of every kernel as bit patterns, and the runner that compares them on the target it runs on.
//!
//! The files in `vectors/` are written by `cargo run -p habitus-tests --bin write-vectors` from a slow reference that shares no code with
//! `habitus-core`. The core promises the same bits on every target; this crate holds it to that on a host, with vectors of any width, in
//! a browser or on a microcontroller: it needs no heap and no operating system.
//!
//! | vectors | kernels |
//! |---|---|
//! | `models.txt` | model files, used by the others |
//! | `generator.txt` | evaluation by ranges, derivatives, prepared forms |
//! | `fit.txt` | normal equations, priors, fits |
//! | `solve.txt` | Cholesky, Jacobi, Procrustes, rotations, Levenberg-Marquardt; QR, least squares, 3 x 3 SVD, measures of isometry, L-BFGS-B |
//! | `bodies.txt` | all of these for linear and skinned models in every storage, and for bilinear ones in half precision and bytes |
//! | `wavelets.txt` | the wavelet transform; wavelet models by levels and windows in every storage, their fits by levels |
//! | `files.txt` | what model files hold, and what is refused |
#![no_std]
#![forbid(unsafe_code)]

mod backend;
mod control;
mod kernels;
mod memory;
mod result;
mod samples;
mod text;

pub use backend::Backend;
use backend::Plain;
pub use control::{CASE_BYTES, noticed};
pub use memory::{Memory, Requirement};
pub use result::{CaseResult, Difference, Problem, Summary};
pub use text::{Case, Cases};

/// The text of the vectors.
#[derive(Debug, Clone, Copy)]
pub struct Vectors<'t> {
    /// Model files that the cases name.
    pub models: &'t str,
    /// Name and text of each file of cases.
    pub files: [(&'t str, &'t str); 6],
}

/// The committed vectors.
pub const VECTORS: Vectors<'static> = Vectors {
    models: include_str!("../vectors/models.txt"),
    files: [
        ("generator.txt", include_str!("../vectors/generator.txt")),
        ("fit.txt", include_str!("../vectors/fit.txt")),
        ("solve.txt", include_str!("../vectors/solve.txt")),
        ("bodies.txt", include_str!("../vectors/bodies.txt")),
        ("wavelets.txt", include_str!("../vectors/wavelets.txt")),
        ("files.txt", include_str!("../vectors/files.txt")),
    ],
};

/// Scratch that [`run`] needs.
pub const REQUIREMENT: Requirement = Requirement { floats: 16 * 1024, doubles: 256, bytes: 12 * 1024, indices: 256 };

/// Runs every case of `vectors` through the core, hands each result to `report`, and returns the sums.
///
/// `memory` holds at least [`REQUIREMENT`]; a case that does not find enough is reported as [`Problem::Memory`]. Panics: never.
pub fn run(vectors: &Vectors<'_>, memory: &mut Memory<'_>, report: &mut dyn FnMut(&CaseResult<'_>)) -> Summary {
    run_with(&Plain, vectors, memory, report)
}

/// The same by way of `backend`.
pub fn run_with<B: Backend>(
    backend: &B,
    vectors: &Vectors<'_>,
    memory: &mut Memory<'_>,
    report: &mut dyn FnMut(&CaseResult<'_>),
) -> Summary {
    let mut summary = Summary::default();
    for (file, text) in vectors.files {
        for case in Cases::new(text) {
            let result = kernels::case_result(file, case, vectors.models, backend, memory);
            summary.add(&result);
            report(&result);
        }
    }
    summary
}
