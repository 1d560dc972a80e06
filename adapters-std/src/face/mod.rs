//! Statistical models of faces, learned from registered shapes (ch. 12).
//!
//! A [`tensor::ShapeTensor`] holds every identity in every expression; [`hosvd`] learns a
//! [`multilinear::MultilinearModel`] from it; [`projection`] finds the parameters of a shape whose correspondence is
//! known; [`bilinear_form`] is the same model in the form of eq. 8.2.

pub mod bilinear_form;
pub mod hooi;
pub mod hosvd;
pub mod mode_basis;
pub mod mode_gram;
pub mod multilinear;
mod packed;
pub mod projection;
pub(crate) mod reduced;
pub mod remainder;
pub(crate) mod subset_model;
pub mod tensor;
pub mod training_data;
pub mod weight_statistics;
