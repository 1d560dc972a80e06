//! Tests of the decomposition, of its equivalence with eq. 8.2, and of the refinement.

use super::*;
use crate::face::bilinear_form::BilinearForm;

/// Numbers without structure, the same everywhere.
fn noise(seed: usize) -> impl Fn(usize) -> f64 {
    move |index| {
        let mut x =
            (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (seed as u64).wrapping_mul(0xD134_2543_DE82_EF95);
        x = (x ^ (x >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((x ^ (x >> 29)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }
}

fn random_tensor(d2: usize, d3: usize, n: usize) -> ShapeTensor {
    let (base, change) = (noise(1), noise(2));
    let len = 3 * n;
    let data = (0..d2 * d3 * len).map(|at| 200.0 * base(at % len) + 10.0 * change(at)).collect();
    ShapeTensor::from_shapes(d2, d3, n, data).unwrap()
}

/// `mean + sum_jk w2[i, j] w3[p, k] m_jk`, centred factors, so that the tensor less its mean has rank `(r2, r3)`.
fn low_rank_tensor(d2: usize, d3: usize, n: usize, r2: usize, r3: usize) -> ShapeTensor {
    let (mean, core, left, right) = (noise(3), noise(4), noise(5), noise(6));
    let centred = |d: usize, f: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let mut values: Vec<f64> = (0..d).map(f).collect();
        let average = values.iter().sum::<f64>() / d as f64;
        values.iter_mut().for_each(|x| *x -= average);
        values
    };
    let w2: Vec<Vec<f64>> = (0..r2).map(|j| centred(d2, &|i| left(j * d2 + i))).collect();
    let w3: Vec<Vec<f64>> = (0..r3).map(|k| centred(d3, &|p| right(k * d3 + p))).collect();
    let mut data = Vec::new();
    for p in 0..d3 {
        for i in 0..d2 {
            for l in 0..3 * n {
                let mut x = 200.0 * mean(l);
                for (j, w2) in w2.iter().enumerate() {
                    for (k, w3) in w3.iter().enumerate() {
                        x += 20.0 * w2[i] * w3[p] * core((l * r2 + j) * r3 + k);
                    }
                }
                data.push(x);
            }
        }
    }
    ShapeTensor::from_shapes(d2, d3, n, data).unwrap()
}

fn sized(d_id: usize, d_pose: usize) -> HosvdOptions {
    HosvdOptions { identity: ModeSize::Dimension(d_id), expression: ModeSize::Dimension(d_pose), hooi: None }
}

fn square_residual(tensor: &ShapeTensor, model: &MultilinearModel) -> f64 {
    model.training_shapes().unwrap().iter().zip(tensor.data()).map(|(a, b)| (a - b) * (a - b)).sum()
}

fn worst_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |worst, (a, b)| worst.max((a - b).abs()))
}

#[test]
fn untruncated_model_reproduces_the_training_shapes() {
    let tensor = random_tensor(11, 4, 173);
    let model = hosvd(&tensor, &sized(11, 4)).unwrap().model;
    let worst = worst_difference(&model.training_shapes().unwrap(), tensor.data());
    assert!(worst < 1e-9, "M1: {worst} mm");
    let (w2, w3) = model.training_weights(7, 2);
    assert!(worst_difference(&model.shape(&w2, &w3).unwrap(), tensor.shape(7, 2)) < 1e-9);
}

#[test]
fn untruncated_model_at_its_mean_weights_is_the_mean() {
    let model = hosvd(&random_tensor(11, 4, 60), &sized(11, 4)).unwrap().model;
    let face = model.shape(&model.identity.weights.mean, &model.expression.weights.mean).unwrap();
    assert!(worst_difference(&face, &model.mean) < 1e-10);
}

#[test]
fn forms_12_1_and_8_2_agree_both_ways() {
    let model = hosvd(&random_tensor(11, 5, 60), &sized(6, 3)).unwrap().model;
    let form = BilinearForm::about_means(&model);
    let (x, y) = ([0.3, -0.2, 0.1, 0.7, -0.5, 0.05], [0.4, -0.9, 0.2]);
    let add = |mean: &[f64], step: &[f64]| -> Vec<f64> { mean.iter().zip(step).map(|(m, s)| m + s).collect() };
    let (w2, w3) = (add(&model.identity.weights.mean, &x), add(&model.expression.weights.mean, &y));
    let truth = model.shape(&w2, &w3).unwrap();
    assert!(worst_difference(&form.shape(&x, &y).unwrap(), &truth) < 1e-10, "M2");

    let augmented = form.to_augmented();
    let (one_x, one_y) = ([&[1.0], &x[..]].concat(), [&[1.0], &y[..]].concat());
    assert!(worst_difference(&augmented.shape(&one_x, &one_y).unwrap(), &truth) < 1e-10, "M2");
    assert_eq!(BilinearForm::from_augmented(&augmented).unwrap(), form);
    assert!(form.shape(&x[1..], &y).is_err() && augmented.shape(&x, &y).is_err());
}

#[test]
fn low_rank_tensor_is_learned_completely_at_its_rank() {
    let tensor = low_rank_tensor(12, 7, 90, 5, 3);
    let model = hosvd(&tensor, &sized(5, 3)).unwrap().model;
    let energy: f64 = model.identity.eigenvalues.iter().sum::<f64>() * 7.0;
    assert!((square_residual(&tensor, &model) / energy).sqrt() < 1e-9, "M3");
    assert!(1.0 - model.identity.energy_kept() < 1e-12 && 1.0 - model.expression.energy_kept() < 1e-12, "M3");
    assert!(model.identity.eigenvalues[4] > 1e-6 * model.identity.eigenvalues[0], "the rank is not less than 5");
    let whole = ModeSize::Energy { share: 1.0 - 1e-9, cap: 100 };
    let found = hosvd(&tensor, &HosvdOptions { identity: whole, expression: whole, hooi: None }).unwrap().model;
    assert_eq!((found.identity.dim, found.expression.dim), (5, 3));
}

#[test]
fn truncation_stays_within_its_bound_and_hooi_does_not_make_it_worse() {
    let tensor = random_tensor(14, 6, 50);
    for (d_id, d_pose) in [(1, 1), (5, 3), (9, 4)] {
        let model = hosvd(&tensor, &sized(d_id, d_pose)).unwrap().model;
        let residual = square_residual(&tensor, &model);
        let bound = 6.0 * model.identity.eigenvalues[d_id..].iter().sum::<f64>()
            + 14.0 * model.expression.eigenvalues[d_pose..].iter().sum::<f64>();
        assert!(residual <= bound * (1.0 + 1e-12), "{residual} {bound}");
        let options = HosvdOptions { hooi: Some(HooiOptions::default()), ..sized(d_id, d_pose) };
        let refined = square_residual(&tensor, &hosvd(&tensor, &options).unwrap().model);
        assert!(refined <= residual * (1.0 + 1e-12), "{refined} {residual}");
        assert!(d_id == 1 || refined < residual * (1.0 - 1e-6), "noise leaves room for refinement");
    }
}

#[test]
fn bits_do_not_depend_on_the_thread_count() {
    let tensor = random_tensor(13, 5, 700);
    let options = HosvdOptions { hooi: Some(HooiOptions::default()), ..sized(6, 4) };
    let models: Vec<MultilinearModel> = [1, 2, 8]
        .iter()
        .map(|&threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| hosvd(&tensor, &options).unwrap().model)
        })
        .collect();
    assert_eq!(models[0], models[1]);
    assert_eq!(models[0], models[2]);
}

#[test]
fn one_identity_or_one_expression_trains_with_a_warning() {
    let trained = hosvd(&random_tensor(1, 6, 50), &sized(1, 5)).unwrap();
    assert_eq!(trained.warnings, [TrainingWarning::OneIdentity]);
    assert!(trained.warnings[0].to_string().contains("one identity"));
    let tensor = random_tensor(6, 1, 50);
    let trained = hosvd(&tensor, &sized(6, 1)).unwrap();
    assert_eq!(trained.warnings, [TrainingWarning::OneExpression]);
    assert!(worst_difference(&trained.model.training_shapes().unwrap(), tensor.data()) < 1e-9);
    assert!(hosvd(&random_tensor(2, 2, 5), &sized(2, 2)).unwrap().warnings.is_empty());
}

#[test]
fn what_cannot_be_learned_is_a_sentence() {
    let said = |tensor: &ShapeTensor, options: &HosvdOptions| hosvd(tensor, options).unwrap_err().to_string();
    assert!(said(&random_tensor(1, 1, 9), &sized(1, 1)).contains("training shapes are equal"));
    let tensor = random_tensor(4, 3, 9);
    assert!(said(&tensor, &sized(5, 3)).contains("5 identity weights were asked for, but the training data hold 4"));
    assert!(said(&tensor, &sized(4, 0)).contains("expression mode needs at least 1"));
    let share = HosvdOptions { identity: ModeSize::Energy { share: 1.5, cap: 3 }, ..sized(4, 3) };
    assert!(said(&tensor, &share).contains("energy share of 1.5"));
}
