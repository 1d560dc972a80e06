//! Sums rows of a Jacobian into the normal equations, a group of rows at a time so that the sums stay in registers.

use crate::Error;
use crate::workspace::{Requirement, Workspace, saturated};

/// Rows of a group.
const GROUP: usize = 24;
/// Columns that are summed side by side.
const TILE: usize = 8;
/// Rows of the total that are summed side by side: as many chains of additions as keep the units of a wide processor busy, one where registers are few.
const BESIDE: usize = if cfg!(feature = "inline-kernels") { 4 } else { 1 };

/// Collects rows `[J | r]` and sums their products: entry (p, q) of the total is `sum_k row_k[p] row_k[q]`.
///
/// Order of summation: rows in groups of 24 in the order in which they come; inside a group from zero in row order; then group by group. The
/// upper triangle is computed by columns in tiles of 8.
pub(super) struct Rows<'w> {
    width: usize,
    padded: usize,
    rows: &'w mut [f32],
    filled: usize,
    total: &'w mut [f32],
}

/// Scratch for rows of `width` entries (residual included).
pub(super) const fn rows_req(width: usize) -> Requirement {
    let padded = width.saturating_add(TILE - 1) / TILE * TILE;
    Requirement::of(padded.saturating_mul(GROUP)).and(Requirement::of(padded.saturating_mul(width)))
}

impl<'w> Rows<'w> {
    pub(super) fn new(width: usize, workspace: &mut Workspace<'w, f32>) -> Result<Self, Error> {
        let padded = width.div_ceil(TILE) * TILE;
        let rows = workspace.take(padded.saturating_mul(GROUP))?;
        let total = workspace.take(padded.saturating_mul(width))?;
        rows.fill(0.0);
        total.fill(0.0);
        Ok(Rows { width, padded, rows, filled: 0, total })
    }

    /// The next row to be written, `width` entries that hold old values; it counts at once.
    #[inline(always)]
    pub(super) fn next_row(&mut self) -> &mut [f32] {
        if self.filled == GROUP {
            self.flush();
        }
        let from = self.filled * self.padded;
        self.filled += 1;
        self.rows.get_mut(from..from + self.width).unwrap_or_default()
    }

    /// Sums the group into the total.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    fn flush(&mut self) {
        let padded = self.padded.max(1);
        let Some(rows) = self.rows.get(..self.filled * padded) else { return };
        for (group, total) in self.total.chunks_mut(padded.saturating_mul(BESIDE)).enumerate() {
            let p = group * BESIDE;
            for tile in p / TILE..padded / TILE {
                let mut sums = [[0.0f32; TILE]; BESIDE];
                let mut rest = rows;
                while let Some((row, behind)) = rest.split_at_checked(padded) {
                    rest = behind;
                    let factors = row.get(p..).and_then(|row| row.first_chunk::<BESIDE>());
                    let (Some(factors), Some(entries)) = (factors, row.as_chunks::<TILE>().0.get(tile)) else { break };
                    for (sum, factor) in sums.iter_mut().zip(factors) {
                        for (sum, entry) in sum.iter_mut().zip(entries) {
                            *sum += *factor * *entry;
                        }
                    }
                }
                for (total, sum) in total.chunks_exact_mut(padded).zip(sums) {
                    let Some(total) = total.as_chunks_mut::<TILE>().0.get_mut(tile) else { break };
                    for (total, sum) in total.iter_mut().zip(sum) {
                        *total += sum;
                    }
                }
            }
        }
        self.filled = 0;
    }

    /// Writes `J^T J` (both triangles) and `J^T r`; returns `r^T r`.
    ///
    /// Errors: `NotFinite` when a sum has left the range of `f32`; nothing is written then.
    #[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
    pub(super) fn finish(mut self, jtj: &mut [f32], jtr: &mut [f32]) -> Result<f32, Error> {
        self.flush();
        if let Some(index) = self.total.iter().position(|sum| !sum.is_finite()) {
            return Err(Error::NotFinite { index: saturated(index) });
        }
        let dim = self.width.saturating_sub(1);
        let total = |p: usize, q: usize| self.total.get(p * self.padded + q).copied().unwrap_or(0.0);
        for (p, row) in jtj.chunks_exact_mut(dim.max(1)).enumerate() {
            for (q, entry) in row.iter_mut().enumerate() {
                *entry = total(p.min(q), p.max(q));
            }
        }
        for (p, entry) in jtr.iter_mut().enumerate() {
            *entry = total(p, dim);
        }
        Ok(total(dim, dim))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn sums_equal_plain_products() {
        for (count, width) in [(1usize, 2usize), (23, 7), (24, 8), (25, 9), (61, 20)] {
            let entry = |k: usize, p: usize| ((k * 31 + p * 17) % 13) as f32 - 6.0;
            let mut memory = vec![0.0; rows_req(width).numbers()];
            let mut rows = Rows::new(width, &mut Workspace::new(&mut memory)).unwrap();
            for k in 0..count {
                for (p, value) in rows.next_row().iter_mut().enumerate() {
                    *value = entry(k, p);
                }
            }
            let dim = width - 1;
            let (mut jtj, mut jtr) = (vec![0.0; dim * dim], vec![0.0; dim]);
            let energy = rows.finish(&mut jtj, &mut jtr).unwrap();
            let plain = |p, q| (0..count).map(|k| entry(k, p) * entry(k, q)).sum::<f32>();
            let expected: Vec<f32> = (0..dim * dim).map(|k| plain(k / dim, k % dim)).collect();
            assert_eq!(jtj, expected);
            assert_eq!(jtr, (0..dim).map(|p| plain(p, dim)).collect::<Vec<_>>());
            assert_eq!(energy, plain(dim, dim));
        }
    }
}
