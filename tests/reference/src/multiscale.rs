//! The multilinear wavelet model (Wuhrer, ch. 15): `s_q = mean_q + sum_i x_qi sum_j y_qj m_qij` for each coefficient, then the synthesis.

use super::bilinear::Linearised;
use super::generator::Generator;
use super::model_file::{Extras, Head, Section, extra_sections, floats, integers};
use super::number::Number;
use super::skin_file::{section, stored_coefficients};
use super::storage::Term;
use super::wavelet::{Grid, Wavelet, cut, lines_of, synthesis};

/// Mean and scale of the weights of each coefficient, of one mode.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)]
pub struct Spread {
    pub mean: Vec<f32>,
    pub scale: Vec<f32>,
}

/// A wavelet model, which part of its weights there are and which part of the surface is wanted.
#[derive(Debug, Clone)]
pub struct Multiscale {
    /// The grid of the file.
    pub grid: Grid,
    /// Which wavelet.
    pub wavelet: Wavelet,
    /// Per coefficient, filled up with zeros.
    pub mean: Vec<[f32; 3]>,
    /// `m_ij`.
    pub core: Vec<Vec<Term>>,
    /// The finest level that has weights.
    pub detail: usize,
    /// The level at which the synthesis stops.
    pub resolution: usize,
    /// First column and the one behind the last, likewise for rows.
    pub window: [[usize; 2]; 2],
}

/// `sum + weight v`, the product rounded.
fn plus_scaled<R: Number>(sum: [R; 3], weight: R, v: [R; 3]) -> [R; 3] {
    [0, 1, 2].map(|axis| sum[axis] + weight * v[axis])
}

impl Multiscale {
    /// The whole model.
    pub fn new(grid: Grid, wavelet: Wavelet, mean: Vec<[f32; 3]>, core: Vec<Vec<Term>>) -> Self {
        let detail = grid.levels;
        Multiscale { grid, wavelet, mean, core, detail, resolution: 0, window: [[0; 2]; 2] }.with_levels(detail, detail)
    }

    /// Weights up to level `detail`, the surface at level `resolution`.
    pub fn with_levels(self, detail: usize, resolution: usize) -> Self {
        let window = [[0, self.grid.width(resolution)], [0, self.grid.height(resolution)]];
        Multiscale { detail, resolution, window, ..self }
    }

    /// A rectangle of nodes.
    pub fn with_window(self, columns: [usize; 2], rows: [usize; 2]) -> Self {
        Multiscale { window: [columns, rows], ..self }
    }

    /// Identity and pose weights of a coefficient.
    pub fn local_dims(&self) -> [usize; 2] {
        [self.core.len(), self.core[0].len()]
    }

    /// The grid of the vertices.
    pub fn vertex_grid(&self) -> Grid {
        Grid { levels: self.resolution, ..self.grid }
    }

    /// Coefficients that have weights.
    pub fn weighted(&self) -> usize {
        self.grid.count(self.detail)
    }

    /// Own weights of coefficient q, if it has any; zeros where another of its block has some, by which a mean of -0 becomes 0.
    fn own<R: Number>(&self, weights: &[R], dim: usize, q: usize) -> Option<Vec<R>> {
        if q < self.weighted() {
            return Some(weights[q * dim..(q + 1) * dim].to_vec());
        }
        (q / 16 * 16 < self.weighted()).then(|| vec![R::of(0.0); dim])
    }

    pub(crate) fn mean_of<R: Number>(&self, q: usize) -> [R; 3] {
        self.mean[q].map(|value| R::of(value.into()))
    }

    /// `t_i`, the derivative of a coefficient by its identity weight i.
    pub(crate) fn identity_slope<R: Number>(&self, q: usize, y: &[R], i: usize) -> [R; 3] {
        let terms = self.core[i].iter().zip(y);
        terms.fold([R::of(0.0); 3], |sum, (term, &y)| plus_scaled(sum, y, term.decoded(q)))
    }

    /// The derivative by its pose weight j.
    pub(crate) fn pose_slope<R: Number>(&self, q: usize, x: &[R], j: usize) -> [R; 3] {
        let rows = self.core.iter().zip(x);
        rows.fold([R::of(0.0); 3], |sum, (row, &x)| plus_scaled(sum, x, row[j].decoded(q)))
    }

    /// The coefficient at weights of its own.
    pub(crate) fn local<R: Number>(&self, q: usize, x: &[R], y: &[R]) -> [R; 3] {
        let slopes = (0..x.len()).map(|i| self.identity_slope(q, y, i));
        slopes.zip(x).fold(self.mean_of(q), |value, (slope, &x)| plus_scaled(value, x, slope))
    }

    /// The coefficient when the identity was fixed first: its slopes are the columns.
    fn local_of_fixed<R: Number>(&self, q: usize, x: &[R], y: &[R]) -> [R; 3] {
        let slopes = (0..y.len()).map(|j| self.pose_slope(q, x, j));
        slopes.zip(y).fold(self.mean_of(q), |value, (slope, &y)| plus_scaled(value, y, slope))
    }

    /// The window from the coefficients, node by node.
    fn surface<R: Number>(&self, coefficient: impl Fn(usize) -> [R; 3]) -> Vec<[R; 3]> {
        let grid = self.vertex_grid();
        let coefficients: Vec<[R; 3]> = (0..grid.len()).map(coefficient).collect();
        let planes = [0, 1, 2].map(|axis| {
            let plane: Vec<R> = coefficients.iter().map(|value| value[axis]).collect();
            let whole = synthesis(&grid, self.wavelet, grid.levels, &plane);
            cut(&whole, grid.width(grid.levels), self.window[0], self.window[1])
        });
        (0..planes[0].len()).map(|v| [0, 1, 2].map(|axis| planes[axis][v])).collect()
    }

    /// All positions of the window.
    pub fn positions<R: Number>(&self, x: &[R], y: &[R]) -> Vec<[R; 3]> {
        let [d, e] = self.local_dims();
        self.surface(|q| match (self.own(x, d, q), self.own(y, e, q)) {
            (Some(x), Some(y)) => self.local(q, &x, &y),
            _ => self.mean_of(q),
        })
    }

    /// The same with the identity fixed first; the last bits may differ.
    pub fn positions_of_fixed<R: Number>(&self, x: &[R], y: &[R]) -> Vec<[R; 3]> {
        let [d, e] = self.local_dims();
        self.surface(|q| match (self.own(x, d, q), self.own(y, e, q)) {
            (Some(x), Some(y)) => self.local_of_fixed(q, &x, &y),
            _ => self.mean_of(q),
        })
    }

    /// Column and row of a vertex.
    pub fn node(&self, v: usize) -> [usize; 2] {
        let [columns, rows] = self.window;
        let width = columns[1] - columns[0];
        [columns[0] + v % width, rows[0] + v / width]
    }

    /// Derivatives of a vertex by every identity weight and by every pose weight.
    pub fn derivatives<R: Number>(&self, x: &[R], y: &[R], v: usize) -> [Vec<[R; 3]>; 2] {
        let ([d, e], grid, [column, row]) = (self.local_dims(), self.vertex_grid(), self.node(v));
        let mut found = [vec![[R::of(0.0); 3]; d * self.weighted()], vec![[R::of(0.0); 3]; e * self.weighted()]];
        for (q, node) in grid.nodes().iter().enumerate().take(self.weighted()) {
            let lines: [Vec<R>; 2] = lines_of(&grid, self.wavelet, node);
            let function = lines[0][column] * lines[1][row];
            let of = |slope: [R; 3]| slope.map(|slope| R::of(0.0) + function * slope);
            for i in 0..d {
                found[0][q * d + i] = of(self.identity_slope(q, &y[q * e..(q + 1) * e], i));
            }
            for j in 0..e {
                found[1][q * e + j] = of(self.pose_slope(q, &x[q * d..(q + 1) * d], j));
            }
        }
        found
    }

    /// What its file's header says.
    pub fn head(&self) -> Head {
        let [identity_dim, pose_dim] = self.local_dims();
        Head { kind: 4, n: self.grid.len(), identity_dim, pose_dim, flags: 0 }
    }

    /// The sections of its file.
    pub fn sections(&self, extras: &Extras, spreads: &[Option<Spread>; 2]) -> Vec<Section> {
        let mut sections = stored_coefficients(&self.mean, &self.core.iter().flatten().collect::<Vec<_>>());
        sections.extend(extra_sections(extras));
        for (first, spread) in [(6, &spreads[0]), (9, &spreads[1])] {
            if let Some(Spread { mean, scale }) = spread {
                sections.push(section(first, 3, &[mean.len()], floats(mean.iter().copied())));
                sections.push(section(first + 1, 3, &[scale.len()], floats(scale.iter().copied())));
            }
        }
        let [width, height] = self.grid.base.map(|size| size as u32);
        let grid = [width, height, self.grid.levels as u32, self.wavelet as u32];
        sections.push(section(31, 2, &[4], integers(grid)));
        sections
    }
}

impl Generator for Multiscale {
    fn n(&self) -> usize {
        let [columns, rows] = self.window;
        (columns[1] - columns[0]) * (rows[1] - rows[0])
    }

    fn lanes(&self) -> usize {
        self.n()
    }

    fn dims(&self) -> (usize, usize) {
        let [d, e] = self.local_dims();
        (d * self.weighted(), e * self.weighted())
    }

    fn linearised(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        Linearised { value: self.value(x, y, v), derivatives: self.derivatives(x, y, v).concat() }
    }

    fn value(&self, x: &[f32], y: &[f32], v: usize) -> [f32; 3] {
        self.positions(x, y)[v]
    }

    fn identity_fixed(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        let [_, derivatives] = self.derivatives(x, y, v);
        Linearised { value: self.positions_of_fixed(x, y)[v], derivatives }
    }

    fn pose_fixed(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        let [derivatives, _] = self.derivatives(x, y, v);
        Linearised { value: self.value(x, y, v), derivatives }
    }
}
