//! From where a scene is seen, what of it fills the picture, and where its points fall in it.

use std::f64::consts::{FRAC_PI_2, PI};

/// A direction of view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Turn of the viewer to the subject's left about the vertical axis, in radians.
    pub yaw: f64,
    /// Height of the viewer above the horizon, in radians.
    pub pitch: f64,
    /// Distance of the eye from the centre of the frame in multiples of the frame's size (twice its `reach`); none: orthographic.
    pub distance: Option<f64>,
}

impl View {
    /// From straight ahead, in mild perspective.
    pub const FRONT: View = View { yaw: 0.0, pitch: 0.0, distance: Some(5.0) };
    /// Between front and side, in mild perspective.
    pub const THREE_QUARTER: View = View { yaw: 0.7, pitch: 0.1, distance: Some(5.0) };
    /// The subject's left profile, in mild perspective.
    pub const SIDE: View = View { yaw: FRAC_PI_2, ..View::FRONT };
    /// From behind, in mild perspective.
    pub const BACK: View = View { yaw: PI, ..View::FRONT };
    /// From above, the front at the bottom of the picture, in mild perspective.
    pub const TOP: View = View { pitch: FRAC_PI_2, ..View::FRONT };

    /// The views of a figure that shows everything, with their names.
    pub const NAMED: [(&str, View); 5] = [
        ("front", View::FRONT),
        ("three-quarter", View::THREE_QUARTER),
        ("left side", View::SIDE),
        ("back", View::BACK),
        ("top", View::TOP),
    ];
}

/// The part of space that fills a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Middle of the picture, in the coordinates of the scene.
    pub centre: [f64; 3],
    /// What must be visible around it: half the width and half the height, in the unit of the scene.
    pub half_size: [f64; 2],
    /// Half the size of what is shown, in the unit of the scene: perspective and the depth of shadows follow it.
    pub reach: f64,
}

/// Room between the shown points and the border of the picture.
const MARGIN: f64 = 1.05;

/// Coordinates beyond this are no place that could be shown: their squares would overflow.
const FARTHEST: f64 = 1e100;

/// Whether a point can be drawn: its coordinates are finite and at most 1e100.
pub(super) fn visible(point: [f64; 3]) -> bool {
    point.iter().all(|x| x.abs() <= FARTHEST)
}

impl Frame {
    /// The frame that holds these points in every one of the views, and of a single view has them in its middle. Points that are not finite count for nothing.
    pub fn holding(points: impl Iterator<Item = [f64; 3]> + Clone, views: &[View]) -> Self {
        let points = points.filter(|point| visible(*point));
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in points.clone() {
            low = std::array::from_fn(|axis| low[axis].min(point[axis]));
            high = std::array::from_fn(|axis| high[axis].max(point[axis]));
        }
        if low.iter().any(|bound| !bound.is_finite()) {
            return Frame { centre: [0.0; 3], half_size: [1.0; 2], reach: 1.0 };
        }
        let centre: [f64; 3] = std::array::from_fn(|axis| low[axis] / 2.0 + high[axis] / 2.0);
        let mut reach = (0..3).map(|axis| high[axis] / 2.0 - low[axis] / 2.0).fold(0.0, f64::max);
        if !(reach > 1e-100) {
            reach = 1.0;
        }
        let mut frame = Frame { centre, half_size: [reach; 2], reach };
        if let [view] = views {
            // The middle of the box is not that of what is seen of a shape that is turned.
            for _ in 0..3 {
                frame.centre = frame.centred(view, points.clone());
            }
        }
        let cameras: Vec<Camera> = views.iter().map(|view| Camera::new(view, &frame, [0, 0])).collect();
        let mut half = [0.0_f64; 2];
        for point in points {
            for camera in &cameras {
                let ([x, y, _], weight) = camera.seen(point);
                half = [half[0].max((x * weight).abs()), half[1].max((y * weight).abs())];
            }
        }
        if !views.is_empty() {
            // What is flat in a view still gets a little room.
            frame.half_size = half.map(|half| MARGIN * reach * half.max(0.02));
        }
        frame
    }

    /// The centre with which as much of the points is seen to the left as to the right, and above as below; nearly so in perspective.
    fn centred(&self, view: &View, points: impl Iterator<Item = [f64; 3]>) -> [f64; 3] {
        let camera = Camera::new(view, self, [0, 0]);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points {
            let ([x, y, _], weight) = camera.seen(point);
            let at = [x * weight, y * weight];
            (low, high) = ([0, 1].map(|axis| low[axis].min(at[axis])), [0, 1].map(|axis| high[axis].max(at[axis])));
        }
        let [right, up] = [0, 1].map(|axis| self.reach * (low[axis] / 2.0 + high[axis] / 2.0));
        let moved: [f64; 3] = std::array::from_fn(|axis| {
            // The axes of the picture are the first two rows of the turn.
            let unit: [f64; 3] = std::array::from_fn(|k| f64::from(u8::from(k == axis)));
            let [x, y, _] = camera.turned(unit);
            self.centre[axis] + right * x + up * y
        });
        if moved.iter().all(|x| x.is_finite()) { moved } else { self.centre }
    }
}

/// A view of a frame on a raster.
#[derive(Debug, Clone, Copy)]
pub(super) struct Camera {
    yaw: [f64; 2],
    pitch: [f64; 2],
    centre: [f64; 3],
    /// Units of the scene per unit of the camera.
    reach: f64,
    /// Of the eye from the centre, in units of the camera.
    distance: Option<f64>,
    middle: [f64; 2],
    /// Pixels per unit of the camera, at the depth of the frame's centre.
    pub scale: f64,
}

impl Camera {
    /// The camera whose picture of `size` = [width, height] pixels holds the frame.
    pub fn new(view: &View, frame: &Frame, size: [usize; 2]) -> Self {
        let (yaw, pitch) = (view.yaw.sin_cos(), view.pitch.sin_cos());
        let middle = size.map(|pixels| pixels as f64 / 2.0);
        let reach = if frame.reach > 0.0 { frame.reach } else { 1.0 };
        Camera {
            yaw: yaw.into(),
            pitch: pitch.into(),
            centre: frame.centre,
            reach,
            distance: view.distance.map(|multiple| 2.0 * multiple),
            middle,
            scale: (middle[0] / frame.half_size[0] * reach).min(middle[1] / frame.half_size[1] * reach),
        }
    }

    /// Camera coordinates (x right, y up, z towards the viewer) of a vector.
    pub fn turned(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [sine, cosine] = self.yaw;
        let (x, z) = (cosine * x - sine * z, sine * x + cosine * z);
        let [sine, cosine] = self.pitch;
        [x, cosine * y - sine * z, sine * y + cosine * z]
    }

    /// A point in units of the camera, and how much larger perspective makes it.
    fn seen(&self, point: [f64; 3]) -> ([f64; 3], f64) {
        let at = self.turned(std::array::from_fn(|axis| (point[axis] - self.centre[axis]) / self.reach));
        (at, self.distance.map_or(1.0, |distance| distance / (distance - at[2]).max(0.05 * distance)))
    }

    /// Column, row (in pixels) and depth (in units of the camera, towards the viewer) of a point, and its perspective weight.
    pub fn projected(&self, point: [f64; 3]) -> ([f32; 3], f32) {
        let ([x, y, z], weight) = self.seen(point);
        let scale = self.scale * weight;
        ([(self.middle[0] + scale * x) as f32, (self.middle[1] - scale * y) as f32, z as f32], weight as f32)
    }

    /// A length of the scene in units of the camera.
    pub fn length(&self, length: f64) -> f32 {
        (length / self.reach) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_holds_a_cube_in_every_view() {
        let corners = (0..8).map(|k| [0, 1, 2].map(|axis| 1000.0 + 3.0 * f64::from(k >> axis & 1)));
        let views = View::NAMED.map(|(_, view)| view);
        let frame = Frame::holding(corners.clone(), &views);
        assert_eq!((frame.centre, frame.reach), ([1001.5; 3], 1.5));
        for view in &views {
            let camera = Camera::new(view, &frame, [200, 100]);
            for corner in corners.clone() {
                let ([column, row, _], _) = camera.projected(corner);
                assert!((0.0..200.0).contains(&column) && (0.0..100.0).contains(&row), "{view:?} {column} {row}");
            }
        }
    }

    #[test]
    fn a_single_view_has_the_points_in_its_middle() {
        // Without its rear left edge the box that holds it is not what is seen of it.
        let corners =
            (0..8).filter(|k| k & 5 != 1).map(|k| [0, 1, 2].map(|axis| 1000.0 + 3.0 * f64::from(k >> axis & 1)));
        for view in [View::THREE_QUARTER, View { distance: None, ..View::THREE_QUARTER }, View::SIDE] {
            let camera = Camera::new(&view, &Frame::holding(corners.clone(), &[view]), [200, 200]);
            let ends = |axis: usize| {
                let all = corners.clone().map(|corner| f64::from(camera.projected(corner).0[axis]));
                all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
            };
            for [low, high] in [ends(0), ends(1)] {
                assert!((low + high - 200.0).abs() < 1.0 && low > 0.0, "{view:?}: {low} to {high}");
            }
        }
    }

    #[test]
    fn from_above_the_front_is_at_the_bottom_and_the_left_hand_at_the_right() {
        let frame = Frame { centre: [0.0; 3], half_size: [2.0; 2], reach: 1.0 };
        let camera = Camera::new(&View { distance: None, ..View::TOP }, &frame, [100, 100]);
        let ([column, row, depth], _) = camera.projected([1.0, 0.5, 1.0]);
        assert!((column - 75.0).abs() < 1e-4 && (row - 75.0).abs() < 1e-4 && (depth - 0.5).abs() < 1e-6);
    }

    #[test]
    fn points_that_cannot_be_shown_do_not_move_the_frame() {
        let points = [[0.0, 0.0, 0.0], [2.0, 4.0, 2.0]];
        let broken = [[f64::NAN, 0.0, 0.0], [f64::MAX, 0.0, 0.0], [0.0, f64::NEG_INFINITY, 0.0]];
        let sound = Frame::holding(points.iter().copied(), &[View::FRONT]);
        assert_eq!(Frame::holding(points.iter().chain(&broken).copied(), &[View::FRONT]), sound);
        let nothing = Frame::holding(broken.iter().copied(), &[View::FRONT]);
        assert_eq!(nothing, Frame::holding(std::iter::empty(), &[View::FRONT]));
        let single = Frame::holding(std::iter::once([7.0; 3]), &[View::FRONT]);
        assert!(single.half_size.iter().all(|half| *half > 0.0) && single.reach == 1.0);
    }
}
