//! Accuracy of the `f32` kernels against the same formula in `f64`, on random models, with the bound of rounding error analysis.

// Indices are what the formulas are written in.
#![allow(clippy::needless_range_loop)]

use habitus_core::format::Model;
use habitus_core::generator::{Generator, Weights};
use habitus_core::wavelet::transform::{analysis, analysis_req};
use habitus_core::wavelet::window::{window, window_req};
use habitus_tests::reference::bilinear::Bilinear;
use habitus_tests::reference::model_file::{Extras, bytes, file, sections};
use habitus_tests::reference::normal_equations::{Frame, Sample, equations};
use habitus_tests::reference::number::Number;
use habitus_tests::reference::placement::Placement;
use habitus_tests::reference::skin_file::{skinned_head, skinned_sections};
use habitus_tests::reference::skinned::Skinned;
use habitus_tests::reference::storage::Storage;
use habitus_tests::reference::wavelet::{self, Grid, Wavelet};
use habitus_tests::vectors::{Shape, Stream, multiscale, skinned};

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

/// The bodies whose derivatives and values are compared: both blends, corrective terms, joints that follow and that stay.
fn bodies() -> Vec<(&'static str, Skinned)> {
    let plain = Shape { joints: 5, corrected: false, dual: false, follows: true, storage: Storage::F32 };
    [
        ("linear blend", plain),
        ("linear blend, corrected", Shape { corrected: true, ..plain }),
        ("dual quaternions", Shape { dual: true, ..plain }),
        ("dual quaternions, corrected, in bytes", Shape { dual: true, corrected: true, storage: Storage::I8, ..plain }),
        ("joints of the mean, in half precision", Shape { follows: false, storage: Storage::F16, ..plain }),
    ]
    .map(|(name, shape)| (name, skinned(name, 21, 2, shape)))
    .into()
}

fn wide(values: &[f32]) -> Vec<f64> {
    values.iter().map(|&value| value.into()).collect()
}

/// The derivatives of the reference in `f64` are those of its values: central differences of 1e-5 rad and 1e-4 standard deviations.
#[test]
fn derivatives_of_bodies_against_differences() {
    let mut worst = 0.0f64;
    for (name, body) in bodies() {
        let mut stream = Stream::of(name);
        for _ in 0..200 {
            let (z, theta): (Vec<f64>, Vec<f64>) = (stream.numbers(2, 2.0), stream.numbers(9, 1.5));
            let v = stream.below(21);
            let found = body.linearised(&z, &theta, v);
            let size = found.derivatives.iter().flatten().fold(0.0f64, |size, value| size.max(value.abs()));
            for (k, column) in found.derivatives.iter().enumerate() {
                let moved = |by: f64| {
                    let (mut z, mut theta) = (z.clone(), theta.clone());
                    if k < 2 {
                        z[k] += by
                    } else {
                        theta[k - 2] += by
                    }
                    body.value(&z, &theta, v)
                };
                let step = if k < 2 { 1e-4 } else { 1e-5 };
                let (above, below) = (moved(step), moved(-step));
                for axis in 0..3 {
                    let error = ((above[axis] - below[axis]) / (2.0 * step) - column[axis]).abs() / size;
                    assert!(error < 1e-6, "{name}: weight {k}: {error:e} of {size}");
                    worst = worst.max(error);
                }
            }
        }
    }
    println!("derivatives of bodies: largest relative error of the differences {worst:.2e}");
    assert!(worst > 0.0);
}

/// The kernel in `f32` against the reference in `f64` at the same weights: bodies of 600 mm with joints as far apart, angles to 1.5.
#[test]
fn bodies_against_double_precision() {
    for (name, body) in bodies() {
        let file = file(&skinned_head(&body), &skinned_sections(&body, &Extras::default()));
        let generator = Model::open(&file).unwrap().generator().unwrap();
        let mut stream = Stream::of(name);
        let (mut by_value, mut by_derivative) = (0.0f64, 0.0f64);
        for _ in 0..40 {
            let (z, theta): (Vec<f32>, Vec<f32>) = (stream.numbers(2, 2.0), stream.numbers(9, 1.5));
            let mut state = vec![0.0; generator.state_req(true).numbers()];
            let at = generator.begin(Weights { identity: &z, pose: &theta }, true, &mut state).unwrap();
            let mut jacobian = vec![[0.0; 3]; 11];
            for v in 0..21 {
                let value = generator.linearised_vertex_unchecked(at, v, &mut jacobian).unwrap();
                let exact = body.linearised(&wide(&z), &wide(&theta), v);
                for axis in 0..3 {
                    by_value = by_value.max((f64::from(value[axis]) - exact.value[axis]).abs());
                    for (found, exact) in jacobian.iter().zip(&exact.derivatives) {
                        by_derivative = by_derivative.max((f64::from(found[axis]) - exact[axis]).abs());
                    }
                }
            }
        }
        println!("{name}: largest error {by_value:.2e} mm, of a derivative {by_derivative:.2e} mm");
        assert!(by_value < 5e-4 && by_derivative < 5e-4, "{name}: {by_value:e} {by_derivative:e}");
        assert!(by_value > 1e-6 && by_derivative > 1e-6, "{name}: nothing was compared");
    }
}

/// With joints of the mean a body is bilinear (eq. 8.2) in `(1, z)` and the bone transforms: its tensor, written out, gives the same shape.
#[test]
fn joints_of_the_mean_are_an_explicit_tensor() {
    let (n, d, joints) = (50, 2, 5);
    let shape = Shape { joints, corrected: false, dual: false, follows: false, storage: Storage::F32 };
    let body = skinned("toy", n, d, shape);
    // T[v][j][c][l]: what column c of joint j's [R | t] gives vertex v through component l (0: the mean).
    let entry = |v: usize, j: usize, c: usize, l: usize| -> f64 {
        let weight = f64::from(body.weights[j][v]);
        match (c, l) {
            (3, 0) => weight,
            (3, _) => 0.0,
            (_, 0) => weight * f64::from(body.rest.mean[v][c]),
            _ => weight * body.rest.components[l - 1].decoded::<f64>(v)[c],
        }
    };
    let mut stream = Stream::of("toy weights");
    let mut worst = 0.0f64;
    for _ in 0..20 {
        let (z, theta): (Vec<f64>, Vec<f64>) = (stream.numbers(d, 2.0), stream.numbers(9, 1.5));
        let with_one: Vec<f64> = std::iter::once(1.0).chain(z.iter().copied()).collect();
        let motions = body.motions(&z, &theta);
        for v in 0..n {
            let value = body.value(&z, &theta, v);
            for axis in 0..3 {
                let mut sum = 0.0;
                for (j, (rotation, translation)) in motions.iter().enumerate() {
                    for c in 0..4 {
                        let transform = if c == 3 { translation[axis] } else { rotation[axis][c] };
                        for (l, z) in with_one.iter().enumerate() {
                            sum += entry(v, j, c, l) * transform * z;
                        }
                    }
                }
                worst = worst.max((sum - value[axis]).abs() / 1000.0);
            }
        }
    }
    println!("explicit tensor: largest error {worst:.2e} of a body of a metre");
    assert!(worst < 1e-12);
}

/// The weights of a vertex sum to one; so a pose of zero gives the rest shape.
#[test]
fn weights_sum_to_one_and_a_pose_of_zero_rests() {
    for (name, body) in bodies() {
        for v in 0..21 {
            let sum: f64 = body.weights.iter().map(|weights| f64::from(weights[v])).sum();
            assert!((sum - 1.0).abs() < 2.0 * f64::from(f32::EPSILON), "{name}: {sum}");
            let z = [1.5f64, -0.75];
            let (posed, rest) = (body.value(&z, &[0.0; 9], v), body.rest.value(&z, v));
            for axis in 0..3 {
                // A blend of matrices scales by the sum of the weights, one of dual quaternions does not.
                let bound = if body.dual { 0.0 } else { (sum - 1.0).abs() * rest[axis].abs() };
                let error = (posed[axis] - rest[axis]).abs();
                assert!(error <= bound + 1e-12 * 1000.0, "{name}: {error:e}");
            }
        }
    }
}

/// A grid, a wavelet and samples by a stream.
fn wavelet_case(stream: &mut Stream) -> (Grid, Wavelet) {
    let base = [2 + stream.below(4), 2 + stream.below(4)];
    let grid = Grid { base, levels: stream.below(4) };
    (grid, Wavelet::ALL[stream.below(2)])
}

fn core_of(grid: &Grid, wavelet: Wavelet) -> (habitus_core::wavelet::Grid, habitus_core::wavelet::Wavelet) {
    let core = habitus_core::wavelet::Grid::new(grid.base[0], grid.base[1], grid.levels).unwrap();
    let kind = match wavelet {
        Wavelet::Cubic => habitus_core::wavelet::Wavelet::Cubic,
        Wavelet::Bilinear => habitus_core::wavelet::Wavelet::Bilinear,
    };
    (core, kind)
}

/// Analysis, synthesis at every level, a window of it and the order of the coefficients against the reference, bit by bit, on random grids.
fn transforms<R: Number + habitus_core::Real + Default>(name: &str) {
    let mut stream = Stream::of(name);
    let hex = |numbers: &[R]| numbers.iter().map(|number| number.hexadecimal()).collect::<Vec<_>>();
    for _ in 0..60 {
        let (grid, wavelet) = wavelet_case(&mut stream);
        let (core, kind) = core_of(&grid, wavelet);
        for (q, node) in grid.nodes().iter().enumerate() {
            let found = core.node_of(q).unwrap();
            assert_eq!((found.level, found.column, found.row), (node.level, node.column, node.row));
        }
        let samples: Vec<R> = stream.numbers(grid.len(), 10.0);
        let expected = wavelet::analysis(&grid, wavelet, &samples);
        let mut coefficients = vec![R::default(); grid.len()];
        let mut workspace = vec![R::default(); analysis_req(&core).numbers()];
        analysis(&core, kind, &samples, &mut coefficients, &mut workspace).unwrap();
        assert_eq!(hex(&coefficients), hex(&expected), "{grid:?} {wavelet:?}");
        for level in 0..=grid.levels {
            let whole = wavelet::synthesis(&grid, wavelet, level, &coefficients);
            let (w, h) = (grid.width(level), grid.height(level));
            let (left, top) = (stream.below(w), stream.below(h));
            let (right, bottom) = (left + 1 + stream.below(w - left), top + 1 + stream.below(h - top));
            for ([left, right], [top, bottom]) in [([0, w], [0, h]), ([left, right], [top, bottom])] {
                let mut out = vec![R::default(); (right - left) * (bottom - top)];
                let (columns, rows) = (left..right, top..bottom);
                let mut workspace = vec![R::default(); window_req(&core, level, &columns, &rows).numbers()];
                window(&core, kind, level, columns, rows, &coefficients, &mut out, &mut workspace).unwrap();
                let expected = wavelet::cut(&whole, w, [left, right], [top, bottom]);
                assert_eq!(hex(&out), hex(&expected), "{grid:?} {wavelet:?} level {level}");
            }
        }
    }
}

#[test]
fn wavelet_transforms_have_the_bits_of_the_reference() {
    transforms::<f32>("transforms of f32");
    transforms::<f64>("transforms of f64");
}

/// A constant is its own base and has no details; the transform is linear and comes back, in `f64`.
#[test]
fn wavelet_transforms_of_the_reference_are_what_they_should_be() {
    let mut stream = Stream::of("properties of transforms");
    for _ in 0..40 {
        let (grid, wavelet) = wavelet_case(&mut stream);
        let n = grid.len();
        let coarse = grid.count(0);
        let of_constant = wavelet::analysis(&grid, wavelet, &vec![3.0f64; n]);
        assert!(of_constant[..coarse].iter().all(|value| (value - 3.0).abs() < 1e-12));
        assert!(of_constant[coarse..].iter().all(|value| value.abs() < 1e-12));
        let (a, b): (Vec<f64>, Vec<f64>) = (stream.numbers(n, 1.0), stream.numbers(n, 1.0));
        let sum: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - 2.0 * b).collect();
        let [a, b, sum] = [a, b, sum].map(|samples| wavelet::analysis(&grid, wavelet, &samples));
        assert!((0..n).all(|k| (a[k] - 2.0 * b[k] - sum[k]).abs() < 1e-10));
        let samples: Vec<f64> = stream.numbers(n, 1.0);
        let back = wavelet::synthesis(&grid, wavelet, grid.levels, &wavelet::analysis(&grid, wavelet, &samples));
        assert!(samples.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}

/// Wavelet models of 100 mm in `f32` against the same formula in `f64`, and derivatives of the reference in `f64` against its values, which are linear in a single weight.
#[test]
fn wavelet_models_against_double_precision() {
    let (mut worst, mut sloped) = (0.0f64, 0.0f64);
    for (name, storage) in
        [("wavelets f32", Storage::F32), ("wavelets f16", Storage::F16), ("wavelets i8", Storage::I8)]
    {
        for wavelet in Wavelet::ALL {
            let grid = Grid { base: [3, 4], levels: 3 };
            let model = multiscale(name, grid, wavelet, [2, 3], storage);
            let (di, dp) = (2 * grid.len(), 3 * grid.len());
            let mut stream = Stream::of("weights of wavelets");
            for _ in 0..5 {
                let (x, y): (Vec<f32>, Vec<f32>) = (stream.numbers(di, 1.5), stream.numbers(dp, 1.5));
                let (single, double) = (model.positions(&x, &y), model.positions(&wide(&x), &wide(&y)));
                for (single, double) in single.iter().flatten().zip(double.iter().flatten()) {
                    worst = worst.max((f64::from(*single) - double).abs());
                }
                let (x, y, v) = (wide(&x), wide(&y), stream.below(grid.len()));
                let [by_identity, by_pose] = model.derivatives(&x, &y, v);
                let (at, k) = (model.positions(&x, &y)[v], stream.below(di));
                let mut moved = x.clone();
                moved[k] += 1.0;
                for axis in 0..3 {
                    let difference = model.positions(&moved, &y)[v][axis] - at[axis];
                    sloped = sloped.max((difference - by_identity[k][axis]).abs());
                }
                let (mut moved, k) = (y.clone(), stream.below(dp));
                moved[k] += 1.0;
                for axis in 0..3 {
                    let difference = model.positions(&x, &moved)[v][axis] - at[axis];
                    sloped = sloped.max((difference - by_pose[k][axis]).abs());
                }
            }
        }
    }
    println!("wavelet models: positions off by {worst:.1e} mm at most, derivatives by {sloped:.1e} mm");
    // A coefficient of 100 mm is rounded by 4e-6 mm, and three levels of the cubic synthesis amplify that by 18 at most, the condition of a line.
    assert!(worst > 1e-6 && worst < 1e-4 && sloped < 1e-10, "{worst} {sloped}");
}
