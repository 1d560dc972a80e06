//! Angles, and directions of the plane as unit vectors that are multiplied like complex numbers.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::Frame;

/// The angle from `-pi` to `pi` that differs by full turns.
pub fn wrapped(angle: f64) -> f64 {
    if angle.abs() <= PI {
        return angle;
    }
    angle - TAU * (angle / TAU).round()
}

/// The angle from 0 to below `2 pi` that differs by full turns.
pub(super) fn positive(angle: f64) -> f64 {
    let rest = angle.rem_euclid(TAU);
    if rest < TAU { rest } else { 0.0 }
}

/// `direction` turned by the angle of the unit vector `by`.
pub(super) fn turned(direction: DVec2, by: DVec2) -> DVec2 {
    by.rotate(direction)
}

/// `direction` turned back by the angle of the unit vector `by`.
pub(super) fn turned_back(direction: DVec2, by: DVec2) -> DVec2 {
    DVec2::new(by.x, -by.y).rotate(direction)
}

/// The angle of a plane vector, from `-pi` to `pi`.
pub(super) fn angle_of(direction: DVec2) -> f64 {
    direction.y.atan2(direction.x)
}

/// `v` turned by the smallest rotation that takes the unit vector `from` to the unit vector `to`; unchanged where they are opposite.
pub(super) fn carried(v: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    // Rodrigues: with w = from x to and c = from . to, v c + w x v + w (w . v) / (1 + c).
    let (w, c) = (from.cross(to), from.dot(to));
    if 1.0 + c < 1e-12 { v } else { v * c + w.cross(v) + w * (w.dot(v) / (1.0 + c)) }
}

/// The frame with this unit normal whose `u` is along the projection of `towards`, or of the axis least along the normal when that
/// projection has no direction.
pub(super) fn frame_towards(normal: DVec3, towards: DVec3) -> Frame {
    let flat = |v: DVec3| v - normal * normal.dot(v);
    let mut u = flat(towards);
    if !(u.length_squared() > 1e-20 * towards.length_squared()) {
        let n = normal.abs();
        let axis = if n.x <= n.y && n.x <= n.z {
            DVec3::X
        } else if n.y <= n.z {
            DVec3::Y
        } else {
            DVec3::Z
        };
        u = flat(axis);
    }
    // Twice, since a projection of a vector almost along the normal keeps a rounded part of it.
    let u = flat(u.normalize()).normalize();
    Frame { u: u.to_array(), v: normal.cross(u).to_array(), normal: normal.to_array() }
}

impl Frame {
    /// The coordinates of a vector in the tangent plane.
    pub fn coordinates(&self, vector: [f64; 3]) -> [f64; 2] {
        let vector = DVec3::from_array(vector);
        [vector.dot(DVec3::from_array(self.u)), vector.dot(DVec3::from_array(self.v))]
    }

    /// The vector with these coordinates in the tangent plane.
    pub fn vector(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        (DVec3::from_array(self.u) * x + DVec3::from_array(self.v) * y).to_array()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_wrapped() {
        for (angle, expected) in
            [(0.0, 0.0), (PI, PI), (-PI, -PI), (4.0, 4.0 - TAU), (-7.0, TAU - 7.0), (1e3, 1e3 - 159.0 * TAU)]
        {
            assert!((wrapped(angle) - expected).abs() < 1e-12, "{angle}");
            assert!((positive(angle) - wrapped(angle)).rem_euclid(TAU).min(1.0) < 1e-12, "{angle}");
        }
        assert_eq!(positive(-1e-18), 0.0);
        assert!(wrapped(f64::NAN).is_nan());
    }

    #[test]
    fn the_smallest_rotation_takes_one_normal_to_the_other() {
        let (from, to) = (DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.0, 0.28, 0.96));
        assert!((carried(from, from, to) - to).length() < 1e-15);
        let axis = from.cross(to);
        assert!((carried(axis, from, to) - axis).length() < 1e-15);
        assert_eq!(carried(axis, from, -from), axis);
    }

    #[test]
    fn frames_are_right_handed_also_without_a_direction() {
        for towards in [DVec3::X, DVec3::Z * 7.0, DVec3::ZERO, DVec3::new(1e-14, 0.0, 1.0)] {
            let frame = frame_towards(DVec3::Z, towards);
            let [u, v, n] = [frame.u, frame.v, frame.normal].map(DVec3::from_array);
            assert!((u.cross(v) - n).length() < 1e-15 && u.dot(n).abs() < 1e-15, "{frame:?}");
            assert!(
                frame
                    .coordinates(frame.vector([2.0, -3.0]))
                    .iter()
                    .zip([2.0, -3.0])
                    .all(|(a, b)| (a - b).abs() < 1e-14)
            );
        }
    }
}
