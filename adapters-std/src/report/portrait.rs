//! Pictures of single shapes for a page: one cell each, all at one scale, and the legend of their colours.

use super::colour_bar::ColourBar;
use super::light::Finish;
use super::picture::Image;
use super::scene::Scene;
use super::view::{Frame, View};
use crate::mesh::Mesh;

/// A little to the side, so that a face shows its profile and both its eyes.
pub const PORTRAIT: View = View { yaw: 0.32, ..View::THREE_QUARTER };

/// sRGB colour behind an open mouth.
pub const LINING: [u8; 3] = [90, 50, 48];

/// How the cells of a strip are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Portraits {
    /// From where.
    pub view: View,
    /// What fills a cell.
    pub frame: Frame,
    /// Width and height of a cell, pixels.
    pub size: [usize; 2],
    /// What is seen through holes that a shape encloses, see [`Scene::lining`].
    pub lining: Option<[u8; 3]>,
}

impl Portraits {
    /// Cells that hold each of these shapes.
    pub fn holding<'a>(view: View, shapes: impl IntoIterator<Item = &'a Mesh>, lining: Option<[u8; 3]>) -> Self {
        let points: Vec<[f64; 3]> = shapes.into_iter().flat_map(|mesh| mesh.positions.iter().copied()).collect();
        Portraits::around(view, Frame::holding(points.into_iter(), &[view]), lining)
    }

    /// Cells that hold these points, one kind for each of the views: all at one scale and of one size, and in each the points are in the middle.
    pub fn of_views(views: &[View], points: &[[f64; 3]], lining: Option<[u8; 3]>) -> Vec<Self> {
        let own: Vec<Frame> =
            views.iter().map(|view| Frame::holding(points.iter().copied(), std::slice::from_ref(view))).collect();
        let half =
            own.iter().fold([0.0_f64; 2], |half, frame| [0, 1].map(|axis| half[axis].max(frame.half_size[axis])));
        let cell = |(view, frame): (&View, Frame)| Portraits::around(*view, Frame { half_size: half, ..frame }, lining);
        views.iter().zip(own).map(cell).collect()
    }

    fn around(view: View, frame: Frame, lining: Option<[u8; 3]>) -> Self {
        let [width, height] = frame.half_size;
        // Cells are at most three times as long as they are wide, whatever is shown.
        let shape = (width / height).clamp(1.0 / 3.0, 3.0);
        let size = if shape < 1.0 { [(460.0 * shape) as usize, 460] } else { [460, (460.0 / shape) as usize] };
        Portraits { view, frame, size, lining }
    }

    /// A shape in the colour of clay; its own colours are not shown.
    pub fn clay(&self, mesh: &Mesh) -> Image {
        let plain = Mesh { colours: Vec::new(), ..mesh.clone() };
        self.drawn(&plain, None, Finish::Clay)
    }

    /// A shape in the colours of numbers.
    pub fn coloured(&self, mesh: &Mesh, colours: &[[u8; 3]]) -> Image {
        self.drawn(mesh, Some(colours), Finish::Even)
    }

    fn drawn(&self, mesh: &Mesh, colours: Option<&[[u8; 3]]>, finish: Finish) -> Image {
        let mut scene = Scene { frame: Some(self.frame), lining: self.lining, finish, ..Scene::new([mesh]) };
        scene.meshes.iter_mut().for_each(|placed| placed.colours = colours);
        scene.shaded(&[self.view], self.size)
    }

    /// The legend of colours. It is not as high as a cell, and its letters are shown larger than they would be.
    pub fn legend(&self, bar: &ColourBar) -> Image {
        const ROOM: usize = 10;
        const LEGEND: usize = 300;
        let background = Scene::new([]).background;
        let drawn = bar.drawn(LEGEND - 2 * ROOM, background);
        let mut image = Image::filled(drawn.width + 2 * ROOM, drawn.height + 2 * ROOM, background);
        image.paste(&drawn, ROOM, ROOM);
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::ColourScale;

    #[test]
    fn cells_have_the_shape_of_what_they_hold_and_own_colours_do_not_count() {
        let tall = Mesh {
            positions: vec![[-50.0, -100.0, 0.0], [50.0, -100.0, 0.0], [0.0, 100.0, 0.0]],
            faces: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let cells = Portraits::holding(View::FRONT, [&tall], None);
        assert!(cells.size[1] == 460 && (200..260).contains(&cells.size[0]), "{:?}", cells.size);
        let plain = cells.clay(&tall);
        assert_eq!([plain.width, plain.height], cells.size);
        assert_eq!(cells.clay(&Mesh { colours: vec![[0, 0, 255]; 3], ..tall.clone() }), plain);
        assert_ne!(cells.coloured(&tall, &[[0, 0, 255]; 3]), plain);
        let bar = ColourBar::of(ColourScale::sequential(0.0, 2.0), "mm", &[1.0]);
        assert_eq!(cells.legend(&bar).height, 300);
        let nothing = Portraits::holding(View::FRONT, [&Mesh::default()], None);
        assert!(nothing.clay(&Mesh::default()).height > 0);
    }
}
