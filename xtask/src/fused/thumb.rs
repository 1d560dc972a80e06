//! Thumb code: instructions of one or two halves.

/// Number of instructions in a run of Thumb code, and the offsets of the fused ones.
pub fn scan(code: &[u8]) -> (usize, Vec<u64>) {
    let halves: Vec<u16> = code.chunks_exact(2).map(|half| u16::from_le_bytes([half[0], half[1]])).collect();
    let (mut at, mut count, mut found) = (0, 0, Vec::new());
    while let Some(&first) = halves.get(at) {
        // Five leading bits 11101, 11110 or 11111 announce a second half.
        let long = first >> 11 >= 0b11101;
        if long && halves.get(at + 1).is_some_and(|&second| fused(first, second)) {
            found.push(2 * at as u64);
        }
        at += if long { 2 } else { 1 };
        count += 1;
    }
    (count, found)
}

/// ARMv7-M A7.7.228-229: VFMA and VFMS are 1110 1110 1D10, VFNMA and VFNMS 1110 1110 1D01, in coprocessor 10 or 11.
fn fused(first: u16, second: u16) -> bool {
    matches!(first & 0xFFB0, 0xEEA0 | 0xEE90) && second & 0x0E10 == 0x0A00
}

#[cfg(test)]
mod tests {
    use super::scan;

    fn bytes(halves: &[u16]) -> Vec<u8> {
        halves.iter().flat_map(|half| half.to_le_bytes()).collect()
    }

    // Encodings as the GNU assembler writes them.
    #[test]
    fn fused_instructions_are_found_behind_short_and_long_ones() {
        // nop; vmul.f32 s0, s1, s2; vfma.f32 s0, s1, s2; vfnms.f32 s15, s0, s0; vfms.f64 d1, d2, d3;
        // vfnma.f32 s31, s30, s29; bx lr
        let code = [0xBF00, 0xEE20, 0x0A81, 0xEEA0, 0x0A81, 0xEED0, 0x7A00, 0xEEA2, 0x1B43, 0xEEDF, 0xFA6E, 0x4770];
        assert_eq!(scan(&bytes(&code)), (7, vec![6, 10, 14, 18]));
    }

    #[test]
    fn what_rounds_twice_or_does_not_add_is_allowed() {
        // vmla.f32 s0, s1, s2; vmls.f64 d0, d1, d2; vnmla.f32 s0, s1, s2; vdiv.f32 s0, s1, s2; vsqrt.f32 s0, s0;
        // vcvt.s32.f32 s0, s0; vmov r0, s0; vldr s0, [r0]
        let code = [
            0xEE00, 0x0A81, 0xEE01, 0x0B42, 0xEE10, 0x0AC1, 0xEE80, 0x0A81, 0xEEB1, 0x0AC0, 0xEEBD, 0x0AC0, 0xEE10,
            0x0A10, 0xED90, 0x0A00,
        ];
        assert_eq!(scan(&bytes(&code)), (8, vec![]));
    }

    #[test]
    fn the_second_half_of_a_long_instruction_is_not_read_as_a_first() {
        // bl with a second half that looks like the first of a vfma would.
        let code = bytes(&[0xF000, 0xEEA0, 0x0A00, 0x4770]);
        assert_eq!(scan(&code), (3, vec![]));
    }
}
