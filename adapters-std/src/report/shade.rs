//! Shaded views of triangle meshes: three lights and an obscurance term over a z-buffer.
//!
//! Every view is drawn at twice the width and height and averaged. The obscurance (how much of the hemisphere above a
//! pixel is blocked by nearer pixels within 14 mm) is what makes eyelids, nostrils and the line between lips readable.

use super::picture::Image;
use super::raster::{Buffer, Corner, Fragment};
use crate::mesh::Mesh;
use rayon::prelude::*;

/// Samples per pixel along each side.
const SUPERSAMPLING: usize = 2;

/// A direction of view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Turn of the viewer to the subject's left about the vertical axis, in radians.
    pub yaw: f64,
    /// Height of the viewer above the horizon, in radians.
    pub pitch: f64,
    /// Distance of the eye from the centre of the frame in multiples of the frame's height; none: orthographic.
    pub distance: Option<f64>,
}

impl View {
    /// From straight ahead, in mild perspective.
    pub const FRONT: View = View { yaw: 0.0, pitch: 0.0, distance: Some(5.0) };
    /// Between front and side, in mild perspective.
    pub const THREE_QUARTER: View = View { yaw: 0.7, pitch: 0.1, distance: Some(5.0) };
    /// The subject's left profile, in mild perspective.
    pub const SIDE: View = View { yaw: std::f64::consts::FRAC_PI_2, pitch: 0.0, distance: Some(5.0) };

    /// Camera coordinates (x right, y up, z towards the viewer) of a vector.
    fn turned(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (sine, cosine) = self.yaw.sin_cos();
        let (x, z) = (cosine * x - sine * z, sine * x + cosine * z);
        let (sine, cosine) = self.pitch.sin_cos();
        [x, cosine * y - sine * z, sine * y + cosine * z]
    }
}

/// The part of space that fills a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Middle of the picture, in the coordinates of the scene.
    pub centre: [f64; 3],
    /// What must be visible around it in either direction: half the width and half the height, in mm.
    pub half_size: [f64; 2],
}

impl Frame {
    /// The frame that holds these points, whatever the yaw.
    pub fn holding(points: impl Iterator<Item = [f64; 3]>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in points {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        if low.iter().chain(&high).any(|bound| !bound.is_finite()) {
            return Frame { centre: [0.0; 3], half_size: [1.0; 2] };
        }
        let half = |axis: usize| (high[axis] - low[axis]).max(1e-9) / 2.0;
        let centre = [0, 1, 2].map(|axis| (low[axis] + high[axis]) / 2.0);
        Frame { centre, half_size: [1.06 * half(0).max(half(2)), 1.06 * half(1)] }
    }
}

/// A mesh in a scene.
#[derive(Debug, Clone, Copy)]
pub struct Placed<'a> {
    /// The mesh; its normals are used when it has them, else area-weighted ones.
    pub mesh: &'a Mesh,
    /// Translation, in mm.
    pub offset: [f64; 3],
    /// sRGB colour where the mesh has none of its own.
    pub colour: [u8; 3],
}

impl<'a> Placed<'a> {
    /// The mesh where it is, in the colour of unglazed clay.
    pub fn new(mesh: &'a Mesh) -> Self {
        Placed { mesh, offset: [0.0; 3], colour: [214, 188, 168] }
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
}

impl<'a> Scene<'a> {
    /// These meshes where they are, before a light background.
    pub fn new(meshes: impl IntoIterator<Item = &'a Mesh>) -> Self {
        let meshes = meshes.into_iter().map(Placed::new).collect();
        Scene { meshes, background: [244, 244, 242], frame: None, lining: None }
    }

    /// The frame that holds every mesh.
    fn whole(&self) -> Frame {
        Frame::holding(self.meshes.iter().flat_map(|placed| {
            placed.mesh.positions.iter().map(|p| [0, 1, 2].map(|axis| p[axis] + placed.offset[axis]))
        }))
    }

    /// The views side by side, each `size` = [width, height] pixels, at one common scale.
    pub fn shaded(&self, views: &[View], size: [usize; 2]) -> Image {
        let frame = self.frame.unwrap_or_else(|| self.whole());
        let pictures: Vec<Image> = views.par_iter().map(|view| self.view(view, &frame, size)).collect();
        let mut image = Image::filled(size[0] * views.len(), size[1], self.background);
        for (place, picture) in pictures.iter().enumerate() {
            image.paste(picture, place * size[0], 0);
        }
        image
    }

    fn view(&self, view: &View, frame: &Frame, [width, height]: [usize; 2]) -> Image {
        let mut buffer = Buffer::new(width * SUPERSAMPLING, height * SUPERSAMPLING);
        let (middle_x, middle_y) = (buffer.width as f64 / 2.0, buffer.height as f64 / 2.0);
        let pixels_per_mm = (middle_x / frame.half_size[0]).min(middle_y / frame.half_size[1]);
        let distance = view.distance.map(|multiple| multiple * 2.0 * frame.half_size[1]);
        for placed in &self.meshes {
            let mesh = placed.mesh;
            let own = mesh.normals.len() == mesh.positions.len();
            let normals = if own { mesh.normals.clone() } else { vertex_normals(mesh) };
            let corners: Vec<Corner> = std::iter::zip(&mesh.positions, &normals)
                .enumerate()
                .map(|(vertex, (position, normal))| {
                    let centred = [0, 1, 2].map(|axis| position[axis] + placed.offset[axis] - frame.centre[axis]);
                    let [x, y, z] = view.turned(centred);
                    let weight = distance.map_or(1.0, |distance| distance / (distance - z).max(0.05 * distance));
                    let scale = pixels_per_mm * weight;
                    Corner {
                        at: [(middle_x + scale * x) as f32, (middle_y - scale * y) as f32, z as f32],
                        weight: weight as f32,
                        normal: view.turned(*normal).map(|n| n as f32),
                        albedo: mesh.colours.get(vertex).unwrap_or(&placed.colour).map(linear),
                    }
                })
                .collect();
            for face in &mesh.faces {
                let [a, b, c] = face.map(|vertex| corners.get(vertex as usize));
                if let (Some(a), Some(b), Some(c)) = (a, b, c) {
                    buffer.draw([a, b, c]);
                }
            }
        }
        self.averaged(&buffer, pixels_per_mm as f32, [width, height])
    }

    /// The picture from its fragments: each pixel is the mean light of its samples.
    fn averaged(&self, buffer: &Buffer, pixels_per_mm: f32, [width, height]: [usize; 2]) -> Image {
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
                        light(fragment, openness(buffer, x, y, pixels_per_mm))
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

/// Area-weighted unit normals of the vertices; zero where no face is.
fn vertex_normals(mesh: &Mesh) -> Vec<[f64; 3]> {
    let mut normals = vec![[0.0; 3]; mesh.positions.len()];
    for face in &mesh.faces {
        let [Some(p), Some(q), Some(r)] = face.map(|vertex| mesh.positions.get(vertex as usize)) else { continue };
        let (e, f) = ([0, 1, 2].map(|k| q[k] - p[k]), [0, 1, 2].map(|k| r[k] - p[k]));
        let normal = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
        for vertex in face {
            (0..3).for_each(|axis| normals[*vertex as usize][axis] += normal[axis]);
        }
    }
    for normal in &mut normals {
        let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        if length > 0.0 {
            normal.iter_mut().for_each(|n| *n /= length);
        }
    }
    normals
}

/// The unblocked share of the hemisphere above a fragment, 0 to 1, from the depths around it.
fn openness(buffer: &Buffer, column: usize, row: usize, pixels_per_mm: f32) -> f32 {
    const DIRECTIONS: usize = 8;
    const RADII_MM: [f32; 4] = [1.2, 3.0, 7.0, 14.0];
    const RADIUS_WEIGHTS: [f32; 4] = [1.0, 1.0, 0.8, 0.5];
    let here = &buffer.fragments[row * buffer.width + column];
    // The samples of one pixel look in different directions, so that the average has four times as many.
    let turn = ((column % SUPERSAMPLING) * SUPERSAMPLING + row % SUPERSAMPLING) as f32 / 4.0;
    let mut blocked = 0.0;
    for direction in 0..DIRECTIONS {
        let (sine, cosine) = ((direction as f32 + turn) * std::f32::consts::TAU / DIRECTIONS as f32).sin_cos();
        for (radius, weight) in RADII_MM.iter().zip(RADIUS_WEIGHTS) {
            let x = column as i64 + (radius * pixels_per_mm * cosine).round() as i64;
            let y = row as i64 - (radius * pixels_per_mm * sine).round() as i64;
            if let Some(depth) = buffer.depth(x, y) {
                let rise = depth - here.depth;
                let along = radius * (cosine * here.normal[0] + sine * here.normal[1]) + rise * here.normal[2];
                let length = (radius * radius + rise * rise).sqrt();
                // What stands far in front belongs to another part of the shape and blocks less.
                let near = 1.0 / (1.0 + (rise / (2.0 * radius)).powi(2));
                blocked += weight * near * (along / length - 0.06).max(0.0);
            }
        }
    }
    (1.0 - 2.0 * blocked / (DIRECTIONS as f32 * RADIUS_WEIGHTS.iter().sum::<f32>())).clamp(0.0, 1.0)
}

/// Linear light that a fragment sends to the viewer: key from the upper left, fill from the right, rim from behind.
fn light(fragment: &Fragment, open: f32) -> [f32; 3] {
    const KEY: [f32; 3] = [-0.48, 0.56, 0.675];
    const FILL: [f32; 3] = [0.80, 0.10, 0.59];
    const HALF: [f32; 3] = [-0.262, 0.306, 0.915];
    let n = fragment.normal;
    let towards = |l: [f32; 3]| n[0] * l[0] + n[1] * l[1] + n[2] * l[2];
    let key = towards(KEY).max(0.0);
    let fill = ((towards(FILL) + 0.3) / 1.3).max(0.0);
    let grazing = (1.0 - n[2].clamp(0.0, 1.0)).powi(4);
    let rim = grazing * (0.6 + 0.4 * n[1]).max(0.0);
    let gloss = towards(HALF).max(0.0).powi(28);
    let tones = [
        [1.0, 0.97, 0.92].map(|tone| 0.80 * tone * key * (0.35 + 0.65 * open)),
        [0.86, 0.93, 1.0].map(|tone| 0.17 * tone * fill * open),
        [0.92, 0.96, 1.0].map(|tone| 0.20 * tone * rim * open),
        [0.95, 0.97, 1.0].map(|tone| 0.20 * tone * (0.65 + 0.35 * n[1]) * open * open),
    ];
    let side = if fragment.back { 0.12 } else { 1.0 };
    let gloss = if fragment.back { 0.0 } else { 0.05 * gloss * open };
    [0, 1, 2].map(|c| side * fragment.albedo[c] * tones.iter().map(|tone| tone[c]).sum::<f32>() + gloss)
}

/// Linear value of an sRGB byte.
fn linear(byte: u8) -> f32 {
    let value = f32::from(byte) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// sRGB byte of a linear value.
fn encoded(value: f32) -> u8 {
    let value = value.clamp(0.0, 1.0);
    let code = if value <= 0.0031308 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
    (255.0 * code).round() as u8
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
    fn bytes_survive_the_linear_scale() {
        (0..=255u8).for_each(|byte| assert_eq!(encoded(linear(byte)), byte));
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
        let frame = Frame { centre: [0.0; 3], half_size: [50.0; 2] };
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
}
