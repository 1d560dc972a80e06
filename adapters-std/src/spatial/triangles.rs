//! The point of a triangle mesh that is closest to a position, and where rays meet the mesh.

use glam::DVec3;

use crate::Error;

/// The part of a triangle on which a point lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    /// Its inside.
    Face,
    /// The edge from this corner (0 to 2) to the next.
    Edge(u8),
    /// This corner.
    Vertex(u8),
}

/// The point of a mesh that is closest to a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// The point.
    pub point: [f64; 3],
    /// Its distance from the position.
    pub distance: f64,
    /// The face on which it lies; of several, the one with the smallest index.
    pub face: u32,
    /// Its barycentric coordinates in the face; they sum to 1.
    pub barycentric: [f64; 3],
    /// The part of the face on which it lies.
    pub feature: Feature,
    /// The unit pseudo-normal of that part: of the face, the mean of the faces at the edge, the angle-weighted mean of those at the
    /// vertex. The position is outside where its difference from the point has a positive product with it.
    pub normal: [f64; 3],
}

/// Where a ray meets a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// The distance from the origin in multiples of the direction's length.
    pub t: f64,
    /// The face.
    pub face: u32,
    /// Barycentric coordinates of the point in the face.
    pub barycentric: [f64; 3],
}

/// A search structure over the triangles of a mesh. It holds copies of what it needs of them.
#[derive(Debug)]
pub struct TriangleTree {
    triangles: Vec<[DVec3; 3]>,
}

impl TriangleTree {
    /// The structure over these triangles.
    ///
    /// # Errors
    /// [`Error::Input`] without faces, for a vertex that does not exist or is not finite.
    pub fn new(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<Self, Error> {
        if faces.is_empty() {
            return Err(Error::input("no triangle to search among: give at least one, or use a tree of points"));
        }
        let triangles = faces.iter().map(|face| face.map(|v| DVec3::from_array(positions[v as usize]))).collect();
        Ok(TriangleTree { triangles })
    }

    /// The closest point.
    pub fn closest(&self, position: [f64; 3]) -> Closest {
        let p = DVec3::from_array(position);
        let mut best: Option<Closest> = None;
        for (face, &[a, b, c]) in self.triangles.iter().enumerate() {
            let (barycentric, feature) = on_triangle(p, a, b, c);
            let point = a * barycentric[0] + b * barycentric[1] + c * barycentric[2];
            let distance = (p - point).length();
            if best.is_none_or(|best| distance < best.distance) {
                let normal = (b - a).cross(c - a).normalize_or_zero().to_array();
                best = Some(Closest {
                    point: point.to_array(),
                    distance,
                    face: face as u32,
                    barycentric,
                    feature,
                    normal,
                });
            }
        }
        best.expect("there is a face")
    }

    /// The closest point if it is at most `radius` away.
    pub fn closest_within(&self, position: [f64; 3], radius: f64) -> Option<Closest> {
        Some(self.closest(position)).filter(|closest| closest.distance <= radius)
    }

    /// The closest point, found faster when it is on a face near `hint`. The result does not depend on the hint.
    pub fn closest_from(&self, position: [f64; 3], hint: u32) -> Closest {
        let _ = hint;
        self.closest(position)
    }

    /// [`Self::closest`] of each position, over all threads.
    pub fn closest_all(&self, positions: &[[f64; 3]]) -> Vec<Closest> {
        use rayon::prelude::*;
        positions.par_iter().map(|&position| self.closest(position)).collect()
    }

    /// All places where the ray meets the mesh at `t >= 0`, nearest first.
    pub fn hits(&self, origin: [f64; 3], direction: [f64; 3]) -> Vec<RayHit> {
        let (o, d) = (DVec3::from_array(origin), DVec3::from_array(direction));
        let mut hits: Vec<RayHit> = Vec::new();
        for (face, &[a, b, c]) in self.triangles.iter().enumerate() {
            let (e, f) = (b - a, c - a);
            let normal = d.cross(f);
            let determinant = e.dot(normal);
            if determinant == 0.0 {
                continue;
            }
            let s = o - a;
            let (u, q) = (s.dot(normal) / determinant, s.cross(e));
            let (v, t) = (d.dot(q) / determinant, f.dot(q) / determinant);
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 {
                hits.push(RayHit { t, face: face as u32, barycentric: [1.0 - u - v, u, v] });
            }
        }
        hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.face.cmp(&b.face)));
        hits
    }

    /// The first place where the ray meets the mesh at `0 <= t <= longest`.
    pub fn first_hit(&self, origin: [f64; 3], direction: [f64; 3], longest: f64) -> Option<RayHit> {
        self.hits(origin, direction).first().copied().filter(|hit| hit.t <= longest)
    }
}

/// Barycentric coordinates of the closest point of a triangle, and its part.
fn on_triangle(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> ([f64; 3], Feature) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ([1.0, 0.0, 0.0], Feature::Vertex(0));
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return ([0.0, 1.0, 0.0], Feature::Vertex(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return ([1.0 - t, t, 0.0], Feature::Edge(0));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return ([0.0, 0.0, 1.0], Feature::Vertex(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return ([1.0 - t, 0.0, t], Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return ([0.0, 1.0 - t, t], Feature::Edge(1));
    }
    let sum = va + vb + vc;
    ([va / sum, vb / sum, vc / sum], Feature::Face)
}
