//! The measures 3.1 to 3.4, straight from the formulas.

use super::Refusal;
use super::number::{Number, larger};

/// A matrix of rows.
pub type Matrix<R> = [[R; 2]; 2];

/// Green's strain: xx, xy, yy.
pub fn green_strain<R: Number>(j: &Matrix<R>) -> [R; 3] {
    let (one, half) = (R::of(1.0), R::of(0.5));
    [
        (j[0][0] * j[0][0] + j[1][0] * j[1][0] - one) * half,
        (j[0][0] * j[0][1] + j[1][0] * j[1][1]) * half,
        (j[0][1] * j[0][1] + j[1][1] * j[1][1] - one) * half,
    ]
}

/// Eq. 3.4.
pub fn local<R: Number>(j: &Matrix<R>) -> R {
    let [xx, xy, yy] = green_strain(j);
    R::of(4.0) * (xx * xx + R::of(2.0) * (xy * xy) + yy * yy)
}

/// The larger and the smaller singular value, the latter with the sign of the determinant.
pub fn singular_values<R: Number>(j: &Matrix<R>) -> [R; 2] {
    let length = |x: R, y: R| (x * x + y * y).sqrt() * R::of(0.5);
    let q = length(j[0][0] + j[1][1], j[1][0] - j[0][1]);
    let p = length(j[0][0] - j[1][1], j[1][0] + j[0][1]);
    [q + p, q - p]
}

/// Stretch, area, angle.
pub fn factors<R: Number>([longest, shortest]: [R; 2]) -> [R; 3] {
    let shortest = shortest.magnitude();
    let one = R::of(1.0);
    [larger(longest, one / shortest) - one, longest * shortest, longest / shortest]
}

/// `u.u`, `u.v`, `v.v` and twice the area.
pub fn metric_of_corners<R: Number>(corners: [[R; 3]; 3]) -> [R; 4] {
    let u = [0, 1, 2].map(|k| corners[1][k] - corners[0][k]);
    let v = [0, 1, 2].map(|k| corners[2][k] - corners[0][k]);
    let dot = |a: [R; 3], b: [R; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    [dot(u, u), dot(u, v), dot(v, v), dot(n, n).sqrt()]
}

/// The same of the lengths of u, v and the third edge.
pub fn metric_of_lengths<R: Number>(lengths: [R; 3]) -> [R; 4] {
    let [u, v, w] = lengths;
    let mut sorted = lengths;
    sorted.sort_by(|a, b| b.partial_cmp(a).expect("lengths are numbers"));
    let [a, b, c] = sorted;
    let square = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    let (zero, half) = (R::of(0.0), R::of(0.5));
    let area = if square > zero { square.sqrt() * half } else { zero };
    [u * u, (u * u + v * v - w * w) * half, v * v, area]
}

/// The edges u, v in the plane.
pub fn edges<R: Number>([uu, uv, vv, area]: [R; 4]) -> Result<Matrix<R>, Refusal> {
    if !(area > R::EPSILON * (uu + vv)) {
        return Err([403, 0, 0]);
    }
    Ok([[uu.sqrt(), R::of(0.0)], [uv / uu.sqrt(), area / uu.sqrt()]])
}

/// The map that carries edges to edges.
pub fn jacobian<R: Number>([u, v]: Matrix<R>, [to_u, to_v]: Matrix<R>) -> Result<Matrix<R>, Refusal> {
    let det = u[0] * v[1] - u[1] * v[0];
    let size = u[0] * u[0] + u[1] * u[1] + (v[0] * v[0] + v[1] * v[1]);
    if !(det.magnitude() > R::EPSILON * size) {
        return Err([403, 0, 0]);
    }
    Ok([0, 1].map(|k| [(to_u[k] * v[1] - to_v[k] * u[1]) / det, (to_v[k] * u[0] - to_u[k] * v[0]) / det]))
}

/// Weight of a neighbour.
pub fn weight<R: Number>(b: [R; 2], spacing: R) -> R {
    let r = R::of(1.5) * spacing;
    (-((b[0] * b[0] + b[1] * b[1]) / (R::of(2.0) * r * r))).exp()
}

/// The fit to scattered samples; `Err(0)` too few, `Err(1)` ill-conditioned.
pub fn fit<R: Number>(samples: &[([R; 2], [R; 2], R)]) -> Result<Matrix<R>, u32> {
    if samples.len() < 4 {
        return Err(0);
    }
    let mut cross = [[R::of(0.0); 2]; 2];
    let [mut xx, mut xy, mut yy] = [R::of(0.0); 3];
    for &(b, a, w) in samples {
        let wb = [w * b[0], w * b[1]];
        for i in 0..2 {
            for j in 0..2 {
                cross[i][j] = cross[i][j] + wb[j] * a[i];
            }
        }
        xx = xx + wb[0] * b[0];
        xy = xy + wb[0] * b[1];
        yy = yy + wb[1] * b[1];
    }
    let det = xx * yy - xy * xy;
    let large = (xx + yy + ((xx - yy) * (xx - yy) + R::of(4.0) * (xy * xy)).sqrt()) * R::of(0.5);
    if !(large * large < R::of(25.0) * det) {
        return Err(1);
    }
    Ok(cross.map(|[p, q]| [(p * yy - q * xy) / det, (q * xx - p * xy) / det]))
}
