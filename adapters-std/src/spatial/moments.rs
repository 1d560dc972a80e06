//! What a far observer sees of a piece of surface: its moments, from which the solid angle follows (Barill et al. 2018, section 3).
//!
//! The solid angle of a surface with area vectors `A` seen from `q` is the sum of `A . r / |r|^3`, `r` from `q` to the surface. Its
//! Taylor series about a centre `c` needs the moments `sum A_i`, `sum A_i d_j`, `sum A_i d_j d_k`, `d` from `c` to the surface. The
//! derivatives of `r / |r|^3` are symmetric and without trace, so only those parts of the moments count. Such a part is a homogeneous
//! harmonic polynomial, and with `u = (c - q) / |c - q|` the series is `N(u) / r^2 - 3 M(u) / r^3 + 15/2 T(u) / r^4`.

use glam::DVec3;

/// The coefficients of a homogeneous polynomial of degree 2: xx, yy, zz, xy, yz, zx.
type Quadratic = [f64; 6];

/// Of degree 3: xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy, xyz.
type Cubic = [f64; 10];

/// The moments of area vectors about a centre, as polynomials.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments {
    zeroth: DVec3,
    first: Quadratic,
    second: Cubic,
}

/// Moments in a unit of length of their own, harmonic parts only.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expansion {
    linear: [f32; 3],
    quadratic: [f32; 6],
    cubic: [f32; 10],
}

/// The product of two linear polynomials.
fn quadratic(a: DVec3, b: DVec3) -> Quadratic {
    [a.x * b.x, a.y * b.y, a.z * b.z, a.x * b.y + a.y * b.x, a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z]
}

/// The product of a quadratic and a linear polynomial.
fn cubic(&[xx, yy, zz, xy, yz, zx]: &Quadratic, l: DVec3) -> Cubic {
    [
        xx * l.x,
        yy * l.y,
        zz * l.z,
        xx * l.y + xy * l.x,
        xx * l.z + zx * l.x,
        yy * l.x + xy * l.y,
        yy * l.z + yz * l.y,
        zz * l.x + zx * l.z,
        zz * l.y + yz * l.z,
        xy * l.z + yz * l.x + zx * l.y,
    ]
}

fn sum<const N: usize>(a: &[f64; N], b: &[f64; N], factor: f64) -> [f64; N] {
    std::array::from_fn(|k| a[k] + factor * b[k])
}

impl Moments {
    /// Of nothing.
    pub const NONE: Moments = Moments { zeroth: DVec3::ZERO, first: [0.0; 6], second: [0.0; 10] };

    /// Of a triangle about `centre`.
    pub fn of_triangle(corners: &[DVec3; 3], centre: DVec3) -> Self {
        let [a, b, c] = corners.map(|corner| corner - centre);
        let area = (b - a).cross(c - a) * 0.5;
        let all = a + b + c;
        // The mean of d_j d_k over a triangle.
        let squares = [a, b, c, all].iter().fold([0.0; 6], |squares, &d| sum(&squares, &quadratic(d, d), 1.0 / 12.0));
        Moments { zeroth: area, first: quadratic(area, all / 3.0), second: cubic(&squares, area) }
    }

    /// Of an area vector at a point, about `centre`.
    pub fn of_point(point: DVec3, area: DVec3, centre: DVec3) -> Self {
        let d = point - centre;
        Moments { zeroth: area, first: quadratic(area, d), second: cubic(&quadratic(area, d), d) }
    }

    /// The sum of both, which have the same centre.
    pub fn with(&self, other: &Moments) -> Self {
        Moments {
            zeroth: self.zeroth + other.zeroth,
            first: sum(&self.first, &other.first, 1.0),
            second: sum(&self.second, &other.second, 1.0),
        }
    }

    /// The same about a centre from which the present one is `shift` away.
    pub fn shifted(&self, shift: DVec3) -> Self {
        let second = sum(&self.second, &cubic(&self.first, shift), 2.0);
        Moments {
            zeroth: self.zeroth,
            first: sum(&self.first, &quadratic(self.zeroth, shift), 1.0),
            second: sum(&second, &cubic(&quadratic(self.zeroth, shift), shift), 1.0),
        }
    }

    /// The harmonic parts where `unit` is the unit of length. With a unit that is not below the radius of the surface about the centre
    /// and whose square is not below its area, no number of the result is above 15.
    pub fn expansion(&self, unit: f64) -> Expansion {
        if !(unit > 0.0) {
            return Expansion { linear: [0.0; 3], quadratic: [0.0; 6], cubic: [0.0; 10] };
        }
        let per = 1.0 / unit;
        // q - |u|^2 Laplace(q) / 6, and c - |u|^2 Laplace(c) / 10.
        let mut q = self.first.map(|x| x * per * per * per);
        let trace = (q[0] + q[1] + q[2]) / 3.0;
        q[..3].iter_mut().for_each(|x| *x -= trace);
        let mut c = self.second.map(|x| x * per * per * per * per);
        let [xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy, _] = c;
        let x = (6.0 * xxx + 2.0 * yyx + 2.0 * zzx) / 10.0;
        let y = (6.0 * yyy + 2.0 * xxy + 2.0 * zzy) / 10.0;
        let z = (6.0 * zzz + 2.0 * xxz + 2.0 * yyz) / 10.0;
        c = sum(&c, &[x, y, z, y, z, x, z, x, y, 0.0], -1.0);
        Expansion {
            linear: (self.zeroth * per * per).to_array().map(|x| x as f32),
            quadratic: q.map(|x| (-3.0 * x) as f32),
            cubic: c.map(|x| (7.5 * x) as f32),
        }
    }
}

impl Expansion {
    /// The solid angle seen from where the centre is in the direction `u`, a unit vector, `1 / nearness` units away.
    #[inline(always)]
    pub fn solid_angle(&self, u: DVec3, nearness: f64) -> f64 {
        let DVec3 { x, y, z } = u;
        let l = self.linear.map(f64::from);
        let q = self.quadratic.map(f64::from);
        let c = self.cubic.map(f64::from);
        let linear = l[0] * x + l[1] * y + l[2] * z;
        let quadratic = x * (q[0] * x + q[3] * y + q[5] * z) + y * (q[1] * y + q[4] * z) + q[2] * z * z;
        let cubic = x * x * (c[0] * x + c[3] * y + c[4] * z)
            + y * y * (c[5] * x + c[1] * y + c[6] * z)
            + z * z * (c[7] * x + c[8] * y + c[2] * z)
            + c[9] * x * y * z;
        nearness * nearness * (linear + nearness * (quadratic + nearness * cubic))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spatial::triangle::solid_angle;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0..1.0).prop_map(DVec3::from_array)
    }

    /// The solid angle from the moments about `centre`, seen from `p`.
    fn expanded(moments: &Moments, centre: DVec3, p: DVec3) -> f64 {
        let r = centre - p;
        moments.expansion(4.0).solid_angle(r / r.length(), 4.0 / r.length())
    }

    proptest! {
        #[test]
        fn errors_fall_with_the_fifth_power_of_the_distance(corners in prop::array::uniform3(vector()), centre in vector(), to in vector()) {
            prop_assume!(to.length() > 0.1);
            let moments = Moments::of_triangle(&corners, centre);
            let radius = corners.iter().map(|corner| (*corner - centre).length()).fold(0.0, f64::max);
            for distance in [4.0, 8.0, 16.0, 64.0] {
                let p = centre + to / to.length() * (distance * radius);
                let error = (expanded(&moments, centre, p) - solid_angle(p, &corners)).abs();
                // The term that is left out is at most 10 P_4-like, area / r^2 at most 2; the rest is the rounding of 32 bits.
                prop_assert!(error < 40.0 * f64::powi(distance, -5) + 3e-6 * f64::powi(distance, -2), "{distance} {error}");
            }
        }

        #[test]
        fn moments_move_to_another_centre(corners in prop::array::uniform3(vector()), centre in vector(), shift in vector()) {
            let (here, there) = (Moments::of_triangle(&corners, centre), Moments::of_triangle(&corners, centre - shift));
            let moved = here.shifted(shift);
            let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
            prop_assert!(near(&moved.first, &there.first) && near(&moved.second, &there.second));
            let (here, there) = (Moments::of_point(corners[0], corners[1], centre), Moments::of_point(corners[0], corners[1], centre - shift));
            let moved = here.shifted(shift);
            prop_assert!(near(&moved.first, &there.first) && near(&moved.second, &there.second));
        }
    }

    #[test]
    fn a_triangle_far_away_is_many_points() {
        let corners = [DVec3::new(0.1, 0.2, -0.3), DVec3::new(0.9, -0.1, 0.2), DVec3::new(-0.2, 0.8, 0.4)];
        let [a, b, c] = corners;
        let n = 64;
        let part = (b - a).cross(c - a) * (0.5 / f64::from(n * n));
        let mut points = Moments::NONE;
        let mut push = |i: f64, j: f64| {
            let point = a + (b - a) * (i / f64::from(n)) + (c - a) * (j / f64::from(n));
            points = points.with(&Moments::of_point(point, part, DVec3::ZERO));
        };
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (f64::from(i), f64::from(j)))) {
            push(i + 1.0 / 3.0, j + 1.0 / 3.0);
            if i + j < f64::from(n - 1) {
                push(i + 2.0 / 3.0, j + 2.0 / 3.0);
            }
        }
        let whole = Moments::of_triangle(&corners, DVec3::ZERO);
        let pairs = whole.second.iter().zip(&points.second).chain(whole.first.iter().zip(&points.first));
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-4), "{whole:?} {points:?}");
        assert!(pairs.map(|(a, _)| a.abs()).fold(0.0, f64::max) > 0.05);
    }
}
