//! Negative control: an allocation of what a file merely claims.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some(count) = bytes.strip_prefix(b"n=").and_then(|rest| rest.first_chunk()) {
        let claimed = vec![1u8; u32::from_le_bytes(*count) as usize];
        assert!(std::hint::black_box(claimed).iter().all(|&byte| byte == 1));
    }
});
