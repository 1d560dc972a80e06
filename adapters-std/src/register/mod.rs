//! Bringing shapes into one coordinate frame.

pub mod gpa;
pub mod rigid;
pub mod scan_fit;
