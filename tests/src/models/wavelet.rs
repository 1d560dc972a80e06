//! A multilinear wavelet model of the procedural faces: a local model of 3 x 3 weights for each coefficient of the 129 x 193 grid (ch. 15).

use habitus::Error;
use habitus::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use habitus::face::tensor::ShapeTensor;
use habitus::io::model::{Coefficients, ModePrior, ModelSource, WaveletForm, hab};
use habitus::synth::face_grid::LANDMARKS;
use habitus::synth::faces::{FaceOptions, FacePopulation};
use habitus_core::wavelet::transform::{analysis, analysis_req};
use habitus_core::wavelet::{Grid, Wavelet};
use rayon::prelude::*;

/// Weights of each coefficient and mode.
const DIM: usize = 3;
/// Level of the face grid whose nodes are those of a 5 x 7 base after as many refinements.
const LEVEL: u32 = 5;

/// Coefficients of all faces, `[face][axis][coefficient]`; the faces identity fastest.
fn analysed(population: &FacePopulation, grid: &Grid, wavelet: Wavelet) -> Result<Vec<f32>, Error> {
    let [identities, expressions, n, _] = population.extents();
    let face = |k: usize| {
        let from = (k % identities * expressions + k / identities) * 3 * n;
        let positions = &population.tensor[from..from + 3 * n];
        let samples: Vec<f64> = (0..3 * n).map(|at| f64::from(positions[at % n * 3 + at / n])).collect();
        let mut coefficients = vec![0.0; 3 * n];
        let mut workspace = vec![0.0; analysis_req(grid).numbers()];
        analysis(grid, wavelet, &samples, &mut coefficients, &mut workspace)?;
        Ok(coefficients.into_iter().map(|value| value as f32).collect())
    };
    let faces: Result<Vec<Vec<f32>>, habitus_core::Error> =
        (0..identities * expressions).into_par_iter().map(face).collect();
    Ok(faces.map_err(|error| Error::Kernel { what: "the faces cannot be transformed".into(), error })?.concat())
}

/// A local model: mean, core (pose weight fastest, then coordinates), means and scales of the weights.
struct Local {
    mean: Vec<f64>,
    core: Vec<f64>,
    means: [Vec<f64>; 2],
    scales: [f64; 2],
}

/// HOSVD of one coefficient.
fn local(coefficients: &[f32], n: usize, q: usize, sizes: [usize; 2]) -> Result<Local, Error> {
    let faces = sizes[0] * sizes[1];
    let data = (0..3 * faces).map(|at| f64::from(coefficients[at * n + q])).collect();
    let tensor = ShapeTensor::from_shapes(sizes[0], sizes[1], 1, data)?;
    let options = HosvdOptions { identity: ModeSize::Dimension(DIM), expression: ModeSize::Dimension(DIM), hooi: None };
    let model = hosvd(&tensor, &options)?.model;
    let core = (0..DIM * DIM).flat_map(|k| model.core_block(k / DIM, k % DIM).to_vec()).collect();
    let scales = [model.identity.weights.scale(), model.expression.weights.scale()];
    let means = [model.identity.weights.mean.clone(), model.expression.weights.mean.clone()];
    Ok(Local { mean: model.mean, core, means, scales })
}

/// Quads of the population's faces, split along their shorter diagonal in `shape`.
fn faces(population: &FacePopulation, shape: &[f64]) -> Vec<[u32; 3]> {
    let columns = population.grid.columns as u32;
    let squared = |p: u32, q: u32| -> f64 {
        (0..3).map(|axis| (shape[3 * p as usize + axis] - shape[3 * q as usize + axis]).powi(2)).sum()
    };
    let quads = population.faces.as_chunks::<2>().0.iter();
    quads
        .flat_map(|pair| {
            let a = pair.as_flattened().iter().copied().min().unwrap_or(0);
            let [b, c, d] = [a + 1, a + 1 + columns, a + columns];
            if squared(a, c) <= squared(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        })
        .collect()
}

/// The model file of a population of so many people, and the largest and the root mean square distance of the training faces from their mean, mm.
///
/// # Errors
/// On a fault of training or of the writer.
pub fn file(identities: usize, wavelet: Wavelet) -> Result<Vec<u8>, Error> {
    let population = FacePopulation::of(&FaceOptions { identities, seed: 1, level: LEVEL })?;
    let kernel = |error| Error::Kernel { what: "the grid".into(), error };
    let grid = Grid::new(5, 7, LEVEL as usize).map_err(kernel)?;
    let [_, expressions, n, _] = population.extents();
    let coefficients = analysed(&population, &grid, wavelet)?;
    let locals: Result<Vec<Local>, Error> =
        (0..n).into_par_iter().map(|q| local(&coefficients, n, q, [identities, expressions])).collect();
    let locals = locals?;
    let mean: Vec<f64> = locals.iter().flat_map(|local| local.mean.clone()).collect();
    let core: Vec<f64> = (0..DIM * DIM)
        .flat_map(|k| locals.iter().flat_map(move |local| local.core[3 * k..3 * k + 3].iter().copied()))
        .collect();
    let form = WaveletForm { grid, wavelet, identity_dim: DIM, pose_dim: DIM, mean: &mean, core: &core };
    let mut source = ModelSource::new(Coefficients::Wavelet(form));
    let prior = |mode: usize| ModePrior {
        mean: locals.iter().flat_map(|local| local.means[mode].clone()).collect(),
        scale: locals.iter().flat_map(|local| [local.scales[mode]; DIM]).collect(),
        precision: Vec::new(),
    };
    (source.identity_prior, source.pose_prior) = (prior(0), prior(1));
    let count = population.tensor.len() / (3 * n);
    let mut shape = vec![0.0; 3 * n];
    for face in population.tensor.chunks_exact(3 * n) {
        shape.iter_mut().zip(face).for_each(|(sum, value)| *sum += f64::from(*value) / count as f64);
    }
    source.faces = faces(&population, &shape);
    source.landmarks = population.landmarks.to_vec();
    source.landmark_names = LANDMARKS.iter().map(|name| (*name).to_owned()).collect();
    source.mirror = population.mirror;
    source.provenance = format!(
        "a local model of {DIM} x {DIM} weights for each {wavelet:?} wavelet coefficient of {identities} procedural faces with {expressions} \
        expressions (synth faces, seed 1, level {LEVEL}); a developer's model"
    );
    hab::bytes(&source)
}

#[cfg(test)]
mod tests {
    use super::*;
    use habitus::synth::face_motion::EXPRESSIONS;
    use habitus_core::format::Model;
    use habitus_core::generator::{Generator, Weights};
    use habitus_core::quantise::F32;

    /// Without weights the surface is the mean of the faces.
    #[test]
    fn the_model_lies_among_its_faces() {
        let identities = 4;
        let file = file(identities, Wavelet::Cubic).unwrap();
        let model = Model::open(&file).unwrap();
        let generator = model.wavelet::<F32<'_>>().unwrap();
        let population = FacePopulation::of(&FaceOptions { identities, seed: 1, level: LEVEL }).unwrap();
        let n = generator.vertex_count();
        let (identity, pose) = (vec![0.0; DIM * n], vec![0.0; DIM * n]);
        let mut state = vec![0.0; generator.state_req(false).numbers()];
        let weights = Weights { identity: &identity, pose: &pose };
        let at = generator.begin(weights, false, &mut state).unwrap();
        let mut found = vec![0.0; 3 * n];
        generator.evaluate_at(at, 0..n, &mut found).unwrap();
        let count = identities * EXPRESSIONS.len();
        for (k, found) in found.iter().enumerate() {
            let sum: f64 = population.tensor.iter().skip(k).step_by(3 * n).map(|&value| f64::from(value)).sum();
            assert!((f64::from(*found) - sum / count as f64).abs() < 1e-3);
        }
        assert_eq!(model.faces().unwrap().len(), population.faces.len());
        assert_eq!(model.landmarks().unwrap().len(), 13);
    }
}
