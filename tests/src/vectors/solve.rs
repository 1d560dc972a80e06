//! Cholesky, Jacobi, Procrustes, rotations, Levenberg-Marquardt, each in `f32` and `f64`.

use super::stream::Stream;
use super::text::File;
use super::{lbfgsb, linalg};
use crate::reference::levenberg_marquardt::{Bounds, Equations, Limits, Problem, minimum};
use crate::reference::number::Number;
use crate::reference::placement::{Placement, rotation_matrix};
use crate::reference::{cholesky, eigen, procrustes};

pub fn text() -> String {
    let mut file = File::new(
        "Cholesky, Jacobi, Procrustes, rotations, Levenberg-Marquardt; QR, least squares, 3 x 3 SVD, measures of isometry; L-BFGS-B.",
    );
    kernels::<f32>(&mut file, "f32");
    kernels::<f64>(&mut file, "f64");
    linalg::cases(&mut file);
    lbfgsb::cases(&mut file);
    file.text()
}

fn kernels<R: Number>(file: &mut File, real: &str) {
    for n in [1, 2, 3, 7, 8, 9] {
        cholesky::<R>(file, real, n);
    }
    let pivot = [1.0, 2.0, 2.0, 1.0].map(R::of);
    let kernel = format!("cholesky_{real}");
    file.case(&kernel, "indefinite").integer("n", 2).numbers("matrix", &pivot).error([401, 1, 0]);
    file.case(&kernel, "nan").integer("n", 1).numbers("matrix", &[R::of(f64::NAN)]).error([401, 0, 0]);
    file.case(&kernel, "length").integer("n", 2).numbers("matrix", &pivot[..3]).error([101, 4, 3]);
    for n in [1, 2, 3, 4, 8] {
        eigenpairs::<R>(file, real, n);
    }
    let kernel = format!("eigenpairs_{real}");
    file.case(&kernel, "infinite").integer("n", 1).numbers("matrix", &[R::of(f64::INFINITY)]).error([103, 0, 0]);
    for count in [3, 4, 17] {
        for with_scale in [false, true] {
            procrustes::<R>(file, real, count, with_scale);
        }
    }
    for count in [3, 16, 17, 37] {
        aligned::<R>(file, real, count, count % 2 == 1);
    }
    if real == "f32" {
        // More than are summed in one go.
        aligned::<R>(file, real, 260, true);
    }
    let line: Vec<[R; 3]> = (0..5).map(|k| [R::of(f64::from(k)), R::of(2.0 * f64::from(k)), R::of(1.0)]).collect();
    file.case(&format!("procrustes_{real}"), "line")
        .numbers("sources", line.iter().flatten())
        .numbers("targets", line.iter().flatten())
        .numbers("weights", &[R::of(1.0); 5])
        .integer("with_scale", 0)
        .error([403, 0, 0]);
    // Around the change from series to formula, and beyond a full turn.
    for (name, size) in
        [("zero", 0.0), ("tiny", 1e-5), ("series", 0.006), ("f32_edge", 0.0131), ("medium", 0.7), ("far", 9.0)]
    {
        let vector: [R; 3] = Stream::of(name).point::<f64>(1.0).map(|value| R::of(value * size));
        let matrix = rotation_matrix(vector);
        file.case(&format!("rotation_{real}"), name)
            .numbers("vector", &vector)
            .numbers("matrix", matrix.iter().flatten());
    }
    for times in [1, 25] {
        moved::<R>(file, real, times);
    }
    minimised::<R>(file, real);
}

fn cholesky<R: Number>(file: &mut File, real: &str, n: usize) {
    let mut stream = Stream::of(&format!("cholesky {n}"));
    let half: Vec<Vec<R>> = (0..n).map(|_| stream.numbers(n, 1.0)).collect();
    let mut matrix = vec![vec![R::of(0.0); n]; n];
    for i in 0..n {
        for j in 0..n {
            let mut sum = R::of(if i == j { 1.0 } else { 0.0 });
            for k in 0..n {
                sum = sum + half[i.min(j)][k] * half[i.max(j)][k];
            }
            matrix[i][j] = sum;
        }
    }
    let rhs: Vec<R> = stream.numbers(n, 10.0);
    let factor = cholesky::factor(&matrix).expect("positive definite");
    let solution = cholesky::solution(&factor, &rhs);
    // The kernel leaves the strict upper triangle as it was.
    let left: Vec<Vec<R>> =
        (0..n).map(|i| (0..n).map(|j| if j > i { matrix[i][j] } else { factor[i][j] }).collect()).collect();
    file.case(&format!("cholesky_{real}"), &format!("size_{n}"))
        .integer("n", n)
        .rows("matrix", &matrix)
        .numbers("rhs", &rhs)
        .rows("factor", &left)
        .numbers("solution", &solution);
}

fn eigenpairs<R: Number>(file: &mut File, real: &str, n: usize) {
    let mut stream = Stream::of(&format!("eigenpairs {n}"));
    let entries: Vec<Vec<R>> = (0..n).map(|_| stream.numbers(n, 5.0)).collect();
    let random: Vec<Vec<R>> = (0..n).map(|i| (0..n).map(|j| entries[i.min(j)][i.max(j)]).collect()).collect();
    // Equal eigenvalues, a zero row, eigenvalues far apart.
    let special: Vec<Vec<R>> = (0..n)
        .map(|i| {
            (0..n)
                .map(|j| {
                    R::of(if i == j {
                        [2.0, 2.0, 0.0, 1e-9][i % 4]
                    } else if i + j == 1 {
                        1.0
                    } else {
                        0.0
                    })
                })
                .collect()
        })
        .collect();
    for (name, matrix) in [("random", random), ("special", special)] {
        let (diagonal, vectors) = eigen::eigenpairs(&matrix).expect("a matrix that converges");
        file.case(&format!("eigenpairs_{real}"), &format!("{name}_{n}"))
            .integer("n", n)
            .rows("matrix", &matrix)
            .rows("diagonal", &diagonal)
            .rows("vectors", &vectors);
    }
}

/// Points, and where a known placement has them, with noise.
fn pairs<R: Number>(stream: &mut Stream, count: usize) -> [Vec<[R; 3]>; 2] {
    let truth = Placement {
        scale: R::of(1.25),
        rotation: rotation_matrix(stream.point(2.0)),
        translation: stream.point(300.0),
    };
    let sources: Vec<[R; 3]> = stream.points(count, 100.0);
    let targets: Vec<[R; 3]> = sources
        .iter()
        .map(|&source| {
            let (moved, noise) = (truth.applied(source), stream.point::<R>(1.0));
            [0, 1, 2].map(|k| moved[k] + noise[k])
        })
        .collect();
    [sources, targets]
}

fn aligned<R: Number>(file: &mut File, real: &str, count: usize, with_scale: bool) {
    let [sources, targets] = pairs::<R>(&mut Stream::of(&format!("aligned {count}")), count);
    let found = procrustes::aligned(&sources, &targets, with_scale).expect("points that are not on a line");
    file.case(&format!("aligned_{real}"), &format!("points_{count}"))
        .numbers("sources", sources.iter().flatten())
        .numbers("targets", targets.iter().flatten())
        .integer("with_scale", usize::from(with_scale))
        .numbers("placement", &found.numbers());
}

fn procrustes<R: Number>(file: &mut File, real: &str, count: usize, with_scale: bool) {
    let mut stream = Stream::of(&format!("procrustes {count}"));
    let [sources, targets] = pairs::<R>(&mut stream, count);
    let weights: Vec<R> = (0..count).map(|_| R::of(1.0) + stream.number(0.75)).collect();
    let found = procrustes::placement(&sources, &targets, &weights, with_scale).expect("points that are not on a line");
    file.case(
        &format!("procrustes_{real}"),
        &format!("points_{count}_{}", if with_scale { "scaled" } else { "rigid" }),
    )
    .numbers("sources", sources.iter().flatten())
    .numbers("targets", targets.iter().flatten())
    .numbers("weights", &weights)
    .integer("with_scale", usize::from(with_scale))
    .numbers("placement", &found.numbers());
}

fn moved<R: Number>(file: &mut File, real: &str, times: usize) {
    let mut stream = Stream::of("moved");
    let mut place =
        Placement { scale: R::of(0.8), rotation: rotation_matrix(stream.point(2.0)), translation: stream.point(50.0) };
    let before = place.numbers();
    let (rotation, translation) = (stream.point::<R>(0.2), stream.point::<R>(3.0));
    let log_scale: R = stream.number(0.05);
    let point: [R; 3] = stream.point(80.0);
    for _ in 0..times {
        place = place.moved(rotation, translation, log_scale);
    }
    file.case(&format!("moved_{real}"), &format!("times_{times}"))
        .numbers("placement", &before)
        .numbers("rotation", &rotation)
        .numbers("translation", &translation)
        .number("log_scale", log_scale)
        .numbers("point", &point)
        .integer("times", times)
        .numbers("moved", &place.numbers())
        .numbers("applied", &place.applied(point))
        .numbers("inverse_applied", &place.inverse_applied(point))
        .numbers("inverse_rotated", &place.inverse_rotated(point));
}

/// Rosenbrock's valley: `r = (10 (y - x x), 1 - x)`.
struct Valley;

impl<R: Number> Problem<R> for Valley {
    fn equations(&mut self, x: &[R]) -> Option<Equations<R>> {
        let (x, y) = (x[0], x[1]);
        let (zero, one, ten) = (R::of(0.0), R::of(1.0), R::of(10.0));
        Some(summed(&[vec![-(R::of(20.0) * x), ten], vec![-one, zero]], &[ten * (y - x * x), one - x]))
    }
}

/// The curve `a exp(-b t) + c` through values at `t = 0, 1/4, 1/2, ...`.
struct Decay<R> {
    values: Vec<R>,
}

impl<R: Number> Problem<R> for Decay<R> {
    fn equations(&mut self, x: &[R]) -> Option<Equations<R>> {
        let (a, b, c) = (x[0], x[1], x[2]);
        let (mut rows, mut residuals) = (Vec::new(), Vec::new());
        for (k, &value) in self.values.iter().enumerate() {
            let t = R::of(0.25 * k as f64);
            let decayed = (-(b * t)).exp();
            rows.push(vec![decayed, -(a * t * decayed), R::of(1.0)]);
            residuals.push(a * decayed + c - value);
        }
        Some(summed(&rows, &residuals))
    }
}

fn summed<R: Number>(rows: &[Vec<R>], residuals: &[R]) -> Equations<R> {
    let product = |a: &dyn Fn(usize) -> R, b: &dyn Fn(usize) -> R| {
        let mut sum = R::of(0.0);
        for k in 0..rows.len() {
            sum = sum + a(k) * b(k);
        }
        sum
    };
    let n = rows[0].len();
    let jtj = (0..n).map(|p| (0..n).map(|q| product(&|k| rows[k][p], &|k| rows[k][q])).collect()).collect();
    let jtr = (0..n).map(|p| product(&|k| rows[k][p], &|k| residuals[k])).collect();
    (product(&|k| residuals[k], &|k| residuals[k]), jtj, jtr)
}

fn minimised<R: Number>(file: &mut File, real: &str) {
    let values: Vec<R> = {
        let mut stream = Stream::of("decay");
        (0..12).map(|k| R::of(3.0 * (-0.7 * 0.25 * f64::from(k)).exp() + 0.5) + stream.number(0.01)).collect()
    };
    let (near, far) = (R::of(-2.0), R::of(2.0));
    let half = R::of(0.5);
    let free: &[R] = &[];
    let vector = |values: &[f64]| values.iter().map(|&value| R::of(value)).collect::<Vec<R>>();
    for (name, problem, start, lower, upper, iterations) in [
        ("valley_free", "valley", vector(&[-1.2, 1.0]), free.to_vec(), free.to_vec(), 50),
        ("valley_five", "valley", vector(&[-1.2, 1.0]), free.to_vec(), free.to_vec(), 5),
        ("valley_bounded", "valley", vector(&[-1.2, 1.0]), vec![near, near], vec![half, far], 50),
        ("valley_outside", "valley", vector(&[-7.0, 9.0]), vec![near, near], vec![far, far], 50),
        ("valley_corner", "valley", vector(&[-1.0, 0.0]), vec![near, near], vector(&[-0.5, 0.1]), 50),
        ("valley_at_minimum", "valley", vector(&[1.0, 1.0]), free.to_vec(), free.to_vec(), 50),
        ("decay_free", "decay", vector(&[1.0, 1.0, 0.0]), free.to_vec(), free.to_vec(), 50),
        ("decay_far", "decay", vector(&[20.0, 5.0, -4.0]), free.to_vec(), free.to_vec(), 80),
        ("decay_bounded", "decay", vector(&[1.0, 1.0, 0.0]), vector(&[0.0, 0.9, 0.0]), vector(&[5.0, 3.0, 0.4]), 50),
    ] {
        let limits =
            Limits { max_iterations: iterations, relative_decrease: R::EPSILON * R::of(16.0), damping: R::of(1e-3) };
        let bounds = (!lower.is_empty()).then(|| Bounds { lower: lower.clone(), upper: upper.clone() });
        let found = match problem {
            "valley" => minimum(&mut Valley, &start, bounds.as_ref(), &limits),
            _ => minimum(&mut Decay { values: values.clone() }, &start, bounds.as_ref(), &limits),
        };
        let found = found.expect("finite at the start");
        let mut case = file.case(&format!("minimised_{real}"), name);
        case.word("problem", problem).numbers("start", &start);
        if bounds.is_some() {
            case.numbers("lower", &lower).numbers("upper", &upper);
        }
        if problem == "decay" {
            case.numbers("values", &values);
        }
        case.integer("max_iterations", iterations as usize)
            .number("relative_decrease", limits.relative_decrease)
            .number("damping", limits.damping)
            .integers("iterations_status", [found.iterations, found.status])
            .numbers("energy_start", &[found.energy, found.start_energy])
            .numbers("result", &found.x);
    }
    for (name, lower, refusal) in [("crossed", 3.0, [104, 0, 0]), ("nan_bound", f64::NAN, [104, 0, 0])] {
        file.case(&format!("minimised_{real}"), name)
            .word("problem", "valley")
            .numbers("start", &[near, near])
            .numbers("lower", &[near, R::of(lower)])
            .numbers("upper", &[far, far])
            .integer("max_iterations", 5)
            .number("relative_decrease", half)
            .number("damping", half)
            .error(refusal);
    }
}
