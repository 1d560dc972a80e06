//! The wavelet transform of a grid (Wuhrer, ch. 15) line by line in the full array, levels at multiples of their step.

use super::number::Number;

/// Which wavelet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Wavelet {
    Cubic,
    Bilinear,
}

impl Wavelet {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Cubic, Self::Bilinear];
}

/// Width and height of the base, and refinements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Grid {
    pub base: [usize; 2],
    pub levels: usize,
}

/// A node of the finest grid and the coarsest level that has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Node {
    pub level: usize,
    pub column: usize,
    pub row: usize,
}

/// Nodes of an axis at a level.
pub fn size(base: usize, level: usize) -> usize {
    (base - 1) * 2usize.pow(level as u32) + 1
}

impl Grid {
    /// Nodes of a row at a level.
    pub fn width(&self, level: usize) -> usize {
        size(self.base[0], level)
    }

    /// Nodes of a column at a level.
    pub fn height(&self, level: usize) -> usize {
        size(self.base[1], level)
    }

    /// Nodes of a level.
    pub fn count(&self, level: usize) -> usize {
        self.width(level) * self.height(level)
    }

    /// Nodes of the finest grid.
    pub fn len(&self) -> usize {
        self.count(self.levels)
    }

    /// Never.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Distance of neighbours of a level in the finest grid.
    pub fn step(&self, level: usize) -> usize {
        2usize.pow((self.levels - level) as u32)
    }

    /// The nodes in the order of their coefficients: by levels, in a level by rows.
    pub fn nodes(&self) -> Vec<Node> {
        let mut nodes = Vec::new();
        for level in 0..=self.levels {
            for row in 0..self.height(self.levels) {
                for column in 0..self.width(self.levels) {
                    let on = |level: usize| column % self.step(level) == 0 && row % self.step(level) == 0;
                    if on(level) && !(0..level).any(on) {
                        nodes.push(Node { level, column, row });
                    }
                }
            }
        }
        nodes
    }
}

/// `b v` at an end of the line.
fn star<R: Number>(wavelet: Wavelet, line: &[R], k: usize) -> R {
    let at_end = k == 0 || k == line.len() - 1;
    if wavelet == Wavelet::Cubic && at_end { R::of(0.5) * line[k] } else { line[k] }
}

/// Evens `v` become coarse samples, odds `e` details, in place.
pub fn analyse_line<R: Number>(wavelet: Wavelet, line: &mut [R]) {
    let last = line.len() - 1;
    let beside = |line: &[R], k: usize| line[k - 1] + line[k + 1];
    if wavelet == Wavelet::Cubic {
        for k in (2..last).step_by(2) {
            line[k] = line[k] - R::of(0.25) * beside(line, k);
        }
    }
    for k in (1..last).step_by(2) {
        let around = star(wavelet, line, k - 1) + star(wavelet, line, k + 1);
        line[k] = match wavelet {
            Wavelet::Cubic => line[k] - around,
            Wavelet::Bilinear => line[k] - R::of(0.5) * around,
        };
    }
    for k in (2..last).step_by(2) {
        line[k] = match wavelet {
            Wavelet::Cubic => R::of(2.0) * line[k] + R::of(0.375) * beside(line, k),
            Wavelet::Bilinear => line[k] + R::of(0.25) * beside(line, k),
        };
    }
    if wavelet == Wavelet::Bilinear {
        line[0] = line[0] + R::of(0.25) * line[1];
        line[last] = line[last] + R::of(0.25) * line[last - 1];
    }
}

/// The inverse of [`analyse_line`].
pub fn synthesise_line<R: Number>(wavelet: Wavelet, line: &mut [R]) {
    let last = line.len() - 1;
    let beside = |line: &[R], k: usize| line[k - 1] + line[k + 1];
    if wavelet == Wavelet::Bilinear {
        line[0] = line[0] - R::of(0.25) * line[1];
        line[last] = line[last] - R::of(0.25) * line[last - 1];
    }
    for k in (2..last).step_by(2) {
        line[k] = match wavelet {
            Wavelet::Cubic => R::of(0.5) * (line[k] - R::of(0.375) * beside(line, k)),
            Wavelet::Bilinear => line[k] - R::of(0.25) * beside(line, k),
        };
    }
    for k in (1..last).step_by(2) {
        let around = star(wavelet, line, k - 1) + star(wavelet, line, k + 1);
        line[k] = match wavelet {
            Wavelet::Cubic => line[k] + around,
            Wavelet::Bilinear => line[k] + R::of(0.5) * around,
        };
    }
    if wavelet == Wavelet::Cubic {
        for k in (2..last).step_by(2) {
            line[k] = line[k] + R::of(0.25) * beside(line, k);
        }
    }
}

/// Changes the rows of every `step`-th node of an array.
fn change_rows<R: Number>(array: &mut [Vec<R>], step: usize, change: impl Fn(&mut [R])) {
    for row in array.iter_mut().step_by(step) {
        let mut line: Vec<R> = row.iter().step_by(step).copied().collect();
        change(&mut line);
        for (to, from) in row.iter_mut().step_by(step).zip(line) {
            *to = from;
        }
    }
}

fn change_columns<R: Number>(array: &mut [Vec<R>], step: usize, change: impl Fn(&mut [R])) {
    for column in (0..array[0].len()).step_by(step) {
        let mut line: Vec<R> = array.iter().step_by(step).map(|row| row[column]).collect();
        change(&mut line);
        for (to, from) in array.iter_mut().step_by(step).zip(line) {
            to[column] = from;
        }
    }
}

/// The coefficients of samples that are given by rows.
pub fn analysis<R: Number>(grid: &Grid, wavelet: Wavelet, samples: &[R]) -> Vec<R> {
    let mut array: Vec<Vec<R>> = samples.chunks(grid.width(grid.levels)).map(<[R]>::to_vec).collect();
    for level in (1..=grid.levels).rev() {
        change_rows(&mut array, grid.step(level), |line| analyse_line(wavelet, line));
        change_columns(&mut array, grid.step(level), |line| analyse_line(wavelet, line));
    }
    grid.nodes().iter().map(|node| array[node.row][node.column]).collect()
}

/// The surface at a level, by rows.
pub fn synthesis<R: Number>(grid: &Grid, wavelet: Wavelet, level: usize, coefficients: &[R]) -> Vec<R> {
    let mut array = vec![vec![R::of(0.0); grid.width(grid.levels)]; grid.height(grid.levels)];
    for (node, &coefficient) in grid.nodes().iter().zip(coefficients) {
        array[node.row][node.column] = coefficient;
    }
    for level in 1..=level {
        change_columns(&mut array, grid.step(level), |line| synthesise_line(wavelet, line));
        change_rows(&mut array, grid.step(level), |line| synthesise_line(wavelet, line));
    }
    let step = grid.step(level);
    array.iter().step_by(step).flat_map(|row| row.iter().step_by(step).copied()).collect()
}

/// The part `columns` x `rows` of numbers that lie in rows of `width`.
pub fn cut<R: Copy>(numbers: &[R], width: usize, columns: [usize; 2], rows: [usize; 2]) -> Vec<R> {
    let rows = rows[0]..rows[1];
    rows.flat_map(|row| numbers[row * width + columns[0]..row * width + columns[1]].iter().copied()).collect()
}

/// The line of index `index` at a level of an axis, at all samples of the finest level: the synthesis of a unit.
pub fn line<R: Number>(base: usize, levels: usize, wavelet: Wavelet, level: usize, index: usize) -> Vec<R> {
    let mut line = vec![R::of(0.0); size(base, level)];
    line[index] = R::of(1.0);
    if level > 0 {
        synthesise_line(wavelet, &mut line);
    }
    for _ in level..levels {
        let mut finer = vec![R::of(0.0); 2 * line.len() - 1];
        for (to, from) in finer.iter_mut().step_by(2).zip(line) {
            *to = from;
        }
        synthesise_line(wavelet, &mut finer);
        line = finer;
    }
    line
}

/// The two lines of a node, along its row and along its column.
pub fn lines_of<R: Number>(grid: &Grid, wavelet: Wavelet, node: &Node) -> [Vec<R>; 2] {
    let index = [node.column, node.row].map(|at| at / grid.step(node.level));
    [0, 1].map(|axis| line(grid.base[axis], grid.levels, wavelet, node.level, index[axis]))
}
