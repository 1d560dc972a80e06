//! A page for a browser: one folder with `index.html` and the pictures, plots, meshes and figures that it shows.
//!
//! [`Page`] is a list of titled [`Section`]s made of [`Block`]s. It needs no script, no network and no other program: styles are within the page,
//! everything else lies beside it. Texts may hold any letters, they are escaped.

mod files;
mod html;

pub use files::File;
pub use html::bytes;

/// A page with its files.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Page {
    /// What it is about.
    pub title: String,
    /// What the reader should know first, one paragraph each.
    pub lead: Vec<String>,
    /// The content.
    pub sections: Vec<Section>,
    /// Below everything: who made it.
    pub footer: String,
    /// Files that lie beside the page without being shown on it, such as `figures.json`.
    pub files: Vec<File>,
}

/// A part of a page under its own title.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    /// The title.
    pub title: String,
    /// What it holds, from above.
    pub blocks: Vec<Block>,
}

/// A piece of a section.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// Pictures side by side that belong together.
    Strip(Strip),
    /// Plots, two side by side where there is room; a single one is as wide as one of two.
    Plots(Vec<Picture>),
    /// Numbers in rows and columns.
    Table(Table),
    /// Files to take away.
    Downloads(Vec<Download>),
}

/// Pictures of one size side by side.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Strip {
    /// The pictures.
    pub pictures: Vec<Picture>,
    /// The legend of their colours, as high as they are.
    pub legend: Option<Picture>,
    /// What they show together, below them.
    pub caption: String,
}

/// A picture or plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// PNG or SVG.
    pub file: File,
    /// Pixels, width and height; a plot may be shown at any size of the same shape.
    pub size: [usize; 2],
    /// What it shows, for those who do not see it.
    pub alt: String,
    /// Below it.
    pub caption: String,
}

/// A table. The first cell of each row names the row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Above it.
    pub caption: String,
    /// Names of the columns, with units.
    pub head: Vec<String>,
    /// The rows.
    pub rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cell {
    /// What is written in it.
    pub text: String,
    /// Where the number stands in `figures.json`, such as `scans/0/mean_mm` (a JSON pointer without its first stroke); it is not shown.
    pub figure: Option<String>,
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Cell { text: text.to_owned(), figure: None }
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Cell { text, figure: None }
    }
}

impl Cell {
    /// The number at `pointer` of `figures`, with `decimals`; a stroke where there is none.
    pub fn figure(figures: &serde_json::Value, pointer: &str, decimals: usize) -> Self {
        let text = match figures.pointer(&format!("/{pointer}")) {
            Some(value) if value.is_u64() || value.is_i64() => value.to_string(),
            Some(value) => value.as_f64().map_or("\u{2013}".to_owned(), |number| format!("{number:.decimals$}")),
            None => "\u{2013}".to_owned(),
        };
        Cell { text, figure: Some(pointer.to_owned()) }
    }
}

/// A file to take away.
#[derive(Debug, Clone, PartialEq)]
pub struct Download {
    /// The file.
    pub file: File,
    /// What it is.
    pub text: String,
}

impl Picture {
    /// A picture in a PNG file.
    ///
    /// # Errors
    /// Those of [`Image::png_bytes`](super::Image::png_bytes).
    pub fn of(
        image: &super::Image,
        name: impl Into<String>,
        alt: impl Into<String>,
        caption: impl Into<String>,
    ) -> Result<Self, crate::Error> {
        let file = File::new(name, image.png_bytes()?);
        Ok(Picture { file, size: [image.width, image.height], alt: alt.into(), caption: caption.into() })
    }

    /// A plot, from the text of its SVG file.
    pub fn plot(svg: String, name: impl Into<String>, alt: impl Into<String>, caption: impl Into<String>) -> Self {
        let file = File::new(name, svg.into_bytes());
        Picture { file, size: [800, 500], alt: alt.into(), caption: caption.into() }
    }
}
