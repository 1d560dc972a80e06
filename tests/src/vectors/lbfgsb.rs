//! L-BFGS-B in `f32` and `f64`.

use super::text::File;
use crate::reference::lbfgsb::{Limits, minimum};
use crate::reference::number::Number;

pub fn cases(file: &mut File) {
    kernels::<f32>(file, "f32");
    kernels::<f64>(file, "f64");
}

/// The chained valley: `100 (x_i+1 - x_i x_i)^2 + (1 - x_i)^2`, summed from zero.
fn chain<R: Number>(x: &[R]) -> (R, Vec<R>) {
    let mut value = R::of(0.0);
    let mut gradient = vec![R::of(0.0); x.len()];
    for i in 0..x.len() - 1 {
        let (up, off) = (x[i + 1] - x[i] * x[i], R::of(1.0) - x[i]);
        value = value + (R::of(100.0) * up * up + off * off);
        gradient[i] = gradient[i] - (R::of(400.0) * x[i] * up + R::of(2.0) * off);
        gradient[i + 1] = gradient[i + 1] + R::of(200.0) * up;
    }
    (value, gradient)
}

fn kernels<R: Number>(file: &mut File, real: &str) {
    let infinity = f64::INFINITY;
    for (name, start, lower, upper, history, iterations) in [
        ("two_free", vec![-1.2, 1.0], vec![], vec![], 5, 30),
        ("nine_free", vec![-1.2, 1.0, -1.2, 1.0, -1.2, 1.0, -1.2, 1.0, -1.2], vec![], vec![], 3, 25),
        ("two_bounded", vec![-1.2, 1.0], vec![-2.0, -2.0], vec![0.5, 2.0], 5, 40),
        ("far_outside", vec![40.0, -17.0], vec![-2.0, -infinity], vec![3.0, 0.25], 2, 40),
        ("corner", vec![-1.0, 0.0], vec![-2.0, -2.0], vec![-0.5, 0.1], 5, 40),
        ("no_room", vec![5.0, 5.0, 0.0], vec![0.5, 0.0, 0.25], vec![0.5, 4.0, 0.25], 5, 40),
        (
            "seven_bounded",
            vec![-1.2, 1.0, 0.5, 0.0, 2.0, -1.0, 1.0],
            vec![-1.5, 0.25, -2.0, -infinity, -2.0, -0.5, 0.75],
            vec![0.75, 2.0, 0.4, 1.0, infinity, 0.9, 0.8],
            4,
            40,
        ),
    ] {
        let vector = |values: &[f64]| values.iter().map(|&value| R::of(value)).collect::<Vec<R>>();
        let (start, lower, upper) = (vector(&start), vector(&lower), vector(&upper));
        let limits = Limits {
            max_iterations: iterations,
            max_evaluations: 100,
            relative_decrease: R::EPSILON * R::of(16.0),
            gradient: R::of(1e-6),
            history,
        };
        let bounds = (!lower.is_empty()).then_some((&lower[..], &upper[..]));
        let found = minimum(&mut |x| chain(x), &start, bounds, &limits).expect("bounds in order");
        let mut case = file.case(&format!("lbfgsb_{real}"), name);
        case.numbers("start", &start);
        if bounds.is_some() {
            case.numbers("lower", &lower).numbers("upper", &upper);
        }
        case.integer("max_iterations", iterations as usize)
            .integer("history", history)
            .integers("counts", [found.iterations, found.evaluations, found.status])
            .numbers("values", &[found.value, found.start_value, found.gradient])
            .numbers("result", &found.x);
    }
    file.case(&format!("lbfgsb_{real}"), "crossed")
        .numbers("start", &[R::of(0.5); 2])
        .numbers("lower", &[R::of(0.0), R::of(2.0)])
        .numbers("upper", &[R::of(1.0); 2])
        .integer("max_iterations", 5)
        .integer("history", 2)
        .error([104, 0, 0]);
}
