//! The transform of whole surfaces: samples to coefficients and back.
//!
//! Per level: analysis lifts along rows, then along columns, and goes on with the coarse samples; synthesis goes the way back, coarse to fine,
//! columns then rows. It may stop at any level. The condition of the cubic synthesis grows with the levels (a line: 3.6, 9.8, 18, 35, 63 for 1 to 5;
//! bilinear 1.9, 2.7, 3.9, 5.5, 7.7): analyse in `f64`.
//!
//! Levels lie compactly, each in rows of its own width, coarse samples and coefficients apart, so that all loops run over contiguous numbers.

use super::grid::Grid;
use super::lifting::{BilinearAnalysis, CubicAnalysis, Lifting, Wavelet};
use super::lines::copy;
use super::span::{Interval, Span};
use super::step::Step;
use super::strip::Strip;
use super::window::{components, window, window_req};
use crate::workspace::{Requirement, Workspace, check_len, part, part_mut};
use crate::{Error, Real};

/// Workspace of [`synthesis`].
pub const fn synthesis_req(grid: &Grid, level: usize) -> Requirement {
    window_req(grid, level, &(0..grid.width(level)), &(0..grid.height(level)))
}

/// Writes the surface at a level from its coefficients.
///
/// | argument | shape | note |
/// |---|---|---|
/// | `level` | `0..=levels` | the surface as it is without the coefficients of finer levels |
/// | `coefficients` | components, [`Grid::len`] | order of [`Grid::node_of`]; those of finer levels are not read |
/// | `out` | components, height, width of the level | rows from the first; wholly overwritten, untouched on error |
///
/// Cost: proportional to the nodes of the level; workspace [`synthesis_req`], less than half a component of `out` for the published
/// grid (test `memory_of_the_published_grid`).
/// Accuracy: a surface of magnitude 100 whose coefficients are exact comes out in `f32` within 5e-5 (test `single_precision`).
/// Determinism: see [`lifting`](super::lifting).
/// Errors: `IndexOutOfRange` for the level, `DimensionMismatch`, `WorkspaceTooSmall`. Panics: never.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub fn synthesis<R: Real>(
    grid: &Grid,
    wavelet: Wavelet,
    level: usize,
    coefficients: &[R],
    out: &mut [R],
    workspace: &mut [R],
) -> Result<(), Error> {
    grid.check_level(level)?;
    let (columns, rows) = (0..grid.width(level), 0..grid.height(level));
    window(grid, wavelet, level, columns, rows, coefficients, out, workspace)
}

/// Workspace of [`analysis`].
pub const fn analysis_req(grid: &Grid) -> Requirement {
    match grid.levels() {
        0 => Requirement::NONE,
        levels => {
            let coarse = if levels > 1 { grid.node_count(levels - 1) } else { 0 };
            let [columns, rows] = whole(grid, levels);
            Requirement::of(coarse).and(Strip::<f32>::req(&columns, &rows))
        }
    }
}

/// Writes the coefficients of a surface: the inverse of [`synthesis`] at the finest level.
///
/// | argument | shape | note |
/// |---|---|---|
/// | `samples` | components, height, width of the finest grid | |
/// | `coefficients` | components, [`Grid::len`] | order of [`Grid::node_of`]; wholly overwritten, untouched on error |
///
/// For fewer levels, give a grid with a larger base.
///
/// Cost: proportional to the nodes; workspace [`analysis_req`].
/// Accuracy: analysis and synthesis of numbers in -1..1 over five levels reproduce them within 1e-14 in `f64` and 1e-5 in `f32` (tests
/// `reconstruction` and `single_precision`).
/// Determinism: see [`lifting`](super::lifting).
/// Errors: `DimensionMismatch`, `WorkspaceTooSmall`. Panics: never.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
pub fn analysis<R: Real>(
    grid: &Grid,
    wavelet: Wavelet,
    samples: &[R],
    coefficients: &mut [R],
    workspace: &mut [R],
) -> Result<(), Error> {
    let components = components(grid, samples.len())?;
    check_len(components.saturating_mul(grid.len()), coefficients.len())?;
    analysis_req(grid).check(workspace.len())?;
    for component in 0..components {
        let samples = part(samples, component * grid.len(), grid.len())?;
        let coefficients = part_mut(coefficients, component * grid.len(), grid.len())?;
        match wavelet {
            Wavelet::Cubic => plane::<CubicAnalysis, R>(grid, samples, coefficients, workspace)?,
            Wavelet::Bilinear => plane::<BilinearAnalysis, R>(grid, samples, coefficients, workspace)?,
        }
    }
    Ok(())
}

/// One component. The coarse samples of a level are as many as the coefficients of all coarser levels, and go to their place.
#[cfg_attr(all(feature = "inline-kernels", not(debug_assertions)), inline(always))]
fn plane<S: Lifting, R: Real>(
    grid: &Grid,
    samples: &[R],
    coefficients: &mut [R],
    workspace: &mut [R],
) -> Result<(), Error> {
    let levels = grid.levels();
    if levels == 0 {
        copy(samples, coefficients);
        return Ok(());
    }
    let mut workspace = Workspace::new(workspace);
    let source = workspace.take(if levels > 1 { grid.node_count(levels - 1) } else { 0 })?;
    let scratch = workspace.rest();
    for level in (1..=levels).rev() {
        let [columns, rows] = whole(grid, level);
        let mut strip = Strip::new(&columns, &rows, scratch)?;
        let (coarse, rest) = coefficients.split_at_mut_checked(grid.node_count(level - 1)).ok_or(Error::Empty)?;
        let details = rest.get_mut(..grid.coefficients(level).len()).ok_or(Error::Empty)?;
        let from = if level == levels { samples } else { &*source };
        Step { columns, rows }.analysis::<S, R>(from, coarse, details, &mut strip).ok_or(Error::Empty)?;
        if level > 1 {
            copy(coarse, source);
        }
    }
    Ok(())
}

/// The spans of the whole step that ends at `level >= 1`.
const fn whole(grid: &Grid, level: usize) -> [Span; 2] {
    [
        Span::new(grid.width(level - 1), Interval { from: 0, to: grid.width(level) }),
        Span::new(grid.height(level - 1), Interval { from: 0, to: grid.height(level) }),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Stream;
    use proptest::prelude::*;
    use std::vec::Vec;

    const BOTH: [Wavelet; 2] = [Wavelet::Cubic, Wavelet::Bilinear];

    fn random<R: Real>(count: usize, seed: u32) -> Vec<R> {
        Stream::new(seed).take(count).into_iter().map(|value| R::from_f64(value.into())).collect()
    }

    fn analysed<R: Real>(grid: &Grid, wavelet: Wavelet, samples: &[R]) -> Vec<R> {
        let mut coefficients = vec![R::ZERO; samples.len()];
        let mut workspace = vec![R::ZERO; analysis_req(grid).numbers()];
        analysis(grid, wavelet, samples, &mut coefficients, &mut workspace).unwrap();
        coefficients
    }

    fn synthesised<R: Real>(grid: &Grid, wavelet: Wavelet, level: usize, coefficients: &[R]) -> Vec<R> {
        let mut out = vec![R::ZERO; coefficients.len() / grid.len() * grid.node_count(level)];
        let mut workspace = vec![R::ZERO; synthesis_req(grid, level).numbers()];
        synthesis(grid, wavelet, level, coefficients, &mut out, &mut workspace).unwrap();
        out
    }

    fn largest_difference<R: Real + Into<f64>>(a: &[R], b: &[R]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).fold(0.0, |largest, (&a, &b)| f64::max(largest, (a.into() - b.into()).abs()))
    }

    /// Samples of a function of the place in the finest grid, from 0 to 1 along each axis.
    fn sampled(grid: &Grid, value: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let (width, height) = (grid.width(grid.levels()), grid.height(grid.levels()));
        let at = |k: usize, size: usize| k as f64 / (size - 1) as f64;
        (0..grid.len()).map(|k| value(at(k % width, width), at(k / width, height))).collect()
    }

    /// The slow way: one line after the other in the full array, levels at multiples of their step.
    fn reference(grid: &Grid, wavelet: Wavelet, coefficients: &[f32]) -> Vec<f32> {
        let (width, height) = (grid.width(grid.levels()), grid.height(grid.levels()));
        let mut array: Vec<f32> =
            (0..grid.len()).map(|k| coefficients[grid.coefficient_of(k % width, k / width).unwrap()]).collect();
        for level in 1..=grid.levels() {
            let step = grid.step(level);
            for column in (0..width).step_by(step) {
                line(wavelet, &mut array, column, step * width, grid.height(level) / 2);
            }
            for row in (0..height).step_by(step) {
                line(wavelet, &mut array, row * width, step, grid.width(level) / 2);
            }
        }
        array
    }

    fn line(wavelet: Wavelet, array: &mut [f32], start: usize, step: usize, m: usize) {
        let at = |k: usize| start + k * step;
        let cubic = wavelet == Wavelet::Cubic;
        for j in 0..=m {
            let details = |k: usize| array[at(k)];
            let end = j == 0 || j == m;
            array[at(2 * j)] = match (cubic, end) {
                (true, true) => array[at(2 * j)],
                (true, false) => 0.5 * (array[at(2 * j)] - 0.375 * (details(2 * j - 1) + details(2 * j + 1))),
                (false, true) => array[at(2 * j)] - 0.25 * details(if j == 0 { 1 } else { 2 * m - 1 }),
                (false, false) => array[at(2 * j)] - 0.25 * (details(2 * j - 1) + details(2 * j + 1)),
            };
        }
        for j in 0..m {
            let coarse = |j: usize| if cubic && (j == 0 || j == m) { 0.5 * array[at(2 * j)] } else { array[at(2 * j)] };
            let sum = coarse(j) + coarse(j + 1);
            array[at(2 * j + 1)] += if cubic { sum } else { 0.5 * sum };
        }
        for j in 1..m {
            if cubic {
                array[at(2 * j)] += 0.25 * (array[at(2 * j - 1)] + array[at(2 * j + 1)]);
            }
        }
    }

    #[test]
    fn reconstruction() {
        for wavelet in BOTH {
            for levels in [0, 1, 3, 5] {
                let grid = Grid::new(5, 7, levels).unwrap();
                let samples: Vec<f64> = random(3 * grid.len(), 7);
                let back = synthesised(&grid, wavelet, levels, &analysed(&grid, wavelet, &samples));
                let difference = largest_difference(&back, &samples);
                assert!(difference < 1e-14, "{wavelet:?} {levels} {difference:e}");
            }
        }
    }

    #[test]
    fn single_precision() {
        let grid = Grid::new(5, 7, 5).unwrap();
        for wavelet in BOTH {
            let samples: Vec<f32> = random(grid.len(), 7);
            let back = synthesised(&grid, wavelet, 5, &analysed(&grid, wavelet, &samples));
            let difference = largest_difference(&back, &samples);
            assert!(difference < 1e-5, "{wavelet:?} {difference:e}");
            // A smooth surface of the size of a face, from coefficients rounded once.
            let surface = sampled(&grid, |x, y| {
                100.0 * libm::sin(3.0 * x + 1.0) * libm::cos(4.0 * y) + 5.0 * libm::sin(40.0 * x * y)
            });
            let coefficients: Vec<f32> = analysed(&grid, wavelet, &surface).iter().map(|&value| value as f32).collect();
            let wide: Vec<f64> = coefficients.iter().map(|&value| value.into()).collect();
            let exact = synthesised(&grid, wavelet, 5, &wide);
            let found: Vec<f64> =
                synthesised(&grid, wavelet, 5, &coefficients).iter().map(|&value| value.into()).collect();
            let difference = largest_difference(&found, &exact);
            assert!(difference < 5e-5, "{wavelet:?} {difference:e}");
        }
    }

    #[test]
    fn smooth_surfaces() {
        for wavelet in BOTH {
            for levels in [1, 3, 5] {
                let grid = Grid::new(5, 7, levels).unwrap();
                // A constant is itself at the base, an affine surface has no details anywhere.
                let affine = analysed(&grid, wavelet, &sampled(&grid, |x, y| 0.25 + 0.5 * x - 0.75 * y));
                assert!(affine[35..].iter().all(|value| value.abs() < 4e-15));
                assert!((affine[0] - 0.25).abs() < 4e-15 && (affine[34]).abs() < 4e-15);
                let constant = analysed(&grid, wavelet, &vec![0.7; grid.len()]);
                assert!(constant[..35].iter().all(|value| (value - 0.7).abs() < 4e-15));
                assert!(constant[35..].iter().all(|value| value.abs() < 4e-15));
            }
        }
        // Details of the cubic wavelet vanish on cubic polynomials away from the boundary, those of the bilinear one do not.
        let grid = Grid::new(5, 7, 3).unwrap();
        let cubic = |x: f64, y: f64| (x * x * x - x) * (y * y - 2.0 * y * y * y);
        let inside = |wavelet| {
            let coefficients = analysed(&grid, wavelet, &sampled(&grid, cubic));
            grid.coefficients(3)
                .filter(|&q| {
                    let node = grid.node_of(q).unwrap();
                    (4..29).contains(&node.column) && (4..45).contains(&node.row)
                })
                .fold(0.0, |largest, q| f64::max(largest, coefficients[q].abs()))
        };
        assert!(inside(Wavelet::Cubic) < 2e-15 && inside(Wavelet::Bilinear) > 1e-4);
    }

    #[test]
    fn refusals_leave_the_output_alone() {
        let grid = Grid::new(3, 4, 2).unwrap();
        let n = grid.len();
        let (synthesis_len, analysis_len) = (synthesis_req(&grid, 2).numbers(), analysis_req(&grid).numbers());
        let input = vec![1.0f32; 2 * n];
        let mut out = vec![7.0f32; 2 * n];
        let mut workspace = vec![0.0; synthesis_len.max(analysis_len)];
        let mismatch = |expected: usize, found: usize| {
            Err(Error::DimensionMismatch { expected: expected as u32, found: found as u32 })
        };
        let short = |needed: usize| Err(Error::WorkspaceTooSmall { needed: needed as u32, given: needed as u32 - 1 });
        let mut run = |level, from: usize, to: usize, work: usize| {
            synthesis(&grid, Wavelet::Cubic, level, &input[..from], &mut out[..to], &mut workspace[..work])
        };
        assert_eq!(run(3, n, n, synthesis_len), Err(Error::IndexOutOfRange { index: 3, limit: 3 }));
        assert_eq!(run(2, n - 1, n, synthesis_len), mismatch(n, n - 1));
        assert_eq!(run(2, 2 * n - 1, n, synthesis_len), mismatch(n, 2 * n - 1));
        assert_eq!(run(2, 2 * n, n, synthesis_len), mismatch(2 * n, n));
        assert_eq!(run(2, n, n, synthesis_len - 1), short(synthesis_len));
        let mut run = |from: usize, to: usize, work: usize| {
            analysis(&grid, Wavelet::Cubic, &input[..from], &mut out[..to], &mut workspace[..work])
        };
        assert_eq!(run(n + 1, n, analysis_len), mismatch(n, n + 1));
        assert_eq!(run(2 * n, n, analysis_len), mismatch(2 * n, n));
        assert_eq!(run(n, n, analysis_len - 1), short(analysis_len));
        assert!(out.iter().all(|&value| value == 7.0));
        // No components: nothing to do.
        assert_eq!(synthesis::<f32>(&grid, Wavelet::Cubic, 2, &[], &mut [], &mut workspace), mismatch(n, 0));
    }

    #[test]
    fn memory_of_the_published_grid() {
        let grid = Grid::new(5, 7, 5).unwrap();
        assert_eq!((synthesis_req(&grid, 5).numbers(), analysis_req(&grid).numbers()), (10_562, 8_945));
        assert_eq!(window_req(&grid, 5, &(64..65), &(96..97)).numbers(), 98);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::cases()))]

        #[test]
        fn bits_are_those_of_the_slow_way(
            width in 2usize..24, height in 2usize..24, levels in 0usize..4, seed in 1u32..1000, cubic: bool,
        ) {
            let wavelet = BOTH[usize::from(cubic)];
            let grid = Grid::new(width, height, levels).unwrap();
            let coefficients: Vec<f32> = random(grid.len(), seed);
            prop_assert_eq!(synthesised(&grid, wavelet, levels, &coefficients), reference(&grid, wavelet, &coefficients));
        }

        #[test]
        fn analysis_is_the_inverse(
            width in 2usize..24, height in 2usize..24, levels in 0usize..4, seed in 1u32..1000, cubic: bool,
        ) {
            let wavelet = BOTH[usize::from(cubic)];
            let grid = Grid::new(width, height, levels).unwrap();
            let samples: Vec<f64> = random(2 * grid.len(), seed);
            let coefficients = analysed(&grid, wavelet, &samples);
            prop_assert!(largest_difference(&synthesised(&grid, wavelet, levels, &coefficients), &samples) < 4e-14);
            // Components do not mix.
            prop_assert_eq!(&analysed(&grid, wavelet, &samples[grid.len()..])[..], &coefficients[grid.len()..]);
        }

        #[test]
        fn linear(seed in 1u32..1000, factor in -2.0f64..2.0, cubic: bool) {
            let (wavelet, grid) = (BOTH[usize::from(cubic)], Grid::new(3, 4, 3).unwrap());
            let (a, b): (Vec<f64>, Vec<f64>) = (random(grid.len(), seed), random(grid.len(), seed + 1));
            let sum: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a + factor * b).collect();
            let run = |samples: &[f64]| analysed(&grid, wavelet, samples);
            let expected: Vec<f64> = run(&a).iter().zip(run(&b)).map(|(a, b)| a + factor * b).collect();
            prop_assert!(largest_difference(&run(&sum), &expected) < 1e-13);
            let run = |coefficients: &[f64]| synthesised(&grid, wavelet, 3, coefficients);
            let expected: Vec<f64> = run(&a).iter().zip(run(&b)).map(|(a, b)| a + factor * b).collect();
            prop_assert!(largest_difference(&run(&sum), &expected) < 1e-13);
        }

        #[test]
        fn a_coarser_level_is_the_surface_of_a_smaller_grid(level in 0usize..4, seed in 1u32..1000, cubic: bool) {
            let wavelet = BOTH[usize::from(cubic)];
            let (grid, smaller) = (Grid::new(3, 4, 3).unwrap(), Grid::new(3, 4, level).unwrap());
            let coefficients: Vec<f32> = random(grid.len(), seed);
            let expected = synthesised(&smaller, wavelet, level, &coefficients[..smaller.len()]);
            prop_assert_eq!(synthesised(&grid, wavelet, level, &coefficients), expected);
        }
    }
}
