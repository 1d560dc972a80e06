//! Text over semihosting without `core::fmt`, whose float formatting alone exceeds the kernel's code.

use crate::board;

/// Prints a text.
pub fn text(text: &str) {
    let mut buffer = [0u8; 64];
    for part in text.as_bytes().chunks(63) {
        for (to, from) in buffer.iter_mut().zip(part.iter().chain(core::iter::once(&0))) {
            *to = *from;
        }
        board::write(&buffer);
    }
}

/// Prints a text and ends the line.
pub fn line(text_: &str) {
    text(text_);
    text("\n");
}

/// Prints an unsigned integer in decimal.
pub fn number(value: u32) {
    digits(value, 1);
}

/// Prints eight hexadecimal digits, as for the bit pattern of an `f32`.
pub fn hexadecimal(value: u32) {
    let mut out = [0u8; 9];
    for (digit, shift) in out.iter_mut().zip((0..8).rev()) {
        let nibble = (value >> (4 * shift)) as u8 & 15;
        *digit = if nibble < 10 { b'0' + nibble } else { b'a' + nibble - 10 };
    }
    board::write(&out);
}

/// Prints a real number with three decimals; what does not fit 32 bits is printed as its bit pattern.
pub fn real(value: f32) {
    let thousandths = value * 1000.0;
    // Also false for NaN.
    if !(-4.0e9..4.0e9).contains(&thousandths) {
        text("bits ");
        return hexadecimal(value.to_bits());
    }
    if value < 0.0 {
        text("-");
    }
    let magnitude = if value < 0.0 { -thousandths } else { thousandths };
    let rounded = (magnitude + 0.5) as u32;
    number(rounded / 1000);
    text(".");
    digits(rounded % 1000, 3);
}

/// Prints `name` and `value` as a line that `cargo xtask firmware` reads: `@name value`.
pub fn measure(name: &str, value: u32) {
    text("@");
    text(name);
    text(" ");
    number(value);
    text("\n");
}

/// Decimal digits of `value`, at least `least` of them.
fn digits(value: u32, least: usize) {
    let mut out = [0u8; 11];
    let mut rest = value;
    let mut used = 0;
    // The last byte stays zero: it ends the text.
    for (position, digit) in out.iter_mut().take(10).rev().enumerate() {
        if rest == 0 && position >= least {
            break;
        }
        *digit = b'0' + (rest % 10) as u8;
        rest /= 10;
        used = position + 1;
    }
    if let Some(shown) = out.get(10usize.saturating_sub(used)..) {
        board::write(shown);
    }
}
