//! Convex quadratics against their active sets, Rosenbrock's valley, refusals and hostile functions.

use super::*;
use crate::testing::cases;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use std::vec::Vec;

/// A function from a closure that writes the gradient.
struct Function<F> {
    dim: usize,
    value: F,
}

impl<R: Real, F: FnMut(&[R], &mut [R]) -> R> Objective<R> for Function<F> {
    fn dim(&self) -> usize {
        self.dim
    }
    fn value_and_gradient(&mut self, x: &[R], gradient: &mut [R]) -> Result<R, Error> {
        Ok((self.value)(x, gradient))
    }
}

fn minimum<R: Real>(
    dim: usize,
    value: impl FnMut(&[R], &mut [R]) -> R,
    x: &mut [R],
    bounds: [&[R]; 2],
    limits: &Limits<R>,
) -> Result<Outcome<R>, Error> {
    let mut workspace = vec![R::ZERO; minimised_req(dim, limits.history as usize).numbers()];
    minimised_in_place(&mut Function { dim, value }, x, bounds[0], bounds[1], limits, &mut workspace)
}

/// The chained valley `sum 100 (x_i+1 - x_i^2)^2 + (1 - x_i)^2`.
fn valley(x: &[f64], gradient: &mut [f64]) -> f64 {
    gradient.fill(0.0);
    let mut value = 0.0;
    for i in 0..x.len() - 1 {
        let (up, off) = (x[i + 1] - x[i] * x[i], 1.0 - x[i]);
        value += 100.0 * up * up + off * off;
        gradient[i] -= 400.0 * x[i] * up + 2.0 * off;
        gradient[i + 1] += 200.0 * up;
    }
    value
}

/// Beside a minimum of value zero rounding ends the search.
fn is_done(outcome: &Outcome<f64>) -> bool {
    match outcome.status {
        Status::Converged | Status::Stationary => true,
        status => status == Status::Stalled && outcome.value < 1e-24,
    }
}

#[test]
fn valley_free() {
    for n in [2, 3, 10, 50] {
        let mut x: Vec<f64> = (0..n).map(|i| if i % 2 == 0 { -1.2 } else { 1.0 }).collect();
        let limits = Limits { max_iterations: 1000, max_evaluations: 2000, ..Limits::default() };
        let outcome = minimum(n, valley, &mut x, [&[], &[]], &limits).unwrap();
        assert!(is_done(&outcome), "{outcome:?}");
        // A chain has a second minimum near (-1, 1, 1, ...) from four variables on.
        assert!(outcome.value < 1e-15 || (n > 3 && (outcome.value - 3.98).abs() < 0.01), "{n}: {outcome:?}");
        assert!(outcome.evaluations < 8 * n as u32 + 100, "{outcome:?}");
    }
}

#[test]
fn valley_bounded() {
    // With x <= 0.5 the minimum is at (0.5, 0.25), value 0.25; a bound that is not active changes nothing.
    for (high, expected) in [([0.5, 2.0], [0.5, 0.25]), ([3.0, 2.0], [1.0, 1.0]), ([3.0, 0.25], [0.50488, 0.25])] {
        for start in [[-1.2, 1.0], [0.5, 0.25], [-2.0, -2.0], [40.0, -17.0]] {
            let mut x = start;
            let outcome = minimum(2, valley, &mut x, [&[-2.0, -2.0], &high], &Limits::default()).unwrap();
            assert!(is_done(&outcome), "{outcome:?}");
            assert!(
                (x[0] - expected[0]).abs() < 1e-4 && (x[1] - expected[1]).abs() < 1e-4,
                "{start:?} {x:?} {outcome:?}"
            );
        }
    }
}

#[test]
fn boxes_without_room() {
    let mut x = [5.0, 5.0];
    let outcome = minimum(2, valley, &mut x, [&[0.5, 0.0], &[0.5, 4.0]], &Limits::default()).unwrap();
    assert!(x[0] == 0.5 && (x[1] - 0.25).abs() < 1e-9 && (outcome.value - 0.25).abs() < 1e-12);
    let outcome = minimum(2, valley, &mut x, [&[0.5, 1.0], &[0.5, 1.0]], &Limits::default()).unwrap();
    assert!(x == [0.5, 1.0] && outcome.status == Status::Stationary && outcome.evaluations == 0);
    let outcome = minimum(0, |_: &[f64], _: &mut [f64]| 3.0, &mut [], [&[], &[]], &Limits::default()).unwrap();
    assert_eq!((outcome.value, outcome.status), (3.0, Status::Stationary));
}

#[test]
fn single_precision() {
    let narrow = |x: &[f32], gradient: &mut [f32]| {
        let (up, off) = (x[1] - x[0] * x[0], 1.0 - x[0]);
        gradient.copy_from_slice(&[-(400.0 * x[0] * up + 2.0 * off), 200.0 * up]);
        100.0 * up * up + off * off
    };
    let mut x = [-1.2f32, 1.0];
    let outcome = minimum(2, narrow, &mut x, [&[], &[]], &Limits::default()).unwrap();
    assert!(outcome.value < 1e-6 && (x[0] - 1.0).abs() < 2e-3, "{outcome:?} {x:?}");
}

#[test]
fn limits_hold() {
    let start = [-1.2, 1.0];
    let with = |limits: Limits<f64>| {
        let mut x = start;
        minimum(2, valley, &mut x, [&[], &[]], &limits).map(|outcome| (outcome, x))
    };
    let (outcome, x) = with(Limits { max_iterations: 0, ..Limits::default() }).unwrap();
    assert_eq!((outcome.status, outcome.evaluations, x), (Status::IterationLimit, 0, start));
    let (outcome, _) = with(Limits { max_iterations: 4, ..Limits::default() }).unwrap();
    assert!(outcome.status == Status::IterationLimit && outcome.iterations == 4);
    let (outcome, _) = with(Limits { max_evaluations: 7, ..Limits::default() }).unwrap();
    assert_eq!((outcome.status, outcome.evaluations), (Status::EvaluationLimit, 7));
    assert!(outcome.value < outcome.start_value);
    let (outcome, _) = with(Limits { gradient: 1e-3, ..Limits::default() }).unwrap();
    assert!(outcome.status == Status::Stationary && outcome.gradient <= 1e-3);
    for limits in [
        Limits { relative_decrease: f64::NAN, ..Limits::default() },
        Limits { relative_decrease: -1.0, ..Limits::default() },
        Limits { gradient: f64::INFINITY, ..Limits::default() },
        Limits { history: 0, ..Limits::default() },
    ] {
        assert_eq!(with(limits), Err(Error::BadOption { option: 3 }));
    }
}

#[test]
fn refusals() {
    let run = |x: &[f64], low: &[f64], high: &[f64]| {
        minimum(2, valley, &mut x.to_vec(), [low, high], &Limits::default()).map(|_| ())
    };
    let infinity = f64::INFINITY;
    assert_eq!(run(&[0.0; 3], &[], &[]), Err(Error::DimensionMismatch { expected: 2, found: 3 }));
    assert_eq!(run(&[0.0; 2], &[0.0], &[]), Err(Error::DimensionMismatch { expected: 2, found: 1 }));
    assert_eq!(run(&[0.0; 2], &[1.0, 0.0], &[0.0, 0.0]), Err(Error::BadOption { option: 0 }));
    assert_eq!(run(&[0.0; 2], &[], &[0.0, f64::NAN]), Err(Error::BadOption { option: 0 }));
    assert_eq!(run(&[0.0, f64::NAN], &[], &[]), Err(Error::NotFinite { index: 1 }));
    assert_eq!(run(&[0.0; 2], &[infinity; 2], &[infinity; 2]), Err(Error::NotFinite { index: 0 }));
    assert_eq!(run(&[1e160, 0.0], &[], &[]), Err(Error::NotFinite { index: 0 }));
    assert_eq!(run(&[0.0; 2], &[-infinity; 2], &[infinity; 2]), Ok(()));
    let mut x = [0.0; 2];
    let short = minimised_in_place(
        &mut Function { dim: 2, value: valley },
        &mut x,
        &[],
        &[],
        &Limits::default(),
        &mut [0.0; 169],
    );
    assert_eq!(short.map(|_| ()), Err(Error::WorkspaceTooSmall { needed: 170, given: 169 }));
    let no_value = |_: &[f64], gradient: &mut [f64]| {
        gradient.fill(0.0);
        f64::NAN
    };
    assert_eq!(
        minimum(2, no_value, &mut x, [&[], &[]], &Limits::default()).map(|_| ()),
        Err(Error::NotFinite { index: 2 })
    );
}

/// Where the function has no value the step is shortened: `x - ln x` from far right jumps over zero.
#[test]
fn steps_back_from_what_is_not_finite() {
    let function = |x: &[f64], gradient: &mut [f64]| {
        gradient[0] = 1.0 - 1.0 / x[0];
        if x[0] > 0.0 { x[0] - x[0].ln() } else { f64::NAN }
    };
    for start in [1e-3, 0.5, 7.0, 1e4] {
        let mut x = [start];
        let outcome = minimum(1, function, &mut x, [&[], &[]], &Limits::default()).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-6 && outcome.value <= outcome.start_value, "{outcome:?} {x:?}");
    }
}

#[test]
fn a_wrong_gradient_stalls() {
    let uphill = |x: &[f64], gradient: &mut [f64]| {
        gradient[0] = -2.0 * x[0];
        x[0] * x[0]
    };
    let mut x = [3.0];
    let outcome = minimum(1, uphill, &mut x, [&[], &[]], &Limits::default()).unwrap();
    assert_eq!((outcome.status, outcome.iterations, x), (Status::Stalled, 0, [3.0]));
}

/// A linear function runs into its bounds; without any it falls until the limits stop it.
#[test]
fn linear_functions() {
    let linear = |x: &[f64], gradient: &mut [f64]| {
        gradient.copy_from_slice(&[1.0, -2.0, 0.0]);
        x[0] - 2.0 * x[1]
    };
    let mut x = [0.5; 3];
    let outcome = minimum(3, linear, &mut x, [&[-1e3; 3], &[1e3; 3]], &Limits::default()).unwrap();
    assert_eq!((x, outcome.status), ([-1e3, 1e3, 0.5], Status::Stationary));
    let outcome = minimum(3, linear, &mut x, [&[], &[]], &Limits::default()).unwrap();
    assert!(outcome.value < -1e5);
}

/// Evaluations beside those of another program: `cargo test -p habitus-core lbfgsb -- --ignored --nocapture`.
#[test]
#[ignore = "prints figures"]
fn figures() {
    let limits = Limits {
        gradient: 1e-8,
        relative_decrease: 0.0,
        max_iterations: 2000,
        max_evaluations: 4000,
        ..Limits::default()
    };
    for n in [2, 3, 10, 50] {
        let mut x: Vec<f64> = (0..n).map(|i| if i % 2 == 0 { -1.2 } else { 1.0 }).collect();
        let found = minimum(n, valley, &mut x, [&[], &[]], &limits).unwrap();
        std::println!("{n} free: {found:?}");
    }
    for high in [[0.5, 2.0], [3.0, 2.0], [3.0, 0.25]] {
        let found = minimum(2, valley, &mut [-1.2, 1.0], [&[-2.0, -2.0], &high], &limits).unwrap();
        std::println!("{high:?}: {found:?}");
    }
}

/// `x A x / 2 - b x` with A = half half^T + ridge I.
#[derive(Debug)]
struct Quadratic {
    a: DMatrix<f64>,
    b: DVector<f64>,
    bounds: [Vec<f64>; 2],
    start: Vec<f64>,
}

impl Quadratic {
    fn value_and_gradient(&self, x: &[f64], gradient: &mut [f64]) -> f64 {
        let x = DVector::from_row_slice(x);
        let image = &self.a * &x;
        for (i, g) in gradient.iter_mut().enumerate() {
            *g = image[i] - self.b[i];
        }
        0.5 * x.dot(&image) - self.b.dot(&x)
    }

    /// The minimum by trying every set of active bounds.
    fn by_active_sets(&self) -> Vec<f64> {
        let n = self.b.len();
        let [low, high] = &self.bounds;
        'sets: for set in 0..3usize.pow(n as u32) {
            let kind: Vec<usize> = (0..n).map(|i| set / 3usize.pow(i as u32) % 3).collect();
            let free: Vec<usize> = (0..n).filter(|&i| kind[i] == 0).collect();
            let mut x = DVector::from_fn(n, |i, _| [0.0, low[i], high[i]][kind[i]]);
            if x.iter().any(|x| !x.is_finite()) {
                continue;
            }
            let rest = &self.b - &self.a * &x;
            let a = DMatrix::from_fn(free.len(), free.len(), |i, j| self.a[(free[i], free[j])]);
            let solution = a.cholesky().unwrap().solve(&DVector::from_fn(free.len(), |i, _| rest[free[i]]));
            for (k, &i) in free.iter().enumerate() {
                x[i] = solution[k];
            }
            let gradient = &self.a * &x - &self.b;
            for i in 0..n {
                let right = match kind[i] {
                    0 => x[i] >= low[i] && x[i] <= high[i],
                    1 => gradient[i] >= 0.0,
                    _ => gradient[i] <= 0.0,
                };
                if !right {
                    continue 'sets;
                }
            }
            return x.iter().copied().collect();
        }
        panic!("a convex quadratic has a minimum in a box");
    }
}

/// Up to `most` variables; bounds of every kind: none, one side, both, no room; starts inside, at bounds, outside.
fn quadratic(most: usize) -> impl Strategy<Value = Quadratic> {
    let entries = |count| proptest::collection::vec(-1.0f64..1.0, count);
    let variable = (0usize..6, -2.0f64..2.0, 0.0f64..2.0, -3.0f64..3.0);
    (1..=most, entries(most * most), entries(most), proptest::collection::vec(variable, most), -3.0f64..0.0).prop_map(
        move |(n, half, b, variables, ridge)| {
            let half = DMatrix::from_fn(n, n, |i, j| half[i * most + j]);
            let a = &half * half.transpose() + DMatrix::identity(n, n) * 10f64.powf(ridge);
            let infinity = f64::INFINITY;
            let range = |&(kind, low, width, _): &(usize, f64, f64, f64)| match kind {
                0 => (-infinity, infinity),
                1 => (low, infinity),
                2 => (-infinity, low),
                3 => (low, low),
                _ => (low, low + width),
            };
            let ranges: Vec<(f64, f64)> = variables[..n].iter().map(range).collect();
            let bounds = [ranges.iter().map(|r| r.0).collect(), ranges.iter().map(|r| r.1).collect()];
            let start = variables[..n].iter().map(|v| if v.0 == 5 { v.1 } else { v.3 }).collect();
            Quadratic { a, b: DVector::from_row_slice(&b[..n]) * 3.0, bounds, start }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    #[test]
    fn quadratics_as_by_active_sets(problem in quadratic(5), history in 1u32..9) {
        let n = problem.b.len();
        let mut x = problem.start.clone();
        let limits = Limits { history, max_iterations: 5000, max_evaluations: 10000, ..Limits::default() };
        let outcome = minimum(
            n, |x, g| problem.value_and_gradient(x, g), &mut x, [&problem.bounds[0], &problem.bounds[1]], &limits,
        ).unwrap();
        let expected = problem.by_active_sets();
        let best = problem.value_and_gradient(&expected, &mut vec![0.0; n]);
        prop_assert!(outcome.value <= best + 1e-10 * (1.0 + best.abs()), "{outcome:?} {x:?} {expected:?} {best}");
        prop_assert!(outcome.value <= outcome.start_value);
        let [low, high] = &problem.bounds;
        prop_assert!(x.iter().zip(low).zip(high).all(|((x, low), high)| low <= x && x <= high));
    }

    /// The conditions of Karush, Kuhn and Tucker, in more variables than there are pairs.
    #[test]
    fn stationary_within_bounds(problem in quadratic(24)) {
        let mut x = problem.start.clone();
        let limits = Limits { max_iterations: 5000, max_evaluations: 10000, gradient: 1e-7, ..Limits::default() };
        let outcome = minimum(
            x.len(), |x, g| problem.value_and_gradient(x, g), &mut x, [&problem.bounds[0], &problem.bounds[1]], &limits,
        ).unwrap();
        prop_assert!(outcome.status == Status::Stationary || outcome.gradient < 1e-4, "{outcome:?}");
        let mut gradient = vec![0.0; x.len()];
        problem.value_and_gradient(&x, &mut gradient);
        for (i, &g) in gradient.iter().enumerate() {
            let (low, high) = (problem.bounds[0][i], problem.bounds[1][i]);
            prop_assert!(x[i] >= low && x[i] <= high);
            prop_assert!(g.abs() <= 1e-4 || (g > 0.0 && x[i] - low <= 1e-4) || (g < 0.0 && high - x[i] <= 1e-4));
        }
    }

    #[test]
    fn valley_stays_inside(x in -2.0f64..2.0, y in -2.0f64..2.0, a in -2.0f64..2.0, b in 0.0f64..2.0, c in -2.0f64..2.0, d in 0.0f64..2.0) {
        let (low, high) = ([a, c], [a + b, c + d]);
        let mut point = [x, y];
        let outcome = minimum(2, valley, &mut point, [&low, &high], &Limits::default()).unwrap();
        prop_assert!(outcome.value <= outcome.start_value);
        prop_assert!(point[0] >= a && point[0] <= a + b && point[1] >= c && point[1] <= c + d);
        // No point of a grid is better.
        let mut best = f64::MAX;
        for k in 0..=40 {
            let x = a + b * f64::from(k) / 40.0;
            let y = (x * x).clamp(c, c + d);
            best = best.min(100.0 * (y - x * x) * (y - x * x) + (1.0 - x) * (1.0 - x));
        }
        let local = low[0] < 0.0;
        prop_assert!(local || outcome.value <= best + 1e-7, "{outcome:?} {best}");
    }

    /// A function that answers anything: no panic, no bound left, never above the start.
    #[test]
    fn hostile_functions(answers in proptest::collection::vec(any::<f32>(), 64), start in proptest::collection::vec(-1.0f32..1.0, 3)) {
        let mut turn = 0;
        let hostile = |_: &[f32], gradient: &mut [f32]| {
            let mut next = || { turn += 1; answers[turn % 64] };
            gradient.fill_with(&mut next);
            next()
        };
        let mut x = start.clone();
        if let Ok(outcome) = minimum(3, hostile, &mut x, [&[-1.0; 3], &[1.0; 3]], &Limits::default()) {
            prop_assert!(outcome.value <= outcome.start_value);
        }
        prop_assert!(x.iter().all(|x| (-1.0..=1.0).contains(x)));
    }
}
