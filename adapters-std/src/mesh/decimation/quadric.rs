//! Sums of squared distances from planes as a function of the position (`garland1997`).

use glam::{DMat3, DVec3};

/// Weight, in that of the planes, of the pull to the middle of an edge where the planes leave the best place open.
const PULL: f64 = 1e-4;

/// `x A x + 2 b x + c`: the sum of `weight (n x + d)^2` over planes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadric {
    a: DMat3Sum,
    b: DVec3,
    c: f64,
    /// The weights of the planes that count for the mean.
    pub weight: f64,
}

/// A symmetric matrix that starts at zero (that of glam starts at one).
#[derive(Debug, Clone, Copy)]
struct DMat3Sum(DMat3);

impl Default for DMat3Sum {
    fn default() -> Self {
        DMat3Sum(DMat3::ZERO)
    }
}

impl Quadric {
    /// The plane with this unit normal through a point. It counts for the mean unless it only holds a boundary.
    pub fn plane(normal: DVec3, point: DVec3, weight: f64, counts: bool) -> Self {
        let d = -normal.dot(point);
        let scaled = normal * weight;
        Quadric {
            a: DMat3Sum(DMat3::from_cols(scaled * normal.x, scaled * normal.y, scaled * normal.z)),
            b: scaled * d,
            c: weight * d * d,
            weight: if counts { weight } else { 0.0 },
        }
    }

    pub fn plus(&self, other: &Quadric) -> Quadric {
        Quadric {
            a: DMat3Sum(self.a.0 + other.a.0),
            b: self.b + other.b,
            c: self.c + other.c,
            weight: self.weight + other.weight,
        }
    }

    /// The sum at a position. Rounding does not make it negative.
    pub fn at(&self, x: DVec3) -> f64 {
        (x.dot(self.a.0 * x) + 2.0 * self.b.dot(x) + self.c).max(0.0)
    }

    /// The position of the smallest sum, drawn a little to `middle`; `middle` itself where there is no plane.
    pub fn best(&self, middle: DVec3) -> DVec3 {
        let pull = PULL * (self.a.0.x_axis.x + self.a.0.y_axis.y + self.a.0.z_axis.z);
        if !(pull > 0.0) {
            return middle;
        }
        // About the middle, the solution is small where the planes say little.
        let matrix = self.a.0 + DMat3::from_diagonal(DVec3::splat(pull));
        let step = matrix.inverse() * -(self.a.0 * middle + self.b);
        if step.is_finite() { middle + step } else { middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_planes_meet_in_their_best_point() {
        let corner = DVec3::new(3.0, -2.0, 5.0);
        let planes = [DVec3::X, DVec3::Y, DVec3::new(0.6, 0.0, 0.8)];
        let sum =
            planes.iter().fold(Quadric::default(), |sum, normal| sum.plus(&Quadric::plane(*normal, corner, 2.0, true)));
        assert_eq!(sum.weight, 6.0);
        assert!(sum.at(corner) < 1e-12);
        let away = corner + DVec3::new(0.0, 1.5, 0.0);
        assert!((sum.at(away) - 2.0 * 1.5 * 1.5).abs() < 1e-12);
        let best = sum.best(corner + DVec3::splat(1.0));
        assert!(best.distance(corner) < 20.0 * PULL, "{best}");
    }

    #[test]
    fn one_plane_draws_the_middle_to_itself_alone() {
        let plane = Quadric::plane(DVec3::Z, DVec3::ZERO, 4.0, false);
        let best = plane.best(DVec3::new(7.0, 8.0, 1.0));
        assert!(best.truncate() == glam::DVec2::new(7.0, 8.0) && best.z.abs() < 2.0 * PULL, "{best}");
        assert_eq!(plane.weight, 0.0);
        assert_eq!(Quadric::default().best(DVec3::ONE), DVec3::ONE);
    }
}
