//! The z-buffer: triangles and discs to per-pixel depth, normal and colour.

use rayon::prelude::*;

/// What one pixel sees, in camera space (x right, y up, z towards the viewer).
#[derive(Debug, Clone, Copy)]
pub(super) struct Fragment {
    /// Towards the viewer, in units of the camera; minus infinity where nothing was drawn.
    pub depth: f32,
    /// Unit normal, turned towards the viewer; zero where it is not known yet.
    pub normal: [f32; 3],
    /// Linear colour.
    pub albedo: [f32; 3],
    /// Whether the inner side of the face is seen.
    pub back: bool,
}

/// A vertex after projection.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    /// Column and row in pixels, and depth in units of the camera.
    pub at: [f32; 3],
    /// Perspective weight: the inverse distance along the axis of view, 1 in an orthographic view.
    pub weight: f32,
    /// Camera-space normal.
    pub normal: [f32; 3],
    /// Linear colour.
    pub albedo: [f32; 3],
}

/// A rectangle of fragments.
#[derive(Debug)]
pub(super) struct Buffer {
    pub width: usize,
    pub height: usize,
    pub fragments: Vec<Fragment>,
}

impl Buffer {
    pub fn new(width: usize, height: usize) -> Self {
        let empty = Fragment { depth: f32::NEG_INFINITY, normal: [0.0, 0.0, 1.0], albedo: [0.0; 3], back: false };
        Buffer { width, height, fragments: vec![empty; width * height] }
    }

    /// The depth at a pixel, or nothing outside the picture or where nothing was drawn.
    pub fn depth(&self, column: i64, row: i64) -> Option<f32> {
        let column = usize::try_from(column).ok().filter(|column| *column < self.width)?;
        let row = usize::try_from(row).ok().filter(|row| *row < self.height)?;
        Some(self.fragments[row * self.width + column].depth).filter(|depth| depth.is_finite())
    }

    /// Whether each pixel is empty and cut off from the border of the picture by drawn pixels.
    pub fn enclosed(&self) -> Vec<bool> {
        let mut enclosed: Vec<bool> = self.fragments.iter().map(|fragment| !fragment.depth.is_finite()).collect();
        let (width, height) = (self.width, self.height);
        let on_border = |k: &usize| {
            let (row, column) = (k / width, k % width);
            row == 0 || column == 0 || row + 1 == height || column + 1 == width
        };
        let mut open: Vec<usize> = (0..enclosed.len()).filter(on_border).collect();
        while let Some(pixel) = open.pop() {
            if !std::mem::replace(&mut enclosed[pixel], false) {
                continue;
            }
            let (row, column) = (pixel / width, pixel % width);
            let steps = [(row > 0, pixel.wrapping_sub(width)), (row + 1 < height, pixel + width)];
            let sides = [(column > 0, pixel.wrapping_sub(1)), (column + 1 < width, pixel + 1)];
            open.extend(steps.iter().chain(&sides).filter(|(inside, _)| *inside).map(|(_, next)| *next));
        }
        enclosed
    }

    /// Draws a triangle, both sides; pixel centres lie at half-integers.
    pub fn draw(&mut self, [a, b, c]: [&Corner; 3]) {
        let cross = |p: [f32; 3], q: [f32; 3], x: f32, y: f32| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        let area = cross(a.at, b.at, c.at[0], c.at[1]);
        if !area.is_finite() || area == 0.0 {
            return;
        }
        // Rows grow downwards, so a triangle that is counter-clockwise to the viewer has a negative area here.
        let back = area > 0.0;
        let side = if back { -1.0 } else { 1.0 };
        let pixels = |coordinate: usize, limit: usize| {
            let values = [a.at[coordinate], b.at[coordinate], c.at[coordinate]];
            let low = values.iter().copied().fold(f32::INFINITY, f32::min) - 0.5;
            let high = values.iter().copied().fold(f32::NEG_INFINITY, f32::max) - 0.5;
            // Float to integer conversion saturates, so what lies outside is cut off.
            low.ceil() as usize..((high.floor() + 1.0).max(0.0) as usize).min(limit)
        };
        let columns = pixels(0, self.width);
        for row in pixels(1, self.height) {
            let y = row as f32 + 0.5;
            for column in columns.clone() {
                let x = column as f32 + 0.5;
                let share =
                    [cross(b.at, c.at, x, y) / area, cross(c.at, a.at, x, y) / area, cross(a.at, b.at, x, y) / area];
                if share.iter().any(|share| *share < 0.0) {
                    continue;
                }
                let weighted = [share[0] * a.weight, share[1] * b.weight, share[2] * c.weight];
                let total: f32 = weighted.iter().sum();
                let blend =
                    |of: fn(&Corner) -> f32| (weighted[0] * of(a) + weighted[1] * of(b) + weighted[2] * of(c)) / total;
                let depth = blend(|corner| corner.at[2]);
                let fragment = &mut self.fragments[row * self.width + column];
                if depth > fragment.depth {
                    let normal = [blend(|n| n.normal[0]), blend(|n| n.normal[1]), blend(|n| n.normal[2])];
                    let length = normal.iter().map(|n| n * n).sum::<f32>().sqrt().max(1e-12);
                    *fragment = Fragment {
                        depth,
                        normal: normal.map(|n| side * n / length),
                        albedo: [blend(|n| n.albedo[0]), blend(|n| n.albedo[1]), blend(|n| n.albedo[2])],
                        back,
                    };
                }
            }
        }
    }
}

/// A point of a cloud after projection.
#[derive(Debug, Clone, Copy)]
pub(super) struct Disc {
    /// Column and row in pixels, and depth in units of the camera.
    pub at: [f32; 3],
    /// Pixels per unit of the camera at this depth.
    pub scale: f32,
    /// In units of the camera.
    pub radius: f32,
    /// Camera-space unit normal; none: the disc faces the viewer, and its normal is found from the depths around it.
    pub normal: Option<[f32; 3]>,
    /// Linear colour.
    pub albedo: [f32; 3],
}

/// Discs seen from the edge are drawn as if they were turned this far: the cosine to the axis of view.
const STEEPEST: f32 = 0.25;

impl Buffer {
    /// Draws a disc, both sides; however small it is, the pixel of its centre shows it.
    pub fn draw_disc(&mut self, disc: &Disc) {
        let [x, y, z] = disc.at;
        if !(x.is_finite() && y.is_finite() && z.is_finite() && disc.scale > 0.0) {
            return;
        }
        let back = disc.normal.is_some_and(|n| n[2] < 0.0);
        let side = if back { -1.0 } else { 1.0 };
        let normal = disc.normal.map(|n| n.map(|n| side * n));
        let slope = normal.map_or([0.0; 2], |n| [n[0], n[1]].map(|along| -along / n[2].max(STEEPEST)));
        let reach = (disc.radius * disc.scale).max(0.0);
        let pixels = |middle: f32, limit: usize| {
            let (first, last) = ((middle - reach).floor().max(0.0), (middle + reach).floor().max(-1.0) + 1.0);
            first as usize..(last as usize).min(limit)
        };
        let columns = pixels(x, self.width);
        for row in pixels(y, self.height) {
            for column in columns.clone() {
                let (dx, dy) = ((column as f32 + 0.5 - x) / disc.scale, (y - row as f32 - 0.5) / disc.scale);
                let dz = slope[0] * dx + slope[1] * dy;
                let centre = column as f32 == x.floor() && row as f32 == y.floor();
                if !centre && dx * dx + dy * dy + dz * dz > disc.radius * disc.radius {
                    continue;
                }
                let fragment = &mut self.fragments[row * self.width + column];
                if z + dz > fragment.depth {
                    *fragment =
                        Fragment { depth: z + dz, normal: normal.unwrap_or([0.0; 3]), albedo: disc.albedo, back };
                }
            }
        }
    }

    /// Gives every drawn pixel without a normal that of the plane through the depths around it, in least squares.
    ///
    /// `radius` is that of the discs in units of the camera, `scale` pixels per unit. Depths that differ by more than a few
    /// radii are those of another part of the surface.
    pub fn find_normals(&mut self, radius: f32, scale: f32) {
        let unknown = |fragment: &Fragment| fragment.depth.is_finite() && fragment.normal == [0.0; 3];
        let found: Vec<(usize, [f32; 3])> = (0..self.fragments.len())
            .into_par_iter()
            .filter(|&pixel| unknown(&self.fragments[pixel]))
            .map(|pixel| (pixel, self.normal_around(pixel, radius, scale)))
            .collect();
        for (pixel, normal) in found {
            self.fragments[pixel].normal = normal;
        }
    }

    fn normal_around(&self, pixel: usize, radius: f32, scale: f32) -> [f32; 3] {
        const DIRECTIONS: usize = 12;
        const RINGS: [f32; 3] = [1.0, 2.0, 3.0];
        let here = self.fragments[pixel].depth;
        let (column, row) = ((pixel % self.width) as f32, (pixel / self.width) as f32);
        // At least a few pixels apart, or the steps between discs would be all that is seen.
        let step = (radius * scale).clamp(2.0, 40.0);
        let mut samples = vec![[0.0, 0.0, 0.0]];
        for direction in 0..DIRECTIONS {
            let (sine, cosine) = (direction as f32 * std::f32::consts::TAU / DIRECTIONS as f32).sin_cos();
            for ring in RINGS {
                let (x, y) = ((ring * step * cosine).round(), (ring * step * sine).round());
                if let Some(depth) = self.depth((column + x) as i64, (row - y) as i64)
                    && (depth - here).abs() < (3.0 * step / scale).max(2.0 * ring * step / scale)
                {
                    samples.push([x / step, y / step, (depth - here) * scale / step]);
                }
            }
        }
        plane_normal(&samples)
    }
}

/// Unit normal, towards the viewer, of the plane `z = a x + b y + c` that fits these points best.
fn plane_normal(points: &[[f32; 3]]) -> [f32; 3] {
    let n = points.len().max(1) as f32;
    let mean = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).sum::<f32>() / n);
    let product = |i: usize, j: usize| points.iter().map(|p| (p[i] - mean[i]) * (p[j] - mean[j])).sum::<f32>();
    let (xx, xy, yy, xz, yz) = (product(0, 0), product(0, 1), product(1, 1), product(0, 2), product(1, 2));
    let determinant = xx * yy - xy * xy;
    if !(determinant > 1e-3) {
        return [0.0, 0.0, 1.0];
    }
    let (a, b) = ((xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant);
    let length = (a * a + b * b + 1.0).sqrt();
    [-a / length, -b / length, 1.0 / length]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(x: f32, y: f32, depth: f32) -> Corner {
        Corner { at: [x, y, depth], weight: 1.0, normal: [0.0, 0.0, 1.0], albedo: [depth; 3] }
    }

    #[test]
    fn nearer_triangle_hides_the_farther_in_either_order() {
        let near = [corner(0.0, 0.0, 5.0), corner(0.0, 8.0, 5.0), corner(8.0, 0.0, 5.0)];
        let far = [corner(0.0, 0.0, 1.0), corner(0.0, 8.0, 1.0), corner(8.0, 0.0, 1.0)];
        for order in [[&near, &far], [&far, &near]] {
            let mut buffer = Buffer::new(8, 8);
            order.iter().for_each(|triangle| buffer.draw([&triangle[0], &triangle[1], &triangle[2]]));
            assert_eq!(buffer.depth(1, 1), Some(5.0));
            assert_eq!(buffer.depth(7, 7), None);
            assert!(!buffer.fragments[0].back);
        }
    }

    #[test]
    fn two_triangles_of_a_square_leave_no_gap() {
        let square = [corner(0.0, 0.0, 0.0), corner(0.0, 6.0, 0.0), corner(6.0, 6.0, 0.0), corner(6.0, 0.0, 0.0)];
        let mut buffer = Buffer::new(6, 6);
        buffer.draw([&square[0], &square[1], &square[2]]);
        buffer.draw([&square[0], &square[2], &square[3]]);
        assert!(buffer.fragments.iter().all(|fragment| fragment.depth == 0.0));
    }

    #[test]
    fn a_disc_is_round_from_the_front_and_narrow_when_turned() {
        let drawn = |normal: [f32; 3], radius: f32| {
            let mut buffer = Buffer::new(40, 40);
            buffer.draw_disc(&Disc {
                at: [20.0, 20.0, 1.0],
                scale: 10.0,
                radius,
                normal: Some(normal),
                albedo: [1.0; 3],
            });
            let drawn = buffer.fragments.iter().filter(|fragment| fragment.depth.is_finite());
            (drawn.clone().count(), drawn.filter(|fragment| fragment.back).count())
        };
        let (area, back) = drawn([0.0, 0.0, 1.0], 1.5);
        assert!((area as f32 - 225.0 * std::f32::consts::PI).abs() < 20.0 && back == 0, "{area}");
        let (turned, back) = drawn([0.8, 0.0, -0.6], 1.5);
        assert!((turned as f32 / area as f32 - 0.6).abs() < 0.05 && back == turned, "{turned}");
        assert_eq!(drawn([0.0, 0.0, 1.0], 0.0).0, 1);
    }

    #[test]
    fn the_normal_of_a_slanted_cloud_is_found_from_its_depths() {
        let mut buffer = Buffer::new(60, 60);
        for k in 0..400 {
            let (x, y) = (1.5 + 3.0 * (k % 20) as f32, 1.5 + 3.0 * (k / 20) as f32);
            // One unit is ten pixels; depth grows by 0.5 for each unit to the right.
            let at = [x, y, 0.05 * x];
            buffer.draw_disc(&Disc { at, scale: 10.0, radius: 0.3, normal: None, albedo: [1.0; 3] });
        }
        buffer.find_normals(0.3, 10.0);
        let normal = buffer.fragments[30 * 60 + 30].normal;
        let expected = [-0.4472, 0.0, 0.8944];
        assert!(normal.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.06), "{normal:?}");
    }
}
