//! Cholesky factorisation and solution on a matrix of rows.

use super::number::Number;

/// The factor `L` of `A = L L^T`; refusal with the first pivot that is not positive and finite.
pub fn factor<R: Number>(a: &[Vec<R>]) -> Result<Vec<Vec<R>>, usize> {
    let n = a.len();
    let mut l = vec![vec![R::of(0.0); n]; n];
    for i in 0..n {
        for j in 0..=i {
            let mut entry = a[i][j];
            for k in 0..j {
                entry = entry - l[i][k] * l[j][k];
            }
            if i > j {
                l[i][j] = entry / l[j][j];
            } else if entry > R::of(0.0) && entry.is_finite() {
                l[i][i] = entry.sqrt();
            } else {
                return Err(i);
            }
        }
    }
    Ok(l)
}

/// The solution of `L L^T x = b`.
pub fn solution<R: Number>(l: &[Vec<R>], b: &[R]) -> Vec<R> {
    let n = b.len();
    let mut x = b.to_vec();
    for i in 0..n {
        for k in 0..i {
            x[i] = x[i] - l[i][k] * x[k];
        }
        x[i] = x[i] / l[i][i];
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            x[i] = x[i] - l[k][i] * x[k];
        }
        x[i] = x[i] / l[i][i];
    }
    x
}
