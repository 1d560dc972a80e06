//! The limited-memory matrix in compact form: `B = theta I - W M W^T`, `W = [Y, theta S]` (eq. 3.2 to 3.4 of `byrd1995`).

use crate::linalg::{at, set};
use crate::workspace::{part, part_mut, saturated};
use crate::{Error, Real};

/// The last steps of the variables, the changes of the gradient over them, and a factor of the middle matrix.
pub(super) struct Compact<'w, R> {
    /// Rows of `n` entries, `capacity` of each; the oldest pair stands at `oldest`, the next ones behind it, around the end.
    steps: &'w mut [R],
    changes: &'w mut [R],
    /// `L D L^T`, `2 count` rows.
    middle: &'w mut [R],
    n: usize,
    capacity: usize,
    oldest: usize,
    pub(super) count: usize,
    pub(super) theta: R,
}

impl<'w, R: Real> Compact<'w, R> {
    /// Without any pair, `B = I`. `steps` and `changes` hold `capacity * n` numbers, `middle` `4 capacity^2`.
    pub(super) fn new(
        steps: &'w mut [R],
        changes: &'w mut [R],
        middle: &'w mut [R],
        n: usize,
        capacity: usize,
    ) -> Self {
        Compact { steps, changes, middle, n, capacity, oldest: 0, count: 0, theta: R::ONE }
    }

    pub(super) fn clear(&mut self) {
        (self.oldest, self.count, self.theta) = (0, 0, R::ONE);
    }

    fn start(&self, pair: usize) -> usize {
        let row = self.oldest + pair;
        (if row >= self.capacity { row - self.capacity } else { row }) * self.n
    }

    /// Takes up the pair `s = to - from`, `y = gradient_to - gradient_from`, in place of the oldest one when there is no room, and sets
    /// `theta = y.y / s.y`; not when `s.y <= eps y.y`, or one of the sums is not finite.
    pub(super) fn take_up(&mut self, from: &[R], to: &[R], gradient_from: &[R], gradient_to: &[R]) {
        let (mut sy, mut yy) = (R::ZERO, R::ZERO);
        for i in 0..self.n {
            let y = at(gradient_to, i) - at(gradient_from, i);
            sy += (at(to, i) - at(from, i)) * y;
            yy += y * y;
        }
        let theta = yy / sy;
        if !(sy > R::EPSILON * yy && theta.is_finite() && theta > R::ZERO) {
            return;
        }
        if self.count < self.capacity {
            self.count += 1;
        } else {
            self.oldest = if self.oldest + 1 >= self.capacity { 0 } else { self.oldest + 1 };
        }
        let start = self.start(self.count - 1);
        for i in 0..self.n {
            set(self.steps, start + i, at(to, i) - at(from, i));
            set(self.changes, start + i, at(gradient_to, i) - at(gradient_from, i));
        }
        self.theta = theta;
    }

    /// Writes row `i` of W.
    pub(super) fn row(&self, i: usize, row: &mut [R]) {
        for pair in 0..self.count {
            let at_i = self.start(pair) + i;
            set(row, pair, at(self.changes, at_i));
            set(row, self.count + pair, self.theta * at(self.steps, at_i));
        }
    }

    /// Row `i` of W times `v`: the changes' part for the pairs from the oldest, then the steps'.
    pub(super) fn row_dot(&self, i: usize, v: &[R]) -> R {
        let (mut sum, mut steps) = (R::ZERO, R::ZERO);
        for pair in 0..self.count {
            let at_i = self.start(pair) + i;
            sum += at(self.changes, at_i) * at(v, pair);
            steps += at(self.steps, at_i) * at(v, self.count + pair);
        }
        sum + self.theta * steps
    }

    /// Writes `W^T d`.
    pub(super) fn transpose_applied(&self, d: impl Fn(usize) -> R, out: &mut [R]) {
        for pair in 0..self.count {
            let start = self.start(pair);
            let (mut changes, mut steps) = (R::ZERO, R::ZERO);
            for i in 0..self.n {
                let d = d(i);
                changes += at(self.changes, start + i) * d;
                steps += at(self.steps, start + i) * d;
            }
            set(out, pair, changes);
            set(out, self.count + pair, self.theta * steps);
        }
    }

    /// Factors `K = M^-1 - W_F^T W_F / theta`, F the variables whose entry of `free` is not zero; with none it is the inverse of M.
    ///
    /// With the sums over the free variables and those over the held ones apart nothing is added that cancels:
    /// `K = [-(D + Y_F^T Y_F / theta), X^T; X, theta S_H^T S_H]`, `X_ij` the sum over the held ones of `s_i y_j` for `i > j`, else minus that over the free ones.
    /// K is quasi-definite, so that `L D L^T` exists without exchanges: the first half of D is negative, the second positive.
    pub(super) fn factor(&mut self, free: &[R]) -> Result<(), Error> {
        let (k, size) = (self.count, 2 * self.count);
        for i in 0..k {
            let (s_i, y_i) = (part(self.steps, self.start(i), self.n)?, part(self.changes, self.start(i), self.n)?);
            for j in 0..k {
                let (s_j, y_j) = (part(self.steps, self.start(j), self.n)?, part(self.changes, self.start(j), self.n)?);
                let [mut yy, mut ss, mut sy_free, mut sy_held] = [R::ZERO; 4];
                for ((((&s_i, &y_i), &s_j), &y_j), &free) in s_i.iter().zip(y_i).zip(s_j).zip(y_j).zip(free) {
                    if free == R::ZERO {
                        ss += s_i * s_j;
                        sy_held += s_i * y_j;
                    } else {
                        yy += y_i * y_j;
                        sy_free += s_i * y_j;
                    }
                }
                let curvature = if i == j { sy_free + sy_held } else { R::ZERO };
                set(self.middle, i * size + j, -(curvature + yy / self.theta));
                set(self.middle, (k + i) * size + j, if i > j { sy_held } else { -sy_free });
                set(self.middle, (k + i) * size + k + j, self.theta * ss);
            }
        }
        factor_quasi_definite(self.middle, size, k)
    }

    /// Solves `K z = v` in place of `v`, after [`Compact::factor`]: both substitutions subtract by ascending index, the second after the division by D.
    pub(super) fn solve(&self, v: &mut [R]) {
        let size = 2 * self.count;
        for i in 0..size {
            let known = (0..i).fold(at(v, i), |sum, k| sum - at(self.middle, i * size + k) * at(v, k));
            set(v, i, known);
        }
        for i in (0..size).rev() {
            let start = at(v, i) / at(self.middle, i * size + i);
            let known = (i + 1..size).fold(start, |sum, k| sum - at(self.middle, k * size + i) * at(v, k));
            set(v, i, known);
        }
    }
}

/// Replaces the lower triangle of `a` by L (unit diagonal, not stored) and D of `L D L^T`, whose first `negative` pivots are below zero and the others
/// above: for each row i, `u_ij = a_ij - sum u_ik l_jk` for j < i, then `l_ij = u_ij / d_j` and `d_i = a_ii - sum u_ik l_ik`, k ascending.
///
/// Source: R. J. Vanderbei, Symmetric quasi-definite matrices, 1995. Errors: `NonPositivePivot` at a pivot of the wrong sign.
fn factor_quasi_definite<R: Real>(a: &mut [R], n: usize, negative: usize) -> Result<(), Error> {
    for i in 0..n {
        let (done, rest) = a.split_at_mut_checked(i * n).unwrap_or_default();
        let row = part_mut(rest, 0, n)?;
        for j in 0..i {
            let above = part(done, j * n, n)?;
            let u = (0..j).fold(at(row, j), |sum, k| sum - at(row, k) * at(above, k));
            set(row, j, u);
        }
        let mut pivot = at(row, i);
        for j in 0..i {
            let (u, d) = (at(row, j), at(done, j * n + j));
            pivot -= u * (u / d);
            set(row, j, u / d);
        }
        let sized = if i < negative { -pivot } else { pivot };
        if !(sized > R::ZERO && sized.is_finite()) {
            return Err(Error::NonPositivePivot { index: saturated(i) });
        }
        set(row, i, pivot);
    }
    Ok(())
}
