//! Synthesis of wavelets on two grids, and a model with a bilinear one for each coefficient.

use std::error::Error;
use std::hint::black_box;

use habitus::evaluate::{evaluate_at, evaluate_surface_parallel, wavelet_synthesis, wavelet_synthesis_parallel};
use habitus::io::model::{Coefficients, ModelSource, WaveletForm, hab};
use habitus_core::format::{Checksums, Model};
use habitus_core::generator::{Generator, Weights};
use habitus_core::quantise::F32;
use habitus_core::wavelet::{Grid, Wavelet, transform};

use super::inputs::Inputs;
use super::{Bench, Job};
use crate::workload::noise;

/// Identity and pose weights of each coefficient, as the peers have them.
const DIMS: [usize; 2] = [10, 5];

/// Synthesis on both grids.
///
/// # Errors
/// When a program fails or results differ.
pub fn synthesis(bench: &mut Bench<'_>, inputs: &Inputs) -> Result<(), Box<dyn Error>> {
    for (levels, coefficients) in [5, 6].into_iter().zip(&inputs.wavelets) {
        let grid = Grid::new(5, 7, levels)?;
        let mut workspace = vec![0.0; transform::synthesis_req(&grid, levels).numbers()];
        let mut out = vec![0.0; 3 * grid.len()];
        let peer = format!("wavelet{levels}");
        let name = format!("wavelet synthesis, {} x {} x 3", grid.width(levels), grid.height(levels));
        let job = Job::new(name, 3.0 * 12.0 * grid.len() as f64).peer(&peer, "C++ lifting in place", Some(0.3));
        let plain = format!("levels{levels}");
        let job = job.plain(&plain).packaged(if levels == 5 { "wavelet_rec_L5" } else { "wavelet_rec_L6" });
        bench.row(&job, || {
            let out = black_box(&mut out);
            Ok(wavelet_synthesis(&grid, Wavelet::Cubic, levels, coefficients, out, &mut workspace)?)
        })?;
        bench.expect(&peer, &out, 1e-5)?;
        bench.expect(&plain, &out, 1e-5)?;
        bench.row(&job.on(2), || {
            Ok(wavelet_synthesis_parallel(&grid, Wavelet::Cubic, levels, coefficients, black_box(&mut out), 2)?)
        })?;
    }
    Ok(())
}

/// Every coefficient's model, and the synthesis behind them.
///
/// # Errors
/// When a program fails or results differ.
pub fn model(bench: &mut Bench<'_>) -> Result<(), Box<dyn Error>> {
    let grid = Grid::new(5, 7, 5)?;
    let [identity_dim, pose_dim] = DIMS;
    let number = |k: usize| f64::from(noise(7_000_000 + k));
    let mean: Vec<f64> = (0..3 * grid.len()).map(number).collect();
    let core: Vec<f64> = (0..3 * grid.len() * identity_dim * pose_dim).map(|k| number(k + mean.len())).collect();
    let form = WaveletForm { grid, wavelet: Wavelet::Cubic, identity_dim, pose_dim, mean: &mean, core: &core };
    let file = hab::bytes(&ModelSource::new(Coefficients::Wavelet(form)))?;
    let generator = Model::open_with(&file, Checksums::Skip)?.wavelet::<F32<'_>>()?;
    let n = generator.vertex_count();
    let own = |dim: usize, seed: usize| (0..n * dim).map(|k| noise(seed + k)).collect::<Vec<f32>>();
    let (identity, pose) = (own(identity_dim, 8_000_000), own(pose_dim, 9_000_000));
    let weights = Weights { identity: &identity, pose: &pose };
    let mut state = vec![0.0; generator.state_req(false).numbers()];
    let mut out = vec![0.0; 3 * n];
    let moved = 4.0 * (n * (3 + 3 * identity_dim * pose_dim + identity_dim + pose_dim + 2 * 3)) as f64;
    let name = format!("{n} local models {identity_dim} x {pose_dim}, with synthesis");
    let job = Job::new(name, moved).plain("locals_blocks").packaged("wavelet_local_models");
    let job = job.peer("locals", "C++ loop + lifting in place", None);
    bench.row(&job, || {
        let at = generator.begin(weights, false, &mut state)?;
        Ok(evaluate_at(&generator, at, 0..n, black_box(&mut out))?)
    })?;
    bench.expect("locals", &out, 1e-5)?;
    bench.expect("locals_blocks", &out, 1e-5)?;
    bench.row(&job.on(2), || Ok(evaluate_surface_parallel(&generator, weights, black_box(&mut out), 2)?))
}
