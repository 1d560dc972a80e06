//! One triangle: the point of it that is closest to a position, and where a ray meets it.

use glam::DVec3;

use super::triangles::Feature;

/// Where height over length, squared, is above this, the formula from dot products alone has ten good digits.
const SOUND: f64 = 1e-6;

/// Below this the sides say better where the points of a triangle are than any formula for its inside: the error of the best one, in
/// lengths, is the rounding error over the ratio, what the sides leave out is the ratio.
const THIN: f64 = 1e-16;

/// The closest point of a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct OnTriangle {
    pub point: DVec3,
    pub squared: f64,
    pub barycentric: [f64; 3],
    pub feature: Feature,
}

/// The closest point of the triangle `corners` to `p`.
///
/// The plane is divided into the regions of Ericson, Real-Time Collision Detection, 2004, section 5.1.5. What lies on a side is
/// computed from the side's ends in an order of their own, so that two triangles that share it find the same point, bit by bit.
/// A triangle without area is the three sides that it has.
#[inline(always)]
pub(super) fn on_triangle(p: DVec3, corners: &[DVec3; 3]) -> OnTriangle {
    let &[a, b, c] = corners;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return at_corner(p, corners, 0);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return at_corner(p, corners, 1);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return at_corner(p, corners, 2);
    }
    let normal = ab.cross(ac);
    let longest = ab.length_squared().max(ac.length_squared()).max((c - b).length_squared());
    if !(normal.length_squared() > SOUND * longest * longest) {
        return on_needle(p, corners, normal, longest);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return on_side(p, corners, 0);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return on_side(p, corners, 2);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return on_side(p, corners, 1);
    }
    // Rounding may leave one of them a little below 0 outside of all regions.
    let (va, vb, vc) = (va.max(0.0), vb.max(0.0), vc.max(0.0));
    let sum = va + vb + vc;
    if !(sum > 0.0) {
        return on_sides(p, corners);
    }
    inside(p, corners, [va / sum, vb / sum, vc / sum])
}

#[inline(always)]
fn inside(p: DVec3, &[a, b, c]: &[DVec3; 3], barycentric: [f64; 3]) -> OnTriangle {
    let point = a + (b - a) * barycentric[1] + (c - a) * barycentric[2];
    OnTriangle { point, squared: (p - point).length_squared(), barycentric, feature: Feature::Face }
}

/// The same for a triangle that is long and low: areas are measured along the normal, which loses fewer digits and takes longer.
#[cold]
fn on_needle(p: DVec3, corners: &[DVec3; 3], normal: DVec3, longest: f64) -> OnTriangle {
    let &[a, b, c] = corners;
    if normal.length_squared() > THIN * longest * longest {
        let parts = [[b, c], [c, a], [a, b]].map(|[from, to]| (to - from).cross(p - from).dot(normal));
        let sum: f64 = parts.iter().sum();
        if parts.iter().all(|&part| part > 0.0) && sum.is_finite() {
            return inside(p, corners, parts.map(|part| part / sum));
        }
    }
    on_sides(p, corners)
}

fn at_corner(p: DVec3, corners: &[DVec3; 3], corner: u8) -> OnTriangle {
    let point = corners[usize::from(corner)];
    let mut barycentric = [0.0; 3];
    barycentric[usize::from(corner)] = 1.0;
    OnTriangle { point, squared: (p - point).length_squared(), barycentric, feature: Feature::Vertex(corner) }
}

/// The closest point of the side from corner `side` to the next.
fn on_side(p: DVec3, corners: &[DVec3; 3], side: u8) -> OnTriangle {
    let (mut from, mut to) = (usize::from(side), (usize::from(side) + 1) % 3);
    if corners[to].to_array() < corners[from].to_array() {
        (from, to) = (to, from);
    }
    let (a, b) = (corners[from], corners[to]);
    let ab = b - a;
    let t = ab.dot(p - a) / ab.length_squared();
    if !(t > 0.0) {
        return at_corner(p, corners, from as u8);
    }
    if t >= 1.0 {
        return at_corner(p, corners, to as u8);
    }
    let point = a + ab * t;
    let mut barycentric = [0.0; 3];
    (barycentric[from], barycentric[to]) = (1.0 - t, t);
    OnTriangle { point, squared: (p - point).length_squared(), barycentric, feature: Feature::Edge(side) }
}

/// The closest point of the three sides, the first of equals.
#[cold]
fn on_sides(p: DVec3, corners: &[DVec3; 3]) -> OnTriangle {
    let (first, second, third) = (on_side(p, corners, 0), on_side(p, corners, 1), on_side(p, corners, 2));
    let nearer = if second.squared < first.squared { second } else { first };
    if third.squared < nearer.squared { third } else { nearer }
}

/// A ray in the frame in which it runs along the third axis from the origin (Woop, Benthin, Wald, Watertight ray/triangle intersection,
/// JCGT 2013): two triangles that share a side agree on which of them the ray meets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sheared {
    origin: DVec3,
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Sheared {
    /// The ray from `origin` along `direction`, which is finite and not zero.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let d = direction.to_array();
        let z = (1..3).fold(0, |best, axis| if d[axis].abs() > d[best].abs() { axis } else { best });
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        Sheared { origin, axes, shear: [d[axes[0]] / d[z], d[axes[1]] / d[z], 1.0 / d[z]] }
    }

    /// Where the ray meets the triangle: `t` and barycentric coordinates. On a side or a corner every triangle at it is met; a triangle
    /// that the ray sees from its edge is not.
    pub fn meets(&self, corners: &[DVec3; 3]) -> Option<(f64, [f64; 3])> {
        let [x, y, z] = self.axes;
        let [sx, sy, sz] = self.shear;
        let [a, b, c] = corners.map(|corner| {
            let v = (corner - self.origin).to_array();
            [v[x] - sx * v[z], v[y] - sy * v[z], sz * v[z]]
        });
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        // Adding 0 makes a positive zero of a negative one: equal places must compare as equal, bit by bit.
        let barycentric = [u / sum + 0.0, v / sum + 0.0, w / sum + 0.0];
        let t = barycentric[0] * a[2] + barycentric[1] * b[2] + barycentric[2] * c[2] + 0.0;
        (sum != 0.0 && t >= 0.0).then_some((t, barycentric))
    }
}

/// The solid angle under which `p` sees the triangle, positive from behind (van Oosterom, Strackee 1983).
#[inline]
pub(super) fn solid_angle(p: DVec3, corners: &[DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    2.0 * a.dot(b.cross(c)).atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-4_i16..=4).prop_map(|v| DVec3::from_array(v.map(f64::from)))
    }

    /// The smallest squared distance among points spread over the triangle.
    fn sampled(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
        let n = 24;
        (0..=n)
            .flat_map(|i| (0..=n - i).map(move |j| (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n))))
            .map(|(s, t)| (p - (a + (b - a) * s + (c - a) * t)).length_squared())
            .fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn no_point_of_the_triangle_is_closer(p in vector(), corners in prop::array::uniform3(vector())) {
            let best = on_triangle(p, &corners);
            let [u, v, w] = best.barycentric;
            prop_assert!([u, v, w].iter().all(|x| (0.0..=1.0).contains(x)) && (u + v + w - 1.0).abs() < 1e-14);
            prop_assert!((corners[0] * u + corners[1] * v + corners[2] * w - best.point).length() < 1e-13);
            prop_assert!(best.squared <= sampled(p, corners) + 1e-12, "{} {}", best.squared, sampled(p, corners));
            let zeros = best.barycentric.iter().filter(|&&x| x == 0.0).count();
            let expected = match best.feature { Feature::Face => 0, Feature::Edge(_) => 1, Feature::Vertex(_) => 2 };
            prop_assert_eq!(zeros, expected);
        }

        #[test]
        fn a_shared_side_gives_both_triangles_the_same_point(p in vector(), a in vector(), b in vector(), c in vector()) {
            let p = p + DVec3::new(0.1, 0.2, 0.3);
            for side in 0..3 {
                let mut turned = [a, b, c];
                turned.rotate_left(side);
                let other = [turned[1], turned[0], turned[2]];
                let (one, two) = (on_side(p, &turned, 0), on_side(p, &other, 0));
                prop_assert_eq!((one.point, one.squared), (two.point, two.squared));
            }
        }
    }

    #[test]
    fn thin_and_tiny_triangles_have_no_nan() {
        let needle = [DVec3::ZERO, DVec3::new(1e6, 1e-9, 0.0), DVec3::new(5e5, 0.0, 1e-9)];
        let speck = [DVec3::splat(1e-170), DVec3::ZERO, DVec3::new(0.0, 1e-180, 0.0)];
        for corners in [needle, speck, [DVec3::ONE; 3]] {
            for p in [DVec3::new(2e5, 3.0, 0.0), DVec3::ZERO, DVec3::new(-7.0, 1e-300, 1e90)] {
                let best = on_triangle(p, &corners);
                assert!(best.squared.is_finite() && best.barycentric.iter().all(|x| x.is_finite()), "{best:?}");
                assert!(corners.iter().all(|&corner| best.squared <= (p - corner).length_squared()));
            }
        }
        let on_needle = on_triangle(DVec3::new(2e5, 3.0, 0.0), &needle);
        assert!((on_needle.squared.sqrt() - 3.0).abs() < 1e-8, "{on_needle:?}");
    }

    #[test]
    fn solid_angles_of_a_box_seen_from_inside_sum_to_the_sphere() {
        let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let sum = |p| {
            quads
                .iter()
                .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
                .map(|face| solid_angle(p, &face.map(corner)))
                .sum::<f64>()
        };
        assert!((sum(DVec3::new(0.2, 0.3, 0.9)) - 4.0 * std::f64::consts::PI).abs() < 1e-13);
        assert!(sum(DVec3::new(0.2, 1.3, 0.9)).abs() < 1e-13);
    }
}
