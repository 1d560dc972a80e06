//! One lifting step along a line of samples.
//!
//! A line has `2m + 1` samples. The even ones, `v_0 ... v_m`, become the coarse samples, the odd ones, `e_0 ... e_{m-1}`, the details; `e_j` lies
//! between `v_j` and `v_{j+1}`. Both wavelets and both directions of the transform run through three lifts:
//! ```text
//! first   v_j  from  v_j, e_{j-1}, e_j
//! second  e_j  from  e_j, v*_j, v*_{j+1}     with the v of the first lift; v* = b v at an end of the line, v* = v inside
//! third   v_j  from  v_j, e_{j-1}, e_j       with the e of the second lift
//! ```
//!
//! | | first | second | third |
//! |---|---|---|---|
//! | cubic analysis | `v - 1/4 (e + e')` | `e - (v* + v'*)` | `2v + 3/8 (e + e')` |
//! | cubic synthesis | `1/2 (v - 3/8 (e + e'))` | `e + (v* + v'*)` | `v + 1/4 (e + e')` |
//! | bilinear analysis | `v` | `e - 1/2 (v + v')` | `v + 1/4 (e + e')` |
//! | bilinear synthesis | `v - 1/4 (e + e')` | `e + 1/2 (v + v')` | `v` |
//!
//! Ends, `v_0` and `v_m`. Cubic: never lifted nor scaled, `b = 1/2` in the second lift; so an affine line has no details anywhere, and the
//! coarse line of a bounded one stays bounded. Bilinear: `b = 1`, and the update is one-sided, with the one detail that there is: `v + 1/4 e`, `v - 1/4 e`.
//! Without details the cubic synthesis is the refinement of the uniform cubic B-spline with interpolated ends, `e_j = (v_j + v_{j+1}) / 2`,
//! `v_j = (v_{j-1} + 6 v_j + v_{j+1}) / 8`: along both axes, Catmull-Clark.
//!
//! Determinism: the parentheses of the table are the order of the operations, each rounded on its own. A sample's bits do not depend on how
//! much of the line is computed, nor on the width of vectors.
//!
//! Source: Brunton, Bolkart and Wuhrer 2014 (`brunton2014wavelets`); the rule at the ends is ours.

use crate::Real;

/// Which wavelet. Coefficients of one mean nothing to the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wavelet {
    /// Cubic B-splines: smooth surfaces.
    #[default]
    Cubic,
    /// Hat functions: shorter reach, better condition, creases.
    Bilinear,
}

/// The arithmetic of one direction of one wavelet.
pub(crate) trait Lifting {
    /// `b`: weight of an end in the second lift.
    const END: f64;
    fn first<R: Real>(v: R, before: R, behind: R) -> R;
    fn first_at_end<R: Real>(v: R, beside: R) -> R;
    fn second<R: Real>(e: R, before: R, behind: R) -> R;
    fn third<R: Real>(v: R, before: R, behind: R) -> R;
    fn third_at_end<R: Real>(v: R, beside: R) -> R;
}

pub(crate) struct CubicAnalysis;
pub(crate) struct CubicSynthesis;
pub(crate) struct BilinearAnalysis;
pub(crate) struct BilinearSynthesis;
/// No lift at all.
pub(crate) struct Plain;

macro_rules! lifting {
    ($name:ident, $end:expr, [$v:ident, $a:ident, $b:ident], $first:expr, [$first_end:expr], $second:expr, $third:expr, [$third_end:expr]) => {
        #[allow(unused_variables)]
        impl Lifting for $name {
            const END: f64 = $end;
            #[inline(always)]
            fn first<R: Real>($v: R, $a: R, $b: R) -> R {
                $first
            }
            #[inline(always)]
            fn first_at_end<R: Real>($v: R, $a: R) -> R {
                $first_end
            }
            #[inline(always)]
            fn second<R: Real>($v: R, $a: R, $b: R) -> R {
                $second
            }
            #[inline(always)]
            fn third<R: Real>($v: R, $a: R, $b: R) -> R {
                $third
            }
            #[inline(always)]
            fn third_at_end<R: Real>($v: R, $a: R) -> R {
                $third_end
            }
        }
    };
}

/// A constant of the table.
#[inline(always)]
pub(crate) fn constant<R: Real>(value: f64) -> R {
    R::from_f64(value)
}

lifting!(
    CubicAnalysis,
    0.5,
    [v, a, b],
    v - constant::<R>(0.25) * (a + b),
    [v],
    v - (a + b),
    constant::<R>(2.0) * v + constant::<R>(0.375) * (a + b),
    [v]
);
lifting!(
    CubicSynthesis,
    0.5,
    [v, a, b],
    constant::<R>(0.5) * (v - constant::<R>(0.375) * (a + b)),
    [v],
    v + (a + b),
    v + constant::<R>(0.25) * (a + b),
    [v]
);
lifting!(
    BilinearAnalysis,
    1.0,
    [v, a, b],
    v,
    [v],
    v - constant::<R>(0.5) * (a + b),
    v + constant::<R>(0.25) * (a + b),
    [v + constant::<R>(0.25) * a]
);
lifting!(
    BilinearSynthesis,
    1.0,
    [v, a, b],
    v - constant::<R>(0.25) * (a + b),
    [v - constant::<R>(0.25) * a],
    v + constant::<R>(0.5) * (a + b),
    v,
    [v]
);
lifting!(Plain, 1.0, [v, a, b], v, [v], v, v, [v]);
