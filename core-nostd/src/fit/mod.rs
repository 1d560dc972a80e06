//! From landmarks or corresponding points to weights and placement, written once against [`Generator`](crate::generator::Generator).
//!
//! [`samples`] say which point of the model belongs where; [`mod@normal_equations`] turns them into `J^T J` and `J^T r` without ever holding
//! the whole Jacobian; [`points`] and [`landmarks`] run Levenberg-Marquardt on them under the priors of the model. [`wavelet`] fits the
//! thousands of local models of a wavelet model one by one.

pub mod landmarks;
pub mod normal_equations;
pub mod points;
pub mod samples;
pub mod wavelet;

mod local;
mod rows;

pub use landmarks::{LandmarkSamples, fit_landmarks, fit_landmarks_req};
pub use normal_equations::{Frame, normal_equations, normal_equations_req};
pub use points::{FitOptions, FitReport, fit_points, fit_points_req};
pub use samples::{Sample, Samples, SurfacePoint};
pub use wavelet::{WaveletOptions, WaveletReport, fit_wavelet, fit_wavelet_req};

#[cfg(test)]
mod tests;
#[cfg(test)]
mod wavelet_tests;
