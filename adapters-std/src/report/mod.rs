//! Pictures of what was made: shaded views of meshes and sheets of many of them.
//!
//! [`Scene`] places meshes in one frame and renders it from several [`View`]s side by side; [`contact_sheet`] gives
//! every mesh a cell of its own at one common scale. Both return an [`Image`], which writes itself as PNG.

pub mod picture;
mod raster;
pub mod shade;
pub mod sheet;

pub use picture::Image;
pub use shade::{Frame, Placed, Scene, View};
pub use sheet::contact_sheet;
