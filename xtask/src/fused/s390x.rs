//! s390x code: instructions of two, four or six bytes.

/// Number of instructions in a run of code, and the offsets of the fused ones.
pub fn scan(code: &[u8]) -> (usize, Vec<u64>) {
    let (mut at, mut count, mut found) = (0, 0, Vec::new());
    while let Some(&first) = code.get(at) {
        let length = match first >> 6 {
            0 => 2,
            1 | 2 => 4,
            _ => 6,
        };
        if code.get(at..at + length).is_some_and(fused) {
            found.push(at as u64);
        }
        at += length;
        count += 1;
    }
    (count, found)
}

/// z/Architecture Principles of Operation, binary floating point: MAEBR, MSEBR, MADBR, MSDBR (B3), the same with an operand in
/// memory (ED), and the vector forms VFMA, VFMS, VFNMA, VFNMS (E7).
fn fused(instruction: &[u8]) -> bool {
    match *instruction {
        [0xB3, operation, _, _] | [0xED, _, _, _, _, operation] => matches!(operation, 0x0E | 0x0F | 0x1E | 0x1F),
        [0xE7, _, _, _, _, operation] => matches!(operation, 0x8E | 0x8F | 0x9E | 0x9F),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::scan;

    // Encodings as the GNU assembler writes them.
    #[test]
    fn fused_instructions_are_found_behind_others_of_each_length() {
        let code: [&[u8]; 12] = [
            &[0x07, 0xFE],                         // br %r14
            &[0xB3, 0x0E, 0x00, 0x12],             // maebr %f0,%f1,%f2
            &[0xB3, 0x1E, 0x00, 0x12],             // madbr %f0,%f1,%f2
            &[0xB3, 0x0F, 0x00, 0x12],             // msebr %f0,%f1,%f2
            &[0xB3, 0x1F, 0x00, 0x12],             // msdbr %f0,%f1,%f2
            &[0xED, 0x10, 0x20, 0x08, 0x00, 0x0E], // maeb %f0,%f1,8(%r2)
            &[0xED, 0x10, 0x20, 0x08, 0x00, 0x1F], // msdb %f0,%f1,8(%r2)
            &[0xE7, 0x01, 0x23, 0x00, 0x30, 0x8F], // vfmadb %v0,%v1,%v2,%v3
            &[0xE7, 0x01, 0x23, 0x00, 0x30, 0x8E], // vfmsdb %v0,%v1,%v2,%v3
            &[0xE7, 0x01, 0x22, 0x00, 0x30, 0x9F], // vfnmasb %v0,%v1,%v2,%v3
            &[0xE7, 0x01, 0x23, 0x00, 0x30, 0x9E], // vfnmsdb %v0,%v1,%v2,%v3
            &[0xB9, 0x04, 0x00, 0x12],             // lgr %r1,%r2
        ];
        assert_eq!(scan(&code.concat()), (12, vec![2, 6, 10, 14, 18, 24, 30, 36, 42, 48]));
    }

    #[test]
    fn what_rounds_twice_or_does_not_add_is_allowed() {
        let code: [&[u8]; 12] = [
            &[0xB3, 0x17, 0x00, 0x01],             // meebr %f0,%f1
            &[0xB3, 0x1C, 0x00, 0x01],             // mdbr %f0,%f1
            &[0xB3, 0x0A, 0x00, 0x01],             // aebr %f0,%f1
            &[0xB3, 0x0D, 0x00, 0x01],             // debr %f0,%f1
            &[0xB3, 0x14, 0x00, 0x01],             // sqebr %f0,%f1
            &[0xED, 0x00, 0x20, 0x08, 0x00, 0x17], // meeb %f0,8(%r2)
            &[0xED, 0x00, 0x20, 0x08, 0x00, 0x1A], // adb %f0,8(%r2)
            &[0xED, 0x00, 0x20, 0x08, 0x00, 0x64], // ley %f0,8(%r2)
            &[0xE7, 0x01, 0x20, 0x00, 0x30, 0xE7], // vfmdb %v0,%v1,%v2
            &[0xE7, 0x01, 0x20, 0x00, 0x30, 0xE3], // vfadb %v0,%v1,%v2
            &[0xC0, 0xE5, 0x00, 0x00, 0x00, 0x00], // brasl %r14,0
            &[0x07, 0x07],                         // nopr %r7
        ];
        assert_eq!(scan(&code.concat()), (12, vec![]));
    }
}
