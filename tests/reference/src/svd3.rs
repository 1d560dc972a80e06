//! Singular values and polar factors of 3 x 3 matrices, on vectors of columns.

use super::Refusal;
use super::number::{Number, binade, larger};

/// A matrix of rows.
type Matrix<R> = [[R; 3]; 3];

/// `A = U diag(singular) V^T`.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
pub struct Svd<R> {
    pub u: Matrix<R>,
    pub singular: [R; 3],
    pub v: Matrix<R>,
}

/// `A = R S`; `nearest` is 0 for the only nearest rotation, 1 of a reflection, 2 open.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
pub struct Polar<R> {
    pub rotation: Matrix<R>,
    pub stretch: Matrix<R>,
    pub nearest: u32,
}

fn dot<R: Number>(a: &[R; 3], b: &[R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross<R: Number>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn transposed<R: Number>(a: &Matrix<R>) -> Matrix<R> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[j][i]))
}

fn identity<R: Number>() -> Matrix<R> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| R::of(if i == j { 1.0 } else { 0.0 })))
}

fn fourth<R: Number>() -> R {
    (R::EPSILON * R::EPSILON) * (R::EPSILON * R::EPSILON)
}

/// The singular value decomposition.
pub fn svd3<R: Number>(a: &Matrix<R>) -> Result<Svd<R>, Refusal> {
    if let Some(index) = a.iter().flatten().position(|entry| !entry.is_finite()) {
        return Err([103, index as u32, 0]);
    }
    let (zero, one) = (R::of(0.0), R::of(1.0));
    let mut largest = zero;
    for entry in a.iter().flatten() {
        largest = larger(entry.magnitude(), largest);
    }
    let scale = if largest > zero { binade(largest) } else { one };
    let mut b = transposed(&a.map(|row| row.map(|entry| entry / scale)));
    let mut v = identity();
    let mut sweeps = 0;
    loop {
        let mut changed = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            changed |= turned(&mut b, &mut v, p, q);
        }
        if !changed {
            break;
        }
        sweeps += 1;
        if sweeps == 16 {
            return Err([402, 16, 0]);
        }
    }
    let mut u = [[zero; 3]; 3];
    let mut lengths = [zero; 3];
    for k in 0..3 {
        let square = dot(&b[k], &b[k]);
        if square > fourth() {
            lengths[k] = square.sqrt();
            u[k] = b[k].map(|x| x / lengths[k]);
        }
    }
    let singular = lengths.map(|length| length * scale);
    if singular.iter().any(|value| !value.is_finite()) {
        return Err([103, 9, 0]);
    }
    if lengths[0] == zero {
        u = identity();
    } else {
        if lengths[1] == zero {
            let mut least = 0;
            for k in 1..3 {
                if u[0][k].magnitude() < u[0][least].magnitude() {
                    least = k;
                }
            }
            let side = cross(&u[0], &identity()[least]);
            let length = dot(&side, &side).sqrt();
            u[1] = side.map(|x| x / length);
        }
        if lengths[2] == zero {
            u[2] = cross(&u[0], &u[1]);
        }
    }
    Ok(Svd { u: transposed(&u), singular, v: transposed(&v) })
}

fn turned<R: Number>(b: &mut Matrix<R>, v: &mut Matrix<R>, p: usize, q: usize) -> bool {
    let (one, two) = (R::of(1.0), R::of(2.0));
    let exchanged = dot(&b[p], &b[p]) < dot(&b[q], &b[q]);
    if exchanged {
        for m in [&mut *b, &mut *v] {
            (m[p], m[q]) = (m[q], m[p].map(|x| -x));
        }
    }
    let (alpha, beta, gamma) = (dot(&b[p], &b[p]), dot(&b[q], &b[q]), dot(&b[p], &b[q]));
    if beta <= fourth() || gamma.magnitude() <= R::of(4.0) * R::EPSILON * (alpha.sqrt() * beta.sqrt()) {
        return exchanged;
    }
    let zeta = (beta - alpha) / (two * gamma);
    let t = if zeta.magnitude() > R::of(1e15) {
        one / (two * zeta)
    } else {
        let t = one / (zeta.magnitude() + (zeta * zeta + one).sqrt());
        if zeta < R::of(0.0) { -t } else { t }
    };
    let c = one / (t * t + one).sqrt();
    let s = t * c;
    for m in [b, v] {
        for k in 0..3 {
            (m[p][k], m[q][k]) = (c * m[p][k] - s * m[q][k], s * m[p][k] + c * m[q][k]);
        }
    }
    true
}

/// The nearest rotation and the stretch.
pub fn polar<R: Number>(a: &Matrix<R>) -> Result<Polar<R>, Refusal> {
    let Svd { u, singular: [s0, s1, s2], v } = svd3(a)?;
    let mut left = transposed(&u);
    let reflects = dot(&cross(&left[0], &left[1]), &left[2]) < R::of(0.0);
    let mut s = [s0, s1, s2];
    if reflects {
        left[2] = left[2].map(|x| -x);
        s[2] = -s2;
    }
    let entry = |i: usize, j: usize| {
        // R = U V^T: row i of U with row j of V.
        left[0][i] * v[j][0] + left[1][i] * v[j][1] + left[2][i] * v[j][2]
    };
    let rotation = [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j)));
    let stretched = |i: usize, j: usize| {
        let (i, j) = (i.min(j), i.max(j));
        v[i][0] * v[j][0] * s[0] + v[i][1] * v[j][1] * s[1] + v[i][2] * v[j][2] * s[2]
    };
    let stretch = [0, 1, 2].map(|i| [0, 1, 2].map(|j| stretched(i, j)));
    let open = !(s[1] + s[2] > R::of(16.0) * R::EPSILON * s[0]);
    Ok(Polar { rotation, stretch, nearest: if open { 2 } else { u32::from(reflects) } })
}
