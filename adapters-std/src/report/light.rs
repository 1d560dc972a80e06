//! The light that a fragment sends to the viewer: three lights, and an obscurance term over the depths around it.
//!
//! The obscurance (how much of the hemisphere above a pixel is blocked by nearer pixels within a tenth of the frame)
//! is what makes eyelids, nostrils and the line between lips readable.

use super::raster::{Buffer, Fragment};

/// Samples per pixel along each side.
pub(super) const SUPERSAMPLING: usize = 2;

/// How surfaces answer the light.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Finish {
    /// Strong light and shade, a little gloss: shows the form.
    #[default]
    Clay,
    /// Soft light without tint or gloss: colours stay close to those of a colour bar.
    Even,
}

/// The unblocked share of the hemisphere above a fragment, 0 to 1, from the depths around it. `scale` is in pixels per
/// unit of depth.
pub(super) fn openness(buffer: &Buffer, column: usize, row: usize, scale: f32) -> f32 {
    const DIRECTIONS: usize = 8;
    /// In units of the camera, half the size of what is shown: about 1 to 14 mm on a face.
    const RADII: [f32; 4] = [0.0095, 0.024, 0.056, 0.112];
    const RADIUS_WEIGHTS: [f32; 4] = [1.0, 1.0, 0.8, 0.5];
    let here = &buffer.fragments[row * buffer.width + column];
    // The samples of one pixel look in different directions, so that the average has four times as many.
    let turn = ((column % SUPERSAMPLING) * SUPERSAMPLING + row % SUPERSAMPLING) as f32 / 4.0;
    let mut blocked = 0.0;
    for direction in 0..DIRECTIONS {
        let (sine, cosine) = ((direction as f32 + turn) * std::f32::consts::TAU / DIRECTIONS as f32).sin_cos();
        for (radius, weight) in RADII.iter().zip(RADIUS_WEIGHTS) {
            let x = column as i64 + (radius * scale * cosine).round() as i64;
            let y = row as i64 - (radius * scale * sine).round() as i64;
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

/// Linear light that a fragment sends to the viewer.
pub(super) fn light(finish: Finish, fragment: &Fragment, open: f32) -> [f32; 3] {
    match finish {
        Finish::Clay => clay(fragment, open),
        Finish::Even => even(fragment, open),
    }
}

const KEY: [f32; 3] = [-0.48, 0.56, 0.675];

fn towards(n: [f32; 3], l: [f32; 3]) -> f32 {
    n[0] * l[0] + n[1] * l[1] + n[2] * l[2]
}

/// Key from the upper left, fill from the right, rim from behind.
fn clay(fragment: &Fragment, open: f32) -> [f32; 3] {
    const FILL: [f32; 3] = [0.80, 0.10, 0.59];
    const HALF: [f32; 3] = [-0.262, 0.306, 0.915];
    let n = fragment.normal;
    let key = towards(n, KEY).max(0.0);
    let fill = ((towards(n, FILL) + 0.3) / 1.3).max(0.0);
    let grazing = (1.0 - n[2].clamp(0.0, 1.0)).powi(4);
    let rim = grazing * (0.6 + 0.4 * n[1]).max(0.0);
    let gloss = towards(n, HALF).max(0.0).powi(28);
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

/// White light that falls off slowly with the angle to the key.
fn even(fragment: &Fragment, open: f32) -> [f32; 3] {
    let lit = 0.5 + 0.5 * towards(fragment.normal, KEY);
    let side = if fragment.back { 0.4 } else { 1.0 };
    let tone = side * (0.30 + 0.72 * lit * lit) * (0.45 + 0.55 * open);
    fragment.albedo.map(|albedo| albedo * tone)
}

/// Linear value of an sRGB byte.
pub(super) fn linear(byte: u8) -> f32 {
    let value = f32::from(byte) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// sRGB byte of a linear value.
pub(super) fn encoded(value: f32) -> u8 {
    let value = value.clamp(0.0, 1.0);
    let code = if value <= 0.0031308 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
    (255.0 * code).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_survive_the_linear_scale() {
        (0..=255u8).for_each(|byte| assert_eq!(encoded(linear(byte)), byte));
    }

    #[test]
    fn even_light_keeps_the_colour_of_what_faces_the_key() {
        let albedo = [68, 1, 84].map(linear);
        let fragment = Fragment { depth: 0.0, normal: KEY, albedo, back: false };
        let seen = light(Finish::Even, &fragment, 1.0).map(encoded);
        assert!(seen.iter().zip([68u8, 1, 84]).all(|(a, b)| a.abs_diff(b) <= 2), "{seen:?}");
    }
}
