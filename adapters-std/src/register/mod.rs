//! Bringing shapes into one coordinate frame.

pub mod gpa;
pub mod rigid;
