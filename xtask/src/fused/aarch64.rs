//! AArch64 code: instructions of four bytes.

/// Number of instructions in a run of code, and the offsets of the fused ones.
pub fn scan(code: &[u8]) -> (usize, Vec<u64>) {
    let words = code.as_chunks().0.iter().map(|&word| u32::from_le_bytes(word));
    let found = words.clone().enumerate().filter(|&(_, word)| fused(word)).map(|(at, _)| 4 * at as u64);
    (words.len(), found.collect())
}

/// Arm ARM C4.1: floating-point data processing with three sources (FMADD, FMSUB, FNMADD, FNMSUB); FMLA and FMLS of vectors, by
/// vector, and by element, the last also on scalars. Single and double precision.
fn fused(word: u32) -> bool {
    word >> 24 == 0x1F
        || word & 0xBF20_FC00 == 0x0E20_CC00
        || word & 0xBF80_B400 == 0x0F80_1000
        || word & 0xFF80_B400 == 0x5F80_1000
}

#[cfg(test)]
mod tests {
    use super::scan;

    fn bytes(words: &[u32]) -> Vec<u8> {
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    // Encodings as the GNU assembler writes them.
    #[test]
    fn fused_instructions_are_found() {
        // fmadd s0, s1, s2, s3; fmsub d0, d1, d2, d3; fnmadd s31, s30, s29, s28; fnmsub d0, d1, d2, d3;
        // fmla v0.4s, v1.4s, v2.4s; fmls v0.2d, v1.2d, v2.2d; fmla v0.2s, v1.2s, v2.2s; fmla v3.4s, v1.4s, v2.s[3];
        // fmls v3.2d, v1.2d, v2.d[1]; fmla s0, s1, v2.s[1]; fmls d0, d1, v2.d[1]
        let code = [
            0x1F02_0C20,
            0x1F42_8C20,
            0x1F3D_73DF,
            0x1F62_8C20,
            0x4E22_CC20,
            0x4EE2_CC20,
            0x0E22_CC20,
            0x4FA2_1823,
            0x4FC2_5823,
            0x5FA2_1020,
            0x5FC2_5820,
        ];
        assert_eq!(scan(&bytes(&code)), (11, (0..11).map(|at| 4 * at).collect()));
    }

    #[test]
    fn what_rounds_twice_or_does_not_add_is_allowed() {
        // nop; fmul s0, s1, s2; fnmul s0, s1, s2; fadd v0.4s, v1.4s, v2.4s; fmul v0.4s, v1.4s, v2.4s;
        // fmul v0.4s, v1.4s, v2.s[1]; fmul s0, s1, v2.s[1]; fdiv v0.2d, v1.2d, v2.2d; fsqrt s0, s0; fcsel s0, s1, s2, eq;
        // fabd v0.4s, v1.4s, v2.4s; mla v0.4s, v1.4s, v2.4s; mla v0.4s, v1.4s, v2.s[1]; fcvt d0, s0; ldr q0, [x0, #16];
        // fmaxnm v0.4s, v1.4s, v2.4s; fcmeq v0.4s, v1.4s, v2.4s; sshll v0.4s, v1.4h, #1; movi v0.4s, #1; fmov v0.4s, #1.0;
        // fcvtzs v0.4s, v1.4s, #3; madd x0, x1, x2, x3; ret
        let code = [
            0xD503_201F,
            0x1E22_0820,
            0x1E22_8820,
            0x4E22_D420,
            0x6E22_DC20,
            0x4FA2_9020,
            0x5FA2_9020,
            0x6E62_FC20,
            0x1E21_C000,
            0x1E22_0C20,
            0x6EA2_D420,
            0x4EA2_9420,
            0x6FA2_0020,
            0x1E22_C000,
            0x3DC0_0400,
            0x4E22_C420,
            0x4E22_E420,
            0x0F11_A420,
            0x4F00_0420,
            0x4F03_F600,
            0x4F3D_FC20,
            0x9B02_0C20,
            0xD65F_03C0,
        ];
        assert_eq!(scan(&bytes(&code)), (23, vec![]));
    }
}
