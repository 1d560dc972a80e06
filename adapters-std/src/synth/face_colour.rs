//! The colours of a face: skin, lips, brows and eyes. They are for the viewer; no measure uses them.

use super::face_grid::{EYE_ACROSS, EYE_HALF_WIDTH, EYE_HEIGHT, LID_BAND, MOUTH_CORNER, Node, SLIT};
use super::face_shape::FaceShape;
use super::face_surface::{brow_hair, lid_heights, lip_height};
use super::profile::{mound, step};

/// The sRGB colour of a node.
pub(super) fn colour(node: &Node, shape: &FaceShape) -> [u8; 3] {
    let at = [node.across, node.up];
    let mut colour = [222.0, 184.0, 160.0];
    let mut over = |amount: f64, paint: [f64; 3]| (0..3).for_each(|k| colour[k] += amount * (paint[k] - colour[k]));
    over(0.22 * mound(at, [40.0, -30.0], [26.0, 24.0]), [220.0, 140.0, 124.0]);
    over(0.30 * mound(at, [0.0, -42.0], [16.0, 14.0]), [220.0, 140.0, 124.0]);
    let red = (node.up - SLIT).abs() / lip_height(node);
    let body = step((MOUTH_CORNER + 1.5 - node.across) / 4.0);
    over(0.5 * body * (1.0 - step((red - 0.85) / 0.3)), [186.0, 98.0, 94.0]);
    over(0.78 * brow_hair(node), [84.0, 60.0, 46.0]);
    let t = (node.across - EYE_ACROSS) / EYE_HALF_WIDTH;
    let beta = node.up - EYE_HEIGHT;
    if t.abs() < 1.0 && beta.abs() < 0.98 * LID_BAND {
        let (_, height) = lid_heights(t, beta, shape);
        let from_pupil = (EYE_HALF_WIDTH * (t + 0.03)).hypot(height - 0.6);
        over(1.0, [240.0, 236.0, 230.0]);
        over(1.0 - step((from_pupil - 4.8) / 2.0), [92.0, 66.0, 44.0]);
        over(1.0 - step((from_pupil - 1.4) / 2.0), [24.0, 18.0, 16.0]);
    } else if t.abs() < 1.08 && (beta.abs() - LID_BAND).abs() < 1.0 {
        over(0.45, [120.0, 76.0, 62.0]);
    }
    colour.map(|channel| channel.round() as u8)
}
