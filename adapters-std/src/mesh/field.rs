//! Numbers sampled on a regular grid, such as the distances from a surface.

use crate::Error;

/// The most samples that a grid may have: 2 GiB of numbers, 645 on each side of a cube.
const MAX_SAMPLES: usize = 1 << 28;

/// A regular grid of samples, axis-parallel, equally wide on all axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Position of sample `[0, 0, 0]`.
    pub origin: [f64; 3],
    /// Distance of neighbouring samples.
    pub spacing: f64,
    /// Number of samples on each axis.
    pub size: [usize; 3],
}

impl Grid {
    /// The smallest grid whose samples reach at least `margin` beyond the box on all sides; it has the box's middle.
    ///
    /// # Errors
    /// [`Error::Input`] for a box or margin that is not finite, a spacing that is not positive, or more than 2^28 samples.
    pub fn around(low: [f64; 3], high: [f64; 3], spacing: f64, margin: f64) -> Result<Self, Error> {
        let mut grid = Grid { origin: low, spacing, size: [0; 3] };
        if !(spacing > 0.0 && spacing.is_finite() && margin >= 0.0 && margin.is_finite()) {
            return Err(Error::input(format!(
                "a grid of spacing {spacing} and margin {margin}: give a spacing above 0 and a margin of at least 0"
            )));
        }
        for axis in 0..3 {
            let length = high[axis] - low[axis] + 2.0 * margin;
            if !(length >= 0.0) || !length.is_finite() {
                return Err(Error::input(format!("a grid around a box from {low:?} to {high:?}: give a finite box")));
            }
            // A factor just below 1 keeps rounding from adding a layer where the length is a multiple of the spacing.
            let n_cells = (length / spacing * (1.0 - 1e-12)).ceil().max(1.0);
            if !(n_cells < MAX_SAMPLES as f64) {
                return Err(too_many(spacing));
            }
            grid.size[axis] = n_cells as usize + 1;
            grid.origin[axis] = 0.5 * (low[axis] + high[axis]) - 0.5 * n_cells * spacing;
        }
        grid.check()?;
        Ok(grid)
    }

    /// The number of samples.
    pub fn n_samples(&self) -> usize {
        self.size.iter().product()
    }

    /// The position of a sample.
    pub fn position(&self, sample: [usize; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| self.origin[axis] + sample[axis] as f64 * self.spacing)
    }

    /// The place of a sample in the list of values: x varies fastest, z slowest.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.size[1] + j) * self.size[0] + i
    }

    /// Whether there are at least two samples on each axis, at most 2^28 in all, at finite positions.
    ///
    /// # Errors
    /// [`Error::Input`] says what does not hold.
    pub fn check(&self) -> Result<(), Error> {
        let finite = self.origin.iter().all(|x| x.is_finite()) && self.spacing.is_finite();
        if !finite || !(self.spacing > 0.0) || self.size.iter().any(|&n| n < 2) {
            return Err(Error::input(format!(
                "a grid of {:?} samples from {:?} on, {} apart: give at least two on each axis, finite positions and a \
                 spacing above 0",
                self.size, self.origin, self.spacing
            )));
        }
        let n = self.size[0].checked_mul(self.size[1]).and_then(|n| n.checked_mul(self.size[2]));
        if n.is_none_or(|n| n > MAX_SAMPLES) {
            return Err(too_many(self.spacing));
        }
        Ok(())
    }
}

fn too_many(spacing: f64) -> Error {
    Error::input(format!("a grid of spacing {spacing} has more than {MAX_SAMPLES} samples: make the spacing wider"))
}

/// Numbers at the samples of a grid. NaN stands for unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Where the samples are.
    pub grid: Grid,
    /// One number per sample, in the order of [`Grid::index`].
    pub values: Vec<f64>,
}

impl Field {
    /// The values of a function of the position, computed by all threads.
    ///
    /// # Errors
    /// Those of [`Grid::check`].
    pub fn sampled(grid: Grid, function: impl Fn([f64; 3]) -> f64 + Sync) -> Result<Self, Error> {
        use rayon::prelude::*;
        grid.check()?;
        let [nx, ny, _] = grid.size;
        let mut values = vec![0.0; grid.n_samples()];
        values.par_chunks_mut(nx).enumerate().for_each(|(row, values)| {
            for (i, value) in values.iter_mut().enumerate() {
                *value = function(grid.position([i, row % ny, row / ny]));
            }
        });
        Ok(Field { grid, values })
    }

    /// [`Grid::check`], and whether there is one value per sample.
    ///
    /// # Errors
    /// [`Error::Input`] says what does not hold.
    pub fn check(&self) -> Result<(), Error> {
        self.grid.check()?;
        let (n_values, n_samples) = (self.values.len(), self.grid.n_samples());
        if n_values != n_samples {
            return Err(Error::input(format!("{n_values} values on a grid of {n_samples} samples: give one each")));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_reaches_beyond_its_box() {
        let grid = Grid::around([0.0, 0.0, 0.0], [1.0, 2.0, 0.3], 0.5, 0.25).unwrap();
        assert_eq!(grid.size, [4, 6, 3]);
        assert_eq!(grid.position([0, 0, 0]), [-0.25, -0.25, 0.15 - 0.5]);
        assert_eq!(grid.position([3, 5, 2]), [1.25, 2.25, 0.15 + 0.5]);
        assert_eq!((grid.n_samples(), grid.index([3, 5, 2])), (72, 71));
    }

    #[test]
    fn values_follow_the_order_of_the_index() {
        let grid = Grid { origin: [1.0, 2.0, 3.0], spacing: 2.0, size: [2, 3, 4] };
        let field = Field::sampled(grid, |[x, y, z]| x + 10.0 * y + 100.0 * z).unwrap();
        assert_eq!(field.values[grid.index([1, 2, 3])], 3.0 + 60.0 + 900.0);
        assert!(field.check().is_ok());
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let said = |result: Result<Grid, Error>| result.unwrap_err().to_string();
        assert!(said(Grid::around([0.0; 3], [1.0; 3], 0.0, 1.0)).contains("spacing above 0"));
        assert!(said(Grid::around([0.0; 3], [1.0; 3], 1.0, f64::NAN)).contains("margin of at least 0"));
        assert!(said(Grid::around([0.0; 3], [1.0, f64::NAN, 1.0], 1.0, 0.0)).contains("finite box"));
        assert!(said(Grid::around([0.0; 3], [1.0; 3], 1e-3, 0.0)).contains("wider"));
        assert!(said(Grid::around([0.0; 3], [1.0; 3], 1e-300, 0.0)).contains("wider"));
        let grid = Grid { origin: [0.0; 3], spacing: 1.0, size: [usize::MAX, 2, 2] };
        assert!(grid.check().unwrap_err().to_string().contains("wider"));
        let grid = Grid { size: [2, 1, 2], ..grid };
        assert!(grid.check().unwrap_err().to_string().contains("at least two"));
        let field = Field { grid: Grid { size: [2; 3], ..grid }, values: vec![0.0; 7] };
        assert!(field.check().unwrap_err().to_string().contains("7 values on a grid of 8"));
    }
}
