//! A generator made linear at one set of weights, with only its leading identity weights free: what one round of a fit works on.
//!
//! Positions and derivatives are taken once ([`linearise_parallel`]) and laid out vertex by vertex: the points of a scan meet the vertices in no
//! order, and each costs one run of numbers.

use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::{At, Block, Generator, LANES, NUMBERS, Weights};
use rayon::prelude::*;

use super::displacement::Displacement;
use super::state::State;
use crate::Error;
use crate::evaluate::linearise_parallel;
use crate::mesh::Mesh;

/// `F(w0) + J (w - w0)` over the first `identity_dim` identity weights and all pose weights.
pub(super) struct Held {
    identity_dim: usize,
    /// Pose weights of the generator, then the amplitudes of the displacement.
    pose_dim: usize,
    /// `w0` of the free weights.
    identity: Vec<f32>,
    pose: Vec<f32>,
    /// Position of each vertex at `w0`.
    values: Vec<[f32; 3]>,
    /// Derivatives of a vertex by the free weights, identity first, vertex after vertex.
    jacobian: Vec<[f32; 3]>,
}

impl Held {
    /// The generator at the weights of `state`, of which the first `identity_dim` identity weights stay free.
    ///
    /// Errors: another kind than a bilinear one, see [`super::start::bilinear`].
    pub(super) fn new(generator: &AnyGenerator<'_>, state: &State, identity_dim: usize) -> Result<Self, Error> {
        match generator {
            AnyGenerator::BilinearF32(generator) => Self::of(generator, state, identity_dim),
            AnyGenerator::BilinearF16(generator) => Self::of(generator, state, identity_dim),
            AnyGenerator::BilinearI8(generator) => Self::of(generator, state, identity_dim),
            _ => Err(Error::Internal("a fit of a model that is not bilinear".into())),
        }
    }

    /// The same with the kernels of one storage.
    fn of<G: Generator + Sync>(generator: &G, state: &State, identity_dim: usize) -> Result<Self, Error> {
        let (blocks, all) = (generator.block_count(), generator.dim());
        let mut values = vec![0.0; blocks * NUMBERS];
        let mut jacobian = vec![0.0; blocks * NUMBERS * all];
        let weights = Weights { identity: &state.identity, pose: &state.pose };
        let threads = rayon::current_num_threads();
        linearise_parallel(generator, weights, 0..blocks, &mut values, &mut jacobian, threads)
            .map_err(|error| Error::Kernel { what: "the model cannot be linearised".into(), error })?;
        let identity_dim = identity_dim.min(generator.identity_dim());
        let n = generator.vertex_count();
        let values = values.as_chunks::<NUMBERS>().0;
        let columns = jacobian.as_chunks::<NUMBERS>().0;
        let free: Vec<usize> = (0..identity_dim).chain(generator.identity_dim()..all).collect();
        let mut by_vertex = vec![[0.0; 3]; n * free.len()];
        by_vertex.par_chunks_mut((LANES * free.len()).max(1)).zip(columns.par_chunks_exact(all.max(1))).for_each(
            |(rows, columns)| {
                for (at, row) in rows.chunks_exact_mut(free.len()).enumerate() {
                    row.iter_mut().zip(&free).for_each(|(to, &column)| *to = lane(&columns[column], at));
                }
            },
        );
        Ok(Held {
            identity_dim,
            pose_dim: generator.pose_dim(),
            identity: state.identity[..identity_dim].to_vec(),
            pose: state.pose.clone(),
            values: (0..n).map(|vertex| lane(&values[vertex / LANES], vertex % LANES)).collect(),
            jacobian: by_vertex,
        })
    }

    /// With a displacement of the surface as it is, whose amplitudes stand behind the pose weights; they begin with `amplitudes`.
    pub(super) fn displaced(mut self, displacement: &Displacement, amplitudes: &[f32], faces: &[[u32; 3]]) -> Self {
        if displacement.dim() == 0 {
            return self;
        }
        let mesh = Mesh { positions: self.positions(), faces: faces.to_vec(), ..Mesh::default() };
        let normals = mesh.vertex_normals();
        let (own, more) = (self.dim(), displacement.dim());
        let mut jacobian = vec![[0.0; 3]; self.values.len() * (own + more)];
        jacobian.par_chunks_exact_mut(own + more).zip(&mut self.values).enumerate().for_each(
            |(vertex, (row, value))| {
                let (first, second) = row.split_at_mut(own);
                first.copy_from_slice(&self.jacobian[vertex * own..][..own]);
                displacement.columns(vertex, normals[vertex], second);
                for (column, amplitude) in second.iter().zip(amplitudes) {
                    *value = moved(*value, *amplitude, *column);
                }
            },
        );
        self.jacobian = jacobian;
        self.pose_dim += more;
        self.pose.extend_from_slice(amplitudes);
        self
    }

    /// Positions at `w0`, mm.
    pub(super) fn positions(&self) -> Vec<[f64; 3]> {
        self.values.iter().map(|value| value.map(f64::from)).collect()
    }

    /// Derivatives of a vertex by the free weights.
    fn row(&self, vertex: usize) -> Option<&[[f32; 3]]> {
        self.jacobian.get(vertex * self.dim()..)?.get(..self.dim())
    }

    /// What the weights differ from `w0`, identity first.
    fn steps<'a>(&'a self, weights: Weights<'a>) -> impl Iterator<Item = f32> + 'a {
        let identity = weights.identity.iter().zip(&self.identity);
        identity.chain(weights.pose.iter().zip(&self.pose)).map(|(weight, start)| weight - start)
    }
}

fn lane(numbers: &[f32; NUMBERS], lane: usize) -> [f32; 3] {
    [numbers[lane], numbers[LANES + lane], numbers[2 * LANES + lane]]
}

fn moved([x, y, z]: [f32; 3], step: f32, [u, v, w]: [f32; 3]) -> [f32; 3] {
    [x + step * u, y + step * v, z + step * w]
}

impl Generator for Held {
    fn vertex_count(&self) -> usize {
        self.values.len()
    }

    fn identity_dim(&self) -> usize {
        self.identity_dim
    }

    fn pose_dim(&self) -> usize {
        self.pose_dim
    }

    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block> {
        let mut value = [0.0; NUMBERS];
        for lane in 0..LANES.min(self.values.len().checked_sub(block * LANES)?) {
            let position = self.vertex_unchecked(at, block * LANES + lane)?;
            (0..3).for_each(|axis| value[axis * LANES + lane] = position[axis]);
        }
        Some(Block::load(&value))
    }

    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block> {
        jacobian.iter_mut().for_each(|column| *column = [0.0; NUMBERS]);
        for lane in 0..LANES.min(self.values.len().checked_sub(block * LANES)?) {
            for (column, to) in self.row(block * LANES + lane)?.iter().zip(jacobian.iter_mut()) {
                (0..3).for_each(|axis| to[axis * LANES + lane] = column[axis]);
            }
        }
        self.block_unchecked(at, block)
    }

    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]> {
        // A round takes one step, from here.
        let weights = at.weights();
        if weights.identity == self.identity && weights.pose == self.pose {
            return self.values.get(vertex).copied();
        }
        let columns = self.steps(weights).zip(self.row(vertex)?);
        Some(columns.fold(*self.values.get(vertex)?, |value, (step, column)| moved(value, step, *column)))
    }

    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        jacobian.get_mut(..self.dim())?.copy_from_slice(self.row(vertex)?);
        self.vertex_unchecked(at, vertex)
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{faces, held, mean_state, model};
    use super::super::start::bilinear;
    use super::*;

    fn state() -> State {
        let mut state = mean_state();
        state.identity.iter_mut().zip([0.3, -0.2, 0.1, 0.2]).for_each(|(to, step)| *to += step);
        state.pose[1] -= 0.3;
        state
    }

    fn displacement(n: usize) -> Displacement {
        let heights = vec![(0..n).map(|v| v as f32 / n as f32).collect(), vec![1.0; n]];
        Displacement { heights, components: vec![(0..3 * n).map(|k| (k % 7) as f32).collect()], precision: Vec::new() }
    }

    /// The columns of the displaced model: those of the generator by finite differences, normals times heights, components.
    #[test]
    fn columns_are_finite_differences() {
        let (model, state) = (model(), state());
        let generator = bilinear(&model).expect("a generator");
        let n = generator.vertex_count();
        let plain = held(&state);
        let mesh = Mesh { positions: plain.positions(), faces: faces(), ..Mesh::default() };
        let normals = mesh.vertex_normals();
        let bent = displacement(n);
        let held = held(&state).displaced(&bent, &[0.5, -0.25, 2.0], &faces());
        assert_eq!(held.dim(), 4 + 3 + 3);
        let pose: Vec<f32> = state.pose.iter().copied().chain([0.5, -0.25, 2.0]).collect();
        let weights = Weights { identity: &state.identity, pose: &pose };
        let mut columns = vec![[0.0f32; 3]; held.dim()];
        for vertex in [0, 15, 16, 700, n - 1] {
            let value = held
                .linearised_vertex_unchecked(held.begin(weights, true, &mut []).unwrap(), vertex, &mut columns)
                .expect("a vertex");
            assert_eq!(value.map(f64::from), held.positions()[vertex]);
            for (k, column) in columns.iter().take(7).enumerate() {
                let step = 0.125;
                let moved = |sign: f32| {
                    let (mut identity, mut pose) = (state.identity.clone(), state.pose.clone());
                    *identity.iter_mut().chain(&mut pose).nth(k).expect("a weight") += sign * step;
                    generator
                        .vertex_unchecked(
                            generator.begin(Weights { identity: &identity, pose: &pose }, true, &mut []).unwrap(),
                            vertex,
                        )
                        .expect("a vertex")
                };
                let (high, low) = (moved(1.0), moved(-1.0));
                for axis in 0..3 {
                    let difference = (high[axis] - low[axis]) / (2.0 * step);
                    assert!((column[axis] - difference).abs() < 2e-3 * (1.0 + difference.abs()), "{vertex} {k}");
                }
            }
            for (bump, heights) in bent.heights.iter().enumerate() {
                let expected = normals[vertex].map(|x| x as f32 * heights[vertex]);
                assert_eq!(columns[7 + bump], expected);
            }
            assert_eq!(columns[9][..], bent.components[0][3 * vertex..][..3]);
        }
    }

    /// Blocks and single vertices agree; amplitudes move the surface by what their columns say.
    #[test]
    fn blocks_hold_the_same_vertices() {
        let state = state();
        let n = model().header().n_vertices as usize;
        let bent = displacement(n);
        let held = held(&state).displaced(&bent, &[0.0; 3], &faces());
        let pose: Vec<f32> = state.pose.iter().copied().chain([0.5, 1.0, -0.5]).collect();
        let identity: Vec<f32> = state.identity.iter().map(|x| x + 0.1).collect();
        let weights = Weights { identity: &identity, pose: &pose };
        let mut jacobian = vec![[0.0; NUMBERS]; held.dim()];
        let block = held
            .linearised_block_unchecked(held.begin(weights, true, &mut []).unwrap(), 3, &mut jacobian)
            .expect("a block");
        let mut numbers = [0.0; NUMBERS];
        block.store(&mut numbers);
        let mut columns = vec![[0.0f32; 3]; held.dim()];
        for at_lane in 0..LANES {
            let vertex = held
                .linearised_vertex_unchecked(
                    held.begin(weights, true, &mut []).unwrap(),
                    3 * LANES + at_lane,
                    &mut columns,
                )
                .expect("a vertex");
            assert_eq!(lane(&numbers, at_lane), vertex);
            assert_eq!(
                held.vertex_unchecked(held.begin(weights, true, &mut []).unwrap(), 3 * LANES + at_lane),
                Some(vertex)
            );
            assert!(jacobian.iter().zip(&columns).all(|(block, column)| lane(block, at_lane) == *column));
        }
        assert!(held.vertex_unchecked(held.begin(weights, true, &mut []).unwrap(), n + LANES).is_none());
    }

    /// With some identity weights held, the columns of the pose follow the free ones.
    #[test]
    fn held_weights_have_no_column() {
        let state = state();
        let all = held(&state);
        let some = Held::new(&bilinear(&model()).expect("a generator"), &state, 2).expect("linear");
        assert_eq!((some.identity_dim(), some.pose_dim(), some.dim()), (2, 3, 5));
        assert_eq!(some.positions(), all.positions());
        for (k, of_all) in [(0, 0), (1, 1), (2, 4), (3, 5), (4, 6)] {
            assert_eq!(some.row(5).expect("a row")[k], all.row(5).expect("a row")[of_all]);
        }
    }
}
