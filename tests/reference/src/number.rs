//! `f32` and `f64`, with the elementary functions of `libm`.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number of the reference.
#[allow(missing_docs)]
pub trait Number:
    Copy
    + Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    const EPSILON: Self;
    /// Hexadecimal digits of its bit pattern; a single 0 for a pattern of zeros.
    fn hexadecimal(self) -> String;
    /// The nearest number.
    fn of(value: f64) -> Self;
    fn to_f64(self) -> f64;
    fn sqrt(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn exp(self) -> Self;
    fn magnitude(self) -> Self;
    fn is_finite(self) -> bool;
}

macro_rules! number {
    ($t:ident, $sqrt:ident, $sin:ident, $cos:ident, $exp:ident, $digits:literal) => {
        impl Number for $t {
            const EPSILON: Self = $t::EPSILON;
            fn hexadecimal(self) -> String {
                if self.to_bits() == 0 { "0".into() } else { format!($digits, self.to_bits()) }
            }
            fn of(value: f64) -> Self {
                value as $t
            }
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            fn sqrt(self) -> Self {
                libm::$sqrt(self)
            }
            fn sin(self) -> Self {
                libm::$sin(self)
            }
            fn cos(self) -> Self {
                libm::$cos(self)
            }
            fn exp(self) -> Self {
                libm::$exp(self)
            }
            fn magnitude(self) -> Self {
                if self.is_sign_negative() { -self } else { self }
            }
            fn is_finite(self) -> bool {
                $t::is_finite(self)
            }
        }
    };
}

number!(f32, sqrtf, sinf, cosf, expf, "{:08x}");
number!(f64, sqrt, sin, cos, exp, "{:016x}");

/// The largest power of two that is at most a magnitude; zero for zero.
pub fn binade<R: Number>(magnitude: R) -> R {
    let (one, two) = (R::of(1.0), R::of(2.0));
    if !(magnitude > R::of(0.0)) {
        return magnitude;
    }
    let mut power = one;
    while power > magnitude {
        power = power / two;
    }
    // Halved, so that nothing overflows.
    while power <= magnitude / two {
        power = power * two;
    }
    power
}

/// The larger of two numbers that are not NaN.
pub fn larger<R: Number>(a: R, b: R) -> R {
    if a > b { a } else { b }
}
