//! QR, least squares, 3 x 3 singular values and polar factors, measures of isometry, each in `f32` and `f64`.

use super::stream::Stream;
use super::text::File;
use crate::reference::number::Number;
use crate::reference::{isometry, qr, svd3};

pub fn cases(file: &mut File) {
    kernels::<f32>(file, "f32");
    kernels::<f64>(file, "f64");
}

fn kernels<R: Number>(file: &mut File, real: &str) {
    for (m, n) in [(1, 1), (3, 2), (4, 4), (9, 3), (17, 5)] {
        for pivoted in [false, true] {
            factors::<R>(file, real, m, n, pivoted);
        }
    }
    // The third column is the sum of the others.
    let rows = [[1.0, 0.5, 1.5], [0.25, 1.0, 1.25], [1.0, 1.0, 2.0], [2.0, -1.0, 1.0]];
    let dependent: Vec<Vec<R>> = rows.iter().map(|row| row.iter().map(|&x| R::of(x)).collect()).collect();
    let b: Vec<R> = [1.0, 2.0, 3.0, 0.0].map(R::of).to_vec();
    for pivoted in [false, true] {
        solution(file, real, "dependent", &dependent, 3, &b, pivoted);
    }
    file.case(&format!("qr_{real}"), "wide")
        .integer("n", 2)
        .numbers("matrix", &[R::of(1.0); 2])
        .numbers("b", &[R::of(1.0)])
        .integer("pivoted", 0)
        .error([101, 2, 1]);
    let infinite = [R::of(1.0), R::of(f64::INFINITY)];
    file.case(&format!("qr_{real}"), "infinite")
        .integer("n", 1)
        .numbers("matrix", &infinite)
        .numbers("b", &[R::of(1.0); 2])
        .integer("pivoted", 0)
        .error([103, 1, 0]);
    singular_values::<R>(file, real);
    triangles::<R>(file, real);
    samples::<R>(file, real);
}

fn factors<R: Number>(file: &mut File, real: &str, m: usize, n: usize, pivoted: bool) {
    let mut stream = Stream::of(&format!("qr {m} {n}"));
    let a: Vec<Vec<R>> = (0..m).map(|_| stream.numbers(n, 10.0)).collect();
    let b: Vec<R> = stream.numbers(m, 10.0);
    let found = qr::factors(&a, n, pivoted).expect("finite");
    let name = format!("size_{m}_{n}{}", if pivoted { "_pivoted" } else { "" });
    file.case(&format!("qr_{real}"), &name)
        .integer("n", n)
        .rows("matrix", &a)
        .numbers("b", &b)
        .integer("pivoted", usize::from(pivoted))
        .rows("factors", &found.a)
        .numbers("tau", &found.tau)
        .integers("order", found.order.iter().take(if pivoted { n } else { 0 }).map(|&column| column as u32))
        .numbers("transposed", &found.transpose_applied(&b))
        .numbers("applied", &found.applied(&b));
    solution(file, real, &format!("size_{m}_{n}"), &a, n, &b, pivoted);
}

fn solution<R: Number>(file: &mut File, real: &str, name: &str, a: &[Vec<R>], n: usize, b: &[R], pivoted: bool) {
    let tolerance = R::EPSILON * R::of(32.0);
    let found = qr::least_squares(a, n, b, pivoted, tolerance);
    let mut case =
        file.case(&format!("least_squares_{real}"), &format!("{name}{}", if pivoted { "_pivoted" } else { "" }));
    case.integer("n", n)
        .rows("matrix", a)
        .numbers("b", b)
        .integer("pivoted", usize::from(pivoted))
        .number("tolerance", tolerance);
    match found {
        Ok(found) => case
            .numbers("x", &found.x)
            .integer("rank", found.rank)
            .number("residual", found.residual)
            .numbers("rotated", &found.rotated),
        Err(refusal) => case.error(refusal),
    };
}

fn singular_values<R: Number>(file: &mut File, real: &str) {
    let mut stream = Stream::of("svd3");
    let outer: [[f64; 3]; 3] = [1.0, -2.0, 0.5].map(|x| [0.3, 0.1, 0.7].map(|y| x * y));
    let random: [[f64; 3]; 3] = [0; 3].map(|_| stream.point(5.0));
    let diagonal = |x: f64, y: f64, z: f64| [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]];
    for (name, matrix) in [
        ("random", random),
        ("mirrored", random.map(|row| row.map(|x| -x))),
        ("large", random.map(|row| row.map(|x| x * 1e36))),
        ("small", random.map(|row| row.map(|x| x * 1e-36))),
        ("graded", random.map(|[x, y, z]| [x * 1e-9, y, z * 1e-5])),
        ("rank_two", [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]),
        ("rank_one", outer),
        ("rank_one_exact", [[1.0, -1.0, 0.0], [2.0, -2.0, 0.0], [-1.0, 1.0, 0.0]]),
        ("zero", [[0.0; 3]; 3]),
        ("equal", diagonal(2.0, 2.0, 2.0)),
        ("nearly_equal", diagonal(1.0, 1.0 + 1e-7, 1.0 - 1e-7)),
        ("open", diagonal(3.0, 1.0, -1.0)),
        ("of_reflection", diagonal(1.0, 2.0, -0.5)),
    ] {
        let matrix = matrix.map(|row| row.map(R::of));
        let found = svd3::svd3(&matrix).expect("finite");
        let polar = svd3::polar(&matrix).expect("finite");
        file.case(&format!("svd3_{real}"), name)
            .numbers("matrix", matrix.iter().flatten())
            .numbers("u", found.u.iter().flatten())
            .numbers("singular", &found.singular)
            .numbers("v", found.v.iter().flatten())
            .numbers("rotation", polar.rotation.iter().flatten())
            .numbers("stretch", polar.stretch.iter().flatten())
            .integers("nearest", [polar.nearest]);
    }
    let far = if R::of(1e300).is_finite() { 1.7e308 } else { 3e38 };
    for (name, matrix, refusal) in
        [("nan", diagonal(1.0, f64::NAN, 1.0), [103, 4, 0]), ("too_large", [[far; 3]; 3], [103, 9, 0])]
    {
        let matrix = matrix.map(|row| row.map(R::of));
        file.case(&format!("svd3_{real}"), name).numbers("matrix", matrix.iter().flatten()).error(refusal);
    }
}

fn triangles<R: Number>(file: &mut File, real: &str) {
    let mut stream = Stream::of("triangles");
    let random: [[f64; 3]; 3] = [0; 3].map(|_| stream.point(20.0));
    for (name, corners, lengths) in [
        ("random", random, [12.0, 9.5, 17.25]),
        ("scaled", random, [3.0, 4.0, 5.0]),
        ("needle", [[0.0; 3], [100.0, 0.0, 0.0], [50.0, 0.001, 0.0]], [1000.0, 999.5, 0.75]),
        ("line", [[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]], [3.0, 4.0, 5.0]),
        ("impossible", random, [1.0, 1.0, 3.0]),
    ] {
        let (corners, lengths) = (corners.map(|corner| corner.map(R::of)), lengths.map(R::of));
        let (from, to) = (isometry::metric_of_corners(corners), isometry::metric_of_lengths(lengths));
        let mut case = file.case(&format!("isometry_triangles_{real}"), name);
        case.numbers("corners", corners.iter().flatten()).numbers("lengths", &lengths);
        let found =
            isometry::edges(from).and_then(|from| isometry::edges(to).and_then(|to| isometry::jacobian(from, to)));
        match found {
            Ok(jacobian) => {
                let singular = isometry::singular_values(&jacobian);
                case.numbers("metrics", from.iter().chain(&to))
                    .numbers("jacobian", jacobian.iter().flatten())
                    .numbers("strain", &isometry::green_strain(&jacobian))
                    .number("local", isometry::local(&jacobian))
                    .numbers("singular", &singular)
                    .numbers("factors", &isometry::factors(singular))
            }
            Err(refusal) => case.error(refusal),
        };
    }
}

fn samples<R: Number>(file: &mut File, real: &str) {
    for (name, count, height) in [("three", 3, 1.0), ("four", 4, 1.0), ("many", 17, 0.6), ("line", 9, 0.01)] {
        let mut stream = Stream::of(&format!("samples {count}"));
        let spacing = R::of(0.75);
        let samples: Vec<([R; 2], [R; 2], R)> = (0..count)
            .map(|_| {
                let (x, y): (f64, f64) = (stream.number(2.0), stream.number(2.0 * height));
                let b = [x, y].map(R::of);
                let a = [0.9 * x - 0.2 * y + stream.number::<f64>(0.01), 0.3 * x + 1.1 * y].map(R::of);
                (b, a, isometry::weight(b, spacing))
            })
            .collect();
        let mut case = file.case(&format!("isometry_samples_{real}"), name);
        case.numbers("samples", samples.iter().flat_map(|(b, a, _)| b.iter().chain(a)))
            .number("spacing", spacing)
            .numbers("weights", samples.iter().map(|(.., weight)| weight));
        match isometry::fit(&samples) {
            Ok(jacobian) => case.integers("fit", [2]).numbers("jacobian", jacobian.iter().flatten()),
            Err(unfit) => case.integers("fit", [unfit]),
        };
    }
}
