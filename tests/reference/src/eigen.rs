//! Jacobi's method for symmetric matrices, on a matrix of rows.

use super::Refusal;
use super::number::Number;

/// A matrix of rows.
type Rows<R> = Vec<Vec<R>>;

/// The diagonalised matrix and the eigenvectors as rows, sorted by descending eigenvalue, signs fixed.
pub fn eigenpairs<R: Number>(a: &[Vec<R>]) -> Result<(Rows<R>, Rows<R>), Refusal> {
    if let Some(index) = a.iter().flatten().position(|entry| !entry.is_finite()) {
        return Err([103, index as u32, 0]);
    }
    let (zero, one) = (R::of(0.0), R::of(1.0));
    let n = a.len();
    let mut a = a.to_vec();
    let mut vectors: Vec<Vec<R>> = (0..n).map(|i| (0..n).map(|j| if i == j { one } else { zero }).collect()).collect();
    for _sweep in 0..32 {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                if is_zero_to_rounding(a[p][p], a[q][q], a[p][q]) {
                    (a[p][q], a[q][p]) = (zero, zero);
                } else {
                    rotate(&mut a, &mut vectors, p, q);
                    rotated = true;
                }
            }
        }
        if !rotated {
            return Ok(sorted(a, vectors));
        }
    }
    Err([402, 32, 0])
}

fn is_zero_to_rounding<R: Number>(app: R, aqq: R, apq: R) -> bool {
    let half_eps = R::EPSILON * R::of(0.5);
    let (app, aqq, apq) = (app.magnitude(), aqq.magnitude(), apq.magnitude());
    apq == R::of(0.0) || apq <= half_eps * (app.sqrt() * aqq.sqrt()) || apq <= half_eps * half_eps * (app + aqq)
}

fn rotate<R: Number>(a: &mut [Vec<R>], vectors: &mut [Vec<R>], p: usize, q: usize) {
    let (zero, one, two) = (R::of(0.0), R::of(1.0), R::of(2.0));
    let (app, aqq, apq) = (a[p][p], a[q][q], a[p][q]);
    let theta = (aqq - app) / (two * apq);
    let size = theta.magnitude();
    let t = if size > R::of(1e15) {
        one / (two * theta)
    } else {
        let t = one / (size + (theta * theta + one).sqrt());
        if theta < zero { -t } else { t }
    };
    let c = one / (t * t + one).sqrt();
    let s = t * c;
    for k in 0..a.len() {
        if k != p && k != q {
            let (akp, akq) = (a[k][p], a[k][q]);
            a[k][p] = c * akp - s * akq;
            a[p][k] = a[k][p];
            a[k][q] = s * akp + c * akq;
            a[q][k] = a[k][q];
        }
        let (vp, vq) = (vectors[p][k], vectors[q][k]);
        vectors[p][k] = c * vp - s * vq;
        vectors[q][k] = s * vp + c * vq;
    }
    a[p][p] = app - t * apq;
    a[q][q] = aqq + t * apq;
    a[p][q] = zero;
    a[q][p] = zero;
}

fn sorted<R: Number>(mut a: Vec<Vec<R>>, mut vectors: Vec<Vec<R>>) -> (Vec<Vec<R>>, Vec<Vec<R>>) {
    let n = a.len();
    for i in 0..n {
        let mut largest = i;
        for k in i + 1..n {
            if a[k][k] > a[largest][largest] {
                largest = k;
            }
        }
        (a[i][i], a[largest][largest]) = (a[largest][largest], a[i][i]);
        vectors.swap(i, largest);
    }
    for vector in &mut vectors {
        let mut largest = R::of(0.0);
        for &entry in vector.iter() {
            if entry.magnitude() > largest.magnitude() {
                largest = entry;
            }
        }
        if largest < R::of(0.0) {
            for entry in vector.iter_mut() {
                *entry = -*entry;
            }
        }
    }
    (a, vectors)
}
