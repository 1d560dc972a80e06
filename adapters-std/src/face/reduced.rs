//! Alternating least squares for the weights of one shape, on the Gram matrix of the core (ch. 12).
//!
//! With `G = M^T M`, `b = M^T a` and `s = |a|^2`, the energy is `s - 2 b.(w2 (x) w3) + (w2 (x) w3)^T G (w2 (x) w3)`. For fixed
//! `w3`, the best `w2` solves a `d_id x d_id` system; for fixed `w2`, the best `w3` a `d_pose x d_pose` one. One sweep is both.
//!
//! Plain alternation creeps towards the end. There the energy, with the best `w2` for each `w3` put in, is a smooth function
//! of `w3` alone, of a few variables, and Newton's method takes over (variable projection). A step that does not lower the
//! energy is damped, and at last replaced by a plain sweep, so the energy never grows.

use crate::dense::dot;
use crate::face::packed::{cholesky_in_place, forward_solve_in_place, packed_index, packed_len, solve_in_place};
use crate::face::projection::ProjectionOptions;
use pulp::Arch;

/// Relative ridge of the small systems: with untruncated modes they are singular at the mean weights.
const RIDGE: f64 = 1e-12;
/// Smallest damping of a Newton step other than none, relative to the curvature at fixed `w2`.
const LEAST_DAMPING: f64 = 1e-3;
/// Factor between one damping and the next.
const DAMPING_STEP: f64 = 8.0;
/// Dampings tried before a plain sweep is made instead.
const DAMPING_ATTEMPTS: usize = 5;
/// The Gram matrix of a core, arranged for solving.
#[derive(Debug, Clone)]
pub(crate) struct ReducedGram {
    /// Identity weights.
    d_id: usize,
    /// Row `(k, k')`, `k <= k'`, is the packed symmetric `d_id x d_id` matrix that multiplies `w3[k] w3[k']`. Rows are in
    /// packed order too, so a model cut to fewer weights uses the first rows and the first numbers of each.
    rows: Vec<f64>,
    /// Block `(k, k')`, `k <= k'`, in packed order: `G[(., k), (., k')]`, `d_id x d_id`, column after column.
    blocks: Vec<f64>,
}

impl ReducedGram {
    /// From `G`, `(d_id d_pose)` square, identity weight fastest.
    pub(crate) fn new(gram: &[f64], d_id: usize, d_pose: usize) -> Self {
        let rank = d_id * d_pose;
        let mut rows = Vec::with_capacity(packed_len(d_pose) * packed_len(d_id));
        let mut blocks = Vec::with_capacity(packed_len(d_pose) * d_id * d_id);
        for k2 in 0..d_pose {
            for k in 0..=k2 {
                let start = blocks.len();
                for j2 in 0..d_id {
                    blocks.extend_from_slice(&gram[(k2 * d_id + j2) * rank + k * d_id..][..d_id]);
                }
                let block = &blocks[start..];
                for j2 in 0..d_id {
                    let across = block.iter().skip(j2).step_by(d_id);
                    let both = block[j2 * d_id..].iter().zip(across).map(|(x, y)| x + y).take(j2 + 1);
                    rows.extend(both.map(|both| if k < k2 { both } else { 0.5 * both }));
                }
            }
        }
        ReducedGram { d_id, rows, blocks }
    }

    /// The rows of the first `d_pose` expression weights, each cut to the first `d_id` identity weights.
    fn rows(&self, d_id: usize, d_pose: usize) -> impl Iterator<Item = &[f64]> {
        self.rows.chunks_exact(packed_len(self.d_id)).take(packed_len(d_pose)).map(move |row| &row[..packed_len(d_id)])
    }
}

/// One shape to be projected on the first `d_id` and `d_pose` weights of a model.
pub(crate) struct ReducedProblem<'a> {
    /// `G` of the model with all its weights.
    pub gram: &'a ReducedGram,
    /// `b` of the model with `d_id` identity weights and at least `d_pose` expression weights, identity fastest.
    pub moments: &'a [f64],
    /// `s`.
    pub square: f64,
    /// Identity weights used.
    pub d_id: usize,
    /// Expression weights used.
    pub d_pose: usize,
}

/// The weights found from the best start.
#[derive(Debug, Clone)]
pub(crate) struct ReducedSolution {
    pub identity: Vec<f64>,
    /// A unit vector.
    pub expression: Vec<f64>,
    pub energy: f64,
    pub sweeps: usize,
    pub start: usize,
    pub converged: bool,
}

impl ReducedProblem<'_> {
    /// The solution of lowest energy: all `starts` (expression weights) make a few sweeps, the best few go to the end.
    pub(crate) fn solution(&self, starts: &[Vec<f64>], options: &ProjectionOptions) -> ReducedSolution {
        let mut states: Vec<Iteration> = starts.iter().enumerate().map(|(i, w3)| self.begin(i, w3)).collect();
        for state in &mut states {
            for _ in 0..options.screening_sweeps.min(options.sweeps) {
                self.sweep(state);
            }
        }
        states.sort_by(|a, b| a.energy.total_cmp(&b.energy));
        states.truncate(options.kept_starts.max(1));
        for state in &mut states {
            self.finish(state, options);
        }
        let best = states.into_iter().min_by(|a, b| a.energy.total_cmp(&b.energy)).expect("there is a start");
        ReducedSolution {
            identity: best.w2,
            expression: best.w3,
            energy: best.energy,
            sweeps: best.sweeps,
            start: best.start,
            converged: best.converged,
        }
    }

    fn begin(&self, start: usize, w3: &[f64]) -> Iteration {
        let mut w3 = w3[..self.d_pose].to_vec();
        if !normalise(&mut w3) {
            // No direction given: any will do.
            w3[0] = 1.0;
        }
        let best = self.best_identity(&w3);
        Iteration { start, w2: best.w2, w3, energy: best.energy, factor: best.factor, sweeps: 0, converged: false }
    }

    /// One plain sweep.
    fn sweep(&self, state: &mut Iteration) {
        state.sweeps += 1;
        let mut w3 = self.best_expression(&state.w2);
        if normalise(&mut w3) {
            let best = self.best_identity(&w3);
            state.accept_lower(w3, best);
        }
    }

    /// Damped Newton steps, or plain sweeps where those fail, until the energy stands still or the limit is reached.
    fn finish(&self, state: &mut Iteration, options: &ProjectionOptions) {
        let mut damping = 0.0;
        while state.sweeps < options.sweeps && !state.converged {
            let before = state.energy;
            let standstill = options.tolerance * before.abs() + 1e-15 * self.square;
            let quadratic = self.quadratic_model(state);
            let mut lowered = false;
            for attempt in 0..DAMPING_ATTEMPTS {
                if let Some((w3, expected_decrease)) = quadratic.least(&state.w3, damping) {
                    if expected_decrease <= standstill {
                        state.converged = true;
                        return;
                    }
                    let best = self.best_identity(&w3);
                    lowered = state.accept_lower(w3, best);
                }
                if lowered {
                    // What sufficed at once is relaxed.
                    if attempt == 0 {
                        damping = if damping > LEAST_DAMPING { damping / DAMPING_STEP } else { 0.0 };
                    }
                    break;
                }
                damping = LEAST_DAMPING.max(damping * DAMPING_STEP);
            }
            if lowered {
                state.sweeps += 1;
            } else {
                self.sweep(state);
            }
            state.converged = before - state.energy <= standstill;
        }
    }

    /// Second-order model, at the point reached, of the energy as a function of `w3` with the best `w2` put in.
    fn quadratic_model(&self, state: &Iteration) -> QuadraticModel {
        let (d_id, d_pose) = (self.d_id, self.d_pose);
        let (w2, w3) = (&state.w2, &state.w3);
        // products[k][k'] = G[(., k), (., k')] w2.
        let products = Arch::new().dispatch(|| self.block_products(w2));
        let product = |k: usize, k2: usize| &products[(k2 * d_pose + k) * d_id..][..d_id];
        // Mixed second derivatives: J2^T J3 plus the residual's share G (w2 (x) w3) - b; then R^-T of them.
        let mut mixed = vec![0.0; d_id * d_pose];
        for (k, column) in mixed.chunks_exact_mut(d_id).enumerate() {
            column.iter_mut().zip(&self.moments[k * d_id..]).for_each(|(x, b)| *x = -b);
            for (k2, &w) in w3.iter().enumerate() {
                let both = product(k2, k).iter().zip(product(k, k2));
                column.iter_mut().zip(both).for_each(|(x, (a, b))| *x += w * (a + b));
            }
            forward_solve_in_place(&state.factor, column);
        }
        let (mut gradient, mut diagonal) = (Vec::with_capacity(d_pose), Vec::with_capacity(d_pose));
        let mut hessian = Vec::with_capacity(packed_len(d_pose));
        for k2 in 0..d_pose {
            let row: Vec<f64> = (0..d_pose).map(|k| dot(product(k, k2), w2)).collect();
            gradient.push(dot(&row, w3) - dot(&self.moments[k2 * d_id..][..d_id], w2));
            diagonal.push(row[k2]);
            let column = &mixed[k2 * d_id..][..d_id];
            hessian.extend((0..=k2).map(|k| row[k] - dot(&mixed[k * d_id..][..d_id], column)));
        }
        // The energy does not depend on the length of w3: the direction of w3 is made stiff.
        let stiffness = diagonal.iter().sum::<f64>() / d_pose as f64;
        for k2 in 0..d_pose {
            (0..=k2).for_each(|k| hessian[packed_index(k, k2)] += stiffness * w3[k] * w3[k2]);
        }
        QuadraticModel { gradient, hessian, diagonal }
    }

    /// `G[(., k), (., k')] w2` at number `k' d_pose + k`.
    #[inline(always)]
    fn block_products(&self, w2: &[f64]) -> Vec<f64> {
        let (d, d_id, d_pose) = (self.gram.d_id, self.d_id, self.d_pose);
        let mut products = vec![0.0; d_pose * d_pose * d_id];
        let mut column = vec![0.0; d_id];
        for k2 in 0..d_pose {
            for k in 0..=k2 {
                let block = &self.gram.blocks[packed_index(k, k2) * d * d..][..d * d];
                column.fill(0.0);
                for (j, (segment, &w)) in block.chunks_exact(d).zip(w2).enumerate() {
                    let segment = &segment[..d_id];
                    column.iter_mut().zip(segment).for_each(|(x, g)| *x += w * g);
                    if k < k2 {
                        // The block below the diagonal is the transpose.
                        products[(k * d_pose + k2) * d_id + j] = dot(segment, w2);
                    }
                }
                products[(k2 * d_pose + k) * d_id..][..d_id].copy_from_slice(&column);
            }
        }
        products
    }

    /// The identity weights that fit best with `w3`.
    fn best_identity(&self, w3: &[f64]) -> BestIdentity {
        let (matrix, right) = Arch::new().dispatch(|| self.identity_system(w3));
        let solved = Arch::new().dispatch(|| ridge_solution(&matrix, &right));
        // (A + r I) w = b, so w^T A w - 2 b^T w = -b^T w - r |w|^2.
        let energy = self.square - dot(&right, &solved.x) - solved.ridge * dot(&solved.x, &solved.x);
        BestIdentity { w2: solved.x, energy, factor: solved.factor }
    }

    /// Packed matrix and right-hand side for the identity weights at fixed `w3`.
    #[inline(always)]
    fn identity_system(&self, w3: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = packed_len(self.d_id);
        let mut matrix = vec![0.0; n];
        let products = (0..self.d_pose).flat_map(|k2| (0..=k2).map(move |k| (k, k2)));
        let rows: Vec<(&[f64], f64)> =
            self.gram.rows(self.d_id, self.d_pose).zip(products).map(|(row, (k, k2))| (row, w3[k] * w3[k2])).collect();
        // Four rows at a time: the sum is read and written a quarter as often.
        let (fours, rest) = rows.as_chunks::<4>();
        for [(a, x), (b, y), (c, z), (d, w)] in fours {
            let (b, c, d) = (&b[..n], &c[..n], &d[..n]);
            for (i, (sum, a)) in matrix.iter_mut().zip(*a).enumerate() {
                *sum += (x * a + y * b[i]) + (z * c[i] + w * d[i]);
            }
        }
        for (a, x) in rest {
            matrix.iter_mut().zip(*a).for_each(|(sum, a)| *sum += x * a);
        }
        let mut right = vec![0.0; self.d_id];
        for (moments, &w) in self.moments.chunks_exact(self.d_id).zip(w3) {
            right.iter_mut().zip(moments).for_each(|(sum, b)| *sum += w * b);
        }
        (matrix, right)
    }

    /// The expression weights that fit best with `w2`.
    fn best_expression(&self, w2: &[f64]) -> Vec<f64> {
        let mut products = Vec::with_capacity(packed_len(self.d_id));
        for j2 in 0..self.d_id {
            products.extend(w2[..j2].iter().map(|w| 2.0 * w * w2[j2]));
            products.push(w2[j2] * w2[j2]);
        }
        let mut matrix: Vec<f64> =
            Arch::new().dispatch(|| self.gram.rows(self.d_id, self.d_pose).map(|row| dot(row, &products)).collect());
        // Rows off the diagonal hold the sum of two transposed blocks.
        for k2 in 0..self.d_pose {
            matrix[packed_index(0, k2)..packed_index(k2, k2)].iter_mut().for_each(|x| *x *= 0.5);
        }
        let right: Vec<f64> =
            self.moments.chunks_exact(self.d_id).take(self.d_pose).map(|moments| dot(moments, w2)).collect();
        ridge_solution(&matrix, &right).x
    }
}

/// Half the gradient and half the Hessian of the energy as a function of `w3`.
struct QuadraticModel {
    gradient: Vec<f64>,
    hessian: Vec<f64>,
    /// Half the second derivatives at fixed `w2`, which are positive: the scale of the damping.
    diagonal: Vec<f64>,
}

impl QuadraticModel {
    /// The unit vector of the least of the damped model about `w3`, and by how much the energy should fall; `None` where
    /// there is no least.
    fn least(&self, w3: &[f64], damping: f64) -> Option<(Vec<f64>, f64)> {
        let mut hessian = self.hessian.clone();
        self.diagonal.iter().enumerate().for_each(|(k, x)| hessian[packed_index(k, k)] += damping * x);
        if !cholesky_in_place(&mut hessian, w3.len()) {
            return None;
        }
        let mut step = self.gradient.clone();
        solve_in_place(&hessian, &mut step);
        let mut next: Vec<f64> = w3.iter().zip(&step).map(|(w, step)| w - step).collect();
        normalise(&mut next).then(|| (next, dot(&step, &self.gradient)))
    }
}

/// Where one start has got to: `w2` is the best for `w3`, a unit vector.
struct Iteration {
    start: usize,
    w2: Vec<f64>,
    w3: Vec<f64>,
    energy: f64,
    /// Cholesky factor of the system that gave `w2`.
    factor: Vec<f64>,
    sweeps: usize,
    converged: bool,
}

impl Iteration {
    /// Goes to `w3` if the energy is lower there.
    fn accept_lower(&mut self, w3: Vec<f64>, best: BestIdentity) -> bool {
        let lower = best.energy < self.energy;
        if lower {
            (self.w2, self.w3, self.energy, self.factor) = (best.w2, w3, best.energy, best.factor);
        }
        lower
    }
}

struct BestIdentity {
    w2: Vec<f64>,
    energy: f64,
    factor: Vec<f64>,
}

/// `x = (A + ridge I)^-1 b`.
struct Solved {
    x: Vec<f64>,
    ridge: f64,
    factor: Vec<f64>,
}

/// Solves with a ridge that is a tiny part of the mean diagonal and grows until the factorisation succeeds.
#[inline(always)]
fn ridge_solution(matrix: &[f64], right: &[f64]) -> Solved {
    let n = right.len();
    let trace: f64 = (0..n).map(|j| matrix[packed_index(j, j)]).sum();
    let mut ridge = RIDGE * trace / n as f64;
    let mut factor = matrix.to_vec();
    while ridge > 0.0 && ridge <= trace {
        (0..n).for_each(|j| factor[packed_index(j, j)] += ridge);
        if cholesky_in_place(&mut factor, n) {
            let mut x = right.to_vec();
            solve_in_place(&factor, &mut x);
            return Solved { x, ridge, factor };
        }
        factor.copy_from_slice(matrix);
        ridge *= 100.0;
    }
    // A matrix of zeros: every solution is as good, zero is one.
    (0..n).flat_map(|j| (0..=j).map(move |i| (i, j))).for_each(|(i, j)| factor[packed_index(i, j)] = f64::from(i == j));
    Solved { x: vec![0.0; n], ridge: 0.0, factor }
}

/// Scales to unit length; `false` when there is no direction.
fn normalise(w: &mut [f64]) -> bool {
    let length = dot(w, w).sqrt();
    if !(length.is_finite() && length > 1e-300) {
        return false;
    }
    w.iter_mut().for_each(|x| *x /= length);
    true
}
