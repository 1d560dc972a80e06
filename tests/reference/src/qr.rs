//! Householder QR and least squares, on a matrix of rows.

use super::Refusal;
use super::number::{Number, binade, larger};

/// The factors: the overwritten matrix, the factors of the reflections, the order of the columns.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Factors<R> {
    pub a: Vec<Vec<R>>,
    pub tau: Vec<R>,
    pub order: Vec<usize>,
}

/// What least squares gives, with `Q^T b`.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Solution<R> {
    pub x: Vec<R>,
    pub rank: usize,
    pub residual: R,
    pub rotated: Vec<R>,
}

/// Length of a vector, through the binade of its largest entry.
pub fn norm<R: Number>(values: &[R]) -> R {
    let mut largest = R::of(0.0);
    for &value in values {
        largest = larger(value.magnitude(), largest);
    }
    let scale = binade(largest);
    if !(scale > R::of(0.0)) {
        return R::of(0.0);
    }
    let mut sum = R::of(0.0);
    for &value in values {
        sum = sum + (value / scale) * (value / scale);
    }
    scale * sum.sqrt()
}

/// `A P = Q R` for a matrix of `n` columns.
pub fn factors<R: Number>(a: &[Vec<R>], n: usize, pivoted: bool) -> Result<Factors<R>, Refusal> {
    if let Some(index) = a.iter().flatten().position(|entry| !entry.is_finite()) {
        return Err([103, index as u32, 0]);
    }
    let (mut a, m) = (a.to_vec(), a.len());
    let mut order: Vec<usize> = (0..n).collect();
    let mut tau = vec![R::of(0.0); n];
    for k in 0..n {
        let column = |a: &[Vec<R>], j: usize| (k..m).map(|i| a[i][j]).collect::<Vec<R>>();
        if pivoted {
            let mut longest = k;
            for j in k + 1..n {
                if norm(&column(&a, j)) > norm(&column(&a, longest)) {
                    longest = j;
                }
            }
            order.swap(k, longest);
            a.iter_mut().for_each(|row| row.swap(k, longest));
        }
        let length = norm(&column(&a, k));
        if !(length > R::of(0.0)) {
            continue;
        }
        let head = a[k][k];
        let diagonal = if head > R::of(0.0) { -length } else { length };
        let mut v = column(&a, k);
        for entry in &mut v[1..] {
            *entry = *entry / (head - diagonal);
        }
        tau[k] = (diagonal - head) / diagonal;
        for j in k + 1..n {
            let mut sum = a[k][j];
            for i in k + 1..m {
                sum = sum + v[i - k] * a[i][j];
            }
            sum = sum * tau[k];
            a[k][j] = a[k][j] - sum;
            for i in k + 1..m {
                a[i][j] = a[i][j] - sum * v[i - k];
            }
        }
        a[k][k] = diagonal;
        for i in k + 1..m {
            a[i][k] = v[i - k];
        }
    }
    Ok(Factors { a, tau, order })
}

impl<R: Number> Factors<R> {
    fn reflected(&self, b: &mut [R], k: usize) {
        let mut sum = b[k];
        for i in k + 1..b.len() {
            sum = sum + self.a[i][k] * b[i];
        }
        sum = self.tau[k] * sum;
        b[k] = b[k] - sum;
        for i in k + 1..b.len() {
            b[i] = b[i] - sum * self.a[i][k];
        }
    }

    /// `Q^T b`.
    pub fn transpose_applied(&self, b: &[R]) -> Vec<R> {
        let mut b = b.to_vec();
        (0..self.tau.len()).for_each(|k| self.reflected(&mut b, k));
        b
    }

    /// `Q b`.
    pub fn applied(&self, b: &[R]) -> Vec<R> {
        let mut b = b.to_vec();
        (0..self.tau.len()).rev().for_each(|k| self.reflected(&mut b, k));
        b
    }
}

/// Minimises `|A x - b|`.
pub fn least_squares<R: Number>(
    a: &[Vec<R>],
    n: usize,
    b: &[R],
    pivoted: bool,
    tolerance: R,
) -> Result<Solution<R>, Refusal> {
    if let Some(index) = a.iter().flatten().chain(b).position(|entry| !entry.is_finite()) {
        return Err([103, index as u32, 0]);
    }
    let factors = factors(a, n, pivoted)?;
    let rotated = factors.transpose_applied(b);
    let diagonal: Vec<R> = (0..n).map(|k| factors.a[k][k].magnitude()).collect();
    let smallest = tolerance * diagonal.iter().fold(R::of(0.0), |a, &b| larger(b, a));
    let rank = diagonal.iter().take_while(|&&value| value > smallest).count();
    if rank < n && !pivoted {
        return Err([404, rank as u32, 0]);
    }
    let mut solved = rotated[..rank].to_vec();
    for k in (0..rank).rev() {
        for j in k + 1..rank {
            solved[k] = solved[k] - factors.a[k][j] * solved[j];
        }
        solved[k] = solved[k] / factors.a[k][k];
    }
    let mut x = vec![R::of(0.0); n];
    for k in 0..rank {
        x[factors.order[k]] = solved[k];
    }
    Ok(Solution { x, rank, residual: norm(&rotated[rank..]), rotated })
}
