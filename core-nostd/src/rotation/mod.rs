//! Rotations, dual quaternions, and the similarity transforms that place a model in the frame of a scan.

pub mod axis_angle;
pub mod quaternion;
pub mod similarity;
