//! Figures: several scenes from several views in one frame, with title, captions and the legend of their colours.

use super::colour_bar::ColourBar;
use super::picture::Image;
use super::scene::Scene;
use super::text::Lettering;
use super::view::{Frame, View};

/// A figure. All its pictures have one scale; each view is as wide as it needs.
#[derive(Debug, Clone)]
pub struct Figure<'a> {
    /// Above everything; may be empty.
    pub title: String,
    /// The views, each with the name that stands above it.
    pub views: Vec<(String, View)>,
    /// The scenes, one below the other, each with its caption.
    pub rows: Vec<(String, Scene<'a>)>,
    /// The legend, at the right.
    pub bar: Option<ColourBar>,
    /// The longer side that a view may have, in pixels.
    pub picture_size: usize,
}

const MARGIN: usize = 16;
/// Between a picture and the caption of the next one.
const ROW_GAP: usize = 10;
const BACKGROUND: [u8; 3] = [255; 3];
const INK: [u8; 3] = [40, 40, 44];

impl<'a> Figure<'a> {
    /// A figure of these rows from the front, between front and side, from the left side and from behind, each view at most 480 pixels wide and high.
    pub fn new(title: impl Into<String>, rows: Vec<(String, Scene<'a>)>) -> Self {
        let views = View::NAMED[..4].iter().map(|(name, view)| ((*name).to_owned(), *view)).collect();
        Figure { title: title.into(), views, rows, bar: None, picture_size: 480 }
    }

    /// The figure as a picture. The frame of a scene is not regarded: all of every scene is shown.
    pub fn drawn(&self) -> Image {
        let (plain, heading) = (Lettering::Plain, Lettering::Title);
        let columns = self.columns();
        let drawn: Vec<(&str, Image)> =
            self.rows.iter().map(|(caption, scene)| (caption.as_str(), row(scene, &columns))).collect();
        let pictures_width: usize = columns.iter().map(|(_, _, size)| size[0]).sum();
        let line = |text: bool, style: Lettering| if text { style.height() + 6 } else { 0 };
        let head = MARGIN + line(!self.title.is_empty(), heading);
        let names = line(self.views.iter().any(|(name, _)| !name.is_empty()), plain);
        let caption = line(self.rows.iter().any(|(caption, _)| !caption.is_empty()), plain);
        let below = if caption > 0 { ROW_GAP } else { 0 };
        let content = names + drawn.iter().map(|(_, picture)| caption + picture.height + below).sum::<usize>();
        let bar = self.bar.as_ref().map(|bar| bar.drawn((content - names.min(content)).min(420), BACKGROUND));
        let bar_width = bar.as_ref().map_or(0, |bar| bar.width + MARGIN);
        let width = 2 * MARGIN + pictures_width + bar_width;
        let height = head + content.max(names + bar.as_ref().map_or(0, |bar| bar.height)) + MARGIN;

        let mut image = Image::filled(width, height, BACKGROUND);
        let title = heading.shortened(&self.title, width - 2 * MARGIN);
        image.write_text(&title, heading, MARGIN, MARGIN / 2, INK);
        let mut left = MARGIN;
        for ((name, _), (_, _, size)) in self.views.iter().zip(&columns) {
            let name = plain.shortened(name, size[0]);
            image.write_text(&name, plain, left + (size[0] - plain.width(&name)) / 2, head, INK);
            left += size[0];
        }
        let mut top = head + names;
        for (text, picture) in &drawn {
            image.write_text(&plain.shortened(text, pictures_width), plain, MARGIN, top, INK);
            image.paste(picture, MARGIN, top + caption);
            top += caption + picture.height + below;
        }
        if let Some(bar) = bar {
            image.paste(&bar, MARGIN + pictures_width + MARGIN, head + names);
        }
        image
    }

    /// Each view with the part of the common frame that it needs, and the pixels for it.
    fn columns(&self) -> Vec<(View, Frame, [usize; 2])> {
        let points = self.rows.iter().flat_map(|(_, scene)| scene.points());
        let own: Vec<Frame> =
            self.views.iter().map(|(_, view)| Frame::holding(points.clone(), std::slice::from_ref(view))).collect();
        let longest = own.iter().flat_map(|frame| frame.half_size).fold(0.0, f64::max);
        let pixels = |half: f64| ((self.picture_size as f64 * half / longest).ceil() as usize).max(1);
        let column = |((_, view), frame): (&(String, View), &Frame)| (*view, *frame, frame.half_size.map(pixels));
        self.views.iter().zip(&own).map(column).collect()
    }
}

/// The views of a scene side by side, without the lines of pixels above and below that show nothing.
fn row(scene: &Scene<'_>, columns: &[(View, Frame, [usize; 2])]) -> Image {
    let scene = Scene { background: BACKGROUND, ..scene.clone() };
    let height = columns.iter().map(|(_, _, size)| size[1]).max().unwrap_or(0);
    let width = columns.iter().map(|(_, _, size)| size[0]).sum();
    let mut image = Image::filled(width, height, BACKGROUND);
    let mut left = 0;
    for picture in scene.pictures(columns) {
        image.paste(&picture, left, (height - picture.height) / 2);
        left += picture.width;
    }
    let shows = |line: &[[u8; 3]]| line.iter().any(|pixel| *pixel != BACKGROUND);
    let lines = || image.pixels.chunks_exact(width.max(1));
    let (Some(first), Some(last)) = (lines().position(shows), lines().rposition(shows)) else { return image };
    let pixels = image.pixels[first * width..(last + 1) * width].to_vec();
    Image { width, height: last + 1 - first, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::report::ColourScale;

    /// A flat box of the given half sides, without lids.
    fn block(x: f64, y: f64, z: f64) -> Mesh {
        let corner =
            |k: u32| [(k & 1, x), (k >> 1 & 1, y), (k >> 2, z)].map(|(bit, half)| f64::from(2 * bit) * half - half);
        let faces = vec![[0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3], [4, 6, 7], [4, 7, 5], [0, 1, 3], [0, 3, 2]];
        Mesh {
            positions: (0..8).map(corner).collect(),
            faces: faces.into_iter().map(|f: [u32; 3]| f).collect(),
            ..Mesh::default()
        }
    }

    #[test]
    fn views_are_as_wide_as_they_need_at_one_scale() {
        let tall = block(20.0, 100.0, 5.0);
        let figure = Figure { picture_size: 200, ..Figure::new("", vec![(String::new(), Scene::new([&tall]))]) };
        let columns = figure.columns();
        let sizes: Vec<[usize; 2]> = columns.iter().map(|(_, _, size)| *size).collect();
        assert!(sizes.iter().all(|size| size[1] >= 190 && size[1] <= 200), "{sizes:?}");
        assert!((38..=48).contains(&sizes[0][0]) && sizes[0] == sizes[3], "{sizes:?}");
        assert!((9..=16).contains(&sizes[2][0]), "{sizes:?}");
    }

    #[test]
    fn a_figure_holds_title_captions_pictures_and_legend() {
        let (small, large) = (block(5.0, 5.0, 5.0), block(10.0, 10.0, 10.0));
        let rows = vec![("small".to_owned(), Scene::new([&small])), ("large".to_owned(), Scene::new([&large]))];
        let scale = ColourScale::sequential(0.0, 1.0);
        let bar = ColourBar::of(scale, "distance, mm", &[0.5]);
        let figure = Figure { picture_size: 90, bar: Some(bar), ..Figure::new("two blocks", rows) };
        let image = figure.drawn();
        assert_eq!(image, figure.drawn());
        let pictures: usize = figure.columns().iter().map(|(_, _, size)| size[0]).sum();
        let ink = |columns: std::ops::Range<usize>, rows: std::ops::Range<usize>| {
            let pixels = rows.flat_map(|row| columns.clone().map(move |column| row * image.width + column));
            pixels.filter(|&pixel| image.pixels[pixel] != BACKGROUND).count()
        };
        // Rows are as high as what they show: half and all of the same scale.
        let heights = figure.rows.iter().map(|(_, scene)| row(scene, &figure.columns()).height).collect::<Vec<_>>();
        assert!(2 * heights[0] + 2 >= heights[1] && 2 * heights[0] <= heights[1] + 2 && heights[1] < 90, "{heights:?}");
        assert!(image.height < 36 + 160 + 90, "{}", image.height);
        assert!(ink(MARGIN..pictures, 8..30) > 50, "title");
        assert!(ink(pictures + 2 * MARGIN..image.width, 36..image.height) > 500, "legend");
    }

    #[test]
    fn a_figure_of_nothing_is_still_a_picture() {
        let empty = Mesh::default();
        for rows in [vec![], vec![("nothing".to_owned(), Scene::new([&empty]))]] {
            let image = Figure::new("nothing at all", rows).drawn();
            assert!(image.width > 0 && image.height > 0);
        }
        let figure =
            Figure { views: Vec::new(), ..Figure::new("no views", vec![(String::new(), Scene::new([&empty]))]) };
        assert!(figure.drawn().height > 0);
    }
}
