//! Pictures and pages of what was made: shaded views of meshes and clouds, sheets of many of them, figures with a legend, plots, and pages for
//! a browser that hold them.
//!
//! [`Scene`] places meshes and clouds in one frame and renders it from several [`View`]s side by side; [`contact_sheet`] gives
//! every mesh a cell of its own at one common scale; [`Figure`] puts scenes below each other with names, captions and the
//! [`ColourBar`] of a scalar field, whose colours a [`ColourScale`] makes. All return an [`Image`], which writes itself as PNG.
//!
//! A [`page::Page`] is a folder with a page for a browser, made of [`portrait`]s, figures and [`plot`]s: [`fit_page`] has the one of a fit,
//! [`model_page`] that of a model, [`model_sections`] what pages on models share.
//!
//! Nothing depends on the unit of the meshes: light, perspective and the size of points follow the frame.

mod cloud;
pub mod colour_bar;
pub mod colour_scale;
pub mod figure;
pub mod fit_page;
pub mod fit_shown;
pub mod light;
pub mod model_page;
pub mod model_sections;
pub mod modes;
pub mod page;
pub mod picture;
pub mod plot;
pub mod portrait;
mod raster;
pub mod scene;
pub mod sheet;
pub mod text;
pub mod view;

pub use colour_bar::ColourBar;
pub use colour_scale::{ColourMap, ColourScale, rounded_up};
pub use figure::Figure;
pub use light::Finish;
pub use picture::Image;
pub use scene::{Placed, Scene};
pub use sheet::contact_sheet;
pub use text::Lettering;
pub use view::{Frame, View};

/// Who made a page.
pub fn made_by() -> String {
    format!("Made by habitus {}.", env!("CARGO_PKG_VERSION"))
}
