//! Gauss-Newton normal equations of a generator placed in a scan, from samples; the `3n x d` Jacobian is never held.

use super::rows::{Rows, rows_req};
use super::samples::{Sample, Samples};
use crate::Error;
use crate::Real;
use crate::generator::block::lane_of_numbers;
use crate::generator::{At, Block, Generator, LANES, NUMBERS, Weights};
use crate::rotation::similarity::Similarity;
use crate::workspace::{Requirement, Workspace, check_len, saturated};

/// Which motions of the placement are variables beside the weights. A motion is one of the model in its own frame:
/// rotation vector (3, radians), translation (3, millimetres), logarithm of the scale (1), in this order, zero at the placement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    /// None: the placement is known.
    Fixed,
    /// Rotation and translation.
    Rigid,
    /// Rotation, translation and scale.
    Similarity,
}

impl Frame {
    /// Number of variables.
    pub const fn dim(self) -> usize {
        match self {
            Frame::Fixed => 0,
            Frame::Rigid => 6,
            Frame::Similarity => 7,
        }
    }
}

/// Scratch of [`normal_equations`] for a generator with `dim` weights, to which [`Generator::state_req`] with derivatives is added (nothing for sums of terms).
pub const fn normal_equations_req(dim: usize, frame: Frame) -> Requirement {
    let columns = dim.saturating_mul(NUMBERS + 6);
    rows_req(dim.saturating_add(frame.dim()).saturating_add(1)).and(Requirement::of(columns))
}

/// Writes the normal equations of `E = sum_k weight_k |r_k|^2`, with `r_k = s R x_k(w) + t - target_k`, and returns `E` (mm^2).
///
/// With a normal, `r_k` is the distance along it. Derivatives are by the identity weights, the pose weights, and the motions of `frame`. They are
/// taken in the frame of the model, where rotation and translation of the placement drop out, and scaled by `s`.
///
/// | argument | shape | note |
/// |---|---|---|
/// | `samples` | any | samples of one block of vertices side by side are cheapest: a block is linearised once for a run of them |
/// | `jtj` | `m * m`, row-major, both triangles | `m = identity_dim + pose_dim + frame.dim()` |
/// | `jtr` | `m` | |
/// | `workspace` | [`normal_equations_req`] and the generator's state | |
///
/// Rows: with `p` the point, from zero plus each corner's weight times its position, derivatives likewise; `q = R^T (target - t) / s`; the factor
/// `f = s sqrt(weight)`; and a direction `d`, which is `f` along x, y, z in turn, or `f R^T normal`: a row is `d . derivative` for each weight, then
/// `p x d`, `d`, `d . p` for the motions, then `d . (p - q)`. Scalar products sum x, y, z in this order, also with the zeros of an axis.
///
/// Determinism: a sample's three rows (x, y, z of the model's frame; one with a normal) enter in the order of the samples; their products are summed in
/// groups of 24 rows. Errors: `DimensionMismatch`, `NotFinite` (weights, a placement whose scale is not above zero, index of a sample, or sums beyond `f32`), `BadSample` (normal), `IndexOutOfRange` (vertex of a sample), `WorkspaceTooSmall`.
/// Panics: never.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
#[allow(clippy::too_many_arguments)]
pub fn normal_equations<G: Generator + ?Sized, S: Samples + ?Sized>(
    generator: &G,
    weights: Weights<'_>,
    samples: &S,
    placement: &Similarity<f32>,
    frame: Frame,
    jtj: &mut [f32],
    jtr: &mut [f32],
    workspace: &mut [f32],
) -> Result<f32, Error> {
    let dim = generator.dim();
    let all = dim + frame.dim();
    weights.check(generator.identity_dim(), generator.pose_dim())?;
    let state_req = generator.state_req(true);
    check_len(all, jtr.len())?;
    check_len(all.saturating_mul(all), jtj.len())?;
    normal_equations_req(dim, frame).and(state_req).check(workspace.len())?;
    if !placement.is_finite() {
        return Err(Error::NotFinite { index: 0 });
    }
    let mut pieces = Workspace::new(workspace);
    let at = generator.begin(weights, true, pieces.take(state_req.numbers())?)?;
    let mut rows = Rows::new(all + 1, &mut pieces)?;
    let mut surface = Surface {
        generator,
        at,
        block: None,
        values: Block::ZERO,
        columns: pieces.take(dim * NUMBERS)?.as_chunks_mut().0,
        vertex: pieces.take(dim * 3)?.as_chunks_mut().0,
        sum: pieces.take(dim * 3)?.as_chunks_mut().0,
    };
    let mut next = samples.get(0);
    for index in 0..samples.len() {
        let sample = next;
        next = samples.get(index + 1);
        let Some(sample) = sample else { continue };
        check_sample(&sample, index, generator.vertex_count())?;
        if sample.weight == 0.0 {
            continue;
        }
        let next_vertex = next.map(|sample| sample.point.vertices[0]);
        let position = surface.linearise(&sample, next_vertex).ok_or(Error::NotFinite { index: saturated(index) })?;
        push_rows(&mut rows, &sample, position, surface.sum, placement, frame);
    }
    rows.finish(jtj, jtr)
}

/// Squares of lengths that pass for a unit normal: eight bits per component give one per cent.
const UNIT: (f32, f32) = (0.95, 1.05);

/// Refuses samples that are not numbers or whose vertices do not exist.
pub(super) fn check_sample(sample: &Sample, index: usize, n_vertices: usize) -> Result<(), Error> {
    let normal = sample.normal.unwrap_or_default();
    let numbers = sample.target.iter().chain(&normal).chain(&sample.point.barycentric);
    if !(sample.weight >= 0.0) || sample.weight.is_infinite() || numbers.into_iter().any(|value| !value.is_finite()) {
        return Err(Error::NotFinite { index: saturated(index) });
    }
    if let Some([a, b, c]) = sample.normal
        && !(UNIT.0..=UNIT.1).contains(&(a * a + b * b + c * c))
    {
        return Err(Error::BadSample { index: saturated(index) });
    }
    for (&vertex, &part) in sample.point.vertices.iter().zip(&sample.point.barycentric) {
        if part != 0.0 && vertex as usize >= n_vertices {
            return Err(Error::IndexOutOfRange { index: vertex, limit: saturated(n_vertices) });
        }
    }
    Ok(())
}

/// The generator at fixed weights, with the last block kept.
struct Surface<'a, 'w, G: ?Sized> {
    generator: &'a G,
    at: At<'a>,
    block: Option<usize>,
    values: Block,
    columns: &'w mut [[f32; NUMBERS]],
    vertex: &'w mut [[f32; 3]],
    sum: &'w mut [[f32; 3]],
}

impl<G: Generator + ?Sized> Surface<'_, '_, G> {
    /// Position of a sample's point; its derivatives are in `sum`. `None` for a vertex that does not exist.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn linearise(&mut self, sample: &Sample, next_vertex: Option<u32>) -> Option<[f32; 3]> {
        let mut position = [0.0; 3];
        self.sum.fill([0.0; 3]);
        for (&vertex, &part) in sample.point.vertices.iter().zip(&sample.point.barycentric) {
            if part == 0.0 {
                continue;
            }
            let block = vertex as usize / LANES;
            let run = next_vertex.is_some_and(|next| next as usize / LANES == block);
            let value = if self.block == Some(block) || run {
                self.lane_of_block(block, vertex as usize % LANES, part)?
            } else {
                let value = self.generator.linearised_vertex_unchecked(self.at, vertex as usize, self.vertex)?;
                for (sum, column) in self.sum.iter_mut().zip(self.vertex.iter()) {
                    add_scaled(sum, part, *column);
                }
                value
            };
            add_scaled(&mut position, part, value);
        }
        Some(position)
    }

    /// One lane of a block, which is linearised unless it is the last one.
    #[inline(always)]
    fn lane_of_block(&mut self, block: usize, lane: usize, part: f32) -> Option<[f32; 3]> {
        if self.block != Some(block) {
            self.values = self.generator.linearised_block_unchecked(self.at, block, self.columns)?;
            self.block = Some(block);
        }
        for (sum, column) in self.sum.iter_mut().zip(self.columns.iter()) {
            add_scaled(sum, part, lane_of_numbers(column, lane));
        }
        Some(self.values.lane(lane))
    }
}

#[inline(always)]
fn add_scaled(sum: &mut [f32; 3], factor: f32, value: [f32; 3]) {
    for (sum, value) in sum.iter_mut().zip(value) {
        *sum += factor * value;
    }
}

/// The rows of one sample: derivatives by the weights, by the motions, and the residual.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
fn push_rows(
    rows: &mut Rows<'_>,
    sample: &Sample,
    position: [f32; 3],
    derivatives: &[[f32; 3]],
    placement: &Similarity<f32>,
    frame: Frame,
) {
    let target = placement.inverse_applied(sample.target);
    let [x, y, z] = position;
    let difference = [x - target[0], y - target[1], z - target[2]];
    let factor = placement.scale * Real::sqrt(sample.weight);
    // Rows by a loop, not by a closure called in several places: that would not be inlined and so keep the narrowest vectors.
    let (directions, count) = match sample.normal {
        Some(normal) => ([placement.inverse_rotated(normal).map(|value| factor * value), [0.0; 3], [0.0; 3]], 1),
        None => ([[factor, 0.0, 0.0], [0.0, factor, 0.0], [0.0, 0.0, factor]], 3),
    };
    for [a, b, c] in directions.into_iter().take(count) {
        let along = |[p, q, r]: [f32; 3]| a * p + b * q + c * r;
        let motions = [
            // direction . (e_k x position): the derivative by the rotation about axis k.
            y * c - z * b,
            z * a - x * c,
            x * b - y * a,
            a,
            b,
            c,
            along(position),
        ];
        let row = rows.next_row();
        let (by_weights, rest) = row.split_at_mut_checked(derivatives.len()).unwrap_or_default();
        for (entry, &column) in by_weights.iter_mut().zip(derivatives) {
            *entry = along(column);
        }
        let last = [along(difference)];
        for (entry, value) in rest.iter_mut().zip(motions.iter().take(frame.dim()).chain(&last)) {
            *entry = *value;
        }
    }
}
