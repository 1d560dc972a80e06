//! Meshes and clouds in one frame, drawn from several views over a z-buffer.
//!
//! Every view is drawn at twice the width and height and averaged.

use std::borrow::Cow;

use rayon::prelude::*;

use super::cloud::point_radius;
use super::light::{Finish, SUPERSAMPLING, encoded, light, linear, openness};
use super::picture::Image;
use super::raster::{Buffer, Corner, Disc};
use super::view::{Camera, Frame, View, visible};
use crate::mesh::Mesh;

/// A mesh or a cloud in a scene.
#[derive(Debug, Clone, Copy)]
pub struct Placed<'a> {
    /// The mesh, or the points of one without faces. Its normals are used when it has them; else a mesh gets area-weighted
    /// ones, and a cloud those of the surface that its points make in the picture.
    pub mesh: &'a Mesh,
    /// Translation, in the unit of the mesh.
    pub offset: [f64; 3],
    /// sRGB colour where the mesh has none of its own.
    pub colour: [u8; 3],
    /// One sRGB colour per vertex instead of those of the mesh, such as the colours of a scalar field
    /// ([`ColourScale::colours`](super::ColourScale::colours)).
    pub colours: Option<&'a [[u8; 3]]>,
    /// Radius with which the points of a cloud are drawn, in its unit; none: from their spacing, so that they touch.
    pub point_radius: Option<f64>,
}

impl<'a> Placed<'a> {
    /// The mesh where it is, in the colour of unglazed clay.
    pub fn new(mesh: &'a Mesh) -> Self {
        Placed { mesh, offset: [0.0; 3], colour: [214, 188, 168], colours: None, point_radius: None }
    }

    fn place(&self, position: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| position[axis] + self.offset[axis])
    }

    /// Linear colour of a vertex.
    fn albedo(&self, vertex: usize) -> [f32; 3] {
        let colours = self.colours.unwrap_or(&self.mesh.colours);
        colours.get(vertex).unwrap_or(&self.colour).map(linear)
    }
}

/// Meshes that are drawn together.
#[derive(Debug, Clone)]
pub struct Scene<'a> {
    /// The meshes.
    pub meshes: Vec<Placed<'a>>,
    /// sRGB colour behind them.
    pub background: [u8; 3],
    /// What is shown; none: all of it.
    pub frame: Option<Frame>,
    /// sRGB colour seen through holes that the meshes enclose, such as the open mouth of a mask; none: the background.
    pub lining: Option<[u8; 3]>,
    /// How the surfaces answer the light.
    pub finish: Finish,
}

/// What a mesh needs in every view.
struct Prepared<'a> {
    placed: &'a Placed<'a>,
    /// One per vertex, or none for a cloud without.
    normals: Cow<'a, [[f64; 3]]>,
    point_radius: f64,
}

impl<'a> Scene<'a> {
    /// These meshes where they are, before a light background.
    pub fn new(meshes: impl IntoIterator<Item = &'a Mesh>) -> Self {
        let meshes = meshes.into_iter().map(Placed::new).collect();
        Scene { meshes, background: [244, 244, 242], frame: None, lining: None, finish: Finish::Clay }
    }

    /// Where the vertices of all meshes are.
    pub fn points(&self) -> impl Iterator<Item = [f64; 3]> + Clone {
        self.meshes.iter().flat_map(|placed| placed.mesh.positions.iter().map(|p| placed.place(*p)))
    }

    /// The views side by side, each `size` = [width, height] pixels, at one common scale.
    ///
    /// Vertices without a place (coordinates that are not finite or beyond 1e100) are left out, and so are faces that name one
    /// of them or a vertex that does not exist. A mesh with faces shows only these.
    pub fn shaded(&self, views: &[View], size: [usize; 2]) -> Image {
        let frame = self.frame.unwrap_or_else(|| Frame::holding(self.points(), views));
        let columns: Vec<(View, Frame, [usize; 2])> = views.iter().map(|view| (*view, frame, size)).collect();
        let mut image = Image::filled(size[0] * views.len(), size[1], self.background);
        for (place, picture) in self.pictures(&columns).iter().enumerate() {
            image.paste(picture, place * size[0], 0);
        }
        image
    }

    /// One picture for each view of a frame on `[width, height]` pixels.
    pub(super) fn pictures(&self, views: &[(View, Frame, [usize; 2])]) -> Vec<Image> {
        let prepared: Vec<Prepared<'_>> = self.meshes.iter().map(Prepared::new).collect();
        views.par_iter().map(|(view, frame, size)| self.picture(&prepared, view, frame, *size)).collect()
    }

    fn picture(&self, prepared: &[Prepared<'_>], view: &View, frame: &Frame, size: [usize; 2]) -> Image {
        let [width, height] = size.map(|pixels| pixels * SUPERSAMPLING);
        let mut buffer = Buffer::new(width, height);
        let camera = Camera::new(view, frame, [width, height]);
        let mut widest = 0.0_f32;
        for mesh in prepared {
            if mesh.placed.mesh.faces.is_empty() {
                mesh.draw_points(&camera, &mut buffer);
                widest = widest.max(camera.length(mesh.point_radius));
            } else {
                mesh.draw_faces(&camera, &mut buffer);
            }
        }
        buffer.find_normals(widest, camera.scale as f32);
        self.averaged(&buffer, camera.scale as f32, size)
    }

    /// The picture from its fragments: each pixel is the mean light of its samples.
    fn averaged(&self, buffer: &Buffer, scale: f32, [width, height]: [usize; 2]) -> Image {
        let background = self.background.map(linear);
        let lining = self.lining.map(|colour| (colour.map(linear), buffer.enclosed()));
        let mut image = Image::filled(width, height, self.background);
        image.pixels.par_chunks_exact_mut(width.max(1)).enumerate().for_each(|(row, pixels)| {
            for (column, pixel) in pixels.iter_mut().enumerate() {
                let mut sum = [0.0f32; 3];
                for sample in 0..SUPERSAMPLING * SUPERSAMPLING {
                    let x = column * SUPERSAMPLING + sample % SUPERSAMPLING;
                    let y = row * SUPERSAMPLING + sample / SUPERSAMPLING;
                    let fragment = &buffer.fragments[y * buffer.width + x];
                    let light = if fragment.depth.is_finite() {
                        light(self.finish, fragment, openness(buffer, x, y, scale))
                    } else {
                        match &lining {
                            Some((colour, enclosed)) if enclosed[y * buffer.width + x] => *colour,
                            _ => background,
                        }
                    };
                    (0..3).for_each(|channel| sum[channel] += light[channel]);
                }
                *pixel = sum.map(|channel| encoded(channel / (SUPERSAMPLING * SUPERSAMPLING) as f32));
            }
        });
        image
    }
}

impl<'a> Prepared<'a> {
    fn new(placed: &'a Placed<'a>) -> Self {
        let mesh = placed.mesh;
        let normals = if mesh.normals.len() == mesh.positions.len() || mesh.faces.is_empty() {
            Cow::Borrowed(&mesh.normals[..])
        } else {
            Cow::Owned(mesh.vertex_normals())
        };
        let radius = match placed.point_radius {
            Some(radius) => radius,
            None if mesh.faces.is_empty() => point_radius(&mesh.positions),
            None => 0.0,
        };
        Prepared { placed, normals, point_radius: radius }
    }

    /// Camera-space normal of a vertex, if it has one.
    fn normal(&self, camera: &Camera, vertex: usize) -> Option<[f32; 3]> {
        let normal = camera.turned(*self.normals.get(vertex)?).map(|n| n as f32);
        (normal.iter().all(|n| n.is_finite()) && normal != [0.0; 3]).then_some(normal)
    }

    fn draw_faces(&self, camera: &Camera, buffer: &mut Buffer) {
        let corner = |(vertex, position): (usize, &[f64; 3])| {
            let position = self.placed.place(*position);
            if !visible(position) {
                return None;
            }
            let (at, weight) = camera.projected(position);
            let normal = self.normal(camera, vertex).unwrap_or([0.0, 0.0, 1.0]);
            Some(Corner { at, weight, normal, albedo: self.placed.albedo(vertex) })
        };
        let corners: Vec<Option<Corner>> = self.placed.mesh.positions.iter().enumerate().map(corner).collect();
        for face in &self.placed.mesh.faces {
            let [a, b, c] = face.map(|vertex| corners.get(vertex as usize).and_then(Option::as_ref));
            if let (Some(a), Some(b), Some(c)) = (a, b, c) {
                buffer.draw([a, b, c]);
            }
        }
    }

    fn draw_points(&self, camera: &Camera, buffer: &mut Buffer) {
        let radius = camera.length(self.point_radius);
        for (vertex, position) in self.placed.mesh.positions.iter().enumerate() {
            let position = self.placed.place(*position);
            if visible(position) {
                let (at, weight) = camera.projected(position);
                let scale = camera.scale as f32 * weight;
                let (normal, albedo) = (self.normal(camera, vertex), self.placed.albedo(vertex));
                buffer.draw_disc(&Disc { at, scale, radius, normal, albedo });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(half: f64) -> Mesh {
        let positions = vec![[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]];
        Mesh { positions, faces: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
    }

    fn brightness(image: &Image) -> u32 {
        image.pixels[image.width * (image.height / 2) + image.width / 2].iter().map(|c| u32::from(*c)).sum()
    }

    #[test]
    fn back_of_an_open_mesh_is_darker_than_its_front() {
        let mesh = square(10.0);
        let behind = View { yaw: std::f64::consts::PI, ..View::FRONT };
        let front = Scene::new([&mesh]).shaded(&[View::FRONT], [40, 40]);
        let back = Scene::new([&mesh]).shaded(&[behind], [40, 40]);
        assert!(3 * brightness(&back) < 2 * brightness(&front), "{} {}", brightness(&back), brightness(&front));
        assert_eq!(front.pixels[0], [244, 244, 242]);
    }

    #[test]
    fn subjects_left_appears_at_the_right_of_the_front_view() {
        let mut mesh = square(10.0);
        mesh.positions.iter_mut().for_each(|p| p[0] += 30.0);
        let frame = Frame { centre: [0.0; 3], half_size: [50.0; 2], reach: 50.0 };
        let image = Scene { frame: Some(frame), ..Scene::new([&mesh]) }.shaded(&[View::FRONT], [100, 100]);
        assert_ne!(image.pixels[50 * 100 + 80], [244, 244, 242]);
        assert_eq!(image.pixels[50 * 100 + 20], [244, 244, 242]);
    }

    #[test]
    fn vertex_colours_replace_the_colour_of_the_scene() {
        let mut mesh = square(10.0);
        mesh.colours = vec![[255, 0, 0]; 4];
        let image = Scene::new([&mesh]).shaded(&[View::FRONT], [40, 40]);
        let pixel = image.pixels[20 * 40 + 20];
        assert!(pixel[0] > 150 && pixel[1] < 80, "{pixel:?}");
    }

    #[test]
    fn views_lie_side_by_side_and_repeat_exactly() {
        let mesh = square(10.0);
        let views = [View::FRONT, View::THREE_QUARTER, View::SIDE];
        let image = Scene::new([&mesh]).shaded(&views, [32, 24]);
        assert_eq!((image.width, image.height), (96, 24));
        assert_eq!(image, Scene::new([&mesh]).shaded(&views, [32, 24]));
    }

    #[test]
    fn lining_fills_an_enclosed_hole_and_leaves_the_surroundings() {
        let ring = [-10.0, -4.0, 4.0, 10.0];
        let positions = ring.iter().flat_map(|y| ring.iter().map(move |x| [*x, *y, 0.0])).collect();
        let cells = (0..9u32).filter(|cell| *cell != 4).map(|cell| cell / 3 * 4 + cell % 3);
        let faces = cells.flat_map(|v| [[v, v + 1, v + 5], [v, v + 5, v + 4]]).collect();
        let mesh = Mesh { positions, faces, ..Mesh::default() };
        let image = Scene { lining: Some([40, 30, 30]), ..Scene::new([&mesh]) }.shaded(&[View::FRONT], [40, 40]);
        assert_eq!(image.pixels[20 * 40 + 20], [40, 30, 30]);
        assert_eq!(image.pixels[0], [244, 244, 242]);
    }

    #[test]
    fn empty_scene_is_background() {
        let image = Scene::new([]).shaded(&[View::FRONT], [4, 4]);
        assert!(image.pixels.iter().all(|pixel| *pixel == [244, 244, 242]));
    }

    fn cloud(unit: f64) -> Mesh {
        let point = |k: i32| [f64::from(k % 30) * unit, f64::from(k / 30) * unit, 0.0];
        Mesh { positions: (0..900).map(point).collect(), ..Mesh::default() }
    }

    #[test]
    fn a_cloud_is_a_closed_surface_whatever_its_unit() {
        let seen = |unit: f64| Scene::new([&cloud(unit)]).shaded(&[View::FRONT], [60, 60]);
        let image = seen(1.0);
        let inside = (20..40).flat_map(|row| (20..40).map(move |column| row * 60 + column));
        let gaps = inside.filter(|&pixel| image.pixels[pixel] == [244, 244, 242]).count();
        assert_eq!(gaps, 0);
        assert_eq!(image, seen(1024.0));
        assert_eq!(image, seen(1.0 / 1024.0));
    }

    #[test]
    fn a_cloud_with_normals_away_from_the_viewer_is_dark() {
        let lit = |z: f64| {
            let mesh = Mesh { normals: vec![[0.0, 0.0, z]; 900], ..cloud(1.0) };
            brightness(&Scene::new([&mesh]).shaded(&[View::FRONT], [40, 40]))
        };
        assert!(3 * lit(-1.0) < 2 * lit(1.0), "{} {}", lit(-1.0), lit(1.0));
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        let sound = square(10.0);
        let mut broken = sound.clone();
        broken.positions.extend([[f64::NAN; 3], [f64::MAX; 3], [0.0, f64::INFINITY, 0.0]]);
        broken.faces.extend([[0, 1, 4], [0, 1, 5], [0, 1, 6], [0, 1, 99], [0, 0, 1]]);
        let seen = |mesh: &Mesh| Scene::new([mesh]).shaded(&[View::FRONT], [30, 30]);
        assert_eq!(seen(&broken), seen(&sound));
        let points = Mesh { faces: Vec::new(), ..broken };
        assert_ne!(seen(&points), seen(&Mesh::default()));
        assert_eq!(Scene::new([&sound]).shaded(&[View::FRONT], [0, 0]).pixels.len(), 0);
    }

    #[test]
    fn colours_of_a_field_stand_before_those_of_the_mesh() {
        let mesh = Mesh { colours: vec![[0, 0, 255]; 4], ..square(10.0) };
        let colours = [[255, 0, 0]; 4];
        let mut scene = Scene { finish: Finish::Even, ..Scene::new([&mesh]) };
        scene.meshes[0].colours = Some(&colours);
        let pixel = scene.shaded(&[View::FRONT], [40, 40]).pixels[20 * 40 + 20];
        assert!(pixel[0] > 200 && pixel[2] < 40, "{pixel:?}");
    }
}
