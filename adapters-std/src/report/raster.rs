//! The z-buffer: triangles to per-pixel depth, normal and colour.

/// What one pixel sees, in camera space (x right, y up, z towards the viewer).
#[derive(Debug, Clone, Copy)]
pub(super) struct Fragment {
    /// Towards the viewer, in mm; minus infinity where nothing was drawn.
    pub depth: f32,
    /// Unit normal, turned towards the viewer.
    pub normal: [f32; 3],
    /// Linear colour.
    pub albedo: [f32; 3],
    /// Whether the inner side of the face is seen.
    pub back: bool,
}

/// A vertex after projection.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    /// Column and row in pixels, and depth in mm.
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
}
