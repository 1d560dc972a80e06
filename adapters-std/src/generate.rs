//! From weights in standard deviations to meshes, through the kernel.

use habitus_core::format::{Kind, Mode, Model};
use habitus_core::generator::{Generator, Weights};

use crate::Error;
use crate::evaluate::evaluate_at_parallel;
use crate::mesh::Mesh;

/// Weights of a mode: of all coefficients together in a wavelet model.
pub fn weight_count(model: &Model<'_>, mode: Mode) -> usize {
    let header = model.header();
    let each = if header.kind == Kind::Wavelet { header.n_vertices as usize } else { 1 };
    each * if mode == Mode::Identity { header.identity_dim } else { header.pose_dim } as usize
}

/// Weights of a mode from standard deviations: `mean + t * scale`; weights behind the last one given are at the mean. Without statistics of
/// the weights, deviations of zero are weights of zero.
///
/// Errors: more numbers than weights, numbers that are not finite, others than zero for a model without the statistics of its weights.
pub fn weights_from_deviations(model: &Model<'_>, mode: Mode, deviations: &[f64]) -> Result<Vec<f32>, Error> {
    let name = match (mode, model.header().kind) {
        (Mode::Identity, _) => "identity",
        (Mode::Pose, Kind::Skinned) => "pose",
        (Mode::Pose, _) => "expression",
    };
    let dim = weight_count(model, mode);
    if deviations.len() > dim {
        return Err(Error::input(format!(
            "{} {name} weights were given; this model has {dim}, give at most so many",
            deviations.len()
        )));
    }
    if let Some(index) = deviations.iter().position(|value| !value.is_finite()) {
        return Err(Error::input(format!("{name} weight {index} is not a finite number")));
    }
    let Some(spread) = model.spread(mode) else {
        if deviations.iter().all(|&value| value == 0.0) {
            return Ok(vec![0.0; dim]);
        }
        return Err(Error::input(format!(
            "the model does not say how its {name} weights are distributed, so they cannot be given in standard deviations; leave them out, \
             or train it with this program"
        )));
    };
    let all = deviations.iter().copied().chain(std::iter::repeat(0.0));
    let weights = spread.mean.iter().zip(spread.scale.iter()).zip(all);
    Ok(weights.map(|((mean, scale), t)| (f64::from(mean) + t * f64::from(scale)) as f32).collect())
}

/// Weights in standard deviations: the inverse of [`weights_from_deviations`]; `None` for a model without the statistics of these weights.
pub fn deviations_of_weights(model: &Model<'_>, mode: Mode, weights: &[f32]) -> Option<Vec<f64>> {
    if weights.is_empty() {
        return Some(Vec::new());
    }
    let spread = model.spread(mode)?;
    let pairs = spread.mean.iter().zip(spread.scale.iter()).zip(weights);
    Some(pairs.map(|((mean, scale), weight)| f64::from(weight - mean) / f64::from(scale)).collect())
}

/// Weights of a training expression by its name.
///
/// Errors: a model without names, an unknown name (the message lists the known ones).
pub fn weights_of_expression(model: &Model<'_>, name: &str) -> Result<Vec<f32>, Error> {
    let (Some(names), Some(starts)) = (model.pose_names(), model.pose_starts()) else {
        return Err(Error::input("the model does not name its expressions; train it with --expressions FILE"));
    };
    let Some(row) = names.iter().position(|known| known == name) else {
        let known: Vec<&str> = names.iter().collect();
        return Err(Error::input(format!("the model has no expression {name:?}; it knows {}", known.join(", "))));
    };
    let dim = model.header().pose_dim as usize;
    let row = starts.part(row * dim, dim).ok_or_else(|| Error::Internal("an opened model has short starts".into()))?;
    Ok(row.iter().collect())
}

/// Positions of all vertices, mm, xyz after xyz.
pub fn positions(model: &Model<'_>, identity: &[f32], pose: &[f32]) -> Result<Vec<f32>, Error> {
    let kernel = |error| Error::Kernel { what: "the model cannot be evaluated".into(), error };
    let generator = model.generator().map_err(kernel)?;
    let n = generator.vertex_count();
    let mut state = vec![0.0; generator.state_req(false).numbers()];
    let at = generator.begin(Weights { identity, pose }, false, &mut state).map_err(kernel)?;
    let mut out = vec![0.0; 3 * n];
    evaluate_at_parallel(&generator, at, 0..n, &mut out, rayon::current_num_threads()).map_err(kernel)?;
    Ok(out)
}

/// The mesh of the model with these positions; without triangles when the model has none.
pub fn mesh(model: &Model<'_>, positions: &[f32]) -> Mesh {
    Mesh {
        positions: positions.as_chunks::<3>().0.iter().map(|point| point.map(f64::from)).collect(),
        faces: model.faces().map(|faces| faces.iter().collect()).unwrap_or_default(),
        ..Mesh::default()
    }
}
