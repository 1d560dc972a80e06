//! The multilinear wavelet generator (Wuhrer, ch. 15): a bilinear model for each coefficient of a wavelet transform of the surface.
//!
//! A coefficient q has weights of its own, `s_q = mean_q + sum_i x_qi sum_j y_qj m_qij`; the surface is the synthesis of all `s_q`
//! ([`crate::wavelet`]). Local models see local variation, so a few training faces span many shapes, and a coarse surface needs only a prefix
//! of the weights.
//!
//! Source: Brunton, Bolkart and Wuhrer 2014 (`brunton2014wavelets`).

pub(crate) mod local;
mod prepared;
mod source;
#[cfg(test)]
mod tests;

use core::ops::Range;

use super::lanes::Columns;
use super::{At, Block, Generator, LANES, NUMBERS, Weights};
use crate::Error;
use crate::quantise::Storage;
use crate::wavelet::basis::{Basis, coefficient_lines, lines_req, scratch_req};
use crate::wavelet::span::Interval;
use crate::wavelet::step::{Rows, Samples};
use crate::wavelet::window::{Rectangle, longest_row, planes, planes_req};
use crate::wavelet::{Grid, Wavelet};
use crate::workspace::{Requirement, saturated};
pub use local::{Fixed, Locals, Stored};
pub use prepared::{with_fixed, with_fixed_req};
use source::Source;

/// A wavelet generator; copying it copies views.
///
/// Weights are those of the coefficients in the order of [`Grid`]: all identity weights of coefficient 0, then those of coefficient 1, and so on,
/// likewise for the pose. The vertices are the nodes of the grid in rows, or of a window of it. [`Generator::begin`] writes all of their positions;
/// what gives vertices behind it only reads them.
///
/// Cost of `begin`: one pass over the coefficients of the file that the window needs, each block as one of [`Bilinear`](super::bilinear::Bilinear), and the
/// synthesis; with derivatives also the lines of the transform's functions. A position then is a copy. Derivatives are dense: every block of
/// vertices has a column for every weight of every coefficient, nearly all of them zero, so a linearisation costs and writes `dim` blocks a
/// block. That is for models of a few levels ([`Multiscale::with_levels`]); [`fit_wavelet`](crate::fit::fit_wavelet) fits fine ones coefficient by coefficient.
///
/// Order of summation: that of [`Stored`] for a coefficient, of [`lifting`](crate::wavelet::lifting) for the synthesis. A derivative is the product of the function's two
/// lines at the node, rounded, times the derivative of the coefficient, added to zero.
#[derive(Debug, Clone, Copy)]
pub struct Multiscale<L> {
    locals: L,
    /// The grid of the file.
    whole: Grid,
    /// The grid up to the level at which the synthesis stops.
    grid: Grid,
    wavelet: Wavelet,
    detail: usize,
    /// The window, in nodes of `grid`.
    window: Rectangle,
    /// The first of its nodes that is a vertex.
    first: usize,
    n_vertices: usize,
}

/// Numbers of the parts of the state: positions, lines along rows and columns, scratch.
struct Sizes {
    positions: usize,
    lines: [usize; 2],
    scratch: usize,
}

impl<'a, S: Storage<'a>> Multiscale<Stored<'a, S>> {
    /// The same model with weights for the coefficients up to level `detail` alone, the finer ones standing at their mean, and the surface as it is at
    /// level `resolution`, whose nodes are the vertices. The window is the whole grid again.
    ///
    /// The weights are a prefix of those of more levels. Weights of levels beyond the resolution, if any, do nothing.
    /// Errors: `IndexOutOfRange` for a level that the grid has not.
    pub fn with_levels(mut self, detail: usize, resolution: usize) -> Result<Self, Error> {
        self.whole.check_level(detail)?;
        self.whole.check_level(resolution)?;
        self.grid = Grid::new(self.whole.width(0), self.whole.height(0), resolution)?;
        self.detail = detail;
        self.window = whole_window(&self.grid);
        (self.first, self.n_vertices) = (0, self.window.area());
        Ok(self)
    }
}

impl<L: Locals> Multiscale<L> {
    pub(crate) fn new(locals: L, grid: Grid, wavelet: Wavelet) -> Self {
        let window = whole_window(&grid);
        Multiscale {
            locals,
            whole: grid,
            grid,
            wavelet,
            detail: grid.levels(),
            window,
            first: 0,
            n_vertices: window.area(),
        }
    }

    /// The same model of the nodes `columns` x `rows` alone, in rows: the bits of the whole, for memory and time in proportion to the window.
    ///
    /// Errors: `IndexOutOfRange` for a range beyond the grid of the resolution, `Empty`.
    pub fn with_window(mut self, columns: Range<usize>, rows: Range<usize>) -> Result<Self, Error> {
        let level = self.grid.levels();
        let interval = |range: Range<usize>, size: usize| {
            if range.start > range.end || range.end > size {
                let index = saturated(range.end.max(range.start));
                return Err(Error::IndexOutOfRange { index, limit: saturated(size) });
            }
            if range.is_empty() { Err(Error::Empty) } else { Ok(Interval { from: range.start, to: range.end }) }
        };
        self.window = Rectangle {
            columns: interval(columns, self.grid.width(level))?,
            rows: interval(rows, self.grid.height(level))?,
        };
        (self.first, self.n_vertices) = (0, self.window.area());
        Ok(self)
    }

    /// The same model of the vertices of some blocks alone: vertex `v` of the result is vertex `LANES * blocks.start + v`.
    pub(crate) fn with_blocks(mut self, blocks: &Range<usize>) -> Self {
        let from = (blocks.start * LANES).min(self.n_vertices);
        let to = (blocks.end * LANES).min(self.n_vertices).max(from);
        let width = self.window.columns.len().max(1);
        let (from, count) = (self.first + from, to - from);
        let (row, last) = (from / width, (from + count).saturating_sub(1) / width);
        let rows = &mut self.window.rows;
        rows.to = (rows.from + last.max(row) + 1).min(rows.to);
        // Without vertices there is still a window, of one row.
        rows.from = (rows.from + row).min(rows.to.saturating_sub(1));
        (self.first, self.n_vertices) = (from % width, count);
        self
    }

    /// The same model with other local models.
    fn with_locals<M>(&self, locals: M) -> Multiscale<M> {
        let Multiscale { whole, grid, wavelet, detail, window, first, n_vertices, .. } = *self;
        Multiscale { locals, whole, grid, wavelet, detail, window, first, n_vertices }
    }

    /// The local models.
    pub const fn locals(&self) -> &L {
        &self.locals
    }

    /// The grid up to the level of the resolution; its nodes are the vertices when there is no window.
    pub const fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The grid of the file.
    pub const fn whole_grid(&self) -> &Grid {
        &self.whole
    }

    /// Which wavelet.
    pub const fn wavelet(&self) -> Wavelet {
        self.wavelet
    }

    /// The finest level that has weights.
    pub const fn detail(&self) -> usize {
        self.detail
    }

    /// Column and row, in the grid, of a vertex.
    pub fn node(&self, vertex: usize) -> Option<[usize; 2]> {
        if vertex >= self.n_vertices {
            return None;
        }
        let width = self.window.columns.len();
        let (row, column) = ((self.first + vertex).checked_div(width)?, (self.first + vertex).checked_rem(width)?);
        Some([self.window.columns.from + column, self.window.rows.from + row])
    }

    /// Coefficients that have weights and are in the surface.
    fn n_weighted(&self) -> usize {
        self.whole.node_count(self.detail).min(self.grid.len())
    }

    /// What the window needs of level 0.
    fn base(&self) -> Rectangle {
        self.window.needed(&self.grid, self.grid.levels(), 0)
    }

    /// Coefficients that the synthesis asks for at a time, at most.
    fn longest_row(&self) -> usize {
        longest_row(&self.grid, self.grid.levels(), self.window).max(self.base().columns.len())
    }

    fn sizes(&self, derivatives: bool) -> Sizes {
        let axes = [self.grid.columns(), self.grid.rows()];
        let local = LANES.saturating_mul(self.locals.identity_dim() + self.locals.pose_dim());
        let synthesis = Requirement::of(local)
            .and(Requirement::of(3 * self.longest_row()))
            .and(Requirement::of(3 * self.base().area()))
            .and(planes_req(&self.grid, self.grid.levels(), self.window, 3));
        let (lines, scratch) = if derivatives {
            let scratch = scratch_req(&axes[0]).or(scratch_req(&axes[1]));
            (axes.map(|axis| lines_req(&axis, self.wavelet).numbers()), scratch.or(synthesis))
        } else {
            ([0; 2], synthesis)
        };
        Sizes { positions: 3 * self.window.area(), lines, scratch: scratch.numbers() }
    }

    /// Writes the lines into a state, if they are wanted; what is left are the positions and scratch.
    fn write_lines<'s>(&self, derivatives: bool, state: &'s mut [f32]) -> (&'s mut [f32], &'s mut [f32]) {
        let sizes = self.sizes(derivatives);
        let (positions, rest) = state.split_at_mut_checked(sizes.positions).unwrap_or_default();
        let (along_rows, rest) = rest.split_at_mut_checked(sizes.lines[0]).unwrap_or_default();
        let (along_columns, scratch) = rest.split_at_mut_checked(sizes.lines[1]).unwrap_or_default();
        if derivatives {
            let _ = Basis::write(self.grid.columns(), self.wavelet, along_rows, scratch);
            let _ = Basis::write(self.grid.rows(), self.wavelet, along_columns, scratch);
        }
        (positions, scratch)
    }

    /// Positions of the window, x, y, z.
    fn synthesise(&self, weights: Weights<'_>, positions: &mut [f32], scratch: &mut [f32]) -> Option<()> {
        let area = self.window.area();
        let (x, rest) = positions.split_at_mut_checked(area)?;
        let (y, z) = rest.split_at_mut_checked(area)?;
        let (identity, rest) = scratch.split_at_mut_checked(LANES * self.locals.identity_dim())?;
        let (pose, rest) = rest.split_at_mut_checked(LANES * self.locals.pose_dim())?;
        let longest = self.longest_row();
        let (row_x, rest) = rest.split_at_mut_checked(longest)?;
        let (row_y, rest) = rest.split_at_mut_checked(longest)?;
        let (row_z, rest) = rest.split_at_mut_checked(longest)?;
        let mut source = Source {
            locals: self.locals,
            weights,
            weighted: self.n_weighted(),
            identity: identity.as_chunks_mut().0,
            pose: pose.as_chunks_mut().0,
            last: None,
            rows: [row_x, row_y, row_z],
        };
        let base = self.base();
        let (width, area) = (base.columns.len(), base.area());
        let (mut base_x, rest) = rest.split_at_mut_checked(area)?;
        let (mut base_y, rest) = rest.split_at_mut_checked(area)?;
        let (mut base_z, rest) = rest.split_at_mut_checked(area)?;
        for row in base.rows.from..base.rows.to {
            let from = row * self.grid.width(0) + base.columns.from;
            let numbers = source.row(from, width)?;
            let at = (row - base.rows.from) * width;
            for (to, from) in [&mut base_x, &mut base_y, &mut base_z].into_iter().zip(numbers) {
                for (to, from) in to.get_mut(at..)?.iter_mut().zip(from) {
                    *to = *from;
                }
            }
        }
        let origin = [base.columns.from, base.rows.from];
        let base = [&*base_x, &*base_y, &*base_z].map(|numbers| Samples { numbers, stride: width, origin });
        synthesised_planes(self.wavelet, &self.grid, self.window, &mut source, base, [x, y, z], rest)
    }

    /// Derivatives of some vertices by every weight.
    fn derivatives<const N: usize>(
        &self,
        at: At<'_>,
        vertices: [usize; N],
        columns: &mut (impl Columns<N> + ?Sized),
    ) -> Option<()> {
        for column in 0..self.dim() {
            columns.set(column, [[0.0; N]; 3]);
        }
        let sizes = self.sizes(true);
        let (_, lines) = at.state.split_at_checked(sizes.positions)?;
        let (along_rows, lines) = lines.split_at_checked(sizes.lines[0])?;
        let along_columns = lines.get(..sizes.lines[1])?;
        let along_rows = Basis::of_values(self.grid.columns(), self.wavelet, along_rows);
        let along_columns = Basis::of_values(self.grid.rows(), self.wavelet, along_columns);
        let nodes = vertices.map(|vertex| self.node(vertex));
        let (identity, pose) = (self.locals.identity_dim(), self.locals.pose_dim());
        let poses_from = Generator::identity_dim(self);
        for coefficient in 0..self.n_weighted() {
            let [x, y] = coefficient_lines(&self.grid, &along_rows, &along_columns, coefficient)?;
            let function = nodes.map(|node| node.map_or(0.0, |[column, row]| x.at(column) * y.at(row)));
            if function.iter().all(|&value| value == 0.0) {
                continue;
            }
            let (own_identity, own_pose) = (coefficient * identity, coefficient * pose);
            let x = at.weights.identity.get(own_identity..)?.get(..identity)?;
            let y = at.weights.pose.get(own_pose..)?.get(..pose)?;
            for weight in 0..identity + pose {
                let slope = self.locals.slope(coefficient, x, y, weight)?;
                let column = match weight.checked_sub(identity) {
                    None => own_identity + weight,
                    Some(j) => poses_from + own_pose + j,
                };
                // From zero, so that no zero is negative, however many vertices come at a time.
                columns.set(column, slope.map(|slope| function.map(|value| 0.0 + value * slope)));
            }
        }
        Some(())
    }
}

/// The synthesis for whatever local models: one copy of its code in a program. Wider vectors than the target's make it and the local models no faster
/// (measured: 0.91 ms a surface of 24 897 models of 3 x 10 x 5, with AVX-512 1.09), so it is not compiled for them.
#[inline(never)]
fn synthesised_planes(
    wavelet: Wavelet,
    grid: &Grid,
    window: Rectangle,
    source: &mut dyn Rows<3, f32>,
    base: [Samples<'_, f32>; 3],
    out: [&mut [f32]; 3],
    rest: &mut [f32],
) -> Option<()> {
    planes::<3, f32>(wavelet, grid, grid.levels(), window, base, source, out, rest).ok()
}

const fn whole_window(grid: &Grid) -> Rectangle {
    let level = grid.levels();
    Rectangle {
        columns: Interval { from: 0, to: grid.width(level) },
        rows: Interval { from: 0, to: grid.height(level) },
    }
}

impl<L: Locals> Generator for Multiscale<L> {
    fn vertex_count(&self) -> usize {
        self.n_vertices
    }

    fn identity_dim(&self) -> usize {
        self.whole.node_count(self.detail).saturating_mul(self.locals.identity_dim())
    }

    fn pose_dim(&self) -> usize {
        self.whole.node_count(self.detail).saturating_mul(self.locals.pose_dim())
    }

    /// Three numbers a node of the window, and scratch: the intermediate levels of the synthesis (about half as many numbers for a whole grid), one row and one
    /// block of weights. With derivatives also the lines of both axes.
    fn state_req(&self, derivatives: bool) -> Requirement {
        let sizes = self.sizes(derivatives);
        Requirement::of(sizes.positions + sizes.lines[0] + sizes.lines[1]).and(Requirement::of(sizes.scratch))
    }

    fn write_state(&self, weights: Weights<'_>, derivatives: bool, state: &mut [f32]) {
        let (positions, scratch) = self.write_lines(derivatives, state);
        // The memory has the length that was asked for: this does not fail.
        let _ = self.synthesise(weights, positions, scratch);
    }

    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn block_unchecked(&self, at: At<'_>, block: usize) -> Option<Block> {
        let from = block.checked_mul(LANES)?;
        let count = LANES.min(self.n_vertices.checked_sub(from)?);
        if count == 0 {
            return None;
        }
        let area = self.window.area();
        let mut value = Block::ZERO;
        for (axis, k) in value.axes.iter_mut().zip(0..) {
            let positions = at.state.get(k * area + self.first + from..)?;
            if let Some(whole) = positions.first_chunk::<LANES>().filter(|_| count == LANES) {
                *axis = *whole;
            } else {
                for (to, from) in axis.iter_mut().zip(positions.get(..count)?) {
                    *to = *from;
                }
            }
        }
        Some(value)
    }

    fn linearised_block_unchecked(&self, at: At<'_>, block: usize, jacobian: &mut [[f32; NUMBERS]]) -> Option<Block> {
        let value = self.block_unchecked(at, block)?;
        let mut vertices = [block * LANES; LANES];
        for (lane, vertex) in vertices.iter_mut().enumerate() {
            *vertex += lane;
        }
        self.derivatives(at, vertices, jacobian)?;
        Some(value)
    }

    fn vertex_unchecked(&self, at: At<'_>, vertex: usize) -> Option<[f32; 3]> {
        let area = self.window.area();
        let number = |axis: usize| at.state.get(axis * area + self.first + vertex).copied();
        if vertex < self.n_vertices { Some([number(0)?, number(1)?, number(2)?]) } else { None }
    }

    fn linearised_vertex_unchecked(&self, at: At<'_>, vertex: usize, jacobian: &mut [[f32; 3]]) -> Option<[f32; 3]> {
        let value = self.vertex_unchecked(at, vertex)?;
        self.derivatives(at, [vertex], jacobian)?;
        Some(value)
    }
}
