//! `f32` and `f64` behind one sealed trait: the only door to elementary functions.
//!
//! They come from `libm` on every target, so that a host, a browser and a Cortex-M compute the same bits. The methods of
//! `std` are not available here by construction (`no_std`). With the feature `fast-math` sine, cosine and exponential of `f32` come from
//! `micromath` instead: a fraction of the time on a Cortex-M, errors as `docs/numerics.md` tables them, and bits that promise nothing. Square roots stay
//! exact.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A real number of the solvers: `f32` or `f64`.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + SubAssign
    + Mul<Output = Self>
    + MulAssign
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;
    /// Largest finite number.
    const MAX: Self;

    /// The nearest number of this type.
    fn from_f64(value: f64) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// Correctly rounded square root.
    fn sqrt(self) -> Self;
    /// Sine of radians.
    fn sin(self) -> Self;
    /// Cosine of radians.
    fn cos(self) -> Self;
    /// Exponential function.
    fn exp(self) -> Self;
    /// Neither NaN nor infinite.
    fn is_finite(self) -> bool;
    /// The largest power of two that is at most the magnitude; zero for zero, infinity for what is not finite. Dividing by it is exact wherever
    /// the quotient is a normal number, and leaves `1 <= |x| < 2`.
    fn binade(self) -> Self;

    /// The larger of two numbers; the other one when one is NaN.
    #[allow(clippy::eq_op)]
    fn max(self, other: Self) -> Self {
        if self > other || other != other { self } else { other }
    }

    /// The smaller of two numbers; the other one when one is NaN.
    #[allow(clippy::eq_op)]
    fn min(self, other: Self) -> Self {
        if self < other || other != other { self } else { other }
    }
}

macro_rules! real {
    ($t:ident, $bits:ident, $abs:path, $sqrt:path, $sin:path, $cos:path, $exp:path) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = $t::EPSILON;
            const MAX: Self = $t::MAX;

            #[inline]
            fn from_f64(value: f64) -> Self {
                value as $t
            }
            #[inline]
            fn abs(self) -> Self {
                $abs(self)
            }
            #[inline]
            fn sqrt(self) -> Self {
                $sqrt(self)
            }
            #[inline]
            fn sin(self) -> Self {
                $sin(self)
            }
            #[inline]
            fn cos(self) -> Self {
                $cos(self)
            }
            #[inline]
            fn exp(self) -> Self {
                $exp(self)
            }
            #[inline]
            fn is_finite(self) -> bool {
                $t::is_finite(self)
            }
            #[inline]
            fn binade(self) -> Self {
                let bits = $t::abs(self).to_bits();
                let exponent = bits & Self::INFINITY.to_bits();
                // A subnormal number has no exponent: its highest bit is the power.
                let highest: $bits = 1 << ($bits::BITS - 1);
                let top = highest.checked_shr(bits.leading_zeros()).unwrap_or(0);
                $t::from_bits(if exponent == 0 { top } else { exponent })
            }
        }
    };
}

/// Sine, cosine and exponential of `f32`: `libm`, or with `fast-math` `micromath`.
mod single {
    #[cfg(feature = "fast-math")]
    pub(super) fn sinf(x: f32) -> f32 {
        micromath::F32(x).sin().0
    }

    #[cfg(feature = "fast-math")]
    pub(super) fn cosf(x: f32) -> f32 {
        micromath::F32(x).cos().0
    }

    #[cfg(feature = "fast-math")]
    pub(super) fn expf(x: f32) -> f32 {
        micromath::F32(x).exp().0
    }

    #[cfg(not(feature = "fast-math"))]
    pub(super) use libm::{cosf, expf, sinf};
}

/// Square roots, which are the same number everywhere. For x86 libm has them as assembly in the old encoding: among instructions on wide vectors each
/// costs hundreds of cycles.
#[cfg(all(feature = "inline-kernels", target_arch = "x86_64", target_feature = "sse2"))]
mod root {
    use safe_arch::{get_f32_from_m128_s, get_f64_from_m128d_s, set_m128_s, set_m128d_s, sqrt_m128_s, sqrt_m128d_s};

    #[inline(always)]
    pub(super) fn sqrtf(x: f32) -> f32 {
        get_f32_from_m128_s(sqrt_m128_s(set_m128_s(x)))
    }

    #[inline(always)]
    pub(super) fn sqrt(x: f64) -> f64 {
        let x = set_m128d_s(x);
        get_f64_from_m128d_s(sqrt_m128d_s(x, x))
    }
}
#[cfg(not(all(feature = "inline-kernels", target_arch = "x86_64", target_feature = "sse2")))]
mod root {
    pub(super) use libm::{sqrt, sqrtf};
}

real!(f32, u32, libm::fabsf, root::sqrtf, single::sinf, single::cosf, single::expf);
real!(f64, u64, libm::fabs, root::sqrt, libm::sin, libm::cos, libm::exp);

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest errors of micromath against f64, as docs/numerics.md tables them (`cargo test -p habitus-core --features fast-math fast -- --nocapture`).
    #[cfg(feature = "fast-math")]
    #[test]
    fn fast_functions_err_by_what_the_table_says() {
        let grid = |low: f64, high: f64| (0..=100_000).map(move |k| (low + (high - low) * f64::from(k) / 1e5) as f32);
        let largest = |errors: &mut dyn Iterator<Item = f64>| errors.fold(0.0f64, f64::max);
        let pi = core::f64::consts::PI;
        for (range, limit) in [(pi, 1.2e-3), (100.0, 1.2e-3)] {
            let sine = largest(&mut grid(-range, range).map(|x| (f64::from(Real::sin(x)) - f64::from(x).sin()).abs()));
            let cosine =
                largest(&mut grid(-range, range).map(|x| (f64::from(Real::cos(x)) - f64::from(x).cos()).abs()));
            std::println!("to {range:.2} rad: sine {sine:.1e}, cosine {cosine:.1e}");
            assert!(sine < limit && cosine < limit);
        }
        let exponential = grid(-10.0, 10.0).map(|x| (f64::from(Real::exp(x)) / f64::from(x).exp() - 1.0).abs());
        let exponential = largest(&mut exponential.into_iter());
        std::println!("exponential, -10..10: relative {exponential:.1e}");
        assert!(exponential < 3e-3);
    }

    #[test]
    fn binades() {
        for (value, expected) in
            [(0.0, 0.0), (-0.0, 0.0), (1.0, 1.0), (-1.75, 1.0), (3.999, 2.0), (0.3, 0.25), (f64::MAX, 2f64.powi(1023))]
        {
            assert_eq!(Real::binade(value), expected);
        }
        assert_eq!(Real::binade(f64::NEG_INFINITY), f64::INFINITY);
        for exponent in -149..128 {
            let power = if exponent < -126 {
                f32::from_bits(1 << (exponent + 149))
            } else {
                f32::from_bits(((exponent + 127) as u32) << 23)
            };
            let below_next = f32::from_bits((power * 2.0).to_bits() - 1);
            assert_eq!(Real::binade(power), power);
            assert_eq!(Real::binade(if exponent == 127 { f32::MAX } else { below_next }), power);
        }
    }
}
