//! Evaluation by ranges, derivatives, prepared forms.

use super::models::{Model, Models};
use super::stream::Stream;
use super::text::{Case, File};
use crate::reference::bilinear::Linearised;

pub fn text(models: &Models) -> String {
    let mut file = File::new("Evaluation by ranges, derivatives, prepared forms.");
    for model in models.iter() {
        evaluate(&mut file, model);
    }
    for name in ["linear_16", "plain_17", "plain_1", "linear_49", "identity_linear", "pose_linear"] {
        let model = models.named(name);
        // The last block, which is full or has a single vertex.
        linearised_block(&mut file, model, (model.generator.n() - 1) / 16);
        for vertex in [0, model.generator.n() / 2, model.generator.n() - 1] {
            linearised_vertex(&mut file, model, vertex);
        }
    }
    for (name, from, to) in [
        ("plain_1", 0, 1),
        ("linear_16", 0, 1),
        ("linear_17", 0, 2),
        ("plain_49", 3, 4),
        ("linear_48", 1, 2),
        ("identity_linear", 0, 2),
        ("pose_linear", 1, 2),
    ] {
        for identity_fixed in [true, false] {
            prepared(&mut file, models.named(name), identity_fixed, from, to);
        }
    }
    refusals(&mut file, models.named("linear_17"));
    file.text()
}

/// Weights of a model, the same in all its cases.
pub fn weights(model: &Model) -> (Vec<f32>, Vec<f32>) {
    let (di, dp) = model.generator.dims();
    let mut stream = Stream::of(&format!("weights of {}", model.name));
    (stream.numbers(di, 1.5), stream.numbers(dp, 1.5))
}

pub fn start<'f>(file: &'f mut File, kernel: &str, model: &Model, what: &str, x: &[f32], y: &[f32]) -> Case<'f> {
    let mut case = file.case(kernel, &format!("{}_{what}", model.label()));
    case.word("model", &model.name).parts(model).numbers("identity", x).numbers("pose", y);
    case
}

pub fn evaluate(file: &mut File, model: &Model) {
    let n = model.generator.n();
    let (x, y) = weights(model);
    let shape: Vec<f32> = (0..n).flat_map(|v| model.generator.value(&x, &y, v)).collect();
    // The whole, and ranges that start and end inside blocks, at their edges, and nowhere.
    let mut bounds = vec![[0, n], [0, 0], [n, n], [0, n / 2], [n / 2, n], [n - 1, n]];
    bounds.extend((16..n).step_by(16).flat_map(|edge| [[0, edge], [edge, n], [edge - 1, edge + 1]]));
    let ranges = bounds.into_iter().flatten().map(|bound| bound as u32);
    start(file, "evaluate", model, "ranges", &x, &y).integers("ranges", ranges).numbers("out", &shape);
    if n == 17 {
        for (what, x, y) in [
            ("zero", vec![0.0; x.len()], vec![0.0; y.len()]),
            ("minus", x.iter().map(|x| -x).collect::<Vec<f32>>(), y.iter().map(|y| -y).collect::<Vec<f32>>()),
            ("largest", vec![1e9; x.len()], vec![-1e9; y.len()]),
        ] {
            let shape: Vec<f32> = (0..n).flat_map(|v| model.generator.value(&x, &y, v)).collect();
            start(file, "evaluate", model, what, &x, &y).integers("ranges", [0, n as u32]).numbers("out", &shape);
        }
    }
}

/// Numbers of a block from its vertices: x of 16 vertices, then y, then z; zero behind the last vertex that has numbers.
fn block(lanes: usize, block: usize, point: impl Fn(usize) -> [f32; 3]) -> Vec<f32> {
    let lane = |axis: usize, lane: usize| {
        let vertex = 16 * block + lane;
        if vertex < lanes { point(vertex)[axis] } else { 0.0 }
    };
    (0..3).flat_map(|axis| (0..16).map(move |k| (axis, k))).map(|(axis, k)| lane(axis, k)).collect()
}

pub fn linearised_block(file: &mut File, model: &Model, index: usize) {
    let (n, (x, y)) = (model.generator.lanes(), weights(model));
    let values = block(n, index, |v| model.generator.value(&x, &y, v));
    let jacobian: Vec<f32> = (0..x.len() + y.len())
        .flat_map(|k| block(n, index, |v| model.generator.linearised(&x, &y, v).derivatives[k]))
        .collect();
    start(file, "linearised_block", model, &format!("block_{index}"), &x, &y)
        .integer("block", index)
        .numbers("values", &values)
        .numbers("jacobian", &jacobian);
}

pub fn linearised_vertex(file: &mut File, model: &Model, vertex: usize) {
    let (x, y) = weights(model);
    let Linearised { value, derivatives } = model.generator.linearised(&x, &y, vertex);
    start(file, "linearised_vertex", model, &format!("vertex_{vertex}"), &x, &y)
        .integer("vertex", vertex)
        .numbers("value", &value)
        .numbers("jacobian", derivatives.iter().flatten());
}

/// In reverse mode.
pub fn gradient(file: &mut File, model: &Model) {
    let (x, y) = weights(model);
    let by_vertex: Vec<[f32; 3]> = Stream::of(&format!("gradient of {}", model.name)).points(model.generator.n(), 2.0);
    start(file, "gradient", model, "reverse", &x, &y)
        .numbers("vertex_gradients", by_vertex.iter().flatten())
        .numbers("gradient", &model.generator.gradient(&x, &y, &by_vertex));
}

/// Three sets of weights at once.
pub fn batch(file: &mut File, model: &Model, from: usize, to: usize) {
    let (x, y) = weights(model);
    let factors = [1.0, -0.5, 0.0];
    let scaled = |weights: &[f32], factor: f32| weights.iter().map(|weight| factor * weight).collect::<Vec<f32>>();
    let of_sets = |weights: &[f32]| factors.iter().flat_map(|&factor| scaled(weights, factor)).collect::<Vec<f32>>();
    let mut shapes = Vec::new();
    for factor in factors {
        let (x, y) = (scaled(&x, factor), scaled(&y, factor));
        shapes.extend((from..to).flat_map(|v| model.generator.value(&x, &y, v)));
    }
    start(file, "batch", model, "three", &of_sets(&x), &of_sets(&y))
        .integer("from", from)
        .integer("to", to)
        .numbers("out", &shapes);
}

pub fn prepared(file: &mut File, model: &Model, identity_fixed: bool, from: usize, to: usize) {
    let (x, y) = weights(model);
    let (fixed, free) = if identity_fixed { ("identity", &y) } else { ("pose", &x) };
    let generator = &model.generator;
    let first = 16 * from;
    let form = |v: usize| match identity_fixed {
        true => generator.identity_fixed(&x, &y, first + v),
        false => generator.pose_fixed(&x, &y, first + v),
    };
    let forms: Vec<Linearised> = (0..generator.lanes().min(16 * to) - first).map(form).collect();
    let n = generator.n().min(16 * to) - first;
    let shape: Vec<f32> = forms[..n].iter().flat_map(|form| form.value).collect();
    let (mut values, mut jacobian) = (Vec::new(), Vec::new());
    for index in 0..to - from {
        values.extend(block(forms.len(), index, |v| forms[v].value));
        for k in 0..free.len() {
            jacobian.extend(block(forms.len(), index, |v| forms[v].derivatives[k]));
        }
    }
    start(file, "prepared", model, &format!("{fixed}_fixed"), &x, &y)
        .word("fixed", fixed)
        .integer("from", from)
        .integer("to", to)
        .numbers("out", &shape)
        .numbers("values", &values)
        .numbers("jacobian", &jacobian);
}

fn refusals(file: &mut File, model: &Model) {
    let (x, y) = weights(model);
    let all = [0, 17];
    for (what, x, y, ranges, refusal) in [
        ("short_identity", &x[..1], &y[..], all, [101, 2, 1]),
        ("short_pose", &x[..], &y[..1], all, [101, 2, 1]),
        ("nan", &x[..], &[0.0, f32::NAN][..], all, [103, 3, 0]),
        ("infinite", &[f32::INFINITY, 0.0][..], &y[..], all, [103, 0, 0]),
        ("huge", &[0.0, 1.1e9][..], &y[..], all, [103, 1, 0]),
        ("beyond", &x[..], &y[..], [3, 18], [102, 18, 17]),
        ("reversed", &x[..], &y[..], [9, 4], [102, 9, 17]),
    ] {
        start(file, "evaluate", model, what, x, y).integers("ranges", ranges).error(refusal);
    }
    start(file, "prepared", model, "beyond", &x, &y)
        .word("fixed", "pose")
        .integer("from", 1)
        .integer("to", 3)
        .error([102, 3, 2]);
    start(file, "prepared", model, "nan", &x, &[f32::NAN, 0.0])
        .word("fixed", "pose")
        .integer("from", 0)
        .integer("to", 2)
        .error([103, 0, 0]);
}
