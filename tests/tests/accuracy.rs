//! Accuracy of the `f32` kernels against the same formula in `f64`, on random models, with the bound of rounding error analysis.

use habitus_core::format::Model;
use habitus_core::generator::{Generator, Weights};
use habitus_tests::reference::bilinear::Bilinear;
use habitus_tests::reference::model_file::{Extras, bytes, sections};
use habitus_tests::reference::normal_equations::{Frame, Sample, equations};
use habitus_tests::reference::placement::Placement;
use habitus_tests::vectors::Stream;

fn model(name: &str, n: usize, di: usize, dp: usize, linear: bool) -> Bilinear {
    let mut stream = Stream::of(name);
    let mut term = |size: f64| stream.points::<f32>(n, size);
    Bilinear {
        offset: term(100.0),
        pose_linear: linear.then(|| (0..dp).map(|_| term(10.0)).collect()),
        identity_linear: linear.then(|| (0..di).map(|_| term(10.0)).collect()),
        bilinear: (0..di).map(|_| (0..dp).map(|_| term(10.0)).collect()).collect(),
    }
}

/// Equation 8.2 in `f64` for one coordinate, and the sum of the magnitudes of its terms.
fn in_double(model: &Bilinear, x: &[f32], y: &[f32], v: usize, axis: usize) -> (f64, f64) {
    let term = |points: &Vec<[f32; 3]>| f64::from(points[v][axis]);
    let mut terms = vec![term(&model.offset)];
    for (j, b) in model.pose_linear.iter().flatten().enumerate() {
        terms.push(f64::from(y[j]) * term(b));
    }
    for (i, a) in model.identity_linear.iter().flatten().enumerate() {
        terms.push(f64::from(x[i]) * term(a));
    }
    for (i, row) in model.bilinear.iter().enumerate() {
        for (j, m) in row.iter().enumerate() {
            terms.push(f64::from(x[i]) * f64::from(y[j]) * term(m));
        }
    }
    (terms.iter().sum(), terms.iter().map(|term| term.abs()).sum())
}

/// Every term is rounded in at most `d_id + 2 d_pose + 4` operations one after the other, hence
/// `|error| <= (d_id + 2 d_pose + 4) u sum |term|`, with `u = 2^-24` (N. J. Higham, Accuracy and Stability of Numerical Algorithms, section 3.1).
#[test]
fn evaluation_against_double_precision() {
    let mut worst = 0.0f64;
    for (case, &(di, dp, linear)) in [(2, 2, true), (20, 10, false), (40, 10, true), (59, 10, false)].iter().enumerate()
    {
        let n = 33;
        let model = model(&format!("accuracy {case}"), n, di, dp, linear);
        let file = bytes(&model, &sections(&model, &Extras::default()));
        let generator = Model::open(&file).unwrap().bilinear().unwrap();
        let mut stream = Stream::of("accuracy weights");
        for _ in 0..10 {
            let (x, y): (Vec<f32>, Vec<f32>) = (stream.numbers(di, 2.0), stream.numbers(dp, 2.0));
            let mut out = vec![0.0; 3 * n];
            generator.evaluate(Weights { identity: &x, pose: &y }, 0..n, &mut out).unwrap();
            for (k, &found) in out.iter().enumerate() {
                let (exact, magnitude) = in_double(&model, &x, &y, k / 3, k % 3);
                let error = (f64::from(found) - exact).abs();
                let bound = (di + 2 * dp + 4) as f64 * f64::from(f32::EPSILON) / 2.0 * magnitude;
                assert!(error <= bound, "{error} > {bound} at {k}, dims {di}, {dp}");
                worst = worst.max(error / bound);
            }
        }
    }
    println!("evaluation: largest error is {worst:.3} of the bound");
    // A bound that is never approached, or errors of zero, would mean that the wrong thing is compared.
    assert!(worst > 1e-3);
}

/// The normal equations against sums in `f64` of the reference's rows: entry (p, q) within `(24 + groups) u sum |row_p row_q|`, seen through a fit
/// of the energy alone, whose terms are all positive: relative error at most `(24 + groups + 12) u` with the rounding of the residuals in units
/// of the largest coordinate.
#[test]
fn energy_against_double_precision() {
    let (di, dp, n) = (6, 3, 200);
    let model = model("energy", n, di, dp, true);
    let mut stream = Stream::of("energy samples");
    let (x, y): (Vec<f32>, Vec<f32>) = (stream.numbers(di, 1.0), stream.numbers(dp, 1.0));
    let samples: Vec<Option<Sample>> = (0..n)
        .map(|v| {
            let target = stream.point(100.0);
            Some(Sample { corners: [v as u32, 0, 0], barycentric: [1.0, 0.0, 0.0], target, normal: None, weight: 1.0 })
        })
        .collect();
    let (energy, _, _) = equations(&model, &x, &y, &samples, &Placement::identity(), Frame::Fixed);
    let mut exact = 0.0f64;
    let mut slack = 0.0f64;
    let u = f64::from(f32::EPSILON) / 2.0;
    for (v, sample) in samples.iter().flatten().enumerate() {
        for axis in 0..3 {
            let (value, magnitude) = in_double(&model, &x, &y, v, axis);
            let residual = value - f64::from(sample.target[axis]);
            let rounding = (di + 2 * dp + 5) as f64 * u * (magnitude + f64::from(sample.target[axis]).abs());
            exact += residual * residual;
            slack += 2.0 * residual.abs() * rounding + rounding * rounding;
        }
    }
    let groups = (3 * n).div_ceil(24);
    let bound = slack + (24 + groups + 2) as f64 * u * exact;
    let error = (f64::from(energy) - exact).abs();
    println!("energy: error {error:.3e}, bound {bound:.3e}, energy {exact:.3e}");
    assert!(error <= bound && bound < 1e-4 * exact);
}
