//! A generator made linear at one set of weights, with only its leading identity weights free: what one round of a fit works on.
//!
//! Positions and derivatives are taken once ([`linearise_parallel`]); every sample of the round then costs a look-up.

use habitus_core::generator::bilinear::Bilinear;
use habitus_core::generator::{Block, Generator, LANES, NUMBERS, Weights};

use super::displacement::Displacement;
use super::state::State;
use crate::Error;
use crate::evaluate::linearise_parallel;
use crate::mesh::Mesh;

/// `F(w0) + J (w - w0)` over the first `identity_dim` identity weights and all pose weights.
pub(super) struct Held {
    n_vertices: usize,
    identity_dim: usize,
    pose_dim: usize,
    /// Identity weights of the whole generator: where the columns of the pose begin.
    all_identity: usize,
    /// Pose weights of the generator; the rest of `pose_dim` are amplitudes of the displacement.
    own_pose: usize,
    /// `w0` of the free weights.
    identity: Vec<f32>,
    pose: Vec<f32>,
    values: Vec<f32>,
    jacobian: Vec<f32>,
    /// Columns of the displacement.
    bumps: Vec<f32>,
}

impl Held {
    /// The generator at the weights of `state`, of which the first `identity_dim` identity weights stay free.
    pub(super) fn new(generator: &Bilinear<'_>, state: &State, identity_dim: usize) -> Result<Self, Error> {
        let blocks = generator.block_count();
        let mut values = vec![0.0; blocks * NUMBERS];
        let mut jacobian = vec![0.0; blocks * NUMBERS * generator.dim()];
        let weights = Weights { identity: &state.identity, pose: &state.pose };
        let threads = rayon::current_num_threads();
        linearise_parallel(generator, weights, 0..blocks, &mut values, &mut jacobian, threads)
            .map_err(|error| Error::Kernel { what: "the model cannot be linearised".into(), error })?;
        let identity_dim = identity_dim.min(generator.identity_dim());
        Ok(Held {
            n_vertices: generator.vertex_count(),
            identity_dim,
            pose_dim: generator.pose_dim(),
            all_identity: generator.identity_dim(),
            own_pose: generator.pose_dim(),
            identity: state.identity[..identity_dim].to_vec(),
            pose: state.pose.clone(),
            values,
            jacobian,
            bumps: Vec::new(),
        })
    }

    /// With a displacement along the normals of the surface as it is, whose amplitudes (mm) stand behind the pose weights; they begin with
    /// `amplitudes`.
    pub(super) fn displaced(mut self, displacement: &Displacement, amplitudes: &[f32], faces: &[[u32; 3]]) -> Self {
        let mesh = Mesh { positions: self.positions(), faces: faces.to_vec(), ..Mesh::default() };
        let normals = mesh.vertex_normals();
        let (n_blocks, n_bumps) = (self.n_vertices.div_ceil(LANES), displacement.dim());
        let mut bumps = vec![0.0; n_blocks * n_bumps * NUMBERS];
        let along = |heights: &Vec<f32>| -> Vec<f32> {
            normals.iter().zip(heights).flat_map(|(normal, height)| normal.map(|x| x as f32 * height)).collect()
        };
        let columns = displacement.heights.iter().map(along).chain(displacement.components.iter().cloned());
        for (bump, (column, amplitude)) in columns.zip(amplitudes).enumerate() {
            for (vertex, numbers) in column.as_chunks::<3>().0.iter().enumerate() {
                let (block, lane) = (vertex / LANES, vertex % LANES);
                for (axis, number) in numbers.iter().enumerate() {
                    bumps[(block * n_bumps + bump) * NUMBERS + axis * LANES + lane] = *number;
                    self.values[block * NUMBERS + axis * LANES + lane] += amplitude * number;
                }
            }
        }
        self.bumps = bumps;
        self.pose_dim = self.own_pose + n_bumps;
        self.pose.extend_from_slice(amplitudes);
        self
    }

    /// Positions at `w0`, mm.
    pub(super) fn positions(&self) -> Vec<[f64; 3]> {
        let position = |vertex: usize| {
            let at = vertex / LANES * NUMBERS + vertex % LANES;
            [0, 1, 2].map(|axis| f64::from(self.values[at + axis * LANES]))
        };
        (0..self.n_vertices).map(position).collect()
    }

    /// The numbers of the column of a free weight in one block.
    fn column(&self, block: usize, free: usize) -> Option<&[f32; NUMBERS]> {
        if let Some(bump) = free.checked_sub(self.identity_dim + self.own_pose) {
            let n_bumps = self.pose_dim - self.own_pose;
            return self.bumps.as_chunks::<NUMBERS>().0.get(block * n_bumps + bump);
        }
        let all = self.all_identity + self.own_pose;
        let column = if free < self.identity_dim { free } else { free - self.identity_dim + self.all_identity };
        self.jacobian.as_chunks::<NUMBERS>().0.get(block * all + column)
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

impl Generator for Held {
    fn vertex_count(&self) -> usize {
        self.n_vertices
    }

    fn identity_dim(&self) -> usize {
        self.identity_dim
    }

    fn pose_dim(&self) -> usize {
        self.pose_dim
    }

    fn block_unchecked(&self, weights: Weights<'_>, block: usize) -> Option<Block> {
        let mut value = *self.values.as_chunks::<NUMBERS>().0.get(block)?;
        for (free, step) in self.steps(weights).enumerate() {
            let column = self.column(block, free)?;
            value.iter_mut().zip(column).for_each(|(value, number)| *value += step * number);
        }
        Some(Block::load(&value))
    }

    fn linearised_block_unchecked(
        &self,
        weights: Weights<'_>,
        block: usize,
        jacobian: &mut [[f32; NUMBERS]],
    ) -> Option<Block> {
        for (free, to) in jacobian.iter_mut().take(self.dim()).enumerate() {
            *to = *self.column(block, free)?;
        }
        self.block_unchecked(weights, block)
    }

    fn vertex_unchecked(&self, weights: Weights<'_>, vertex: usize) -> Option<[f32; 3]> {
        let (block, at) = (vertex / LANES, vertex % LANES);
        let mut value = lane(self.values.as_chunks::<NUMBERS>().0.get(block)?, at);
        for (free, step) in self.steps(weights).enumerate() {
            let [x, y, z] = lane(self.column(block, free)?, at);
            value = [value[0] + step * x, value[1] + step * y, value[2] + step * z];
        }
        Some(value)
    }

    fn linearised_vertex_unchecked(
        &self,
        weights: Weights<'_>,
        vertex: usize,
        jacobian: &mut [[f32; 3]],
    ) -> Option<[f32; 3]> {
        let (block, at) = (vertex / LANES, vertex % LANES);
        let mut value = lane(self.values.as_chunks::<NUMBERS>().0.get(block)?, at);
        for ((free, step), to) in self.steps(weights).enumerate().zip(jacobian.iter_mut()) {
            let [x, y, z] = lane(self.column(block, free)?, at);
            value = [value[0] + step * x, value[1] + step * y, value[2] + step * z];
            *to = [x, y, z];
        }
        Some(value)
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
            let at = held.linearised_vertex_unchecked(weights, vertex, &mut columns).expect("a vertex");
            assert_eq!(at.map(f64::from), held.positions()[vertex]);
            for (k, column) in columns.iter().take(7).enumerate() {
                let step = 0.125;
                let moved = |sign: f32| {
                    let (mut identity, mut pose) = (state.identity.clone(), state.pose.clone());
                    *identity.iter_mut().chain(&mut pose).nth(k).expect("a weight") += sign * step;
                    generator.vertex_unchecked(Weights { identity: &identity, pose: &pose }, vertex).expect("a vertex")
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
        let block = held.linearised_block_unchecked(weights, 3, &mut jacobian).expect("a block");
        let mut numbers = [0.0; NUMBERS];
        block.store(&mut numbers);
        let mut columns = vec![[0.0f32; 3]; held.dim()];
        for at in 0..LANES {
            let vertex = held.linearised_vertex_unchecked(weights, 3 * LANES + at, &mut columns).expect("a vertex");
            assert_eq!(lane(&numbers, at), vertex);
            assert_eq!(held.vertex_unchecked(weights, 3 * LANES + at), Some(vertex));
            assert!(jacobian.iter().zip(&columns).all(|(block, column)| lane(block, at) == *column));
        }
        assert!(held.vertex_unchecked(weights, n + LANES).is_none());
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
            assert_eq!(some.column(5, k), all.column(5, of_all));
        }
    }
}
