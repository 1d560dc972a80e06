//! The point that a step aims at: the generalised Cauchy point, then the minimum of the model over the variables that it leaves free.

use super::compact::Compact;
use crate::linalg::{at, set};
use crate::solve::bounds::Bounds;
use crate::workspace::part_mut;
use crate::{Error, Real};

/// Vectors of `2 history` numbers.
pub(super) struct Small<'w, R> {
    pub(super) p: &'w mut [R],
    pub(super) c: &'w mut [R],
    pub(super) w: &'w mut [R],
    pub(super) v: &'w mut [R],
}

/// Where the search stands.
pub(super) struct Place<'a, R> {
    pub(super) x: &'a [R],
    pub(super) gradient: &'a [R],
    pub(super) bounds: Bounds<'a, R>,
}

impl<R: Real> Place<'_, R> {
    /// Writes the aim to `point`; `free` ends with 1 for a variable that the Cauchy point leaves between its bounds, else 0. `scratch` has as many entries.
    ///
    /// Errors: `NonPositivePivot` when rounding has spoilt the matrix.
    pub(super) fn aim(
        &self,
        matrix: &mut Compact<'_, R>,
        small: &mut Small<'_, R>,
        point: &mut [R],
        free: &mut [R],
        scratch: &mut [R],
    ) -> Result<(), Error> {
        let size = 2 * matrix.count;
        let Small { p, c, w, v } = small;
        let [p, c] = [part_mut(p, 0, size)?, part_mut(c, 0, size)?];
        let small = &mut Small { p, c, w: part_mut(w, 0, size)?, v: part_mut(v, 0, size)? };
        free.fill(R::ZERO);
        matrix.factor(free)?;
        self.cauchy(matrix, small, point, free, scratch);
        if matrix.count == 0 {
            return Ok(());
        }
        // M c, before the factor is replaced.
        matrix.solve(small.c);
        matrix.factor(free)?;
        self.subspace(matrix, small, point, free, scratch);
        Ok(())
    }

    /// Algorithm CP: the first minimum of the model along `x - t g`, bent at the bounds.
    ///
    /// Order of operations: a break is the room over `|g|`; the slope starts from zero and loses `g g` of the variables that move; the curvature starts as
    /// `theta |d|^2 - p.(M p)` and is never below eps times its first term. At the next break (the first of equals), where variable b is held:
    /// `c += dt p`, `f' += dt f'' + g g + theta g z - g (v.c)`, then `f'' -= theta g g + (g + g) (v.p) + g g (v.w)` with `v = M w`, then `p += g w`.
    fn cauchy(
        &self,
        matrix: &Compact<'_, R>,
        Small { p, c, w, v }: &mut Small<'_, R>,
        point: &mut [R],
        free: &mut [R],
        breaks: &mut [R],
    ) {
        let n = self.x.len();
        let mut slope = R::ZERO;
        for i in 0..n {
            let (x, g, (low, high)) = (at(self.x, i), at(self.gradient, i), self.bounds.of(i));
            let room = if g > R::ZERO { x - low } else { high - x };
            let moves = room > R::ZERO && g != R::ZERO;
            set(point, i, x);
            set(free, i, if moves { R::ONE } else { R::ZERO });
            set(breaks, i, room / g.abs());
            if moves {
                slope -= g * g;
            }
        }
        matrix.transpose_applied(|i| if at(free, i) == R::ZERO { R::ZERO } else { -at(self.gradient, i) }, p);
        c.fill(R::ZERO);
        copy(v, p);
        matrix.solve(v);
        let unbent = -(matrix.theta * slope);
        let least = R::EPSILON * unbent;
        let mut curvature = (unbent - dot(p, v)).max(least);
        let mut passed = R::ZERO;
        let mut ahead = -slope / curvature;
        // Each turn holds one more variable.
        for _ in 0..n {
            let mut next = None;
            for i in 0..n {
                let t = at(breaks, i);
                if at(free, i) != R::ZERO && t.is_finite() && next.is_none_or(|(_, least)| t < least) {
                    next = Some((i, t));
                }
            }
            let Some((i, t)) = next.filter(|&(_, t)| !(ahead < t - passed)) else { break };
            let (g, (low, high)) = (at(self.gradient, i), self.bounds.of(i));
            let bound = if g > R::ZERO { low } else { high };
            let moved = bound - at(self.x, i);
            set(point, i, bound);
            set(free, i, R::ZERO);
            add_scaled(c, t - passed, p);
            matrix.row(i, w);
            copy(v, w);
            matrix.solve(v);
            slope += (t - passed) * curvature + g * g + matrix.theta * g * moved - g * dot(v, c);
            curvature -= matrix.theta * g * g + (g + g) * dot(v, p) + g * g * dot(v, w);
            curvature = curvature.max(least);
            add_scaled(p, g, w);
            passed = t;
            ahead = -slope / curvature;
        }
        let ahead = ahead.max(R::ZERO);
        add_scaled(c, ahead, p);
        for i in 0..n {
            if at(free, i) != R::ZERO {
                set(point, i, self.bounds.clipped(i, at(self.x, i) - (passed + ahead) * at(self.gradient, i)));
            }
        }
    }

    /// The direct primal method: the minimum over the free variables, then back along the way from the Cauchy point until it keeps the bounds.
    /// `small.c` is `M c`; the matrix is factored for the free variables.
    ///
    /// Order of operations: `r = g + theta z - w.(M c)`, a step is `-(r + w.(K^-1 W^T r) / theta) / theta`, the share the least `room / step`, at most 1.
    fn subspace(
        &self,
        matrix: &Compact<'_, R>,
        Small { c, v, .. }: &mut Small<'_, R>,
        point: &mut [R],
        free: &[R],
        reduced: &mut [R],
    ) {
        let (n, theta) = (self.x.len(), matrix.theta);
        for i in 0..n {
            let moved = theta * (at(point, i) - at(self.x, i));
            let value = at(self.gradient, i) + moved - matrix.row_dot(i, c);
            set(reduced, i, if at(free, i) == R::ZERO { R::ZERO } else { value });
        }
        matrix.transpose_applied(|i| at(reduced, i), v);
        matrix.solve(v);
        let mut share = R::ONE;
        for i in 0..n {
            if at(free, i) != R::ZERO {
                let step = -(at(reduced, i) + matrix.row_dot(i, v) / theta) / theta;
                let (low, high) = self.bounds.of(i);
                let room = if step > R::ZERO { high - at(point, i) } else { low - at(point, i) };
                if step.abs() > room.abs() {
                    share = share.min(room / step);
                }
                set(reduced, i, step);
            }
        }
        for i in 0..n {
            if at(free, i) != R::ZERO {
                set(point, i, self.bounds.clipped(i, at(point, i) + share * at(reduced, i)));
            }
        }
    }
}

pub(super) fn dot<R: Real>(a: &[R], b: &[R]) -> R {
    a.iter().zip(b).fold(R::ZERO, |sum, (&a, &b)| sum + a * b)
}

pub(super) fn copy<R: Real>(to: &mut [R], from: &[R]) {
    for (to, &from) in to.iter_mut().zip(from) {
        *to = from;
    }
}

fn add_scaled<R: Real>(to: &mut [R], factor: R, from: &[R]) {
    for (to, &from) in to.iter_mut().zip(from) {
        *to += factor * from;
    }
}
