//! How far a map between two surfaces is from an isometry (Wuhrer ch. 3, eqs 3.1 to 3.4): of pairs of distances, of triangles, of samples of the map.
//!
//! | measure | function |
//! |---|---|
//! | 3.1, absolute: difference of two distances | [`pairs::absolute`] |
//! | 3.2, relative: ratio of two distances | [`pairs::Relative`] |
//! | 3.3, regional: 3.1 or 3.2 of distances along paths within the region | the same, with those distances |
//! | 3.4, local: first fundamental form against the identity | [`jacobian::local`], from [`triangle`] or [`samples`] |
//!
//! Each gives one number that is to be compared with a tolerance nu; [`summary::Summary`] gathers them one by one. Distances come from the caller. Lengths are in the unit of the surfaces, millimetres.

pub mod jacobian;
pub mod pairs;
pub mod samples;
pub mod summary;
#[cfg(test)]
mod tests;
pub mod triangle;
