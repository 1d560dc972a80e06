//! One lifting step along one line: the transform in one dimension.

use super::lifting::{BilinearAnalysis, BilinearSynthesis, CubicAnalysis, CubicSynthesis, Lifting, Wavelet};
use super::lines::{Lines, copy, lift, lift_twice, load, merge, split};
use super::span::{Interval, Span};
use crate::workspace::{Requirement, Workspace, check_len};
use crate::{Error, Real};

/// Workspace of [`analysis_step`] and [`synthesis_step`] of a line of `samples` samples.
pub const fn step_req(samples: usize) -> Requirement {
    Requirement::of((samples / 2).saturating_add(2).saturating_mul(2))
}

/// Splits `2m + 1` samples of a line into `m + 1` coarse ones and `m` details, `m >= 1` (the table of [`lifting`](super::lifting)).
///
/// Cost: a few passes over the line; workspace [`step_req`].
/// Determinism: see [`lifting`](super::lifting).
/// Errors: `Empty` for fewer than three samples; `DimensionMismatch`, also for an even number of samples; `WorkspaceTooSmall`; outputs
/// untouched. Panics: never.
#[inline(always)]
pub fn analysis_step<R: Real>(
    wavelet: Wavelet,
    samples: &[R],
    coarse: &mut [R],
    detail: &mut [R],
    workspace: &mut [R],
) -> Result<(), Error> {
    let (span, line) = whole(samples.len(), coarse.len(), detail.len(), workspace)?;
    split(&span, samples, line.v, line.e).ok_or(Error::Empty)?;
    match wavelet {
        Wavelet::Cubic => lift::<CubicAnalysis, R>(&span, line.v, line.e).ok_or(Error::Empty)?,
        Wavelet::Bilinear => lift::<BilinearAnalysis, R>(&span, line.v, line.e).ok_or(Error::Empty)?,
    }
    copy(line.v.get(1..).unwrap_or_default(), coarse);
    copy(line.e.get(1..).unwrap_or_default(), detail);
    Ok(())
}

/// The inverse of [`analysis_step`]: `2m + 1` samples from `m + 1` coarse ones and `m` details.
///
/// Cost, errors: as there, the samples being those of `out`.
#[inline(always)]
pub fn synthesis_step<R: Real>(
    wavelet: Wavelet,
    coarse: &[R],
    detail: &[R],
    out: &mut [R],
    workspace: &mut [R],
) -> Result<(), Error> {
    let (span, mut line) = whole(out.len(), coarse.len(), detail.len(), workspace)?;
    load(&span, coarse, line.v, detail, line.e).ok_or(Error::Empty)?;
    match wavelet {
        Wavelet::Cubic => synthesised::<CubicSynthesis, R>(&span, &mut line, out),
        Wavelet::Bilinear => synthesised::<BilinearSynthesis, R>(&span, &mut line, out),
    }
    .ok_or(Error::Empty)
}

#[inline(always)]
fn synthesised<S: Lifting, R: Real>(span: &Span, line: &mut Lines<'_, R>, out: &mut [R]) -> Option<()> {
    lift_twice::<S, R>(span, line.v, line.e)?;
    merge::<S, R>(span, line.v, line.e, out)
}

/// The span of a whole line and scratch for it, when all lengths fit.
fn whole<R: Real>(
    samples: usize,
    coarse: usize,
    detail: usize,
    workspace: &mut [R],
) -> Result<(Span, Lines<'_, R>), Error> {
    if samples < 3 {
        return Err(Error::Empty);
    }
    check_len(samples | 1, samples)?;
    check_len(samples / 2 + 1, coarse)?;
    check_len(samples / 2, detail)?;
    step_req(samples).check(workspace.len())?;
    let span = Span::new(coarse, Interval { from: 0, to: samples });
    let lines = Lines::take(&span, 1, &mut Workspace::new(workspace))?;
    Ok((span, lines))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::symmetric_eigen::diagonalise_in_place;
    use proptest::prelude::*;
    use std::vec::Vec;

    const BOTH: [Wavelet; 2] = [Wavelet::Cubic, Wavelet::Bilinear];

    fn analysis(wavelet: Wavelet, samples: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let m = samples.len() / 2;
        let (mut v, mut e, mut ws) = (vec![0.0; m + 1], vec![0.0; m], vec![0.0; samples.len() + 3]);
        analysis_step(wavelet, samples, &mut v, &mut e, &mut ws).unwrap();
        (v, e)
    }

    fn synthesis(wavelet: Wavelet, v: &[f64], e: &[f64]) -> Vec<f64> {
        let (mut out, mut ws) = (vec![0.0; v.len() + e.len()], vec![0.0; v.len() + e.len() + 3]);
        synthesis_step(wavelet, v, e, &mut out, &mut ws).unwrap();
        out
    }

    #[test]
    fn small_lines_by_hand() {
        // B-spline refinement with interpolated ends.
        assert_eq!(synthesis(Wavelet::Cubic, &[8.0, 16.0, 0.0], &[0.0, 0.0]), [8.0, 12.0, 13.0, 8.0, 0.0]);
        assert_eq!(synthesis(Wavelet::Bilinear, &[8.0, 16.0, 0.0], &[0.0, 0.0]), [8.0, 12.0, 16.0, 8.0, 0.0]);
        // One detail: v -3/16 each side inside, then the details beside it, then the second lift of v.
        let detail = synthesis(Wavelet::Cubic, &[0.0; 6], &[0.0, 0.0, 64.0, 0.0, 0.0]);
        assert_eq!(detail, [0.0, 0.0, -3.0, -12.0, -5.0, 40.0, -5.0, -12.0, -3.0, 0.0, 0.0]);
        let detail = synthesis(Wavelet::Bilinear, &[0.0; 4], &[0.0, 64.0, 0.0]);
        assert_eq!(detail, [0.0, -8.0, -16.0, 48.0, -16.0, -8.0, 0.0]);
        // At an end only one side moves, or the one-sided quarter.
        assert_eq!(synthesis(Wavelet::Cubic, &[0.0; 2], &[64.0]), [0.0, 64.0, 0.0]);
        assert_eq!(synthesis(Wavelet::Bilinear, &[0.0; 2], &[64.0]), [-16.0, 48.0, -16.0]);
        assert_eq!(analysis(Wavelet::Cubic, &[2.0, 5.0, 4.0]), (vec![2.0, 4.0], vec![2.0]));
        assert_eq!(analysis(Wavelet::Bilinear, &[2.0, 5.0, 4.0]), (vec![2.5, 4.5], vec![2.0]));
    }

    #[test]
    fn refusals_leave_the_output_alone() {
        let (mut v, mut e, mut ws) = ([7.0; 3], [7.0; 2], [0.0; 8]);
        let mut run = |n: usize, nv: usize, ne: usize, nw: usize| {
            analysis_step(Wavelet::Cubic, &[1.0; 9][..n], &mut v[..nv], &mut e[..ne], &mut ws[..nw])
        };
        assert_eq!(run(4, 2, 2, 8), Err(Error::DimensionMismatch { expected: 5, found: 4 }));
        assert_eq!(run(2, 2, 1, 8), Err(Error::Empty));
        assert_eq!(run(1, 1, 0, 8), Err(Error::Empty));
        assert_eq!(run(5, 2, 2, 8), Err(Error::DimensionMismatch { expected: 3, found: 2 }));
        assert_eq!(run(5, 3, 1, 8), Err(Error::DimensionMismatch { expected: 2, found: 1 }));
        assert_eq!(run(5, 3, 2, 7), Err(Error::WorkspaceTooSmall { needed: 8, given: 7 }));
        assert_eq!((v, e), ([7.0; 3], [7.0; 2]));
        let mut out = [7.0; 5];
        let refused = synthesis_step(Wavelet::Cubic, &[0.0; 3], &[0.0; 2], &mut out[..4], &mut ws);
        assert_eq!((refused, out), (Err(Error::DimensionMismatch { expected: 5, found: 4 }), [7.0; 5]));
    }

    /// Condition numbers of the synthesis of a line of `base` nodes over `levels` levels.
    fn condition(wavelet: Wavelet, base: usize, levels: usize) -> f64 {
        let n = ((base - 1) << levels) + 1;
        let columns: Vec<Vec<f64>> = (0..n)
            .map(|unit| {
                let coefficient = |k: usize| if k == unit { 1.0 } else { 0.0 };
                let mut line: Vec<f64> = (0..base).map(coefficient).collect();
                while line.len() < n {
                    let details: Vec<f64> = (line.len()..2 * line.len() - 1).map(coefficient).collect();
                    line = synthesis(wavelet, &line, &details);
                }
                line
            })
            .collect();
        let mut gram: Vec<f64> =
            (0..n * n).map(|k| columns[k / n].iter().zip(&columns[k % n]).map(|(a, b)| a * b).sum()).collect();
        diagonalise_in_place(&mut gram, &mut vec![0.0; n * n], n).unwrap();
        (gram[0] / gram[n * n - 1]).sqrt()
    }

    #[test]
    fn condition_numbers() {
        let cases = [(Wavelet::Cubic, [3.6, 9.8, 18.0, 35.0, 63.0]), (Wavelet::Bilinear, [1.9, 2.7, 3.9, 5.5, 7.7])];
        for (wavelet, expected) in cases {
            for (levels, expected) in (1..).zip(expected) {
                let found = condition(wavelet, 5, levels);
                assert!((found / expected - 1.0f64).abs() < 0.02, "{wavelet:?} {levels} {found}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::cases()))]

        #[test]
        fn a_step_can_be_undone(m in 1usize..40, seed in 1u32..10_000, cubic: bool) {
            let wavelet = BOTH[usize::from(cubic)];
            let samples: Vec<f64> =
                crate::testing::Stream::new(seed).take(2 * m + 1).into_iter().map(f64::from).collect();
            let (v, e) = analysis(wavelet, &samples);
            for (a, b) in synthesis(wavelet, &v, &e).iter().zip(&samples) {
                prop_assert!((a - b).abs() < 8e-15);
            }
        }

        #[test]
        fn affine_lines_have_no_details(m in 1usize..40, offset in -1.0f64..1.0, slope in -1.0f64..1.0, cubic: bool) {
            let samples: Vec<f64> = (0..=2 * m).map(|k| offset + slope * k as f64 / m as f64).collect();
            let (v, e) = analysis(BOTH[usize::from(cubic)], &samples);
            prop_assert!(e.iter().all(|e| e.abs() < 4e-15));
            prop_assert!(v.iter().zip(samples.iter().step_by(2)).all(|(a, b)| (a - b).abs() < 8e-15));
        }
    }
}
