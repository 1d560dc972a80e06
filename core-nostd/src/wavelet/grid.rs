//! The hierarchy of grids and the order of its coefficients.
//!
//! Level `l` has `(base - 1) 2^l + 1` nodes along an axis, and its nodes are those of the finest grid at multiples of `2^(L - l)`. A node
//! belongs to the coarsest level that has it; each node has one coefficient.
//!
//! Source: Brunton, Bolkart and Wuhrer 2014 (`brunton2014wavelets`), whose base grid has 5 x 7 nodes.

use core::ops::Range;

use crate::Error;
use crate::format::limits::MAX_VERTICES;
use crate::workspace::saturated;

/// Refinements of a base grid at most.
pub const MAX_LEVELS: usize = 20;

/// One direction of a grid: a number of nodes that is refined dyadically.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axis {
    base: usize,
    levels: usize,
}

impl Axis {
    /// `base` nodes, refined `levels` times.
    ///
    /// Errors: `BadOption` 0 for fewer than two nodes; `LimitExceeded` for more than [`MAX_LEVELS`] levels or [`MAX_VERTICES`] nodes.
    pub const fn new(base: usize, levels: usize) -> Result<Self, Error> {
        if base < 2 {
            return Err(Error::BadOption { option: 0 });
        }
        if levels > MAX_LEVELS {
            return Err(exceeded(levels as u64, MAX_LEVELS as u32));
        }
        if base > MAX_VERTICES as usize {
            return Err(exceeded(base as u64, MAX_VERTICES));
        }
        let nodes = ((base as u64 - 1) << levels) + 1;
        if nodes > MAX_VERTICES as u64 {
            return Err(exceeded(nodes, MAX_VERTICES));
        }
        Ok(Axis { base, levels })
    }

    /// Nodes of the base.
    pub const fn base(&self) -> usize {
        self.base
    }

    /// Refinements.
    pub const fn levels(&self) -> usize {
        self.levels
    }

    /// Nodes at a level; those of the finest level for a level that the axis has not.
    #[inline(always)]
    pub const fn size(&self, level: usize) -> usize {
        let level = if level < self.levels { level } else { self.levels };
        ((self.base - 1) << level) + 1
    }
}

/// A node of the finest grid and the level that it belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Node {
    /// The coarsest level that has the node.
    pub level: usize,
    /// Column in the finest grid.
    pub column: usize,
    /// Row in the finest grid.
    pub row: usize,
}

/// A base grid and its refinements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    columns: Axis,
    rows: Axis,
}

impl Grid {
    /// `base_width x base_height` nodes, refined `levels` times.
    ///
    /// Errors: `BadOption` 0 or 1 for a width or height below two; `LimitExceeded` for more than [`MAX_LEVELS`] levels or
    /// [`MAX_VERTICES`] nodes in the finest grid.
    pub const fn new(base_width: usize, base_height: usize, levels: usize) -> Result<Self, Error> {
        let columns = match Axis::new(base_width, levels) {
            Ok(axis) => axis,
            Err(error) => return Err(error),
        };
        let rows = match Axis::new(base_height, levels) {
            Ok(axis) => axis,
            Err(Error::BadOption { .. }) => return Err(Error::BadOption { option: 1 }),
            Err(error) => return Err(error),
        };
        let nodes = columns.size(levels) as u64 * rows.size(levels) as u64;
        if nodes > MAX_VERTICES as u64 {
            return Err(exceeded(nodes, MAX_VERTICES));
        }
        Ok(Grid { columns, rows })
    }

    /// The direction along a row.
    pub const fn columns(&self) -> Axis {
        self.columns
    }

    /// The direction along a column.
    pub const fn rows(&self) -> Axis {
        self.rows
    }

    /// Refinements of the base.
    pub const fn levels(&self) -> usize {
        self.columns.levels
    }

    /// Nodes of a row at a level. Here and below, a level that the grid has not stands for the finest.
    #[inline(always)]
    pub const fn width(&self, level: usize) -> usize {
        self.columns.size(level)
    }

    /// Nodes of a column at a level.
    #[inline(always)]
    pub const fn height(&self, level: usize) -> usize {
        self.rows.size(level)
    }

    /// Nodes of a level with those of all coarser ones: how many coefficients its surface has.
    #[inline(always)]
    pub const fn node_count(&self, level: usize) -> usize {
        self.width(level) * self.height(level)
    }

    /// Nodes of the finest grid, which are as many as the coefficients.
    pub const fn len(&self) -> usize {
        self.node_count(self.levels())
    }

    /// Never: a grid has at least four nodes.
    pub const fn is_empty(&self) -> bool {
        false
    }

    /// The coefficients that belong to a level and no coarser one.
    pub const fn coefficients(&self, level: usize) -> Range<usize> {
        let from = if level == 0 { 0 } else { self.node_count(level - 1) };
        let to = self.node_count(level);
        if from < to { from..to } else { to..to }
    }

    /// Distance of neighbouring nodes of a level, counted in nodes of the finest grid.
    pub const fn step(&self, level: usize) -> usize {
        1 << self.levels().saturating_sub(level)
    }

    /// The level that a node of the finest grid belongs to: the smallest `l` for which both indices are multiples of `2^(L - l)`.
    pub const fn level_of(&self, column: usize, row: usize) -> Option<usize> {
        if column >= self.width(self.levels()) || row >= self.height(self.levels()) {
            return None;
        }
        // Zero has as many trailing zeros as the type has bits.
        let zeros = (column | row).trailing_zeros() as usize;
        Some(self.levels().saturating_sub(zeros))
    }

    /// The coefficient of a node of the finest grid.
    pub const fn coefficient_of(&self, column: usize, row: usize) -> Option<usize> {
        let Some(level) = self.level_of(column, row) else { return None };
        let shift = self.levels() - level;
        let (column, row) = (column >> shift, row >> shift);
        if level == 0 {
            return Some(row * self.width(0) + column);
        }
        let (all, new) = (self.width(level), self.width(level - 1) - 1);
        let before = self.node_count(level - 1) + row.div_ceil(2) * new + row / 2 * all;
        Some(before + if row % 2 == 0 { column / 2 } else { column })
    }

    /// The node of a coefficient.
    pub const fn node_of(&self, coefficient: usize) -> Option<Node> {
        if coefficient >= self.len() {
            return None;
        }
        let mut level = 0;
        while self.node_count(level) <= coefficient {
            level += 1;
        }
        let (column, row) = if level == 0 {
            let [row, column] = divided(coefficient, self.width(0));
            (column, row)
        } else {
            let (all, new) = (self.width(level), self.width(level - 1) - 1);
            let within = coefficient - self.node_count(level - 1);
            let [pair, rest] = divided(within, all + new);
            if rest < new { (2 * rest + 1, 2 * pair) } else { (rest - new, 2 * pair + 1) }
        };
        let step = self.step(level);
        Some(Node { level, column: column * step, row: row * step })
    }

    /// `Ok` for a level that the grid has.
    pub(crate) fn check_level(&self, level: usize) -> Result<(), Error> {
        if level > self.levels() {
            return Err(Error::IndexOutOfRange { index: saturated(level), limit: saturated(self.levels() + 1) });
        }
        Ok(())
    }
}

/// Quotient and remainder; the divisor is not zero, which the compiler does not know.
const fn divided(number: usize, by: usize) -> [usize; 2] {
    let by = if by == 0 { 1 } else { by };
    [number / by, number % by]
}

const fn exceeded(found: u64, limit: u32) -> Error {
    Error::LimitExceeded { found: if found < u32::MAX as u64 { found as u32 } else { u32::MAX }, limit }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    #[test]
    fn sizes_of_the_published_grid() {
        let grid = Grid::new(5, 7, 5).unwrap();
        assert_eq!((grid.width(5), grid.height(5), grid.len()), (129, 193, 24_897));
        let sizes: Vec<usize> = (0..=5).map(|level| grid.coefficients(level).len()).collect();
        assert_eq!(sizes, [35, 82, 308, 1192, 4688, 18592]);
        assert_eq!((grid.width(0), grid.height(0), grid.step(0), grid.step(5)), (5, 7, 32, 1));
        assert_eq!((grid.width(9), grid.step(9), grid.coefficients(9).len()), (129, 1, 0));
        assert!(!grid.is_empty());
    }

    #[test]
    fn order_of_a_small_grid() {
        // 3 x 3 from 2 x 2: corners, then what is new in raster order.
        let grid = Grid::new(2, 2, 1).unwrap();
        let nodes: Vec<(usize, usize)> =
            (0..9).map(|q| grid.node_of(q).unwrap()).map(|node| (node.column, node.row)).collect();
        assert_eq!(nodes, [(0, 0), (2, 0), (0, 2), (2, 2), (1, 0), (0, 1), (1, 1), (2, 1), (1, 2)]);
        assert_eq!((grid.node_of(9), grid.level_of(3, 0), grid.coefficient_of(0, 3)), (None, None, None));
    }

    #[test]
    fn refusals() {
        assert_eq!(Grid::new(1, 7, 5), Err(Error::BadOption { option: 0 }));
        assert_eq!(Grid::new(5, 0, 5), Err(Error::BadOption { option: 1 }));
        assert_eq!(Grid::new(5, 7, 21), Err(Error::LimitExceeded { found: 21, limit: 20 }));
        assert_eq!(Grid::new(5, 7, 20), Err(Error::LimitExceeded { found: u32::MAX, limit: MAX_VERTICES }));
        assert_eq!(Axis::new(18, 20), Err(Error::LimitExceeded { found: (17 << 20) + 1, limit: MAX_VERTICES }));
        assert!(
            matches!(Grid::new(usize::MAX, 2, 0), Err(Error::LimitExceeded { limit, .. }) if limit == MAX_VERTICES)
        );
        assert!(matches!(Grid::new(5, 7, 10), Err(Error::LimitExceeded { found: 25_176_065, .. })));
        assert!(Grid::new(5, 7, 9).is_ok());
        assert_eq!(Axis::new(1, 0), Err(Error::BadOption { option: 0 }));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::cases()))]

        #[test]
        fn maps_are_inverse(width in 2usize..8, height in 2usize..8, levels in 0usize..5, at in 0.0f64..1.0) {
            let grid = Grid::new(width, height, levels).unwrap();
            let coefficient = (at * grid.len() as f64) as usize;
            let node = grid.node_of(coefficient).unwrap();
            prop_assert_eq!(grid.coefficient_of(node.column, node.row), Some(coefficient));
            prop_assert_eq!(grid.level_of(node.column, node.row), Some(node.level));
            prop_assert!(grid.coefficients(node.level).contains(&coefficient));
            let divisible = |level| (node.column | node.row).is_multiple_of(grid.step(level));
            prop_assert_eq!((0..=levels).find(|&level| divisible(level)), Some(node.level));
            // Raster order within a level.
            if let Some(next) = grid.node_of(coefficient + 1) && next.level == node.level {
                prop_assert!((next.row, next.column) > (node.row, node.column));
            }
        }
    }
}
