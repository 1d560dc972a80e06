//! `quantise` of the kernel.

use crate::memory::Input;
use habitus_core::generator::Block;
use habitus_core::quantise::{f16_of, f32_of, quantised};

#[unsafe(no_mangle)]
unsafe extern "C" fn check_quantised(term: Input<f32>, used: usize) -> i32 {
    // SAFETY: the caller's promise.
    let numbers = unsafe { term.slice() };
    let Some(numbers) = numbers.first_chunk() else { return 0 };
    let quantised = quantised(&Block::load(numbers), used);
    let codes: i32 = quantised.codes.iter().map(|&code| i32::from(code)).sum();
    codes.wrapping_add(quantised.ranges.iter().flatten().sum::<f32>() as i32)
}

#[unsafe(no_mangle)]
extern "C" fn check_half(value: f32, bits: u16) -> i32 {
    i32::from(f16_of(value)).wrapping_add(f32_of(bits) as i32)
}
