//! The 24 rotations that carry axes to axes, and how they are called.

use super::fit::Matrix;

/// A rotation that carries every axis to an axis: the direction of the scan that becomes x, y and z of the template.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisTurn {
    /// For x (left), y (up) and z (front) of the template: which axis of the scan it is, and whether reversed.
    rows: [(usize, bool); 3],
}

impl AxisTurn {
    /// The turn that changes nothing.
    pub const NONE: AxisTurn = AxisTurn { rows: [(0, false), (1, false), (2, false)] };

    /// All 24.
    pub fn all() -> Vec<AxisTurn> {
        let mut turns = Vec::new();
        for (number, axes) in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]].into_iter().enumerate()
        {
            for signs in 0..8u32 {
                // An odd permutation needs an odd number of reversals to be a rotation.
                if (signs.count_ones() % 2 == 1) == (number >= 3) {
                    turns.push(AxisTurn { rows: [0, 1, 2].map(|row| (axes[row], signs >> row & 1 == 1)) });
                }
            }
        }
        turns
    }

    /// The matrix, by rows: `x_template = matrix x_scan`.
    pub fn matrix(&self) -> Matrix {
        let mut matrix = [[0.0; 3]; 3];
        for (row, &(axis, reversed)) in matrix.iter_mut().zip(&self.rows) {
            row[axis] = if reversed { -1.0 } else { 1.0 };
        }
        matrix
    }

    /// The turned vector; exact.
    pub fn applied(&self, v: [f64; 3]) -> [f64; 3] {
        self.rows.map(|(axis, reversed)| if reversed { -v[axis] } else { v[axis] })
    }

    /// The turn nearest to a rotation, and the angle between them in degrees; the first in the order of [`Self::all`] of
    /// equally near ones.
    pub(super) fn nearest(rotation: &Matrix) -> (AxisTurn, f64) {
        let mut nearest = (AxisTurn::NONE, f64::INFINITY);
        for turn in Self::all() {
            let angle = angle_between(&turn.matrix(), rotation);
            if angle < nearest.1 {
                nearest = (turn, angle);
            }
        }
        nearest
    }
}

impl std::fmt::Display for AxisTurn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [left, up, front] =
            self.rows.map(|(axis, reversed)| format!("{}{}", if reversed { '-' } else { '+' }, ["x", "y", "z"][axis]));
        write!(f, "up {up}, front {front}, left {left}")
    }
}

/// The angle of the rotation from one to the other, in degrees.
pub(super) fn angle_between(a: &Matrix, b: &Matrix) -> f64 {
    let trace: f64 = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum();
    ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_24_rotations_all_different() {
        let turns = AxisTurn::all();
        assert_eq!(turns.len(), 24);
        assert_eq!(turns[0], AxisTurn::NONE);
        for (index, turn) in turns.iter().enumerate() {
            assert!(!turns[..index].contains(turn));
            let [a, b, c] = turn.matrix().map(glam::DVec3::from_array);
            assert_eq!(a.cross(b), c, "right-handed");
            assert_eq!(AxisTurn::nearest(&turn.matrix()), (*turn, 0.0));
            let v = [1.0, 2.0, 3.0];
            let product = turn.matrix().map(|row| (0..3).map(|k| row[k] * v[k]).sum::<f64>());
            assert_eq!(turn.applied(v), product);
        }
    }

    #[test]
    fn the_name_says_where_the_axes_are_in_the_scan() {
        // z up and facing -y, as many scanners have it: left is x.
        let turn = AxisTurn { rows: [(0, false), (2, false), (1, true)] };
        assert_eq!(turn.to_string(), "up +z, front -y, left +x");
        assert_eq!(turn.applied([1.0, 2.0, 3.0]), [1.0, 3.0, -2.0]);
        assert!((angle_between(&turn.matrix(), &AxisTurn::NONE.matrix()) - 90.0).abs() < 1e-12);
    }
}
