//! L-BFGS-B, on vectors of pairs and matrices of rows.

use super::Refusal;
use super::number::{Number, larger};

/// A function: value and gradient.
pub type Function<'f, R> = dyn FnMut(&[R]) -> (R, Vec<R>) + 'f;

/// When to stop.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
pub struct Limits<R> {
    pub max_iterations: u32,
    pub max_evaluations: u32,
    pub relative_decrease: R,
    pub gradient: R,
    pub history: usize,
}

/// Where it stopped; `status` is 0 stationary, 1 converged, 2 limit of iterations, 3 limit of evaluations, 4 stalled.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Minimum<R> {
    pub x: Vec<R>,
    pub value: R,
    pub start_value: R,
    pub gradient: R,
    pub iterations: u32,
    pub evaluations: u32,
    pub status: u32,
}

/// Lower and upper bounds, infinite where there are none.
type Range<'b, R> = (&'b [R], &'b [R]);

fn clipped<R: Number>((lower, upper): Range<'_, R>, i: usize, value: R) -> R {
    let value = if value > lower[i] { value } else { lower[i] };
    if value < upper[i] { value } else { upper[i] }
}

fn smaller<R: Number>(a: R, b: R) -> R {
    if a < b { a } else { b }
}

fn dot<R: Number>(a: &[R], b: &[R]) -> R {
    a.iter().zip(b).fold(R::of(0.0), |sum, (&a, &b)| sum + a * b)
}

/// The pairs (s, y), oldest first, and theta.
struct Model<R> {
    pairs: Vec<(Vec<R>, Vec<R>)>,
    theta: R,
}

impl<R: Number> Model<R> {
    fn row(&self, i: usize) -> Vec<R> {
        let changes = self.pairs.iter().map(|(_, y)| y[i]);
        changes.chain(self.pairs.iter().map(|(s, _)| self.theta * s[i])).collect()
    }

    fn row_dot(&self, i: usize, v: &[R]) -> R {
        let k = self.pairs.len();
        let part = |values: Vec<R>, v: &[R]| dot(&values, v);
        let changes = part(self.pairs.iter().map(|(_, y)| y[i]).collect(), &v[..k]);
        changes + self.theta * part(self.pairs.iter().map(|(s, _)| s[i]).collect(), &v[k..])
    }

    fn transpose_applied(&self, d: &[R]) -> Vec<R> {
        let changes = self.pairs.iter().map(|(_, y)| dot(y, d));
        changes.chain(self.pairs.iter().map(|(s, _)| self.theta * dot(s, d))).collect()
    }

    /// L and D of K for the free variables.
    fn factor(&self, free: &[bool]) -> Option<Vec<Vec<R>>> {
        let (k, zero) = (self.pairs.len(), R::of(0.0));
        let mut m = vec![vec![zero; 2 * k]; 2 * k];
        for i in 0..k {
            for j in 0..k {
                let over = |a: &[R], b: &[R], wanted: bool| {
                    let mut sum = zero;
                    for l in 0..free.len() {
                        if free[l] == wanted {
                            sum = sum + a[l] * b[l];
                        }
                    }
                    sum
                };
                let ((s_i, y_i), (s_j, y_j)) = (&self.pairs[i], &self.pairs[j]);
                let (sy_free, sy_held) = (over(s_i, y_j, true), over(s_i, y_j, false));
                let curvature = if i == j { sy_free + sy_held } else { zero };
                m[i][j] = -(curvature + over(y_i, y_j, true) / self.theta);
                m[k + i][j] = if i > j { sy_held } else { -sy_free };
                m[k + i][k + j] = self.theta * over(s_i, s_j, false);
            }
        }
        for i in 0..2 * k {
            for j in 0..i {
                for l in 0..j {
                    m[i][j] = m[i][j] - m[i][l] * m[j][l];
                }
            }
            for j in 0..i {
                let l = m[i][j] / m[j][j];
                m[i][i] = m[i][i] - m[i][j] * l;
                m[i][j] = l;
            }
            let sized = if i < k { -m[i][i] } else { m[i][i] };
            if !(sized > zero && sized.is_finite()) {
                return None;
            }
        }
        Some(m)
    }
}

fn solved<R: Number>(m: &[Vec<R>], v: &[R]) -> Vec<R> {
    let mut v = v.to_vec();
    for i in 0..v.len() {
        for k in 0..i {
            v[i] = v[i] - m[i][k] * v[k];
        }
    }
    for i in (0..v.len()).rev() {
        v[i] = v[i] / m[i][i];
        for k in i + 1..v.len() {
            v[i] = v[i] - m[k][i] * v[k];
        }
    }
    v
}

/// The aim of a step; `None` when the matrix is spoilt.
fn aim<R: Number>(model: &Model<R>, x: &[R], g: &[R], range: Range<'_, R>) -> Option<Vec<R>> {
    let (n, zero, theta) = (x.len(), R::of(0.0), model.theta);
    let mut free = vec![false; n];
    let m = model.factor(&free)?;
    let mut point = x.to_vec();
    let mut breaks = vec![zero; n];
    let mut slope = zero;
    for i in 0..n {
        let room = if g[i] > zero { x[i] - range.0[i] } else { range.1[i] - x[i] };
        free[i] = room > zero && g[i] != zero;
        breaks[i] = room / g[i].magnitude();
        if free[i] {
            slope = slope - g[i] * g[i];
        }
    }
    let d: Vec<R> = (0..n).map(|i| if free[i] { -g[i] } else { zero }).collect();
    let mut p = model.transpose_applied(&d);
    let mut c = vec![zero; p.len()];
    let unbent = -(theta * slope);
    let least = R::EPSILON * unbent;
    let mut curvature = larger(unbent - dot(&p, &solved(&m, &p)), least);
    let mut passed = zero;
    let mut ahead = -slope / curvature;
    for _ in 0..n {
        let mut next: Option<usize> = None;
        for i in 0..n {
            if free[i] && breaks[i].is_finite() && next.is_none_or(|b| breaks[i] < breaks[b]) {
                next = Some(i);
            }
        }
        let Some(b) = next else { break };
        let t = breaks[b];
        if ahead < t - passed {
            break;
        }
        point[b] = if g[b] > zero { range.0[b] } else { range.1[b] };
        free[b] = false;
        for k in 0..p.len() {
            c[k] = c[k] + (t - passed) * p[k];
        }
        let w = model.row(b);
        let v = solved(&m, &w);
        let moved = point[b] - x[b];
        slope = slope + ((t - passed) * curvature + g[b] * g[b] + theta * g[b] * moved - g[b] * dot(&v, &c));
        curvature = curvature - (theta * g[b] * g[b] + (g[b] + g[b]) * dot(&v, &p) + g[b] * g[b] * dot(&v, &w));
        curvature = larger(curvature, least);
        for k in 0..p.len() {
            p[k] = p[k] + g[b] * w[k];
        }
        passed = t;
        ahead = -slope / curvature;
    }
    let ahead = larger(ahead, zero);
    for k in 0..p.len() {
        c[k] = c[k] + ahead * p[k];
    }
    for i in 0..n {
        if free[i] {
            point[i] = clipped(range, i, x[i] - (passed + ahead) * g[i]);
        }
    }
    if model.pairs.is_empty() {
        return Some(point);
    }
    let c = solved(&m, &c);
    let m = model.factor(&free)?;
    let reduced: Vec<R> =
        (0..n).map(|i| if free[i] { g[i] + theta * (point[i] - x[i]) - model.row_dot(i, &c) } else { zero }).collect();
    let v = solved(&m, &model.transpose_applied(&reduced));
    let mut share = R::of(1.0);
    let mut steps = vec![zero; n];
    for i in (0..n).filter(|&i| free[i]) {
        steps[i] = -(reduced[i] + model.row_dot(i, &v) / theta) / theta;
        let room = if steps[i] > zero { range.1[i] - point[i] } else { range.0[i] - point[i] };
        if steps[i].magnitude() > room.magnitude() {
            share = smaller(share, room / steps[i]);
        }
    }
    for i in (0..n).filter(|&i| free[i]) {
        point[i] = clipped(range, i, point[i] + share * steps[i]);
    }
    Some(point)
}

/// Values of a trial: step length, point, value, gradient.
type Taken<R> = (Vec<R>, R, Vec<R>);

/// Minimises within bounds (empty: none).
pub fn minimum<R: Number>(
    function: &mut Function<'_, R>,
    start: &[R],
    bounds: Option<Range<'_, R>>,
    limits: &Limits<R>,
) -> Result<Minimum<R>, Refusal> {
    let (n, zero, one) = (start.len(), R::of(0.0), R::of(1.0));
    let (none_low, none_high) = (vec![R::of(f64::NEG_INFINITY); n], vec![R::of(f64::INFINITY); n]);
    let range = bounds.unwrap_or((&none_low, &none_high));
    if (0..n).any(|i| !(range.0[i] <= range.1[i])) {
        return Err([104, 0, 0]);
    }
    let mut x: Vec<R> = (0..n).map(|i| clipped(range, i, start[i])).collect();
    let (mut value, mut g) = function(&x);
    let mut result =
        Minimum { x: Vec::new(), value, start_value: value, gradient: zero, iterations: 0, evaluations: 0, status: 2 };
    let mut model = Model { pairs: Vec::new(), theta: one };
    let projected = |x: &[R], g: &[R]| {
        (0..n).fold(zero, |most, i| larger((clipped(range, i, x[i] - g[i]) - x[i]).magnitude(), most))
    };
    loop {
        result.gradient = projected(&x, &g);
        if result.gradient <= limits.gradient {
            result.status = 0;
            break;
        }
        if result.iterations >= limits.max_iterations {
            break;
        }
        let least = limits.relative_decrease * value.magnitude();
        let mut slope = zero;
        let mut found: Option<Taken<R>> = None;
        if let Some(point) = aim(&model, &x, &g, range) {
            let way: Vec<R> = (0..n).map(|i| point[i] - x[i]).collect();
            slope = dot(&g, &way);
            if !model.pairs.is_empty() && slope < zero && -slope <= least {
                result.status = 1;
                break;
            }
            if slope < zero {
                let mut largest: Option<R> = None;
                for i in (0..n).filter(|&i| way[i] != zero) {
                    let room = if way[i] > zero { range.1[i] - x[i] } else { range.0[i] - x[i] };
                    let t = room / way[i];
                    if t.is_finite() && largest.is_none_or(|least| t < least) {
                        largest = Some(t);
                    }
                }
                let largest = largest.map(|t| larger(t, one));
                let mut t = if model.pairs.is_empty() { smaller(one, one / dot(&way, &way).sqrt()) } else { one };
                let (mut low, mut at_low, mut slope_low) = (zero, value, slope);
                let mut high: Option<R> = None;
                for trials in 0..20 {
                    if result.evaluations >= limits.max_evaluations {
                        break;
                    }
                    result.evaluations += 1;
                    let along = |i: usize| if t == one { point[i] } else { clipped(range, i, x[i] + t * way[i]) };
                    let trial: Vec<R> = (0..n).map(along).collect();
                    let (at_trial, g_trial) = function(&trial);
                    let finite = at_trial.is_finite() && g_trial.iter().all(|value| value.is_finite());
                    if !(finite && at_trial <= value + R::of(1e-4) * t * slope) {
                        let width = t - low;
                        high = Some(t);
                        let mut share = zero;
                        if finite {
                            let bend = at_trial - at_low - slope_low * width;
                            share = -(slope_low * width) / (bend + bend);
                        }
                        t = low + width * smaller(larger(share, R::of(0.1)), R::of(0.9));
                        continue;
                    }
                    let slope_here = dot(&g_trial, &way);
                    let far = largest.is_some_and(|largest| t >= largest);
                    if trials >= 10 || slope_here >= R::of(0.9) * slope || far {
                        found = Some((trial, at_trial, g_trial));
                        break;
                    }
                    (low, at_low, slope_low) = (t, at_trial, slope_here);
                    t = match high {
                        Some(high) => (t + high) * R::of(0.5),
                        None => largest.map_or(t * R::of(4.0), |largest| smaller(t * R::of(4.0), largest)),
                    };
                }
                if found.is_none() && result.evaluations >= limits.max_evaluations {
                    result.status = 3;
                    break;
                }
            }
        }
        let Some((to, lowered, g_to)) = found else {
            if model.pairs.is_empty() {
                result.status = if slope < zero && -slope <= least { 1 } else { 4 };
                break;
            }
            model = Model { pairs: Vec::new(), theta: one };
            continue;
        };
        let s: Vec<R> = (0..n).map(|i| to[i] - x[i]).collect();
        let y: Vec<R> = (0..n).map(|i| g_to[i] - g[i]).collect();
        let (sy, yy) = (dot(&s, &y), dot(&y, &y));
        let theta = yy / sy;
        if sy > R::EPSILON * yy && theta.is_finite() && theta > zero {
            if model.pairs.len() == limits.history {
                model.pairs.remove(0);
            }
            model.pairs.push((s, y));
            model.theta = theta;
        }
        (x, g) = (to, g_to);
        result.iterations += 1;
        let decrease = value - lowered;
        value = lowered;
        if decrease <= limits.relative_decrease * larger((value + decrease).magnitude(), value.magnitude()) {
            result.gradient = projected(&x, &g);
            result.status = 1;
            break;
        }
    }
    Ok(Minimum { x, value, ..result })
}
