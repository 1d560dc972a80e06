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
