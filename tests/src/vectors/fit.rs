//! Normal equations, priors, fits.

use super::generator::weights;
use super::models::{Model, Models};
use super::stream::Stream;
use super::text::{Case, File};
use crate::reference::fit::{Options, fit};
use crate::reference::levenberg_marquardt::Limits;
use crate::reference::normal_equations::{Frame, Sample, equations};
use crate::reference::placement::{Placement, rotation_matrix};
use crate::reference::prior::{Gaussian, Prior};

pub fn text(models: &Models) -> String {
    let mut file = File::new("Normal equations, priors, fits.");
    // Groups of 24 rows: 8 points, or 24 points with normals; just below, at and above.
    for (count, kind, order) in [
        (1, Kind::Vertices, Order::Runs),
        (7, Kind::Vertices, Order::Runs),
        (8, Kind::Vertices, Order::Scattered),
        (9, Kind::Vertices, Order::Runs),
        (16, Kind::Vertices, Order::Scattered),
        (17, Kind::Vertices, Order::Runs),
        (23, Kind::Normals, Order::Runs),
        (24, Kind::Normals, Order::Scattered),
        (25, Kind::Normals, Order::Runs),
        (9, Kind::Barycentric, Order::Scattered),
        (20, Kind::Mixed, Order::Runs),
    ] {
        for frame in [Frame::Fixed, Frame::Rigid, Frame::Similarity] {
            // The widest form has the rows of the others; those are done where samples are of every kind.
            if frame != Frame::Similarity && !matches!(kind, Kind::Mixed | Kind::Barycentric) {
                continue;
            }
            normal_equations(&mut file, models.named("linear_49"), count, kind, order, frame);
        }
    }
    for name in ["plain_1", "plain_16", "identity_linear", "pose_linear"] {
        normal_equations(&mut file, models.named(name), 9, Kind::Mixed, Order::Runs, Frame::Similarity);
    }
    refused_samples(&mut file, models.named("linear_17"));
    let whole = models.named("whole");
    priors(&mut file, whole);
    fits(&mut file, whole);
    file.text()
}

#[derive(Debug, Clone, Copy)]
pub enum Kind {
    Vertices,
    Barycentric,
    Normals,
    /// All of them, with samples of weight zero and samples that are left out.
    Mixed,
}

#[derive(Debug, Clone, Copy)]
pub enum Order {
    /// Vertices side by side: runs in one block.
    Runs,
    Scattered,
}

pub fn word(value: impl std::fmt::Debug) -> String {
    format!("{value:?}").to_lowercase()
}

fn samples(model: &Model, count: usize, kind: Kind, order: Order) -> Vec<Option<Sample>> {
    let n = model.generator.n();
    let mut stream = Stream::of(&format!("samples {count} {kind:?} {order:?}"));
    (0..count)
        .map(|k| {
            let vertex = match order {
                Order::Runs => (k + 3) % n,
                Order::Scattered => stream.below(n),
            };
            let kind = match (kind, k % 5) {
                (Kind::Mixed, 3) => return None,
                (Kind::Mixed, part) => [Kind::Vertices, Kind::Barycentric, Kind::Normals][part % 3],
                (kind, _) => kind,
            };
            let mut sample = Sample {
                corners: [vertex as u32, 0, 0],
                barycentric: [1.0, 0.0, 0.0],
                target: stream.point(120.0),
                normal: None,
                weight: 1.0 + stream.number::<f32>(0.75),
            };
            match kind {
                Kind::Barycentric => {
                    sample.corners = [vertex, (vertex + 1) % n, stream.below(n)].map(|corner| corner as u32);
                    sample.barycentric = [0.5, 0.3125, 0.1875];
                }
                Kind::Normals => {
                    let [x, y, z] = stream.point::<f32>(1.0);
                    let length = libm::sqrtf(x * x + y * y + z * z);
                    sample.normal = Some([x / length, y / length, z / length]);
                }
                _ => {}
            }
            if k % 11 == 10 {
                sample.weight = 0.0;
            }
            Some(sample)
        })
        .collect()
}

pub fn sample_fields(case: &mut Case<'_>, samples: &[Option<Sample>]) {
    let none = Sample { corners: [0; 3], barycentric: [0.0; 3], target: [0.0; 3], normal: None, weight: 0.0 };
    let all: Vec<&Sample> = samples.iter().map(|sample| sample.as_ref().unwrap_or(&none)).collect();
    let kind = |sample: &Option<Sample>| sample.as_ref().map_or(0, |s| if s.normal.is_some() { 2 } else { 1 });
    let normals: Vec<[f32; 3]> = all.iter().map(|sample| sample.normal.unwrap_or_default()).collect();
    case.integers("kinds", samples.iter().map(kind))
        .integers("corners", all.iter().flat_map(|sample| sample.corners))
        .numbers("barycentric", all.iter().flat_map(|sample| &sample.barycentric))
        .numbers("targets", all.iter().flat_map(|sample| &sample.target))
        .numbers("normals", normals.iter().flatten())
        .numbers("sample_weights", all.iter().map(|sample| &sample.weight));
}

pub fn placement() -> Placement<f32> {
    Placement { scale: 1.125, rotation: rotation_matrix([0.25, -0.5, 0.125]), translation: [12.0, -34.0, 56.0] }
}

pub fn normal_equations(file: &mut File, model: &Model, count: usize, kind: Kind, order: Order, frame: Frame) {
    let (x, y) = weights(model);
    let samples = samples(model, count, kind, order);
    let (energy, jtj, jtr) = equations(model.generator.as_ref(), &x, &y, &samples, &placement(), frame);
    let name = format!("{}_{count}_{}_{}_{}", model.label(), word(kind), word(order), word(frame));
    let mut case = start(file, "normal_equations", model, &name, &x, &y, frame, &placement());
    sample_fields(&mut case, &samples);
    case.number("energy", energy).numbers("jtr", &jtr).rows("jtj", &jtj);
}

#[allow(clippy::too_many_arguments)]
pub fn start<'f>(
    file: &'f mut File,
    kernel: &str,
    model: &Model,
    name: &str,
    x: &[f32],
    y: &[f32],
    frame: Frame,
    placement: &Placement<f32>,
) -> Case<'f> {
    let mut case = file.case(kernel, name);
    case.word("model", &model.name)
        .parts(model)
        .numbers("identity", x)
        .numbers("pose", y)
        .word("frame", &word(frame))
        .numbers("placement", &placement.numbers());
    case
}

fn refused_samples(file: &mut File, model: &Model) {
    let (x, y) = weights(model);
    let good = samples(model, 3, Kind::Barycentric, Order::Runs);
    type Change = fn(&mut Sample);
    let changes: [(&str, Change, [u32; 3]); 5] = [
        ("nan_target", |sample| sample.target[2] = f32::NAN, [103, 1, 0]),
        ("negative_weight", |sample| sample.weight = -1.0, [103, 1, 0]),
        ("infinite_weight", |sample| sample.weight = f32::INFINITY, [103, 1, 0]),
        ("nan_barycentric", |sample| sample.barycentric[1] = f32::NAN, [103, 1, 0]),
        ("no_such_vertex", |sample| sample.corners[1] = 17, [102, 17, 17]),
    ];
    for (name, change, refusal) in changes {
        let mut samples = good.clone();
        change(samples[1].as_mut().expect("a sample"));
        let mut case = start(file, "normal_equations", model, name, &x, &y, Frame::Rigid, &placement());
        sample_fields(&mut case, &samples);
        case.error(refusal);
    }
}

fn prior_words(prior: &Prior<'_>) -> Vec<String> {
    match prior {
        Prior::None => vec!["none".into()],
        Prior::Gaussian(_, factor) => vec!["gaussian".into(), format!("{:08x}", factor.to_bits())],
        Prior::Box(_, factor) => vec!["box".into(), format!("{:08x}", factor.to_bits())],
    }
}

fn gaussians(model: &Model) -> (&Gaussian, &Gaussian) {
    let part = |gaussian: &'_ Option<Gaussian>| gaussian.is_some();
    assert!(part(&model.extras.identity) && part(&model.extras.pose), "the whole model has both");
    (model.extras.identity.as_ref().expect("identity"), model.extras.pose.as_ref().expect("pose"))
}

fn priors(file: &mut File, model: &Model) {
    let (identity, pose) = gaussians(model);
    let mut stream = Stream::of("priors");
    for (mode, gaussian) in [("identity", identity), ("pose", pose)] {
        let d = gaussian.mean.len();
        for (name, prior) in [
            ("none", Prior::None),
            ("gaussian", Prior::Gaussian(gaussian, 0.75)),
            ("gaussian_one", Prior::Gaussian(gaussian, 1.0)),
            ("box", Prior::Box(gaussian, 2.5)),
        ] {
            let (m, first) = (d + 3, 2);
            let weights: Vec<f32> = stream.numbers(d, 2.0);
            let before: Vec<Vec<f32>> = (0..m).map(|_| stream.numbers(m, 10.0)).collect();
            let gradient: Vec<f32> = stream.numbers(m, 10.0);
            let (mut jtj, mut jtr) = (before.clone(), gradient.clone());
            let energy = prior.add_to(&weights, &mut jtj, &mut jtr, first);
            let (lower, upper) = prior.bounds(d);
            file.case("prior", &format!("{mode}_{name}"))
                .word("model", &model.name)
                .word("mode", mode)
                .words("prior", prior_words(&prior))
                .numbers("weights", &weights)
                .rows("jtj_before", &before)
                .numbers("jtr_before", &gradient)
                .integer("first", first)
                .number("energy", energy)
                .rows("jtj", &jtj)
                .numbers("jtr", &jtr)
                .numbers("lower", &lower)
                .numbers("upper", &upper);
        }
        file.case("prior", &format!("{mode}_length"))
            .word("model", &model.name)
            .word("mode", mode)
            .words("prior", prior_words(&Prior::Box(gaussian, 1.0)))
            .numbers("weights", &vec![0.0f32; d + 1])
            .error([101, d as u32 + 1, d as u32]);
        file.case("prior", &format!("{mode}_factor"))
            .word("model", &model.name)
            .word("mode", mode)
            .words("prior", prior_words(&Prior::Gaussian(gaussian, 0.0)))
            .numbers("weights", &vec![0.0f32; d])
            .error([104, 1, 0]);
    }
}

/// Targets at every vertex: a shape of the model, moved, with noise.
pub fn everywhere(model: &Model, kind: Kind) -> Vec<Option<Sample>> {
    let (x, y) = weights(model);
    let mut samples = samples(model, model.generator.n(), kind, Order::Runs);
    let mut stream = Stream::of("noise");
    for sample in samples.iter_mut().flatten() {
        let mut position = [0.0f32; 3];
        for (&corner, &part) in sample.corners.iter().zip(&sample.barycentric) {
            let value = model.generator.value(&x, &y, corner as usize);
            position = [0, 1, 2].map(|k| position[k] + part * value[k]);
        }
        let (there, noise) = (placement().applied(position), stream.point::<f32>(1.5));
        sample.target = [0, 1, 2].map(|k| there[k] + noise[k]);
    }
    samples
}

fn options<'a>(
    frame: Frame,
    place: bool,
    identity_prior: Prior<'a>,
    pose_prior: Prior<'a>,
    max_iterations: u32,
) -> Options<'a> {
    let limits = Limits { max_iterations, relative_decrease: f32::EPSILON * 16.0, damping: 1e-3 };
    Options { frame, place, identity_prior, pose_prior, noise: 1.5, limits }
}

fn fitted(
    file: &mut File,
    model: &Model,
    name: &str,
    samples: &[Option<Sample>],
    options: &Options<'_>,
    [x0, y0]: [&[f32]; 2],
    from: &Placement<f32>,
) {
    let mut case = start(file, "fit_points", model, name, x0, y0, options.frame, from);
    sample_fields(&mut case, samples);
    option_fields(&mut case, options);
    result_fields(&mut case, fit(model.generator.as_ref(), samples, options, x0, y0, from));
}

/// Fits of a model of another kind, with what priors it has, to points and to its landmarks.
pub fn few_fits(file: &mut File, model: &Model) {
    let (di, dp) = model.generator.dims();
    let (x0, y0) = (vec![0.0; di], vec![0.0; dp]);
    let prior = |gaussian: &'static str| match gaussian {
        "identity" => model.extras.identity.as_ref(),
        _ => model.extras.pose.as_ref(),
    };
    let gaussian = |of| prior(of).map_or(Prior::None, |gaussian| Prior::Gaussian(gaussian, 1.0));
    let boxed = |of| prior(of).map_or(Prior::None, |gaussian| Prior::Box(gaussian, 1.5));
    let (vertices, mixed) = (everywhere(model, Kind::Vertices), everywhere(model, Kind::Mixed));
    let few: Vec<Option<Sample>> = vertices.iter().step_by(3).cloned().collect();
    for (what, samples, options, from) in [
        (
            "placed",
            &few,
            options(Frame::Similarity, true, gaussian("identity"), gaussian("pose"), 50),
            Placement::identity(),
        ),
        ("mixed_box", &mixed, options(Frame::Rigid, false, boxed("identity"), boxed("pose"), 6), placement()),
    ] {
        fitted(file, model, &format!("{}_{what}", model.label()), samples, &options, [&x0, &y0], &from);
    }
    let options = options(Frame::Rigid, true, gaussian("identity"), gaussian("pose"), 50);
    landmark_fits(file, model, &format!("{}_", model.label()), &vertices, &options);
}

/// Fits to a shape of the model, moved, with noise.
fn fits(file: &mut File, model: &Model) {
    let (identity, pose) = gaussians(model);
    let (x, y) = weights(model);
    let none = Prior::None;
    let (gaussian_x, gaussian_y) = (Prior::Gaussian(identity, 1.0), Prior::Gaussian(pose, 1.0));
    let (box_x, box_y) = (Prior::Box(identity, 1.5), Prior::Box(pose, 0.5));
    let close = placement();
    let vertices = everywhere(model, Kind::Vertices);
    let mixed = everywhere(model, Kind::Mixed);
    let few: Vec<Option<Sample>> = vertices.iter().step_by(3).cloned().collect();
    for (name, samples, options, from) in [
        ("placed", &vertices, options(Frame::Similarity, true, none, none, 50), Placement::identity()),
        ("rigid_gaussian", &few, options(Frame::Rigid, true, gaussian_x, gaussian_y, 50), Placement::identity()),
        ("fixed_box", &few, options(Frame::Fixed, false, box_x, box_y, 50), close),
        ("mixed_similarity", &mixed, options(Frame::Similarity, false, gaussian_x, box_y, 50), close),
        ("three_iterations", &mixed, options(Frame::Similarity, true, gaussian_x, none, 3), Placement::identity()),
        ("far_start", &few, options(Frame::Rigid, false, gaussian_x, gaussian_y, 50), Placement::identity()),
    ] {
        let (x0, y0) = (vec![0.0; x.len()], vec![0.0; y.len()]);
        fitted(file, model, name, samples, &options, [&x0, &y0], &from);
    }
    let (x0, y0) = (vec![0.0; x.len()], vec![0.0; y.len()]);
    for (name, samples, noise, placement, refusal) in [
        ("nothing", &vec![None; 4], 1.5, close, [105, 0, 0]),
        ("two_points", &vertices[..2].to_vec(), 1.5, close, [403, 0, 0]),
        ("no_noise", &vertices[..5].to_vec(), 0.0, close, [104, 2, 0]),
    ] {
        let options = Options { noise, ..options(Frame::Rigid, true, none, none, 50) };
        let mut case = start(file, "fit_points", model, name, &x0, &y0, options.frame, &placement);
        sample_fields(&mut case, samples);
        option_fields(&mut case, &options);
        case.error(refusal);
    }
    landmark_fits(file, model, "", &vertices, &options(Frame::Similarity, true, gaussian_x, gaussian_y, 50));
    landmark_fits(file, model, "", &vertices, &options(Frame::Rigid, true, box_x, gaussian_y, 50));
}

fn landmark_fits(file: &mut File, model: &Model, prefix: &str, vertices: &[Option<Sample>], options: &Options<'_>) {
    let (di, dp) = model.generator.dims();
    let (x0, y0) = (vec![0.0; di], vec![0.0; dp]);
    let place = Placement::identity();
    for missing in [false, true] {
        let samples: Vec<Option<Sample>> = model
            .extras
            .landmarks
            .iter()
            .enumerate()
            .map(|(k, &vertex)| {
                let found = vertices.iter().flatten().find(|sample| sample.corners[0] == vertex);
                let sample = Sample { weight: 1.0, ..found.expect("a sample at every vertex").clone() };
                (!missing || k % 4 != 1).then_some(sample)
            })
            .collect();
        let name = format!("{prefix}{}_{}", word(options.frame), if missing { "some_missing" } else { "all" });
        let mut case = start(file, "fit_landmarks", model, &name, &x0, &y0, options.frame, &place);
        let targets: Vec<[f32; 3]> = samples.iter().map(|s| s.as_ref().map_or([0.0; 3], |s| s.target)).collect();
        case.integers("kinds", samples.iter().map(|sample| u32::from(sample.is_some())))
            .numbers("targets", targets.iter().flatten());
        option_fields(&mut case, options);
        result_fields(&mut case, fit(model.generator.as_ref(), &samples, options, &x0, &y0, &place));
    }
}

fn option_fields(case: &mut Case<'_>, options: &Options<'_>) {
    case.integer("place", usize::from(options.place))
        .words("identity_prior", prior_words(&options.identity_prior))
        .words("pose_prior", prior_words(&options.pose_prior))
        .number("noise", options.noise)
        .integer("max_iterations", options.limits.max_iterations as usize)
        .number("relative_decrease", options.limits.relative_decrease)
        .number("damping", options.limits.damping);
}

fn result_fields(case: &mut Case<'_>, result: Result<crate::reference::fit::Fit, crate::reference::Refusal>) {
    let result = result.expect("points that determine the fit");
    case.integers("iterations_status", [result.iterations, result.status])
        .numbers("rms_energy_start", &[result.rms, result.energy, result.start_energy])
        .numbers("identity_fitted", &result.identity)
        .numbers("pose_fitted", &result.pose)
        .numbers("placement_fitted", &result.placement.numbers());
}
