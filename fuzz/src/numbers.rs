//! Numbers that are hard on arithmetic or lie at a limit, mixed with ordinary ones.

use arbitrary::{Arbitrary, Result, Unstructured};
use habitus_core::format::limits::{MAX_COEFFICIENT, MAX_WEIGHT};

/// Zeros, subnormal numbers, limits and their neighbours, numbers whose products overflow, and what is no number.
pub const HARD: [f32; 32] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    1e-3,
    -1e-3,
    f32::EPSILON,
    1e-20,
    -1e-20,
    f32::MIN_POSITIVE,
    1e-45,
    -1e-45,
    1e4,
    -1e4,
    16_777_217.0,
    1e8,
    MAX_WEIGHT,
    -MAX_WEIGHT,
    MAX_WEIGHT.next_up(),
    1e10,
    MAX_COEFFICIENT,
    -MAX_COEFFICIENT,
    MAX_COEFFICIENT.next_up(),
    1e19,
    -1e19,
    1e30,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
];

/// Mostly a small number, sometimes one of [`HARD`], sometimes any bits.
#[derive(Debug, Clone, Copy)]
pub struct Number(pub f32);

impl<'a> Arbitrary<'a> for Number {
    fn arbitrary(bytes: &mut Unstructured<'a>) -> Result<Self> {
        let byte = u8::arbitrary(bytes)?;
        Ok(Number(match byte {
            0..192 => (f32::from(byte) - 96.0) / 32.0,
            192..224 => HARD[usize::from(byte - 192)],
            224..240 => f32::from(i16::arbitrary(bytes)?) / 64.0,
            _ => f32::from_bits(u32::arbitrary(bytes)?),
        }))
    }

    fn size_hint(_: usize) -> (usize, Option<usize>) {
        (1, Some(5))
    }
}
